//! What `lift` and `transfer` are given: meshes of the planes of charts, meshes in space, and tables.

use crate::formats::{self, Format, Kind, LabelSource, READ, Source};
use crate::input::read_file;
use crate::settings::Settings;
use planish_core::lift::PlanarPart;
use planish_core::soundness::Triangulation;
use planish_core::vec3::Vec3;
use std::collections::BTreeMap;
use std::path::Path;

/// Rows of chart, u and v.
pub(super) struct Table {
    pub rows: Vec<(usize, [f64; 2])>,
}

/// Whether a name is that of a table.
pub(super) fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"))
}

/// Reads a table: `chart,u,v` in every line, behind a headline with these words or none.
///
/// # Errors
/// What is wrong, and where.
pub(super) fn read_table(path: &Path) -> Result<Table, String> {
    let bytes = read_file(path).map_err(|reason| reason.message)?;
    let text = std::str::from_utf8(&bytes).map_err(|error| format!("no text: {error}"))?;
    let mut rows = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let mut cells = line.split(',').map(str::trim);
        let (Some(chart), Some(u), Some(v), None) = (cells.next(), cells.next(), cells.next(), cells.next()) else {
            return Err(format!("line {}: not three cells: chart,u,v", number + 1));
        };
        match (chart.parse(), u.parse::<f64>(), v.parse::<f64>()) {
            (Ok(chart), Ok(u), Ok(v)) if u.is_finite() && v.is_finite() => rows.push((chart, [u, v])),
            _ if number == 0 && chart == "chart" => {}
            _ => return Err(format!("line {}: not a number of a chart and two finite numbers", number + 1)),
        }
    }
    Ok(Table { rows })
}

/// Reads meshes of planes, whose triangles tell their charts: by references of MEDIT, or surfaces of MSH, from 1; by an array
/// `chart` of VTK, from 0; else by a name like chart-012.stl.
///
/// # Errors
/// What is wrong.
pub(super) fn read(path: &Path, settings: &Settings) -> Result<Vec<PlanarPart>, String> {
    let (points, triangles, charts) = read_with_charts(path, settings)?;
    let charts = match (charts, chart_of_name(path)) {
        (Some(charts), _) => charts,
        (None, Some(chart)) => vec![chart; triangles.len()],
        (None, None) => {
            let ways = "references (.mesh) or surfaces (.msh) that count from 1, an array `chart` (.vtk, .vtu), or a name \
                        like chart-012.stl";
            return Err(format!("nothing tells its charts: {ways}"));
        }
    };
    if let Some(point) = points.iter().find(|point| point[2] != 0.0) {
        let z = point[2];
        return Err(format!("it is no mesh of a plane: a node has z = {z}; --project takes meshes in space"));
    }
    let mut by_chart: BTreeMap<usize, Vec<[u32; 3]>> = BTreeMap::new();
    for (triangle, chart) in triangles.into_iter().zip(charts) {
        by_chart.entry(chart).or_default().push(triangle);
    }
    Ok(by_chart.into_iter().map(|(chart, triangles)| part(chart, &points, triangles)).collect())
}

/// A part with the nodes that it has.
fn part(chart: usize, points: &[Vec3], mut triangles: Vec<[u32; 3]>) -> PlanarPart {
    let mut number = vec![u32::MAX; points.len()];
    let mut uv = Vec::new();
    for node in triangles.iter_mut().flatten() {
        let known = &mut number[*node as usize];
        if *known == u32::MAX {
            *known = uv.len() as u32;
            let [u, v, _] = points[*node as usize];
            uv.push([u, v]);
        }
        *node = *known;
    }
    PlanarPart { chart, uv, triangles }
}

/// The number in a name like chart-012.o.mesh.
fn chart_of_name(path: &Path) -> Option<usize> {
    let name = path.file_name()?.to_str()?;
    let digits: String = name.strip_prefix("chart-")?.chars().take_while(char::is_ascii_digit).collect();
    digits.parse().ok()
}

/// Points, triangles, and the charts of these where the file tells them.
type Charted = (Vec<Vec3>, Vec<[u32; 3]>, Option<Vec<usize>>);

/// Reads a mesh in space, whose nodes at the same place are one; with its charts where it tells them.
///
/// # Errors
/// What is wrong.
pub(super) fn read_in_space(path: &Path, settings: &Settings) -> Result<Charted, String> {
    let (points, triangles, charts) = read_with_charts(path, settings)?;
    let welded = Triangulation::welded(&points, triangles);
    // References of MEDIT may be those of parts: only what MSH and VTK files say are charts in space.
    let charts = charts.filter(|_| !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mesh")));
    let triangles = welded.triangles.iter().map(|t| t.map(|v| v.0)).collect();
    Ok((welded.points, triangles, charts))
}

/// A mesh as its file has it.
pub(super) struct Whole {
    pub points: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    /// Nodes in the middle of sides; empty where not all triangles have them.
    pub middles: Vec<[u32; 3]>,
    pub charts: Option<Vec<usize>>,
}

/// Reads a mesh in space with all of its nodes. Those of STL files, which have three for every triangle, are made one where they
/// are at the same place.
///
/// # Errors
/// What is wrong.
pub(super) fn read_whole(path: &Path, settings: &Settings) -> Result<Whole, String> {
    let Kind::Mesh(format) = formats::kind(path) else {
        return Err(format!("the file name tells no mesh; name one of {READ}"));
    };
    if format == Format::Msh {
        let bytes = read_file(path).map_err(|reason| reason.message)?;
        let source = Source::alone(&bytes, &settings.limits);
        let patches = formats::read_patches(format, &source).map_err(|e| e.reason().message)?;
        let charts = patches.surfaces().map(|tags| tags.iter().map(chart_of_tag).collect());
        let middles: Option<Vec<[u32; 3]>> = patches.mids().iter().copied().collect();
        let (points, triangles) = (patches.points().to_vec(), patches.triangles().to_vec());
        return Ok(Whole { points, triangles, middles: middles.unwrap_or_default(), charts });
    }
    let (points, triangles, charts) = read_in_space(path, settings)?;
    Ok(Whole { points, triangles, middles: vec![], charts })
}

/// The chart of a surface of an MSH file.
fn chart_of_tag(tag: &i64) -> usize {
    tag.checked_sub(1).and_then(|chart| usize::try_from(chart).ok()).unwrap_or(usize::MAX)
}

fn read_with_charts(path: &Path, settings: &Settings) -> Result<Charted, String> {
    let Kind::Mesh(format) = formats::kind(path) else {
        return Err(format!("the file name tells no mesh; name one of {READ}"));
    };
    let bytes = read_file(path).map_err(|reason| reason.message)?;
    let plain = Source::alone(&bytes, &settings.limits);
    let patches = formats::read_patches(format, &plain).map_err(|e| e.reason().message)?;
    if let Some(surfaces) = patches.surfaces() {
        let charts = surfaces.iter().map(chart_of_tag).collect();
        return Ok((patches.points().to_vec(), patches.triangles().to_vec(), Some(charts)));
    }
    let (array, first) = match format {
        Format::Medit => ("ref", 1),
        Format::Vtk | Format::Vtu | Format::Vtp => ("chart", 0),
        _ => return Ok((patches.points().to_vec(), patches.triangles().to_vec(), None)),
    };
    let labels = LabelSource::Array(array.to_owned());
    // Where there is no such array the file is refused: then it tells nothing.
    let labelled = formats::read(format, &Source { labels: &labels, keeps_fields: false, ..plain });
    let charts = labelled.ok().and_then(|content| {
        let numbers = content.notes.labels.iter().map(|label| number_in(&label.name, first));
        let numbers = numbers.collect::<Option<Vec<usize>>>()?;
        let of_triangles = content.soup.labels();
        (!of_triangles.is_empty()).then(|| of_triangles.iter().map(|label| numbers[*label as usize]).collect())
    });
    Ok((patches.points().to_vec(), patches.triangles().to_vec(), charts))
}

/// The number at the end of a name like ref_7, counted from `first`.
fn number_in(name: &str, first: usize) -> Option<usize> {
    name.rsplit('_').next()?.parse::<usize>().ok()?.checked_sub(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_are_told_by_names() {
        let of = |name: &str| chart_of_name(Path::new(name));
        assert_eq!(
            (of("mmg/chart-012.o.mesh"), of("chart-1.stl"), of("part.stl"), of("chart-x.stl")),
            (Some(12), Some(1), None, None)
        );
        assert_eq!((number_in("ref_7", 1), number_in("chart_0", 0), number_in("ref_0", 1)), (Some(6), Some(0), None));
    }
}
