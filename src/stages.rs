//! What each stage does with an input: values in, values out. The threads are in [`crate::conveyor`].

use crate::export;
use crate::formats::{vtm, vtp, vtu};
use crate::outcome::{Abort, Code, Reason, Status};
use crate::report::{self, Decomposition, Output, Report};
use crate::settings::{self, Settings};
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

/// A surface that is cut into charts.
pub struct Cut {
    /// The surface; where ears were split, it has more vertices than before.
    pub mesh: SurfaceMesh,
    /// Its charts.
    pub charts: Vec<Chart>,
    /// What the report says of that.
    pub decomposition: Decomposition,
}

/// Cuts a surface into charts.
///
/// # Errors
/// The refusal of faces of volume elements, or that the result is no longer wanted.
pub fn cut(found: Repaired, settings: &Settings, monitor: &dyn Monitor) -> Result<Cut, Abort> {
    check_sheets(&found)?;
    let atlas = planish_core::decompose(&found.mesh, &settings.decompose(), monitor).map_err(not_cut)?;
    let decomposition = Decomposition { feature_edges: atlas.feature_edges(), ..Decomposition::default() };
    let without = split_ears(&found.mesh, &atlas, settings.decompose().max_triangles);
    Ok(match without.map_err(internal)? {
        Some(done) => Cut {
            mesh: done.mesh,
            charts: done.atlas.into_charts(),
            decomposition: Decomposition { ears_split: done.split, ..decomposition },
        },
        None => Cut { mesh: found.mesh, charts: atlas.into_charts(), decomposition },
    })
}

fn not_cut(error: decompose::Error) -> Abort {
    match error {
        decompose::Error::Interrupted(_) => Abort::Unwanted,
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
) -> Result<Vec<(Chart, MappedChart)>, Abort> {
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
) -> Result<Vec<(Chart, CertifiedChart)>, Abort> {
    finish_or_split(mesh, chart, mapped, settings.order, &settings.decompose(), monitor).map_err(not_mapped)
}

fn not_mapped(error: SplitError) -> Abort {
    let code = match &error {
        SplitError::Interrupted(_) => return Abort::Unwanted,
        SplitError::Map(MapError::Linear(linear::Error::Solver(sparse::Error::TooLarge { .. }))) => Code::TooLarge,
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
    let size = settings.size.unwrap_or_else(|| export::default_size(mesh));
    let network = SeamNetwork::new(mesh, &charts, export::NARROW * size);
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
    if settings.hand_off == settings::ExportTarget::Gmsh {
        let handed = export::gmsh(mesh, &charts, &done, &distortions, &network, size);
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
pub fn finish(found: &Repaired, atlas: Atlas, settings: &Settings, report: &mut Report) -> Result<Files, Abort> {
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
