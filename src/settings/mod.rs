//! Settings: what the user may say, typed and checked in one place.

mod command;
mod limits;
mod template;
mod values;

use crate::system::escape::escape;
use crate::system::machine;
use bytesize::ByteSize;
pub use command::{Hook, HookRefused, Occasion};
pub use limits::Limits;
use planish_core::Order;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::time::Duration;
pub use template::{Part, Placeholder, Template, TemplateError};
pub use values::{
    Also, AlsoFiles, Boundary, ExportTarget, ExportTargets, FeatureAngle, Inputs, LabelSource, Log, Off, RawCommand,
    RawLimits, Refine, Refused,
};

/// What was said, on the command line or in planish.toml; the same names in both, except that commands are said in
/// the file alone.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawSettings {
    /// Folder for the results.
    pub out: Option<PathBuf>,
    /// Order of the elements: 1 or 2.
    pub order: Option<u8>,
    /// Boundary of charts in the plane.
    pub boundary: Option<Boundary>,
    /// How many times as many triangles a chart may get where its map needs them, or `off`.
    pub refine: Option<Refine>,
    /// Tolerance for cracks, relative to the diagonal of the bounding box.
    pub weld: Option<f64>,
    /// Dihedral angle of feature edges, in degrees, or `off`.
    #[serde(rename = "feature-angle")]
    pub feature_angle: Option<FeatureAngle>,
    /// Whether holes of charts must be holes of the surface.
    #[serde(rename = "strict-disks")]
    pub strict_disks: Option<bool>,
    /// Largest area ratio of a chart.
    #[serde(rename = "max-area-ratio")]
    pub max_area_ratio: Option<f64>,
    /// Largest number of triangles of a chart.
    #[serde(rename = "max-triangles")]
    pub max_triangles: Option<usize>,
    /// Meshers to which results are handed.
    #[serde(rename = "hand-off")]
    pub hand_off: Option<ExportTargets>,
    /// Files for other programs, beside those of every result.
    pub also: Option<AlsoFiles>,
    /// Edge length of the mesh to be made.
    pub size: Option<f64>,
    /// Edges of that mesh in a full turn around a bend.
    #[serde(rename = "size-curvature")]
    pub size_curvature: Option<f64>,
    /// Least edge length.
    #[serde(rename = "size-min")]
    pub size_min: Option<f64>,
    /// The array of points that tells edge lengths, by its name in the file.
    #[serde(rename = "size-from")]
    pub size_from: Option<String>,
    /// How much longer edges may become over a distance.
    pub gradation: Option<f64>,
    /// How far mesh and surface may be from each other.
    pub deviation: Option<f64>,
    /// Order of the elements of that mesh: 1 or 2.
    #[serde(rename = "mesh-order")]
    pub mesh_order: Option<u8>,
    /// What names parts of a surface, by its name in the file.
    pub label: Option<String>,
    /// Names of parts count for nothing.
    #[serde(rename = "ignore-labels")]
    pub ignore_labels: Option<bool>,
    /// Process inputs whose output is up to date, too.
    pub force: Option<bool>,
    /// How much is computed at once.
    pub jobs: Option<usize>,
    /// On how many results commands run at once.
    pub commands: Option<usize>,
    /// Memory for inputs on their way and factorisations.
    pub memory: Option<ByteSize>,
    /// The most memory that an input may take.
    #[serde(rename = "job-memory")]
    pub job_memory: Option<ByteSize>,
    /// The most seconds that an input may take.
    #[serde(rename = "job-time")]
    pub job_time: Option<f64>,
    /// Look at the inbox regularly instead of being told by the system.
    pub poll: Option<bool>,
    /// Sub-folders of the inbox, too.
    pub recursive: Option<bool>,
    /// When told to stop, finish what waits first.
    pub drain: Option<bool>,
    /// What becomes of certified inputs.
    pub inputs: Option<Inputs>,
    /// What becomes of inputs that are refused or failed.
    pub refused: Option<Refused>,
    /// The file that tells Prometheus what the daemon does.
    pub metrics: Option<PathBuf>,
    /// Where the disk of the results has less room than this, no input is taken up; 0: whatever it has.
    #[serde(rename = "min-free")]
    pub min_free: Option<ByteSize>,
    /// Days for which results are kept whose input has left the inbox.
    #[serde(rename = "keep-results")]
    pub keep_results: Option<f64>,
    /// What is too much for one input.
    pub limits: Option<RawLimits>,
    /// Form of log messages.
    pub log: Option<Log>,
    /// How much more to log: 1 informs, 2 explains, 3 traces.
    pub verbose: Option<u8>,
    /// Print nothing but errors.
    pub quiet: Option<bool>,
    /// Commands that run after an input is certified, in their order.
    pub on_certified: Option<Vec<RawCommand>>,
    /// Commands that run after an input is refused or failed, in their order.
    pub on_refused: Option<Vec<RawCommand>>,
}

/// Checked settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Folder for the results; verbs that write none need none.
    pub out: Option<PathBuf>,
    /// Order of the elements.
    pub order: Order,
    /// Boundary of charts in the plane.
    pub boundary: Boundary,
    /// How many times as many triangles a chart may get where its map needs them; none: it gets none.
    pub refine: Option<u32>,
    /// Tolerance for cracks, relative to the diagonal of the bounding box.
    pub weld: f64,
    /// Dihedral angle of feature edges, in degrees; none: there are none.
    pub feature_angle: Option<f64>,
    /// Whether the angle was asked for: curves along features have a group in files for meshers then.
    pub names_features: bool,
    /// Whether holes of charts must be holes of the surface.
    pub strict_disks: bool,
    /// Largest area ratio of a chart.
    pub max_area_ratio: f64,
    /// Largest number of triangles of a chart; none: any.
    pub max_triangles: Option<usize>,
    /// Meshers to which results are handed.
    pub hand_off: ExportTargets,
    /// Files for other programs, beside those of every result: each once, in their order.
    pub also: Vec<Also>,
    /// Edge length of the mesh to be made, in the unit of the input; without it, one is chosen.
    pub size: Option<f64>,
    /// Edges of that mesh in a full turn around a bend; none: bends get no more than the rest.
    pub size_curvature: Option<f64>,
    /// Least edge length; none: any that narrow places need.
    pub size_min: Option<f64>,
    /// The array of points that tells edge lengths, by its name in the file; none: no array does.
    pub size_from: Option<String>,
    /// How much longer edges may become over a distance: by this times the distance.
    pub gradation: f64,
    /// How far mesh and surface may be from each other, in the unit of the input; none: as far as edges make them.
    pub deviation: Option<f64>,
    /// Order of the elements of that mesh: 1 or 2.
    pub mesh_order: u8,
    /// What names parts of a surface: borders between them become seams.
    pub labels: LabelSource,
    /// Process inputs whose output is up to date, too.
    pub force: bool,
    /// How much is computed at once.
    pub jobs: usize,
    /// On how many results commands run at once.
    pub commands: usize,
    /// Memory for inputs on their way and factorisations, in bytes.
    pub memory: u64,
    /// The memory that there is for this process, in bytes: no input may take more.
    pub machine_memory: u64,
    /// The most memory that an input may take, in bytes; none: no limit but that of the machine.
    pub job_memory: Option<u64>,
    /// The most seconds (wall-clock) that an input may take; none: no limit.
    pub job_time: Option<f64>,
    /// Look at the inbox regularly instead of being told by the system.
    pub poll: bool,
    /// Sub-folders of the inbox, too.
    pub recursive: bool,
    /// When told to stop, finish what waits first.
    pub drain: bool,
    /// What becomes of certified inputs.
    pub inputs: Inputs,
    /// What becomes of inputs that are refused or failed; they are never deleted.
    pub refused: Inputs,
    /// The file that tells Prometheus what the daemon does; none: nothing does.
    pub metrics: Option<PathBuf>,
    /// Where the disk of the results has less room than this, in bytes, no input is taken up.
    pub min_free: u64,
    /// For how long results are kept whose input has left the inbox; none: for ever.
    pub keep_results: Option<Duration>,
    /// What is too much for one input.
    pub limits: Limits,
    /// Form of log messages.
    pub log: Log,
    /// 0 warns, 1 informs, 2 explains, 3 traces.
    pub verbose: u8,
    /// Print nothing but errors.
    pub quiet: bool,
    /// Commands that run after an input is certified, in their order.
    pub on_certified: Vec<Hook>,
    /// Commands that run after an input is refused or failed, in their order.
    pub on_refused: Vec<Hook>,
}

impl Settings {
    /// What the core is to do.
    pub fn core(&self) -> planish_core::Settings {
        planish_core::Settings {
            order: self.order,
            repair: planish_core::repair::Settings { weld: self.weld },
            decompose: planish_core::decompose::Settings {
                boundary: self.boundary.into(),
                max_area_ratio: self.max_area_ratio,
                max_triangles: self.max_triangles.unwrap_or(usize::MAX),
                strict_disks: self.strict_disks,
                feature_angle: self.feature_angle,
            },
            refine: self.refine,
            size: self.size,
        }
    }
}

/// Why settings are refused: wrong usage.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The order is not 1 or 2.
    #[error("order is {0}; it must be 1 (linear) or 2 (quadratic)")]
    Order(u8),
    /// The factor is out of range.
    #[error("refine is {0}; it must lie between 1 and {MOST_REFINED}, or be off")]
    Refine(u32),
    /// The tolerance is out of range.
    #[error("weld is {0}; it must lie between 0 (close no cracks) and 0.01 of the bounding box's diagonal")]
    Weld(f64),
    /// The feature angle is out of range.
    #[error("feature-angle is {0}; it must lie between 0 and 180 degrees (both excluded), or be off")]
    FeatureAngle(f64),
    /// The area ratio is out of range.
    #[error("max-area-ratio is {0}; it must be a number of at least 10")]
    AreaRatio(f64),
    /// No triangle is allowed.
    #[error("max-triangles is 0; a chart needs at least one")]
    Triangles,
    /// A full turn of so many edges is none.
    #[error(
        "size-curvature is {0}; it must lie between {LEAST_PER_TURN} and {MOST_PER_TURN}: the edges of a full turn"
    )]
    SizeCurvature(f64),
    /// The least edge length is none.
    #[error("size-min is {0}; it must be a positive number: the least edge length in the unit of the input")]
    SizeMin(f64),
    /// No edge could be long enough.
    #[error("size-min is {least}, and size is {size}: give a least edge length that is not above the largest")]
    SizesCross {
        /// The least edge length.
        least: f64,
        /// The largest.
        size: f64,
    },
    /// The gradation is out of range.
    #[error(
        "gradation is {0}; it must lie between {LEAST_GRADATION} and {MOST_GRADATION}: by how much edges become longer per distance"
    )]
    Gradation(f64),
    /// The deviation is none.
    #[error("deviation is {0}; it must be a positive number: a distance in the unit of the input")]
    Deviation(f64),
    /// The order of the mesh is not 1 or 2.
    #[error("mesh-order is {0}; it must be 1 (straight triangles) or 2 (curved ones)")]
    MeshOrder(u8),
    /// Labels are both asked for and ignored.
    #[error("label and ignore-labels are both given; keep the one that is meant")]
    Labels,
    /// The edge length is none.
    #[error("size is {0}; it must be a positive number: the edge length in the unit of the input")]
    Size(f64),
    /// Nothing could be computed, or too much.
    #[error("jobs is {0}; it must lie between 1 and {MOST_JOBS}")]
    Jobs(usize),
    /// No command could run, or too many at once.
    #[error("commands is {0}; it must lie between 1 and {MOST_COMMANDS}")]
    Commands(usize),
    /// Too little to do anything.
    #[error("memory is {0}; it must be at least {LEAST_MEMORY}")]
    Memory(ByteSize),
    /// Too little memory for any input.
    #[error("job-memory is {0}; it must be at least {LEAST_JOB_MEMORY}")]
    JobMemory(ByteSize),
    /// No time.
    #[error("job-time is {0}; it must be a positive number of seconds")]
    JobTime(f64),
    /// Results would go before anybody sees them, or never.
    #[error("keep-results is {0}; it must be a positive number of days, at most {MOST_DAYS}")]
    KeepResults(f64),
    /// A command cannot run.
    #[error("[[{occasion}]], table {table}: {error}")]
    Command {
        /// In which tables.
        occasion: Occasion,
        /// Which, from 1.
        table: usize,
        /// Why.
        error: HookRefused,
    },
    /// The file cannot be read.
    #[error("cannot read the settings file {}: {error}", escape(.path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// The file makes no sense.
    #[error("{}: {error}", escape(.path))]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Where and why.
        error: Box<toml::de::Error>,
    },
}

/// Fewer edges make no turn, more are a slip of the finger.
const LEAST_PER_TURN: f64 = 3.0;
const MOST_PER_TURN: f64 = 10_000.0;

/// Lower makes nearly all elements as small as the smallest, higher makes neighbours lean.
const LEAST_GRADATION: f64 = 0.01;
const MOST_GRADATION: f64 = 10.0;

/// How much longer edges become over a distance, where nothing is said. Around narrow places: less makes more small elements, more
/// makes elements lean where sizes change.
pub const USUAL_GRADATION: f64 = 0.4;

/// More computations at once than this are a slip of the finger.
const MOST_JOBS: usize = 1024;

/// More triangles for each of the input than this are one, too.
const MOST_REFINED: u32 = 1000;

/// More commands at once than this are one, too.
const MOST_COMMANDS: usize = 2 * MOST_JOBS;

/// Commands run at once, at least, where nothing is said: one that hangs must not hold up all others.
const USUAL_COMMANDS: usize = 4;

/// Less memory than this is a slip of the finger.
const LEAST_MEMORY: ByteSize = ByteSize::mib(16);

/// Less memory for an input than this is too little for any: the stacks and buffers of an idle process take half of it.
const LEAST_JOB_MEMORY: ByteSize = ByteSize::mib(64);

/// Room that is left on the disk of the results, where nothing is said: enough to tell what is wrong.
const USUAL_MIN_FREE: ByteSize = ByteSize::mib(64);

/// A century: more is a slip of the finger.
const MOST_DAYS: f64 = 36_500.0;

/// The processors that this process may use.
fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get).min(MOST_JOBS)
}

impl RawSettings {
    /// Reads planish.toml.
    ///
    /// # Errors
    /// [`SettingsError`] with line and key.
    pub fn from_file(path: &Path) -> Result<Self, SettingsError> {
        let text = std::fs::read_to_string(path)
            .map_err(|error| SettingsError::Unreadable { path: path.to_owned(), error })?;
        toml::from_str(&text).map_err(|error| SettingsError::Syntax { path: path.to_owned(), error: Box::new(error) })
    }

    /// What was said here, and where nothing was said, what was said in `other`.
    ///
    /// ```
    /// use planish::settings::{FeatureAngle, Off, RawSettings};
    ///
    /// let file: RawSettings = toml::from_str("jobs = 2\nfeature-angle = \"off\"").expect("planish.toml");
    /// let command_line = RawSettings { jobs: Some(8), ..RawSettings::default() };
    /// let said = command_line.or(file);
    /// assert_eq!(said.jobs, Some(8));
    /// assert_eq!(said.feature_angle, Some(FeatureAngle::Off(Off::Off)));
    /// ```
    pub fn or(self, other: Self) -> Self {
        let says_label = self.label.is_some();
        Self {
            out: self.out.or(other.out),
            order: self.order.or(other.order),
            boundary: self.boundary.or(other.boundary),
            refine: self.refine.or(other.refine),
            weld: self.weld.or(other.weld),
            feature_angle: self.feature_angle.or(other.feature_angle),
            strict_disks: self.strict_disks.or(other.strict_disks),
            max_area_ratio: self.max_area_ratio.or(other.max_area_ratio),
            max_triangles: self.max_triangles.or(other.max_triangles),
            hand_off: self.hand_off.or(other.hand_off),
            also: self.also.or(other.also),
            size: self.size.or(other.size),
            size_curvature: self.size_curvature.or(other.size_curvature),
            size_min: self.size_min.or(other.size_min),
            size_from: self.size_from.or(other.size_from),
            gradation: self.gradation.or(other.gradation),
            deviation: self.deviation.or(other.deviation),
            mesh_order: self.mesh_order.or(other.mesh_order),
            // Who says one of both on the command line unsays the other in the file.
            label: self.label.or(other.label.filter(|_| self.ignore_labels != Some(true))),
            ignore_labels: self.ignore_labels.or(other.ignore_labels.filter(|_| !says_label)),
            force: self.force.or(other.force),
            jobs: self.jobs.or(other.jobs),
            commands: self.commands.or(other.commands),
            memory: self.memory.or(other.memory),
            job_memory: self.job_memory.or(other.job_memory),
            job_time: self.job_time.or(other.job_time),
            poll: self.poll.or(other.poll),
            recursive: self.recursive.or(other.recursive),
            drain: self.drain.or(other.drain),
            inputs: self.inputs.or(other.inputs),
            refused: self.refused.or(other.refused),
            metrics: self.metrics.or(other.metrics),
            min_free: self.min_free.or(other.min_free),
            keep_results: self.keep_results.or(other.keep_results),
            limits: self.limits.or(other.limits),
            log: self.log.or(other.log),
            verbose: self.verbose.or(other.verbose),
            quiet: self.quiet.or(other.quiet),
            on_certified: self.on_certified.or(other.on_certified),
            on_refused: self.on_refused.or(other.on_refused),
        }
    }

    /// Checks everything and fills in the defaults.
    ///
    /// ```
    /// use planish::settings::RawSettings;
    ///
    /// // Sizes: G is 10^9 bytes, Gi is 2^30.
    /// let said: RawSettings = toml::from_str("memory = \"2 GiB\"\njob-memory = \"1 GB\"").expect("planish.toml");
    /// let settings = said.check().expect("in range");
    /// assert_eq!((settings.memory, settings.job_memory), (2 << 30, Some(1_000_000_000)));
    /// assert_eq!((settings.job_time, settings.feature_angle), (None, Some(40.0)));
    ///
    /// let said = RawSettings { weld: Some(0.1), ..RawSettings::default() };
    /// let message = said.check().unwrap_err().to_string();
    /// assert!(message.starts_with("weld is 0.1; it must lie between 0"));
    /// ```
    ///
    /// # Errors
    /// [`SettingsError`] for values out of range.
    pub fn check(self) -> Result<Settings, SettingsError> {
        let boundary = self.boundary.unwrap_or_default();
        let core = planish_core::decompose::Settings::of(boundary.into());
        let order = match self.order.unwrap_or(2) {
            1 => Order::Linear,
            2 => Order::Quadratic,
            other => return Err(SettingsError::Order(other)),
        };
        let refine = self.refine.map_or(planish_core::Settings::default().refine, Refine::times);
        if let Some(times) = refine.filter(|times| !(1..=MOST_REFINED).contains(times)) {
            return Err(SettingsError::Refine(times));
        }
        let weld = self.weld.unwrap_or(planish_core::repair::Settings::default().weld);
        // A range holds no number that is none: NaN is refused here, and below.
        if !(0.0..=0.01).contains(&weld) {
            return Err(SettingsError::Weld(weld));
        }
        let feature_angle = match self.feature_angle {
            None => core.feature_angle,
            Some(angle) => angle.degrees(),
        };
        if let Some(angle) = feature_angle.filter(|a| !(*a > 0.0 && *a < 180.0)) {
            return Err(SettingsError::FeatureAngle(angle));
        }
        let max_area_ratio = self.max_area_ratio.unwrap_or(core.max_area_ratio);
        if !(10.0..=f64::MAX).contains(&max_area_ratio) {
            return Err(SettingsError::AreaRatio(max_area_ratio));
        }
        if self.max_triangles == Some(0) {
            return Err(SettingsError::Triangles);
        }
        if let Some(size) = self.size.filter(|s| !s.is_normal() || *s < 0.0) {
            return Err(SettingsError::Size(size));
        }
        if let Some(edges) = self.size_curvature.filter(|n| !(LEAST_PER_TURN..=MOST_PER_TURN).contains(n)) {
            return Err(SettingsError::SizeCurvature(edges));
        }
        if let Some(least) = self.size_min.filter(|s| !s.is_normal() || *s < 0.0) {
            return Err(SettingsError::SizeMin(least));
        }
        if let (Some(least), Some(size)) = (self.size_min, self.size)
            && least > size
        {
            return Err(SettingsError::SizesCross { least, size });
        }
        let gradation = self.gradation.unwrap_or(USUAL_GRADATION);
        if !(LEAST_GRADATION..=MOST_GRADATION).contains(&gradation) {
            return Err(SettingsError::Gradation(gradation));
        }
        if let Some(deviation) = self.deviation.filter(|d| !d.is_normal() || *d < 0.0) {
            return Err(SettingsError::Deviation(deviation));
        }
        let mesh_order = self.mesh_order.unwrap_or(1);
        if ![1, 2].contains(&mesh_order) {
            return Err(SettingsError::MeshOrder(mesh_order));
        }
        let labels = match (self.label, self.ignore_labels.unwrap_or(false)) {
            (Some(_), true) => return Err(SettingsError::Labels),
            (Some(array), false) => LabelSource::Array(array),
            (None, true) => LabelSource::Ignored,
            (None, false) => LabelSource::Usual,
        };
        let jobs = self.jobs.unwrap_or_else(processors);
        if !(1..=MOST_JOBS).contains(&jobs) {
            return Err(SettingsError::Jobs(jobs));
        }
        // With as many as there are computations, one or two that hang would hold up all others.
        let commands = self.commands.unwrap_or_else(|| USUAL_COMMANDS.max(2 * jobs));
        if !(1..=MOST_COMMANDS).contains(&commands) {
            return Err(SettingsError::Commands(commands));
        }
        let machine_memory = machine::memory();
        // Half of it, as what an input takes is predicted: the rest is for what was predicted too low, and for all else.
        let memory = self.memory.unwrap_or_else(|| ByteSize::b(machine_memory / 2).max(LEAST_MEMORY));
        if memory < LEAST_MEMORY {
            return Err(SettingsError::Memory(memory));
        }
        let memory = memory.as_u64();
        if let Some(memory) = self.job_memory.filter(|m| *m < LEAST_JOB_MEMORY) {
            return Err(SettingsError::JobMemory(memory));
        }
        if let Some(seconds) = self.job_time.filter(|s| !(*s > 0.0 && s.is_finite())) {
            return Err(SettingsError::JobTime(seconds));
        }
        let keep_results = self.keep_results.map(kept_for).transpose()?;
        Ok(Settings {
            out: self.out,
            order,
            boundary,
            refine,
            weld,
            feature_angle,
            names_features: self.feature_angle.is_some_and(|angle| angle.degrees().is_some()),
            strict_disks: self.strict_disks.unwrap_or(core.strict_disks),
            max_area_ratio,
            max_triangles: self.max_triangles,
            hand_off: self.hand_off.unwrap_or_default(),
            also: self.also.unwrap_or_default().each_once(),
            size: self.size,
            size_curvature: self.size_curvature,
            size_min: self.size_min,
            size_from: self.size_from,
            gradation,
            deviation: self.deviation,
            mesh_order,
            labels,
            force: self.force.unwrap_or(false),
            jobs,
            commands,
            memory,
            machine_memory,
            job_memory: self.job_memory.map(|memory| memory.as_u64()),
            job_time: self.job_time,
            poll: self.poll.unwrap_or(false),
            recursive: self.recursive.unwrap_or(false),
            drain: self.drain.unwrap_or(false),
            inputs: self.inputs.unwrap_or_default(),
            refused: self.refused.unwrap_or_default().0,
            metrics: self.metrics,
            min_free: self.min_free.unwrap_or(USUAL_MIN_FREE).as_u64(),
            keep_results,
            limits: self.limits.unwrap_or_default().or_default(),
            log: self.log.unwrap_or_default(),
            verbose: self.verbose.unwrap_or(0),
            quiet: self.quiet.unwrap_or(false),
            on_certified: hooks(self.on_certified, Occasion::Certified)?,
            on_refused: hooks(self.on_refused, Occasion::Refused)?,
        })
    }
}

/// The time of so many days.
fn kept_for(days: f64) -> Result<Duration, SettingsError> {
    if days > 0.0 && days <= MOST_DAYS {
        Ok(Duration::from_secs_f64(days * 86_400.0))
    } else {
        Err(SettingsError::KeepResults(days))
    }
}

/// The commands for an occasion, checked in their order.
fn hooks(said: Option<Vec<RawCommand>>, occasion: Occasion) -> Result<Vec<Hook>, SettingsError> {
    let mut hooks = Vec::new();
    for (i, command) in said.unwrap_or_default().into_iter().enumerate() {
        let hook = Hook::new(command, occasion);
        hooks.push(hook.map_err(|error| SettingsError::Command { occasion, table: i + 1, error })?);
    }
    Ok(hooks)
}

#[cfg(test)]
mod tests;
