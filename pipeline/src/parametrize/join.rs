//! Joining the parts of a chart that was cut: small ones to their neighbours, and the triangles of sharp corners.
//!
//! Needles make cuts that leave single triangles, and meshers need an element for each of their corners.

use super::cut::{Cutter, Mapped, TANGLED};
use super::job::{ChartError, natural_maps};
use crate::atlas::Chart;
use crate::decompose;
use crate::mesh::SurfaceMesh;
use crate::topology::{FaceId, Stars, VertexId};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// Parts of no more triangles than this are joined to neighbours, where that can be.
const SMALL: usize = 64;

/// Corners of parts that are sharper than this, in radians (6 degrees), are given away: elements there have a gamma below 0.1.
const SHARP: f64 = 0.1;

/// How often all corners are looked at: what is given away may leave another sharp corner, at most.
const ROUNDS: usize = 3;

/// What the map of two joined parts may stretch.
const JOINED: f64 = 3.0;

/// Joins small parts of `chart` to neighbours as long as the map of both together suits a mesher. Every join leaves fewer parts.
///
/// # Errors
/// [`ChartError`].
pub(super) fn joined(cutter: &Cutter, chart: &Chart, parts: Vec<Mapped>) -> Result<Vec<Mapped>, ChartError> {
    let local = |face: &FaceId| FaceId::at(chart.faces().partition_point(|f| f < face));
    let faces = parts.iter().map(|(part, _)| part.faces().iter().map(local).collect()).collect();
    let mut parts = Parts::new(chart, faces, parts.into_iter().map(Some).collect());
    let mut waiting: Vec<usize> = (0..parts.faces.len()).collect();
    // The last one is the smallest.
    waiting.sort_by_key(|k| Reverse(parts.faces[*k].len()));
    while let Some(k) = waiting.pop() {
        if !(1..=SMALL).contains(&parts.faces[k].len()) {
            continue;
        }
        for other in parts.beside(k) {
            if let Some(mapped) = parts.mapped(cutter, &parts.together(k, other))? {
                parts.join(k, other, mapped);
                waiting.push(k);
                break;
            }
        }
    }
    parts.blunt(cutter)?;
    Ok(parts.mapped.into_iter().flatten().collect())
}

/// The parts of a chart. What is done to one looks at no others but its neighbours: brain_ch2 has charts of hundreds of parts.
struct Parts<'a> {
    chart: &'a Chart,
    /// The chart, of which parts are made anew.
    surface: SurfaceMesh,
    /// Per triangle of the chart, its part.
    owner: Vec<usize>,
    /// Per part its triangles, ascending; none of one that was joined to another.
    faces: Vec<Vec<FaceId>>,
    /// Per part, the chart that it is, with its maps.
    mapped: Vec<Option<Mapped>>,
}

impl<'a> Parts<'a> {
    /// Parts of these triangles, which hold each of the chart once.
    fn new(chart: &'a Chart, faces: Vec<Vec<FaceId>>, mapped: Vec<Option<Mapped>>) -> Self {
        let mut owner = vec![0; chart.faces().len()];
        for (k, part) in faces.iter().enumerate() {
            part.iter().for_each(|f| owner[f.index()] = k);
        }
        Self { chart, surface: chart.to_surface(), owner, faces, mapped }
    }

    /// The triangles of two parts, ascending.
    fn together(&self, k: usize, other: usize) -> Vec<FaceId> {
        let mut both = [&self.faces[k][..], &self.faces[other][..]].concat();
        both.sort_unstable();
        both
    }

    /// Makes two parts one, with these maps.
    fn join(&mut self, k: usize, other: usize, mapped: Mapped) {
        let both = self.together(k, other);
        both.iter().for_each(|f| self.owner[f.index()] = k);
        self.faces[other].clear();
        self.faces[k] = both;
        self.mapped[other] = None;
        self.mapped[k] = Some(mapped);
    }

    /// The parts beside part `k`, those first that it has the most boundary in common with.
    fn beside(&self, k: usize) -> Vec<usize> {
        let mut shared: BTreeMap<usize, f64> = BTreeMap::new();
        for h in self.faces[k].iter().flat_map(|f| f.sides()) {
            let Some(twin) = self.chart.edges().twin(h) else { continue };
            let other = self.owner[twin.face().index()];
            if other != k {
                *shared.entry(other).or_insert(0.0) += self.chart.length(h);
            }
        }
        let mut all: Vec<(usize, f64)> = shared.into_iter().collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        all.into_iter().map(|(other, _)| other).collect()
    }

    /// These triangles as one part, if its map suits a mesher.
    fn mapped(&self, cutter: &Cutter, faces: &[FaceId]) -> Result<Option<Mapped>, ChartError> {
        let part = decompose::part_of(self.chart, &self.surface, faces);
        let Some(part) = part.filter(|part| !decompose::touches_itself(part)) else { return Ok(None) };
        let map = natural_maps(&part, cutter.settings.order, cutter.monitor)?;
        let suits = map.filter(|map| map.conformal_p99(&part) <= JOINED && map.invalid_share(&part) <= TANGLED);
        Ok(suits.map(|map| (part, map)))
    }

    /// Gives the triangles at the sharp corners of parts to a neighbour, where both have maps that suit a mesher then: no element
    /// is any good in a corner like that. Each corner is looked at once in a round.
    fn blunt(&mut self, cutter: &Cutter) -> Result<(), ChartError> {
        let stars = Stars::new(self.chart.triangles(), self.chart.vertices().len());
        for _ in 0..ROUNDS {
            let mut any = false;
            for v in (0..self.chart.vertices().len()).map(VertexId::at) {
                for corner in self.sharp_corners(&stars, v) {
                    any |= self.give_away(cutter, &corner)?;
                }
            }
            if !any {
                break;
            }
        }
        Ok(())
    }

    /// Gives the triangles in a corner to the first neighbour that can take them; whether there was one.
    fn give_away(&mut self, cutter: &Cutter, Corner { from, fan, beside }: &Corner) -> Result<bool, ChartError> {
        if fan.iter().any(|f| self.owner[f.index()] != *from) {
            return Ok(false);
        }
        let less: Vec<FaceId> = self.faces[*from].iter().copied().filter(|f| !fan.contains(f)).collect();
        let Some(smaller) = self.mapped(cutter, &less)? else { return Ok(false) };
        for to in beside {
            let mut more = [&self.faces[*to][..], fan].concat();
            more.sort_unstable();
            if let Some(larger) = self.mapped(cutter, &more)? {
                fan.iter().for_each(|f| self.owner[f.index()] = *to);
                (self.faces[*from], self.faces[*to]) = (less, more);
                (self.mapped[*from], self.mapped[*to]) = (Some(smaller), Some(larger));
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The sharp corners of parts at a vertex.
    fn sharp_corners(&self, stars: &Stars, v: VertexId) -> Vec<Corner> {
        let (chart, owner) = (self.chart, &self.owner);
        let around: Vec<FaceId> = stars.around(v.index()).iter().map(|f| FaceId(*f)).collect();
        let mut of_parts: Vec<usize> = around.iter().map(|f| owner[f.index()]).collect();
        of_parts.sort_unstable();
        of_parts.dedup();
        if of_parts.len() < 2 {
            return vec![];
        }
        let angle = |f: &FaceId| {
            let angles = chart.shapes()[f.index()].angles();
            (0..3).filter(|k| chart.triangles()[f.index()][*k] == v).map(|k| angles[k]).sum::<f64>()
        };
        let mut corners = Vec::new();
        for from in of_parts {
            let mut fan: Vec<FaceId> = around.iter().copied().filter(|f| owner[f.index()] == from).collect();
            fan.sort_unstable();
            let is_all = self.faces[from].len() == fan.len();
            if is_all || fan.iter().map(angle).sum::<f64>() >= SHARP {
                continue;
            }
            let sides =
                fan.iter().flat_map(|f| f.sides()).filter(|h| [chart.from(*h), chart.from(h.next())].contains(&v));
            let beyond = sides.filter_map(|h| Some((chart.length(h), owner[chart.edges().twin(h)?.face().index()])));
            let mut beside: Vec<(f64, usize)> = beyond.filter(|(_, to)| *to != from).collect();
            beside.sort_by(|a, b| b.0.total_cmp(&a.0));
            corners.push(Corner { from, fan, beside: beside.into_iter().map(|(_, to)| to).collect() });
        }
        corners
    }
}

/// A corner of a part that is sharper than [`SHARP`].
struct Corner {
    /// The part.
    from: usize,
    /// Its triangles at the corner; it has more.
    fan: Vec<FaceId>,
    /// The parts beside them at the corner, that with the longest edge in common first.
    beside: Vec<usize>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleSoup;
    use crate::monitor::NoMonitor;
    use crate::settings::ChartSettings;
    use crate::{decompose, repair};

    /// A square whose lower side is a needle with its tip at the origin, and a triangle beyond its short side.
    fn with_needle() -> Chart {
        let points =
            vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.05, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0]];
        let soup = TriangleSoup::new(points, vec![[0, 1, 2], [1, 5, 2], [0, 2, 3], [0, 3, 4]]).expect("sound");
        let mesh = repair(&soup, &Default::default()).expect("a surface").mesh;
        decompose::assemble(&mesh, &[0; 4]).expect("one chart").into_charts().remove(0)
    }

    /// Parts of these triangles, each with its map.
    fn parts<'a>(cutter: &Cutter, chart: &'a Chart, faces: &[&[u32]]) -> Parts<'a> {
        let faces: Vec<Vec<FaceId>> = faces.iter().map(|part| part.iter().map(|f| FaceId(*f)).collect()).collect();
        let mut parts = Parts::new(chart, faces.clone(), vec![]);
        let mapped =
            |part: &Vec<FaceId>| Some(parts.mapped(cutter, part).expect("nobody interrupts").expect("it maps"));
        parts.mapped = faces.iter().map(mapped).collect();
        parts
    }

    #[test]
    fn sharp_corners_of_parts_are_given_to_their_neighbours() {
        let (chart, settings) = (with_needle(), ChartSettings::default());
        let cutter = Cutter { settings: &settings, monitor: &NoMonitor };
        let mut blunted = parts(&cutter, &chart, &[&[0, 1], &[2, 3]]);
        blunted.blunt(&cutter).expect("nobody interrupts");
        assert_eq!(blunted.owner, [1, 0, 1, 1]);
        let sizes: Vec<usize> = blunted.mapped.iter().flatten().map(|(part, _)| part.triangles().len()).collect();
        assert_eq!(sizes, [1, 3]);
        // What is all of a part stays, and so does what is not sharp.
        let stars = Stars::new(chart.triangles(), chart.vertices().len());
        let single = parts(&cutter, &chart, &[&[0], &[1], &[2], &[3]]);
        for v in (0..6).map(VertexId) {
            assert!(single.sharp_corners(&stars, v).is_empty());
            assert!(blunted.sharp_corners(&stars, v).is_empty());
        }
    }

    #[test]
    fn small_parts_are_joined_where_one_map_suits_both() {
        let (chart, settings) = (with_needle(), ChartSettings::default());
        let cutter = Cutter { settings: &settings, monitor: &NoMonitor };
        let single = parts(&cutter, &chart, &[&[0], &[1], &[2], &[3]]).mapped.into_iter().flatten().collect();
        let joined = joined(&cutter, &chart, single).expect("nobody interrupts");
        assert_eq!(joined.len(), 1, "a flat chart is one part");
    }
}
