//! Fields of the input on the nodes and triangles of a surface.
//!
//! A vertex of the input has the value of the first of its points, and a node half-way between two vertices the mean of theirs,
//! also where that became a vertex: a field that is linear on the triangles of the input stays what it is. Whole numbers have no
//! mean: there it is the value of the vertex that comes first in the input. A triangle has the value of that of which it is a
//! part.

use super::appended::Array;
use crate::formats::fields::{Field, Fields, Values};
use planish_core::CertifiedChart;
use planish_core::atlas::Chart;
use planish_core::mesh::SurfaceMesh;
use planish_core::topology::{EdgeId, VertexId};

/// The fields of the input, on their way to the nodes of charts.
pub(super) struct Carried<'f> {
    fields: &'f Fields,
    /// Per vertex of the surface, the number of its entry.
    entries: Vec<u32>,
    /// Behind the entries of the input, those of vertices that were added: each between two entries before it.
    added: Vec<[u32; 2]>,
}

impl<'f> Carried<'f> {
    /// The fields of the input of which a surface was made, with an entry for each vertex after welding
    /// ([`Fields::by_vertex`]).
    pub fn new(fields: &'f Fields, mesh: &SurfaceMesh) -> Self {
        let mut carried = Self { fields, entries: Vec::new(), added: Vec::new() };
        if let Some(first) = fields.points.first() {
            carried.number(mesh, (first.values.len() / first.components) as u32);
        }
        carried
    }

    /// Numbers the entries of vertices, of which there are so many in the input.
    fn number(&mut self, mesh: &SurfaceMesh, of_input: u32) {
        let vertices = (0..mesh.points().len()).map(VertexId::at);
        let highest = vertices.clone().map(|v| mesh.welded_vertex(v)).max().unwrap_or(0);
        // Numbers of vertices that were added may be those of components that were left out.
        let mut of_welded: Vec<u32> = (0..=highest).collect();
        for vertex in vertices {
            let welded = mesh.welded_vertex(vertex) as usize;
            if let Some(ends) = mesh.middle_of(vertex) {
                let between = ends.map(|end| of_welded[end as usize]);
                of_welded[welded] = of_input + self.added.len() as u32;
                self.added.push(between);
            }
            self.entries.push(of_welded[welded]);
        }
    }

    /// The arrays of the nodes of charts.
    pub fn of_points(&self, charts: &[&CertifiedChart]) -> Vec<Array> {
        if self.fields.points.is_empty() {
            return Vec::new();
        }
        let mut nodes: Vec<[u32; 2]> = Vec::new();
        for certified in charts {
            self.add_nodes(certified.chart(), &mut nodes);
        }
        self.fields.points.iter().map(|field| self.of_nodes(field, &nodes)).collect()
    }

    /// Adds the nodes of a chart: its vertices, then the middles of its edges, each between two entries.
    fn add_nodes(&self, chart: &Chart, nodes: &mut Vec<[u32; 2]>) {
        let entry = |v: VertexId| self.entries[chart.vertices()[v.index()].index()];
        nodes.extend((0..chart.vertices().len()).map(|v| [entry(VertexId::at(v)); 2]));
        for edge in (0..chart.edges().len()).map(EdgeId::at) {
            let h = chart.edges().sides(edge)[0];
            let [a, b] = [h, h.next()].map(|h| entry(chart.from(h)));
            // In the order of the input, on both sides of a seam.
            nodes.push([a.min(b), a.max(b)]);
        }
    }

    /// The array of a field at nodes that lie between these entries.
    fn of_nodes(&self, field: &Field, nodes: &[[u32; 2]]) -> Array {
        let Field { name, components, .. } = field;
        match &field.values {
            Values::Integers(values) => {
                let all = self.with_added(values, *components, first);
                Array::whole(name, *components, between(&all, *components, nodes, first))
            }
            Values::Floats(values) => {
                let all = self.with_added(values, *components, mean);
                Array::doubles(name, *components, between(&all, *components, nodes, mean))
            }
        }
    }

    /// Values of the input, followed by those of vertices that were added.
    fn with_added<T: Copy>(&self, values: &[T], components: usize, middle: fn(T, T) -> T) -> Vec<T> {
        let mut all = values.to_vec();
        for [a, b] in &self.added {
            for k in 0..components {
                let value = middle(all[*a as usize * components + k], all[*b as usize * components + k]);
                all.push(value);
            }
        }
        all
    }

    /// The arrays of the triangles of charts.
    pub fn of_cells(&self, charts: &[&CertifiedChart]) -> Vec<Array> {
        if self.fields.cells.is_empty() {
            return Vec::new();
        }
        let of_chart = |chart: &Chart| -> Vec<u32> {
            (0..chart.triangles().len()).map(|face| chart.source_triangle(face)).collect()
        };
        let sources: Vec<u32> = charts.iter().flat_map(|certified| of_chart(certified.chart())).collect();
        let numbers = || sources.iter().map(|source| *source as usize);
        let of_field = |field: &Field| {
            let Field { name, components, .. } = field;
            match field.values.entries(*components, numbers()) {
                Values::Integers(values) => Array::whole(name, *components, values.into_iter()),
                Values::Floats(values) => Array::doubles(name, *components, values.into_iter()),
            }
        };
        let mut arrays: Vec<Array> = self.fields.cells.iter().map(of_field).collect();
        if !self.fields.cell.is_empty() {
            arrays.push(Array::whole("cell", 1, numbers().map(|source| self.fields.cell[source])));
        }
        arrays
    }
}

/// The values of nodes, each between two entries.
fn between<T: Copy>(
    values: &[T],
    components: usize,
    nodes: &[[u32; 2]],
    middle: fn(T, T) -> T,
) -> impl Iterator<Item = T> {
    nodes.iter().flat_map(move |ends| {
        let [a, b] = ends.map(|end| end as usize * components);
        (0..components).map(move |k| middle(values[a + k], values[b + k]))
    })
}

/// The mean, which is exact where both are the same. What is no number has none.
fn mean(a: f64, b: f64) -> f64 {
    if a == b { a } else { 0.5 * a + 0.5 * b }
}

fn first(a: i64, _: i64) -> i64 {
    a
}

#[cfg(test)]
mod tests {
    use super::super::read_back;
    use super::super::vtu;
    use super::super::xml_parts::Field as Role;
    use super::*;
    use crate::formats::{Content, Format, read_alone};
    use planish_core::monitor::NoMonitor;
    use planish_core::{CertifiedAtlas, Settings, mesh::TriangleSoup, parametrize, shapes};

    fn field(name: &str, components: usize, values: Values) -> Field {
        Field { name: name.to_owned(), input_name: None, components, values }
    }

    /// A linear function: its values at midpoints are the means of those at the ends.
    fn linear([x, y, z]: [f64; 3]) -> f64 {
        x + 2.0 * y - 3.0 * z
    }

    fn linear_fields(soup: &TriangleSoup) -> Fields {
        let of_points = |f: &dyn Fn([f64; 3]) -> f64| soup.points().iter().map(|p| f(*p)).collect::<Vec<f64>>();
        let vectors = soup.points().iter().flat_map(|p| p.map(|c| 2.0 * c)).collect();
        let flags = (0..soup.points().len() as i64).map(|point| 7 * point).collect();
        let numbers = (0..soup.triangles().len() as i64).map(|t| t * t).collect();
        Fields {
            points: vec![
                field("linear", 1, Values::Floats(of_points(&linear))),
                field("position", 3, Values::Floats(vectors)),
                field("flag", 1, Values::Integers(flags)),
            ],
            cells: vec![field("square", 1, Values::Integers(numbers))],
            cell: vec![],
        }
        .by_vertex(soup)
    }

    fn atlas(soup: &TriangleSoup) -> CertifiedAtlas {
        parametrize(soup, &Settings::default(), &NoMonitor).expect("an atlas")
    }

    /// Points, with what is read back of a surface.vtu.
    fn read(bytes: &[u8]) -> Content {
        read_alone(Format::Vtu, bytes).expect("a surface")
    }

    fn floats<'c>(fields: &'c [Field], name: &str) -> &'c [f64] {
        match &fields.iter().find(|f| f.name == name).expect("the field").values {
            Values::Floats(values) => values,
            Values::Integers(_) => panic!("{name} is of whole numbers"),
        }
    }

    fn integers<'c>(fields: &'c [Field], name: &str) -> &'c [i64] {
        match &fields.iter().find(|f| f.name == name).expect("the field").values {
            Values::Integers(values) => values,
            Values::Floats(_) => panic!("{name} is of floats"),
        }
    }

    /// Surfaces that are welded, cut, bisected (a tube of long facets), whose ears are split, and of several sheets.
    #[test]
    fn linear_fields_stay_what_they_are_on_all_nodes() {
        let square = {
            let points = vec![[0.0; 3], [1.0, 0.0, 0.5], [1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [-0.0; 3]];
            TriangleSoup::new(points, vec![[0, 1, 2], [5, 3, 4]]).expect("a soup")
        };
        let mut added = 0;
        for soup in [square, shapes::tube(36, 1, 5.0), shapes::ring_torus(12, 7), shapes::book(3, 2), shapes::sphere(6)]
        {
            let (fields, atlas) = (linear_fields(&soup), atlas(&soup));
            let bytes = vtu::surface(&atlas, &[], &fields);
            let Content { soup: nodes, fields: found, .. } = read(&bytes);
            let values = floats(&found.points, "linear");
            let positions = floats(&found.points, "position").as_chunks::<3>().0;
            assert_eq!((values.len(), positions.len()), (nodes.points().len(), nodes.points().len()));
            let largest = nodes.points().iter().flatten().fold(0.0_f64, |largest, c| largest.max(c.abs()));
            for ((point, value), position) in nodes.points().iter().zip(values).zip(positions) {
                assert!((value - linear(*point)).abs() <= 6e-12 * largest, "{value} at {point:?}");
                assert!(
                    point.iter().zip(position).all(|(c, p)| (2.0 * c - p).abs() <= 2e-12 * largest),
                    "{position:?}"
                );
            }
            // Whole numbers are some that the file has.
            let flags = integers(&found.points, "flag");
            assert!(flags.iter().all(|flag| flag % 7 == 0 && *flag < 7 * soup.points().len() as i64));
            let triangles = integers(&found.cells, "input_triangle");
            let squares = integers(&found.cells, "square");
            assert!(triangles.iter().zip(squares).all(|(triangle, square)| triangle * triangle == *square));
            added += integers(&found.points, "input_vertex").iter().filter(|vertex| **vertex == -2).count();
            // The proof knows nothing of them.
            let plain = read_back::read(&vtu::surface(&atlas, &[], &Fields::default())).expect("planish's own");
            assert_eq!(read_back::read(&bytes).expect("planish's own"), plain);
        }
        assert!(added > 20, "{added}");
    }

    #[test]
    fn what_is_no_number_stays_where_it_is_and_both_sides_of_a_seam_agree() {
        let soup = shapes::sphere(6);
        let mut fields = linear_fields(&soup);
        fields.points.truncate(1);
        let Values::Floats(values) = &mut fields.points[0].values else { panic!("floats") };
        values[5] = f64::NAN;
        values[8] = f64::INFINITY;
        let flags = (0..values.len() as i64).map(|v| v % 5).collect();
        fields.points.push(field("flag", 1, Values::Integers(flags)));
        let bytes = vtu::surface(&atlas(&soup), &[], &fields);
        let found = read(&bytes).fields;
        let (values, vertices) = (floats(&found.points, "linear"), integers(&found.points, "input_vertex"));
        for (value, vertex) in values.iter().zip(vertices) {
            match vertex {
                5 => assert!(value.is_nan()),
                8 => assert_eq!(*value, f64::INFINITY),
                0.. => assert!(value.is_finite(), "{vertex}"),
                _ => {}
            }
        }
        let unknown = values.iter().filter(|value| value.is_nan()).count();
        assert!(unknown > 1 && unknown < values.len() / 4, "{unknown}");
        let mut at_places: Vec<_> = read(&bytes)
            .soup
            .points()
            .iter()
            .map(|p| p.map(f64::to_bits))
            .zip(integers(&found.points, "flag").to_vec())
            .collect();
        at_places.sort_unstable();
        assert!(at_places.windows(2).all(|pair| pair[0].0 != pair[1].0 || pair[0].1 == pair[1].1));
    }

    /// Every array of planish's own has a name that fields give way to, and none can be taken for another.
    #[test]
    fn no_field_passes_for_an_array_of_planish() {
        let soup = shapes::disk(4);
        let labels = [crate::formats::Label { tag: 1, name: "a".to_owned(), group: "a".to_owned() }];
        let labelled = soup.clone().with_labels(vec![0; soup.triangles().len()]);
        let plain = vtu::surface(&atlas(&labelled), &labels, &Fields::default());
        let found = read(&plain).fields;
        let all = found.points.iter().chain(&found.cells);
        assert!(all.clone().count() == 12 && all.clone().all(|field| field.name.starts_with("input_")));
        // As a file that has them all is read, and written again.
        let fields = Fields { points: linear_fields(&soup).points, cells: vec![], cell: vec![] };
        let bytes = vtu::surface(&atlas(&soup), &[], &fields);
        let again = read(&bytes);
        let third = vtu::surface(&atlas(&again.soup), &[], &again.fields.by_vertex(&again.soup));
        let grid = read_back::read(&third).expect("planish's own");
        assert!(grid.chart.iter().all(|chart| *chart == 0) && grid.uv.len() == grid.points.len());
        assert!(matches!(Role::OfPoints("uv"), Role::OfPoints(name) if crate::formats::fields::OWN.contains(&name)));
    }
}
