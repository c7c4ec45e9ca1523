//! `planish transfer --atlas DIR MESH -o FILE`: the fields of the input, on a new mesh.

use super::atlas::AtlasOnDisk;
use super::lift::{NotLifted, answer, write};
use super::planar_input;
use super::{Exit, escape};
use crate::cli;
use crate::formats::{self, Field, Fields, Format, LabelSource, MadeFormat, MadeMesh, Source, Values, encode_made};
use crate::report::FieldOwner;
use crate::settings::Settings;
use crate::stages::guard;
use planish_core::lift::{Nearest, OnSurface};
use planish_core::transfer::{Charted, Share, shares};
use planish_core::vec3::{Vec3, triangle_area};
use std::collections::BTreeMap;

/// Puts the fields of a result on a mesh.
///
/// # Errors
/// Wrong usage.
pub fn transfer(asked: &cli::Transfer, settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let format = MadeFormat::of(&asked.output).filter(|format| format.has_middles()).ok_or_else(|| {
        format!("{}: fields are written to .msh and .vtu: end the name with one of these", escape(&asked.output))
    })?;
    Ok(answer(guard(|| transferred(asked, format, settings)), settings))
}

/// A mesh, and where its nodes and elements are on the surface.
struct Placed {
    mesh: MadeMesh,
    /// Per node.
    places: Vec<OnSurface>,
}

fn transferred(asked: &cli::Transfer, format: MadeFormat, settings: &Settings) -> Result<String, NotLifted> {
    let atlas = AtlasOnDisk::read(&asked.atlas)?;
    let fields = fields(&atlas, settings)?;
    let names: Vec<&str> = fields.cells.iter().map(|field| field.name.as_str()).collect();
    if let Some(unknown) = asked.extensive.iter().find(|name| !names.contains(&name.as_str())) {
        let there = if names.is_empty() { "the result has none".to_owned() } else { names.join(", ") };
        return Err(NotLifted::Broken(format!("there is no field of cells called {unknown}: {there}")));
    }
    let broken = |problem: String| NotLifted::Mesh { mesh: asked.mesh.clone(), problem };
    let input = planar_input::read_whole(&asked.mesh, settings).map_err(broken)?;
    let Placed { mut mesh, places } = placed(&atlas, input).map_err(broken)?;
    mesh.of_points = of_points(&atlas, &fields, &places);
    mesh.of_cells = of_cells(&atlas, &fields, &mesh, &places, &asked.extensive);
    let counts = format!("{} fields of points, {} of cells", fields.points.len(), fields.cells.len());
    let farthest = places.iter().map(|place| place.off).fold(0.0, f64::max);
    write(&asked.output, &encode_made(format, &mesh))?;
    Ok(format!("{}: {counts}; nodes are off the surface by {farthest:.2e} at most", escape(&asked.output)))
}

/// The fields that surface.vtu holds of the input. Those of cells have `cell` beside them where there is one.
fn fields(atlas: &AtlasOnDisk, settings: &Settings) -> Result<Fields, NotLifted> {
    let source = Source { labels: &LabelSource::Ignored, ..Source::alone(&atlas.bytes, &settings.limits) };
    let content = formats::read(Format::Vtu, &source).map_err(|e| NotLifted::Broken(e.reason().message))?;
    let mut found = content.fields;
    let is_of_input = |field: &Field, on: FieldOwner| {
        let name = field.input_name.as_ref().unwrap_or(&field.name);
        atlas.fields.iter().any(|told| told.on == on && told.name == *name)
    };
    found.cell = found
        .cells
        .iter()
        .find(|field| field.input_name.as_deref() == Some("cell"))
        .map_or(vec![], |field| (0..field.values.len()).map(|at| field.number(at) as i64).collect());
    found.points.retain(|field| is_of_input(field, FieldOwner::Points));
    found.cells.retain(|field| is_of_input(field, FieldOwner::Cells));
    for field in found.points.iter_mut().chain(&mut found.cells) {
        // A name that reading has changed is what it was.
        if let Some(name) = field.input_name.take() {
            field.name = name;
        }
    }
    Ok(found)
}

/// The mesh as it is, on the surface.
fn placed(atlas: &AtlasOnDisk, input: planar_input::Whole) -> Result<Placed, String> {
    let planar_input::Whole { points, triangles, middles, charts } = input;
    let nearest = Nearest::new(&atlas.surface);
    let is_there = |chart: &usize| *chart < atlas.surface.charts();
    let known = charts.filter(|charts| charts.iter().all(is_there));
    let mut mesh = MadeMesh {
        points,
        triangles,
        middles,
        parts: atlas.labels.clone(),
        part_of_chart: atlas.part_of_chart.clone(),
        ..MadeMesh::default()
    };
    let mut chart_of_node = vec![None; mesh.points.len()];
    if let Some(charts) = &known {
        for (triangle, chart) in charts.iter().enumerate() {
            mesh.nodes(triangle).for_each(|node| chart_of_node[node as usize] = Some(*chart));
        }
    }
    let mut places = Vec::with_capacity(mesh.points.len());
    for (x, chart) in mesh.points.iter().zip(&chart_of_node) {
        let (place, _) = nearest.to(*x, *chart).ok_or("there is nothing to be near to")?;
        places.push(place);
    }
    let centroid =
        |t: &[u32; 3]| -> Vec3 { [0, 1, 2].map(|k| t.iter().map(|n| mesh.points[*n as usize][k]).sum::<f64>() / 3.0) };
    mesh.charts = match known {
        Some(charts) => charts.into_iter().map(|chart| chart as u32).collect(),
        None => {
            let chart = |t| nearest.to(centroid(t), None).map_or(0, |(_, chart)| chart as u32);
            mesh.triangles.iter().map(chart).collect()
        }
    };
    Ok(Placed { mesh, places })
}

/// Fields of points, and where each node is: its cell of surface.vtu, the triangle of the input, and the weights of the corners
/// of the cell.
fn of_points(atlas: &AtlasOnDisk, fields: &Fields, places: &[OnSurface]) -> Vec<Field> {
    let mut made: Vec<Field> = fields.points.iter().map(|field| interpolated(atlas, field, places)).collect();
    let cells = || places.iter().map(|found| found.place.cell as usize);
    let triangles = cells().map(|cell| i64::from(atlas.grid.triangle[cell])).collect();
    made.push(Field::new("source_cell", 1, Values::Integers(cells().map(|cell| cell as i64).collect())));
    made.push(Field::new("source_triangle", 1, Values::Integers(triangles)));
    let weights = places.iter().flat_map(|found| found.place.weights).collect();
    made.push(Field::new("source_weights", 3, Values::Floats(weights)));
    made
}

/// A field of points at places: linear over cells; whole numbers are those of the nearest corner.
fn interpolated(atlas: &AtlasOnDisk, field: &Field, places: &[OnSurface]) -> Field {
    let corners = |found: &OnSurface| {
        let [a, b, c, ..] = atlas.grid.cells[found.place.cell as usize];
        [a, b, c].map(|n| n as usize)
    };
    let heaviest = |weights: [f64; 3]| (1..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
    let values = match &field.values {
        Values::Integers(values) => {
            let entry = |found| {
                let corner = corners(found)[heaviest(found.place.weights)];
                values[field.components * corner..field.components * (corner + 1)].iter().copied()
            };
            Values::Integers(places.iter().flat_map(entry).collect())
        }
        Values::Floats(values) => {
            let mut made = Vec::with_capacity(field.components * places.len());
            for found in places {
                for component in 0..field.components {
                    let at = corners(found).map(|corner| values[field.components * corner + component]);
                    // What has no weight does not count, whatever it is.
                    let terms = (0..3).filter(|k| found.place.weights[*k] != 0.0);
                    made.push(terms.map(|k| found.place.weights[k] * at[k]).sum());
                }
            }
            Values::Floats(made)
        }
    };
    Field { values, ..field.clone() }
}

/// Fields of cells, and the area of the surface that each element stands for.
fn of_cells(
    atlas: &AtlasOnDisk,
    fields: &Fields,
    mesh: &MadeMesh,
    places: &[OnSurface],
    extensive: &[String],
) -> Vec<Field> {
    let corners: Vec<[Vec3; 3]> =
        atlas.grid.cells.iter().map(|[a, b, c, ..]| [*a, *b, *c].map(|n| atlas.grid.points[n as usize])).collect();
    let elements: Vec<[Vec3; 3]> = mesh.triangles.iter().map(|t| t.map(|n| mesh.points[n as usize])).collect();
    let of_cells: Vec<u32> = atlas.grid.chart.iter().map(|chart| *chart as u32).collect();
    let shares =
        shares(Charted { corners: &corners, charts: &of_cells }, Charted { corners: &elements, charts: &mesh.charts });
    let mut area = vec![0.0; elements.len()];
    shares.iter().for_each(|share| area[share.element as usize] += share.area);
    let overlay = Overlay { shares, area, whole: areas_of_input_cells(atlas, fields, &corners), mesh, places };
    let mut made: Vec<Field> = Vec::new();
    for field in &fields.cells {
        made.push(if extensive.contains(&field.name) { overlay.summed(field) } else { overlay.averaged(field) });
    }
    if !fields.cells.is_empty() {
        made.push(Field::new("source_area", 1, Values::Floats(overlay.area)));
    }
    made
}

/// Per cell of surface.vtu, the area of all that belong to the same cell of the input.
fn areas_of_input_cells(atlas: &AtlasOnDisk, fields: &Fields, corners: &[[Vec3; 3]]) -> Vec<f64> {
    let key = |cell: usize| match fields.cell.get(cell) {
        Some(number) => *number,
        None => i64::from(atlas.grid.triangle[cell]),
    };
    let mut of_input: BTreeMap<i64, f64> = BTreeMap::new();
    for (cell, corners) in corners.iter().enumerate() {
        *of_input.entry(key(cell)).or_default() += triangle_area(*corners);
    }
    (0..corners.len()).map(|cell| of_input[&key(cell)]).collect()
}

/// Cells of a surface over the elements of a mesh.
struct Overlay<'a> {
    shares: Vec<Share>,
    /// Per element.
    area: Vec<f64>,
    /// Per cell, the area of its cell of the input.
    whole: Vec<f64>,
    mesh: &'a MadeMesh,
    places: &'a [OnSurface],
}

impl Overlay<'_> {
    /// Means by area. An element that stands for nothing, as others are in front of it, has the value where its first node is.
    /// Whole numbers are those of the largest area.
    fn averaged(&self, field: &Field) -> Field {
        let cell_at = |element: usize| self.places[self.mesh.triangles[element][0] as usize].place.cell as usize;
        let size = field.components;
        let values = match &field.values {
            Values::Integers(values) => {
                let largest = self.largest_shares();
                let entry = |element: usize| {
                    let cell = largest[element].unwrap_or_else(|| cell_at(element));
                    values[size * cell..size * (cell + 1)].iter().copied()
                };
                Values::Integers((0..self.area.len()).flat_map(entry).collect())
            }
            Values::Floats(values) => {
                let mut made = self.weighed(values, size, |share| share.area);
                for (element, area) in self.area.iter().enumerate() {
                    for component in 0..size {
                        let value = &mut made[size * element + component];
                        *value = if *area > 0.0 { *value / area } else { values[size * cell_at(element) + component] };
                    }
                }
                Values::Floats(made)
            }
        };
        Field { values, ..field.clone() }
    }

    /// What belongs to a cell as a whole, in proportion to areas.
    fn summed(&self, field: &Field) -> Field {
        let all: Vec<f64> = (0..field.values.len()).map(|at| field.number(at)).collect();
        let share_of_cell = |share: &Share| share.area / self.whole[share.triangle as usize];
        let values = Values::Floats(self.weighed(&all, field.components, share_of_cell));
        Field { values, ..field.clone() }
    }

    fn weighed(&self, values: &[f64], size: usize, weight: impl Fn(&Share) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; size * self.area.len()];
        for share in &self.shares {
            let (from, to) = (size * share.triangle as usize, size * share.element as usize);
            let weight = weight(share);
            (0..size).for_each(|component| sums[to + component] += weight * values[from + component]);
        }
        sums
    }

    /// Per element, the cell of which it has the largest area.
    fn largest_shares(&self) -> Vec<Option<usize>> {
        let mut largest: Vec<Option<(f64, usize)>> = vec![None; self.area.len()];
        for share in &self.shares {
            let known = &mut largest[share.element as usize];
            if known.is_none_or(|(area, _)| share.area > area) {
                *known = Some((share.area, share.triangle as usize));
            }
        }
        largest.into_iter().map(|found| found.map(|(_, cell)| cell)).collect()
    }
}
