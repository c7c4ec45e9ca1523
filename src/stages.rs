//! What each stage does with an input: values in, values out. The threads are in [`crate::conveyor`].

use crate::formats::{self, Beside, Content, Kind, READ, Refusal, Source, vtm, vtp, vtu};
use crate::hand_off;
use crate::job::{Job, Stopped};
use crate::look::Look;
use crate::outcome::{Code, Reason, Status};
use crate::passing;
use crate::regular::{self, OpenError};
use crate::report::{self, Decomposition, Output, Report};
use crate::settings::{self, Settings};
use bytesize::ByteSize;
use planish_core::atlas::{Atlas, Chart};
use planish_core::decompose::{self, split_ears};
use planish_core::fem::sparse;
use planish_core::map::linear;
use planish_core::measure::distortion::{self, CellFields};
use planish_core::mesh::{SurfaceMesh, TriangleSoup};
use planish_core::monitor::{Monitor, NoMonitor};
use planish_core::repair::Repaired;
use planish_core::seams::SeamNetwork;
use planish_core::{CertifiedChart, MapError, MappedChart, SplitError, finish_or_split, map_or_split, repair};
use std::cell::RefCell;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// What an input takes per triangle from reading to writing, factors apart, whatever its format: 1250 to 1500 bytes were
/// measured for binary STL and PLY. No more than 430 of them are reached before the surface is cut into charts
/// (`cargo run --release --example decode -- --cut`), so that readers do not count.
pub const MEMORY_PER_TRIANGLE: u64 = 1500;

/// The files of a result: names and contents.
pub type Files = Vec<(String, Vec<u8>)>;

/// Does `work`; a panic in it is a failure of this input, not of the program.
///
/// # Errors
/// Those of `work`, and [`Code::Internal`] for a panic.
pub fn guard<T, E: From<Reason>>(work: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| {
        let message = "planish broke down on this input: that is a fault of planish; please report it with the file";
        Err(Reason::new(Code::Internal, message).into())
    })
}

/// Why an input is not read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unread {
    /// The reason.
    pub reason: Reason,
    /// Whether it says nothing about the input itself, and passes.
    pub passes: bool,
}

impl From<OpenError> for Unread {
    fn from(error: OpenError) -> Self {
        let passes = matches!(&error, OpenError::Io(error) if passing::passes(error));
        Self { reason: unreadable(error), passes }
    }
}

/// Reads an input, as far as it is not too large. What is read is the file that was seen, whatever took its name since.
///
/// # Errors
/// Why not.
pub fn read_input(job: &Job, settings: &Settings) -> Result<Vec<u8>, Unread> {
    Ok(regular::read(&open_input(job)?, settings.limits.file)?)
}

/// The hash of an input, and its size in bytes; as [`read_input`], but nothing of it is kept.
///
/// # Errors
/// Why not.
pub fn hash_input(job: &Job, settings: &Settings) -> Result<(blake3::Hash, u64), Unread> {
    Ok(regular::hash(&open_input(job)?, settings.limits.file)?)
}

fn open_input(job: &Job) -> Result<File, Unread> {
    let file = job.open()?;
    let is_seen = |seen: &Look| file.metadata().is_ok_and(|m| Look::of(&m) == *seen);
    if job.look.as_ref().is_none_or(is_seen) {
        return Ok(file);
    }
    let reason = Reason::new(Code::Unreadable, "the file changed when it was opened; try again");
    Err(Unread { reason, passes: false })
}

/// Reads a regular file whole. Anything else (a folder, a pipe, a device) could block for ever.
///
/// # Errors
/// Why it cannot be read.
pub fn read_file(path: &Path) -> Result<Vec<u8>, Reason> {
    let mut bytes = Vec::new();
    read_file_into(path, &mut bytes)?;
    Ok(bytes)
}

/// As [`read_file`], in the place of what `bytes` hold: memory that is there is used again.
///
/// # Errors
/// As [`read_file`].
pub fn read_file_into(path: &Path, bytes: &mut Vec<u8>) -> Result<(), Reason> {
    regular::open(path).and_then(|file| regular::read_into(&file, u64::MAX, bytes)).map_err(unreadable)
}

fn unreadable(error: OpenError) -> Reason {
    match error {
        OpenError::TooLarge { size, most } => {
            let remedy = "split or decimate it, or raise `file` in the table [limits] of planish.toml";
            Reason::new(Code::TooLarge, format!("the file has {size} bytes, more than {most}: {remedy}"))
        }
        other => Reason::new(Code::Unreadable, format!("cannot read the file: {other}")),
    }
}

/// Decodes the bytes of the file at `path` by its extension; others may lie beside it in `folder`.
///
/// # Errors
/// The refusal, with the place and what to do.
pub fn decode(path: &Path, bytes: &[u8], settings: &Settings, folder: &Folder) -> Result<Content, Refusal> {
    let refuse = |code, message: String| Err(Reason::at(code, message, Some("file name".to_owned())).into());
    match formats::kind(path) {
        Kind::Mesh(format) => {
            let source = Source { bytes, limits: &settings.limits, beside: folder };
            formats::read_or_tell(format, &source)
        }
        Kind::OtherMesh(e) => refuse(
            Code::UnsupportedFormat,
            format!("this version does not read .{e}; convert the file to one of {READ}"),
        ),
        Kind::NoMesh => refuse(Code::NotAMesh, format!("a file of this name holds no mesh; name one of {READ}")),
        Kind::Unknown(e) if e.is_empty() => refuse(
            Code::UnknownExtension,
            format!("the file name has no extension; rename the file to end in one of {READ}, whichever it is"),
        ),
        Kind::Unknown(e) => refuse(
            Code::UnknownExtension,
            format!("the extension .{e} is not known; rename or convert the file to one of {READ}"),
        ),
    }
}

/// Whether there is the memory that a surface will take.
///
/// # Errors
/// The refusal of one that takes more than an input may, or than there is.
pub fn check_memory(soup: &TriangleSoup, settings: &Settings) -> Result<(), Reason> {
    let needed = MEMORY_PER_TRIANGLE.saturating_mul(soup.triangles().len() as u64);
    let (limit, remedy) = match settings.job_memory {
        Some(limit) if limit <= settings.machine_memory => (limit, "raise job-memory"),
        _ => (settings.machine_memory, "give the machine, or its container, more memory"),
    };
    if needed <= limit {
        return Ok(());
    }
    let [needed, limit] = [needed, limit].map(ByteSize::b);
    let message =
        format!("it takes {needed} of memory or more, and there are {limit}: split or decimate it, or {remedy}");
    Err(Reason::new(Code::JobMemory, message))
}

/// The folder of a file, and what was asked for in it.
pub struct Folder<'a> {
    of: &'a Path,
    within: Option<&'a Path>,
    asked: RefCell<Vec<(String, Option<Output>)>>,
}

impl<'a> Folder<'a> {
    /// The folder of the file at this path.
    pub fn of(path: &'a Path) -> Self {
        Self { of: path, within: None, asked: RefCell::default() }
    }

    /// The folder of an input.
    pub fn of_job(job: &'a Job) -> Self {
        Self { within: job.within.as_deref(), ..Self::of(&job.path) }
    }

    /// The names of the files that were asked for, there or not.
    pub fn asked(&self) -> Vec<String> {
        self.asked.borrow().iter().map(|(name, _)| name.clone()).collect()
    }

    /// The files that were read.
    pub fn read(&self) -> Vec<Output> {
        self.asked.borrow().iter().filter_map(|(_, read)| read.clone()).collect()
    }

    /// Whether a file still is what was read once.
    pub fn still_has(&self, read: &Output) -> bool {
        self.bytes(&read.file, read.bytes).is_ok_and(|bytes| Output::of(&read.file, &bytes) == *read)
    }

    /// The bytes of a regular file, no link, of at most `most` bytes; or why there are none, for people.
    fn bytes(&self, name: &str, most: u64) -> Result<Vec<u8>, String> {
        let path = self.of.with_file_name(name);
        if path.file_name() != Some(name.as_ref()) {
            return Err(format!("{name} is no plain name"));
        }
        let opened = match self.within.and_then(|folder| Some((folder, path.strip_prefix(folder).ok()?))) {
            Some((folder, name)) => regular::open_below(folder, name),
            None => regular::open_itself(&path),
        };
        opened.and_then(|file| regular::read(&file, most)).map_err(|error| format!("{name}: {error}"))
    }
}

impl Beside for Folder<'_> {
    fn read(&self, name: &str, most: u64) -> Result<Vec<u8>, String> {
        let bytes = self.bytes(name, most);
        let read = bytes.as_ref().ok().map(|bytes| Output::of(name, bytes));
        self.asked.borrow_mut().push((name.to_owned(), read));
        bytes
    }
}

/// Repairs a soup as the settings say.
///
/// # Errors
/// The refusal, where nothing is left.
pub fn repaired(soup: &TriangleSoup, settings: &Settings) -> Result<Repaired, Reason> {
    let found = repair(soup, &planish_core::repair::Settings { weld: settings.weld });
    found.map_err(|e| not_repaired(&e))
}

fn not_repaired(error: &repair::Error) -> Reason {
    match error {
        repair::Error::OnlyDegenerate { .. } => Reason::new(Code::OnlyDegenerate, error),
        repair::Error::VolumeElements { vertices, .. } => {
            Reason::at(Code::VolumeElements, error, Some(format!("vertices {vertices:?} after welding")))
        }
    }
}

/// Whether an atlas can be made of a surface.
///
/// # Errors
/// The refusal of faces of volume elements.
pub fn check_sheets(found: &Repaired) -> Result<(), Reason> {
    found.check_sheets().map_err(|e| not_repaired(&e))
}

/// Repairs a soup and cuts it into charts; completes the report.
///
/// # Errors
/// The refusal, or that the result is no longer wanted.
pub fn cut(
    soup: TriangleSoup,
    settings: &Settings,
    report: &mut Report,
    monitor: &dyn Monitor,
) -> Result<(SurfaceMesh, Vec<Chart>), Stopped> {
    let found = repaired(&soup, settings)?;
    // The surface is all that is needed from here on.
    drop(soup);
    report.surface = Some(report::surface(&found));
    report.repairs = Some(report::repairs(&found.report));
    report.warnings = report::warnings(&found);
    report.warnings.iter().for_each(|w| tracing::warn!("{}", w.message));
    check_sheets(&found)?;
    let atlas = planish_core::decompose(&found.mesh, &settings.decompose(), monitor).map_err(not_cut)?;
    let feature_edges = atlas.feature_edges();
    report.decomposition = Some(Decomposition { feature_edges, ..Decomposition::default() });
    let without = split_ears(&found.mesh, &atlas, settings.decompose().max_triangles);
    Ok(match without.map_err(internal)? {
        Some(done) => {
            report.decomposition.iter_mut().for_each(|d| d.ears_split = done.split);
            (done.mesh, done.atlas.into_charts())
        }
        None => (found.mesh, atlas.into_charts()),
    })
}

fn not_cut(error: decompose::Error) -> Stopped {
    match error {
        decompose::Error::Interrupted(_) => Stopped::Unwanted,
        fault @ decompose::Error::Illegal(_) => internal(fault).into(),
    }
}

fn internal(fault: impl std::fmt::Display) -> Reason {
    Reason::new(Code::Internal, format!("{fault}: that is a fault of planish; please report it with the file"))
}

/// Maps a chart, splitting it where it must be.
///
/// # Errors
/// The refusal of a chart that cannot be mapped, not even split, or that the result is no longer wanted.
pub fn map(
    mesh: &SurfaceMesh,
    chart: Chart,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Vec<(Chart, MappedChart)>, Stopped> {
    map_or_split(mesh, chart, settings.order, &settings.decompose(), monitor).map_err(not_mapped)
}

/// Untangles and certifies a chart, splitting it where it must be.
///
/// # Errors
/// As [`map`].
pub fn untangle(
    mesh: &SurfaceMesh,
    (chart, mapped): (Chart, MappedChart),
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Vec<(Chart, CertifiedChart)>, Stopped> {
    finish_or_split(mesh, chart, mapped, settings.order, &settings.decompose(), monitor).map_err(not_mapped)
}

fn not_mapped(error: SplitError) -> Stopped {
    let code = match &error {
        SplitError::Interrupted(_) => return Stopped::Unwanted,
        SplitError::Map(MapError::Linear(linear::Error::Solver(sparse::Unsolvable::TooLarge { .. }))) => Code::TooLarge,
        SplitError::Map(_) => Code::NeedsSplit,
        SplitError::Split(_) => Code::Internal,
    };
    Reason::new(code, error).into()
}

/// Puts the charts of a surface together, `whole` of which decomposition made; completes the report, and returns the
/// files of the result.
///
/// # Errors
/// Where the result cannot be encoded: a fault of planish.
pub fn assemble(
    mesh: &SurfaceMesh,
    done: Vec<(Chart, CertifiedChart)>,
    whole: usize,
    settings: &Settings,
    report: &mut Report,
) -> Result<Files, Reason> {
    let (mut charts, done): (Vec<Chart>, Vec<CertifiedChart>) = done.into_iter().unzip();
    Atlas::renumber(&mut charts);
    report.decomposition.iter_mut().for_each(|d| d.charts_by_splitting = charts.len() - whole);
    let size = settings.size.unwrap_or_else(|| hand_off::default_size(mesh));
    let network = SeamNetwork::new(mesh, &charts, hand_off::NARROW * size);
    let fields: Vec<_> = charts.iter().zip(&done).map(|(c, d)| distortion::fields(c, &d.certified)).collect();
    let mut distortions = Vec::with_capacity(charts.len());
    for ((chart, done), fields) in charts.iter().zip(&done).zip(&fields) {
        warn_if_unsolved(chart, done);
        let summary = distortion::summary(chart, &done.certified, fields);
        report.charts.push(report::chart_report(chart, &network, done, fields, &summary));
        distortions.push(summary);
    }
    report.seams = report::seams(&network);
    let mut files = encode(mesh, &charts, &done, &fields, &network)?;
    if settings.hand_off == settings::HandOff::Gmsh {
        let handed = hand_off::gmsh(mesh, &charts, &done, &distortions, &network, size);
        files.extend(handed.files);
        report.hand_off = Some(handed.report);
    }
    report.status = Status::Certified;
    report.outputs = files.iter().map(|(name, content)| Output::of(name, content)).collect();
    Ok(files)
}

/// Maps the charts of an atlas that was made otherwise, and puts them together; returns the files of its result and
/// completes the report.
///
/// # Errors
/// The refusal, where a chart cannot be mapped.
pub fn finish(found: &Repaired, atlas: Atlas, settings: &Settings, report: &mut Report) -> Result<Files, Stopped> {
    report.surface = Some(report::surface(found));
    report.repairs = Some(report::repairs(&found.report));
    report.decomposition = Some(Decomposition::default());
    let whole = atlas.charts().len();
    let mut done = Vec::new();
    for chart in atlas.into_charts() {
        for mapped in map(&found.mesh, chart, settings, &NoMonitor)? {
            done.extend(untangle(&found.mesh, mapped, settings, &NoMonitor)?);
        }
    }
    Ok(assemble(&found.mesh, done, whole, settings, report)?)
}

fn warn_if_unsolved(chart: &Chart, done: &CertifiedChart) {
    if let Some(error) = &done.unsolved {
        tracing::warn!(chart = %chart.id(), "no harmonic map ({error}): the linear one, raised, is published");
    }
}

/// Encodes what ParaView shows.
fn encode(
    mesh: &SurfaceMesh,
    charts: &[Chart],
    done: &[CertifiedChart],
    fields: &[Vec<CellFields>],
    network: &SeamNetwork,
) -> Result<Files, Reason> {
    let none = |chart: &Chart| vec![false; chart.triangles().len()];
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
