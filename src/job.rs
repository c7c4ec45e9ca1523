//! One input as it travels: from its file to its published result.

use crate::formats::{self, Kind, vtm, vtp, vtu};
use crate::hand_off;
use crate::outcome::{Code, Reason, Status};
use crate::publish::{PublishError, Publisher};
use crate::report::{self, Decomposition, Input, Output, Report};
use crate::settings::{self, Settings};
use pipeline::atlas::Atlas;
use pipeline::decompose::split_ears;
use pipeline::distortion::{self, CellFields};
use pipeline::host::Alone;
use pipeline::mesh::{SurfaceMesh, TriangleSoup};
use pipeline::repair::Repaired;
use pipeline::seams::SeamNetwork;
use pipeline::{CertifiedChart, MapError, SplitError, decompose, finish_or_split, map_or_split, repair};
use rustix::time::{ClockId, clock_gettime};
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// An input with the name of its result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// The file.
    pub path: PathBuf,
    /// Its whole name: that of the result folder.
    pub name: OsString,
}

/// The stages, as progress is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Reading bytes and decoding them.
    Read,
    /// Repair and decomposition.
    Decompose,
    /// Linear and harmonic maps.
    Map,
    /// Untangling and proving.
    Untangle,
    /// Measuring, encoding, publishing.
    Write,
}

impl Stage {
    /// The name of the stage.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Decompose => "decompose",
            Self::Map => "map",
            Self::Untangle => "untangle",
            Self::Write => "write",
        }
    }
}

/// What became of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Done {
    /// The report, as it stands on disk.
    pub report: Report,
    /// Whether an older result was up to date.
    pub up_to_date: bool,
}

/// CPU seconds of this thread.
fn cpu_seconds() -> f64 {
    let t = clock_gettime(ClockId::ThreadCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// Tells the stages to whoever watches, and times them.
struct Clock<'a> {
    tell: &'a dyn Fn(Stage),
    started: f64,
    stage: Stage,
}

impl<'a> Clock<'a> {
    fn new(tell: &'a dyn Fn(Stage)) -> Self {
        tell(Stage::Read);
        Self { tell, started: cpu_seconds(), stage: Stage::Read }
    }

    /// Ends the stage at hand, books its time, begins `next`.
    fn next(&mut self, report: &mut Report, next: Stage) {
        let now = cpu_seconds();
        // Milliseconds are enough, and read well.
        let spent = ((now - self.started) * 1e3).round() / 1e3;
        *report.timing.entry(self.stage.name().to_owned()).or_insert(0.0) += spent;
        self.started = now;
        if next != self.stage {
            tracing::debug!(stage = next.name(), "stage begins");
            (self.tell)(next);
        }
        self.stage = next;
    }
}

impl Job {
    /// The job for a file.
    pub fn new(path: PathBuf) -> Self {
        let name = path.file_name().map(ToOwned::to_owned).unwrap_or_default();
        Self { path, name }
    }

    /// Processes the input and publishes its result; `tell` hears of each stage as it begins.
    ///
    /// # Errors
    /// [`PublishError`] where the result cannot be written. Anything else is told by the result itself.
    pub fn run(&self, settings: &Settings, publisher: &Publisher, tell: &dyn Fn(Stage)) -> Result<Done, PublishError> {
        let span = tracing::info_span!("job", input = %self.name.display());
        let _in_span = span.enter();
        tracing::info!("begins");
        let mut clock = Clock::new(tell);
        let content = read_file(&self.path);
        let mut report = Report::new(self.input(content.as_deref().ok()), settings);
        if !settings.force
            && let Some(older) = self.up_to_date(publisher, &report)
        {
            tracing::info!(status = %older.status, "is up to date");
            return Ok(Done { report: older, up_to_date: true });
        }
        let files = match content.and_then(|bytes| self.process(&bytes, settings, &mut report, &mut clock)) {
            Ok(files) => files,
            Err(reason) => {
                report.status = reason.status();
                report.reason = Some(reason);
                vec![]
            }
        };
        self.publish(report, files, publisher, &mut clock)
    }

    fn input(&self, content: Option<&[u8]>) -> Input {
        Input {
            name: self.name.to_string_lossy().into_owned(),
            bytes: content.map(|c| c.len() as u64),
            blake3: content.map(|c| blake3::hash(c).to_hex().to_string()),
        }
    }

    /// The published report, if it is that of the same content, settings and version, and its files are there.
    fn up_to_date(&self, publisher: &Publisher, fresh: &Report) -> Option<Report> {
        let folder = publisher.target(&self.name);
        let older: Report = serde_json::from_slice(&read_file(&folder.join(report::FILE)).ok()?).ok()?;
        let same = older.input == fresh.input
            && fresh.input.blake3.is_some()
            && older.settings == fresh.settings
            && (older.schema, &older.planish) == (fresh.schema, &fresh.planish)
            && older.status != Status::Failed;
        let there =
            |o: &Output| read_file(&folder.join(&o.file)).is_ok_and(|content| Output::of(&o.file, &content) == *o);
        let complete = (older.status == Status::Certified) != older.outputs.is_empty();
        (same && complete && older.outputs.iter().all(there)).then_some(older)
    }

    /// Runs the stages.
    fn process(
        &self,
        bytes: &[u8],
        settings: &Settings,
        report: &mut Report,
        clock: &mut Clock,
    ) -> Result<Vec<(String, Vec<u8>)>, Reason> {
        guard(|| {
            let soup = self.read(bytes)?;
            stages(&soup, settings, report, clock)
        })
    }

    /// Decodes the bytes by the extension of the file.
    pub fn read(&self, bytes: &[u8]) -> Result<TriangleSoup, Reason> {
        let refuse = |code, message: String| Err(Reason { code, message, place: Some("file name".to_owned()) });
        match formats::kind(&self.path) {
            Kind::Mesh(format) => formats::read(format, bytes).map_err(|e| e.reason()),
            Kind::OtherMesh(e) => refuse(
                Code::UnsupportedFormat,
                format!("this version reads .stl and .obj, not .{e}; convert the file to one of these"),
            ),
            Kind::NoMesh => {
                refuse(Code::NotAMesh, "a file of this name holds no mesh; name an .stl or .obj file".to_owned())
            }
            Kind::Unknown(e) if e.is_empty() => refuse(
                Code::UnknownExtension,
                "the file name has no extension; rename the file to end in .stl or .obj, whichever it is".to_owned(),
            ),
            Kind::Unknown(e) => refuse(
                Code::UnknownExtension,
                format!("the extension .{e} is not known; planish reads .stl and .obj: rename or convert the file"),
            ),
        }
    }

    /// Completes the report and publishes it with the other files.
    fn publish(
        &self,
        mut report: Report,
        mut files: Vec<(String, Vec<u8>)>,
        publisher: &Publisher,
        clock: &mut Clock,
    ) -> Result<Done, PublishError> {
        report.outputs = files.iter().map(|(name, content)| Output::of(name, content)).collect();
        clock.next(&mut report, Stage::Write);
        files.push((report::FILE.to_owned(), report.to_json().map_err(PublishError::Report)?));
        publisher.publish(&self.name, &files)?;
        match &report.reason {
            None => tracing::info!(status = %report.status, charts = report.charts.len(), "ends"),
            Some(r) if report.status == Status::Refused => {
                tracing::warn!(code = r.code.name(), "refused: {}", r.message)
            }
            Some(r) => tracing::error!(code = r.code.name(), "failed: {}", r.message),
        }
        Ok(Done { report, up_to_date: false })
    }
}

/// Does `work`; a panic in it is a failure of this input, not of the program.
///
/// # Errors
/// Those of `work`, and [`Code::Internal`] for a panic.
pub fn guard<T>(work: impl FnOnce() -> Result<T, Reason>) -> Result<T, Reason> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        let message = "planish broke down on this input: that is a fault of planish; please report it with the file";
        Err(Reason::new(Code::Internal, message))
    })
}

/// Reads a regular file whole. Anything else (a folder, a pipe, a device) could block for ever.
pub fn read_file(path: &Path) -> Result<Vec<u8>, Reason> {
    let unreadable = |why: String| Reason::new(Code::Unreadable, format!("cannot read the file: {why}"));
    let metadata = std::fs::metadata(path).map_err(|e| unreadable(e.to_string()))?;
    if !metadata.is_file() {
        return Err(unreadable("it is no regular file".to_owned()));
    }
    std::fs::read(path).map_err(|e| unreadable(e.to_string()))
}

/// Repairs a soup as the settings say.
///
/// # Errors
/// The refusal, where nothing is left.
pub fn repaired(soup: &TriangleSoup, settings: &Settings) -> Result<Repaired, Reason> {
    let found = repair(soup, &pipeline::repair::Settings { weld: settings.weld });
    found.map_err(|e| Reason::new(Code::OnlyDegenerate, e))
}

/// From a soup to the files of a certified result.
fn stages(
    soup: &TriangleSoup,
    settings: &Settings,
    report: &mut Report,
    clock: &mut Clock,
) -> Result<Vec<(String, Vec<u8>)>, Reason> {
    clock.next(report, Stage::Decompose);
    let found = repaired(soup, settings)?;
    report.surface = Some(report::surface(&found));
    report.repairs = Some(report::repairs(&found.report));
    let atlas = decompose(&found.mesh, &settings.decompose(), &Alone).map_err(internal)?;
    let feature_edges = atlas.feature_edges();
    report.decomposition = Some(Decomposition { feature_edges, ..Decomposition::default() });
    let (mesh, atlas) = match split_ears(&found.mesh, &atlas, settings.decompose().max_triangles).map_err(internal)? {
        Some(done) => {
            report.decomposition.iter_mut().for_each(|d| d.ears_split = done.split);
            (done.mesh, done.atlas)
        }
        None => (found.mesh, atlas),
    };
    map_and_write(&mesh, atlas, settings, report, clock)
}

fn internal(fault: impl std::fmt::Display) -> Reason {
    Reason::new(Code::Internal, format!("{fault}: that is a fault of planish; please report it with the file"))
}

/// Maps the charts of an atlas that was made otherwise; returns the files of its result and completes the report.
///
/// # Errors
/// The refusal, where a chart cannot be mapped.
pub fn finish(
    found: &Repaired,
    atlas: Atlas,
    settings: &Settings,
    report: &mut Report,
) -> Result<Vec<(String, Vec<u8>)>, Reason> {
    report.surface = Some(report::surface(found));
    report.repairs = Some(report::repairs(&found.report));
    report.decomposition = Some(Decomposition::default());
    let files = map_and_write(&found.mesh, atlas, settings, report, &mut Clock::new(&|_| ()))?;
    report.outputs = files.iter().map(|(name, content)| Output::of(name, content)).collect();
    Ok(files)
}

/// Maps the charts of an atlas, splitting them where they must be; returns the files of the result and completes the
/// report.
///
/// # Errors
/// The refusal, where a chart cannot be mapped.
fn map_and_write(
    mesh: &SurfaceMesh,
    atlas: Atlas,
    settings: &Settings,
    report: &mut Report,
    clock: &mut Clock,
) -> Result<Vec<(String, Vec<u8>)>, Reason> {
    let whole = atlas.charts().len();
    let (mut charts, mut done) = (Vec::new(), Vec::new());
    for chart in atlas.into_charts() {
        clock.next(report, Stage::Map);
        let mapped =
            map_or_split(mesh, chart, settings.order, &settings.decompose(), &Alone).map_err(|e| map_refusal(&e))?;
        clock.next(report, Stage::Untangle);
        for (chart, mapped) in mapped {
            let finished = finish_or_split(mesh, chart, mapped, settings.order, &settings.decompose(), &Alone);
            for (chart, certified) in finished.map_err(|e| map_refusal(&e))? {
                charts.push(chart);
                done.push(certified);
            }
        }
    }
    clock.next(report, Stage::Write);
    Atlas::renumber(&mut charts);
    report.decomposition.iter_mut().for_each(|d| d.charts_by_splitting = charts.len() - whole);
    let network = SeamNetwork::new(mesh, &charts);
    let fields: Vec<_> = charts.iter().zip(&done).map(|(c, d)| distortion::fields(c, &d.certified)).collect();
    for ((chart, done), fields) in charts.iter().zip(&done).zip(&fields) {
        warn_if_unsolved(chart, done);
        let summary = distortion::summary(chart, &done.certified, fields);
        report.charts.push(report::chart_report(chart, &network, done, fields, &summary));
    }
    report.seams = report::seams(&network);
    report.status = Status::Certified;
    let mut files = encode(mesh, &charts, &done, &fields, &network)?;
    if settings.hand_off == settings::HandOff::Gmsh {
        let handed = hand_off::gmsh(mesh, &charts, &done, &network, settings.size);
        files.extend(handed.files);
        report.hand_off = Some(handed.report);
    }
    Ok(files)
}

/// The refusal of a chart that cannot be mapped, not even split.
fn map_refusal(error: &SplitError) -> Reason {
    let code = match error {
        SplitError::Map(MapError::Linear(pipeline::linear::Error::Solver(pipeline::sparse::Error::TooLarge {
            ..
        }))) => Code::TooLarge,
        SplitError::Map(_) => Code::NeedsSplit,
        SplitError::Split(_) | SplitError::Cancelled => Code::Internal,
    };
    Reason::new(code, error)
}

fn warn_if_unsolved(chart: &pipeline::atlas::Chart, done: &CertifiedChart) {
    if let Some(error) = &done.unsolved {
        tracing::warn!(chart = %chart.id(), "no harmonic map ({error}): the linear one, raised, is published");
    }
}

/// Encodes what ParaView shows.
fn encode(
    mesh: &SurfaceMesh,
    charts: &[pipeline::atlas::Chart],
    done: &[CertifiedChart],
    fields: &[Vec<CellFields>],
    network: &SeamNetwork,
) -> Result<Vec<(String, Vec<u8>)>, Reason> {
    let none = |chart: &pipeline::atlas::Chart| vec![false; chart.triangles().len()];
    let invalid = |(c, d): (&_, &CertifiedChart)| d.harmonic.as_ref().map_or(none(c), |h| h.invalid.clone());
    let untangled: Vec<Vec<bool>> = charts.iter().zip(done).map(invalid).collect();
    let view = |i: usize| vtu::ChartView {
        mesh,
        chart: &charts[i],
        map: &done[i].certified,
        fields: &fields[i],
        untangled: &untangled[i],
        colour: network.colours()[i],
    };
    let views: Vec<_> = (0..charts.len()).map(view).collect();
    let files = [
        ("surface.vtu", vtu::surface(&views).map_err(not_encoded)?),
        ("param.vtu", vtu::param(&views).map_err(not_encoded)?),
        ("seams.vtp", vtp::seams(mesh, network).map_err(not_encoded)?),
        ("atlas.vtm", vtm::blocks(&ATLAS)),
    ];
    Ok(files.map(|(name, content)| (name.to_owned(), content)).into())
}

/// The blocks of atlas.vtm.
const ATLAS: [(&str, &str); 3] = [("surface", "surface.vtu"), ("param", "param.vtu"), ("seams", "seams.vtp")];

fn not_encoded(error: impl std::fmt::Display) -> Reason {
    Reason::new(Code::Internal, format!("the result cannot be encoded: {error}"))
}
