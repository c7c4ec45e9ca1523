//! What each stage does with an input: values in, values out. The threads are in [`crate::conveyor`].

use crate::export;
use crate::formats::{Fields, Label, glb, surface_obj, vtm, vtp, vtu, welded};
use crate::outcome::{Abort, Code, Reason};
use crate::report::{
    self, CertifiedFacts, Decomposition, Facts, Input, Output, RefusedComponent, Report, SurfaceFacts,
};
use crate::result_files;
use crate::settings::{Also, ExportTarget, Settings};
use planish_core::atlas::Atlas;
use planish_core::fem::sparse;
use planish_core::map::linear;
use planish_core::mesh::{SurfaceMesh, TriangleSoup};
use planish_core::monitor::{Interrupted, Monitor, NoMonitor};
use planish_core::repair::{self, Accepted, Repaired, repair};
use planish_core::{
    CertifiedAtlas, CertifiedChart, ChartError, ChartJob, Error, MapError, MappedChart, Plan, Surveyed,
};
use std::panic::{AssertUnwindSafe, catch_unwind};

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

/// Repairs a soup as the settings say.
///
/// # Errors
/// The refusal, where nothing is left.
pub fn repaired(soup: &TriangleSoup, settings: &Settings) -> Result<Repaired, Reason> {
    let found = repair(soup, &settings.core().repair);
    found.map_err(|e| not_repaired(&e))
}

fn not_repaired(error: &repair::Error) -> Reason {
    match error {
        repair::Error::OnlyDegenerate { .. } => Reason::new(Code::OnlyDegenerate, error),
        repair::Error::VolumeElements { vertices, .. } | repair::Error::SheetsTogether { vertices, .. } => {
            Reason::at(Code::VolumeElements, error, Some(format!("vertices {vertices:?} after welding")))
        }
    }
}

/// The components of a surface of which no atlas can be made.
///
/// # Errors
/// The refusal, where there are no others.
pub fn refused(found: &Repaired) -> Result<Vec<RefusedComponent>, Reason> {
    Ok(found.refused().map_err(|e| not_repaired(&e))?.iter().map(refusal).collect())
}

fn refusal(component: &repair::RefusedComponent) -> RefusedComponent {
    let &repair::RefusedComponent { component, triangles, first_triangle, ref error } = component;
    RefusedComponent { component, triangles, first_triangle, reason: not_repaired(error) }
}

/// Cuts a surface into charts.
///
/// # Errors
/// The refusal, or that the result is no longer wanted.
pub fn plan(
    found: Repaired,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<(Plan, Vec<RefusedComponent>), Abort> {
    let Accepted { mesh, refused } = found.accepted().map_err(|e| not_repaired(&e))?;
    let refused: Vec<RefusedComponent> = refused.iter().map(refusal).collect();
    for component in &refused {
        tracing::warn!(
            code = component.reason.code.name(),
            triangles = component.triangles,
            first_triangle = component.first_triangle,
            "component {} is refused: {}",
            component.component,
            component.reason.message
        );
    }
    let plan = Plan::new(mesh, &settings.core(), monitor).map_err(not_cut)?;
    Ok((plan, refused))
}

fn not_cut(error: Error) -> Abort {
    match error {
        Error::Interrupted(_) => Abort::Unwanted,
        fault => internal(fault).into(),
    }
}

fn internal(fault: impl std::fmt::Display) -> Reason {
    Reason::new(Code::Internal, format!("{fault}: that is a fault of planish; please report it with the file"))
}

/// Maps a chart for a first time, and finds where it needs more triangles.
///
/// # Errors
/// As [`map`].
pub fn survey(job: ChartJob, monitor: &dyn Monitor) -> Result<Surveyed, Abort> {
    job.survey(monitor).map_err(not_mapped)
}

/// Refines a surface where its charts need it, and cuts chart jobs from it.
///
/// # Errors
/// A fault of planish.
pub fn refine(
    mesh: SurfaceMesh,
    surveyed: Vec<Surveyed>,
) -> Result<(SurfaceMesh, Vec<ChartJob>, report::Refinement), Abort> {
    let (mesh, jobs, done) = planish_core::refine(mesh, surveyed).map_err(internal)?;
    Ok((mesh, jobs, done.into()))
}

/// Maps a chart, splitting it where it must be.
///
/// # Errors
/// The refusal of a chart that cannot be mapped, not even split, or that the result is no longer wanted.
pub fn map(job: ChartJob, monitor: &dyn Monitor) -> Result<Vec<MappedChart>, Abort> {
    job.map(monitor).map_err(not_mapped)
}

/// Untangles and certifies a chart, splitting it where it must be.
///
/// # Errors
/// As [`map`].
pub fn untangle(mapped: MappedChart, monitor: &dyn Monitor) -> Result<Vec<CertifiedChart>, Abort> {
    mapped.untangle(monitor).map_err(not_mapped)
}

fn not_mapped(error: ChartError) -> Abort {
    let code = match &error {
        ChartError::Interrupted(_) => return Abort::Unwanted,
        ChartError::Map(MapError::Linear(linear::Error::Solver(sparse::Unsolvable::TooLarge { .. }))) => Code::TooLarge,
        ChartError::Map(_) => Code::NeedsSplit,
        ChartError::Split(_) | ChartError::Setting(_) => Code::Internal,
    };
    Reason::new(code, error).into()
}

/// Puts the charts of a surface together.
///
/// # Errors
/// A fault of planish.
pub fn gather(mesh: SurfaceMesh, charts: Vec<CertifiedChart>, settings: &Settings) -> Result<CertifiedAtlas, Abort> {
    let atlas = CertifiedAtlas::gather(mesh, charts, settings.size).map_err(internal)?;
    atlas.charts().iter().for_each(warn_if_unsolved);
    Ok(atlas)
}

/// Files of a result that are encoded together. Each kind needs nothing of the others: they can be encoded at the same time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// surface.vtu.
    Surface,
    /// param.vtu.
    Param,
    /// What else ParaView shows: seams, parts with labels, and the file that opens all.
    Beside,
    /// A file for another program.
    Also(Also),
    /// What Gmsh gets.
    HandOff,
    /// What Mmg gets.
    Mmg,
}

/// What a kind of files came to.
#[derive(Debug, Default)]
pub struct Encoded {
    /// Names and contents.
    files: Files,
    /// What the report says of them.
    outputs: Vec<Output>,
    /// The account of the hand-off to Gmsh.
    hand_off: Option<report::ExportReport>,
    /// That of the one to Mmg.
    mmg: Option<report::MmgReport>,
}

/// What a result consists of, in the order of its files.
pub fn encodings(settings: &Settings) -> Vec<Encoding> {
    let mut encodings = vec![Encoding::Surface, Encoding::Param, Encoding::Beside];
    encodings.extend(settings.also.iter().map(|also| Encoding::Also(*also)));
    if settings.hand_off.has(ExportTarget::Gmsh) {
        encodings.push(Encoding::HandOff);
    }
    if settings.hand_off.has(ExportTarget::Mmg) {
        encodings.push(Encoding::Mmg);
    }
    encodings
}

/// What the input tells of its surface beside that, and goes into the files of a result.
#[derive(Clone, Copy, Debug)]
pub struct Told<'a> {
    /// The parts that have names.
    pub labels: &'a [Label],
    /// The arrays, with an entry for each vertex after welding.
    pub fields: &'a Fields,
}

/// Encodes files of one kind. `told` is what the input tells.
///
/// # Errors
/// Where the result cannot be encoded, a fault of planish; the refusal of a surface that a file asked for cannot hold; or that
/// it is no longer wanted.
pub fn encode(
    encoding: Encoding,
    atlas: &CertifiedAtlas,
    told: Told,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Encoded, Abort> {
    let Told { labels, fields } = told;
    let mut encoded = Encoded::default();
    encoded.files = match encoding {
        Encoding::Surface => vec![(result_files::SURFACE.to_owned(), vtu::surface(atlas, labels, fields))],
        Encoding::Param => vec![(result_files::PARAM.to_owned(), vtu::param(atlas, labels))],
        Encoding::Beside => encode_beside(atlas, told)?,
        Encoding::Also(also) => vec![encode_also(also, atlas, labels)?],
        Encoding::HandOff => {
            let export = export::gmsh(atlas, &wanted(atlas, labels, settings), monitor).map_err(unwanted)?;
            encoded.hand_off = Some(export.report);
            export.files
        }
        Encoding::Mmg => {
            let export = export::mmg(atlas, &wanted(atlas, labels, settings), monitor).map_err(unwanted)?;
            encoded.mmg = Some(export.report);
            export.files
        }
    };
    encoded.outputs = encoded.files.iter().map(|(name, content)| Output::of(name, content)).collect();
    Ok(encoded)
}

fn unwanted(Interrupted: Interrupted) -> Abort {
    Abort::Unwanted
}

/// What a mesher is asked for, as the settings say.
fn wanted<'a>(atlas: &CertifiedAtlas, labels: &'a [Label], settings: &Settings) -> export::Wanted<'a> {
    let least = settings.size_min.unwrap_or(0.0);
    let size = settings.size.unwrap_or_else(|| atlas.mesh().default_size().max(least));
    let features = settings.feature_angle.filter(|_| settings.names_features);
    let sizes = export::Sizes {
        size,
        min: least.min(size),
        per_turn: settings.size_curvature,
        deviation: settings.deviation,
        gradation: settings.gradation,
    };
    export::Wanted { sizes, labels, features, ridges: settings.feature_angle, order: settings.mesh_order }
}

/// What is known of an atlas of which all files are `encoded`, in the order of [`encodings`], and these. `whole` is how many charts
/// decomposition made; `told` is what the input tells.
pub fn assemble(atlas: &CertifiedAtlas, whole: usize, told: Told, encoded: Vec<Encoded>) -> (CertifiedFacts, Files) {
    let (mut files, mut outputs, mut hand_off, mut mmg) = (Files::new(), Vec::new(), None, None);
    for one in encoded {
        files.extend(one.files);
        outputs.extend(one.outputs);
        hand_off = hand_off.or(one.hand_off);
        mmg = mmg.or(one.mmg);
    }
    let facts = CertifiedFacts {
        labels: report::labels(atlas, told.labels),
        fields: report::fields(told.fields),
        charts: report::charts(atlas),
        charts_by_splitting: atlas.charts().len() - whole,
        seams: report::seams(atlas.seams()),
        hand_off,
        mmg,
        outputs,
    };
    (facts, files)
}

/// Maps the charts of an atlas that was made otherwise, and puts them together; returns the report and the files of its
/// result.
///
/// # Errors
/// The refusal, where a chart cannot be mapped.
pub fn finish(input: Input, found: Repaired, atlas: Atlas, settings: &Settings) -> Result<(Report, Files), Abort> {
    let surface = SurfaceFacts { decomposition: Some(Decomposition::default()), ..SurfaceFacts::of(&found) };
    let facts = Facts { surface: Some(surface), ..Facts::new(input) };
    let whole = atlas.charts().len();
    let of_charts = settings.core().of_charts();
    let mut done = Vec::new();
    for chart in atlas.into_charts() {
        done.extend(ChartJob::new(chart, of_charts).run(&NoMonitor).map_err(not_mapped)?);
    }
    let atlas = gather(found.mesh, done, settings)?;
    let told = Told { labels: &[], fields: &Fields::default() };
    let mut encoded = Vec::new();
    for encoding in encodings(settings) {
        encoded.push(encode(encoding, &atlas, told, settings, &NoMonitor)?);
    }
    let (certified, files) = assemble(&atlas, whole, told, encoded);
    Ok((facts.certified(settings, certified), files))
}

fn warn_if_unsolved(certified: &CertifiedChart) {
    if let Some(error) = &certified.provenance().unsolved {
        tracing::warn!(chart = %certified.id(), "no harmonic map ({error}): the linear one, raised, is published");
    }
}

/// Encodes what else ParaView shows.
fn encode_beside(atlas: &CertifiedAtlas, Told { labels, fields }: Told) -> Result<Files, Reason> {
    let mut files = vec![(result_files::SEAMS.to_owned(), vtp::seams(atlas, labels).map_err(not_encoded)?)];
    let mut parts = Vec::new();
    for (label, Label { name, group, .. }) in labels.iter().enumerate() {
        let file = result_files::surface_of(group);
        parts.push(vtm::Block::file(name, &file));
        files.push((file, vtu::part(atlas, labels, label, fields)));
    }
    let surface = match parts.len() {
        0 => vtm::Content::File(result_files::SURFACE.to_owned()),
        _ => vtm::Content::Blocks(parts),
    };
    let blocks = [
        vtm::Block { name: "surface".to_owned(), content: surface },
        vtm::Block::file("param", result_files::PARAM),
        vtm::Block::file("seams", result_files::SEAMS),
    ];
    files.push((result_files::ATLAS_VTM.to_owned(), vtm::blocks(&blocks)));
    Ok(files)
}

/// Encodes a file for other programs.
fn encode_also(also: Also, atlas: &CertifiedAtlas, labels: &[Label]) -> Result<(String, Vec<u8>), Reason> {
    let content = match also {
        Also::Obj => surface_obj::surface(atlas, labels),
        Also::Glb => glb::surface(atlas, labels).map_err(|e| e.reason())?,
        Also::Welded => welded::surface(atlas, labels),
    };
    Ok((also_file(also).to_owned(), content))
}

/// The name of a file for other programs.
pub fn also_file(also: Also) -> &'static str {
    match also {
        Also::Obj => result_files::SURFACE_OBJ,
        Also::Glb => result_files::SURFACE_GLB,
        Also::Welded => result_files::WELDED,
    }
}

fn not_encoded(error: impl std::fmt::Display) -> Reason {
    Reason::new(Code::Internal, format!("the result cannot be encoded: {error}"))
}
