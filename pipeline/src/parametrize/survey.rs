//! Where charts need more triangles: first maps, and the surface that is refined on their evidence.
//!
//! Each chart is mapped once. Where that map is too poor ([`crate::refine`]) the chart is refined by itself and mapped again,
//! round by round, and what makes its map far better is noted down. Then all that is repeated on the whole surface, and closed
//! there once: charts meet in the same nodes. Chart jobs are cut from the refined surface; maps of charts that came out
//! as they were by themselves are kept, and so are those of charts that stayed as they are.

use super::cut::Mapped;
use super::divided::each;
use super::job::{ChartError, ChartJob, MapError, MappedChart, Maps, finer_maps, freed_or_cut};
use crate::atlas::Chart;
use crate::certified::BoundaryFound;
use crate::decompose::{self, Illegal, assemble, with_outer};
use crate::grid::GridPoint;
use crate::mesh::SurfaceMesh;
use crate::monitor::Monitor;
use crate::refine::POOR;
use crate::refine::bisect::{Ends, Refined, Step};
use crate::settings::Order;
use crate::topology::{FaceId, VertexId};
use crate::vec3::Vec3;

/// How often a chart is mapped and refined at most. By experience: most are fine after one or two rounds.
const ROUNDS: usize = 4;

/// Rounds that bring nothing, one after another, after which it is given up. One is not enough: of cad_fixture_vtk's chart 0 the
/// first round makes the map worse, and the second mends it.
const IDLE: usize = 2;

/// How often an edge is halved in a round at most: what a map saves by halving is known to be right for the next halving only.
const HALVINGS: f64 = 2.0;

/// Where no larger share of the triangles is invalid, or no more of them, patches of them are untangled sooner than a chart is
/// refined: bones of 160 triangles (foot_bones, +29 %) and tubes of needles (thingi_1514499_needles, +37 %) have the same meshes
/// with up to 16.
const FEW: f64 = 0.01;
const HANDFUL: usize = 16;

/// A map that stretches no more than this on all but a hundredth of the area is followed well by meshers. By experience: with 3,
/// half of all that was bisected in ten CAD files and scans was bisected for no better mesh (soccerball_g31's worst element
/// was at .21 then, and is at .35).
const FOLLOWED: f64 = 10.0;

/// What a round must leave of the invalid triangles, or of the stretch, to be worth its triangles.
const HALF: f64 = 0.5;
const BETTER: f64 = 0.8;

/// Places of refinement that are told, at most.
const TOLD: usize = 10;

/// The parts of a chart with first maps, and what these ask for.
#[derive(Clone, Debug)]
pub struct Surveyed {
    parts: Vec<Part>,
}

#[derive(Clone, Debug)]
struct Part {
    mapped: MappedChart,
    /// Where it is to be refined.
    finer: Option<Finer>,
}

/// A chart, refined by itself.
#[derive(Clone, Debug)]
struct Finer {
    /// What was halved.
    steps: Vec<Step>,
    /// How many triangles that added, those left out that are there so that no node hangs.
    asked: usize,
    /// Which triangles were.
    bisected: Vec<FaceId>,
    /// The refined chart with its maps.
    mapped: MappedChart,
}

/// What refinement did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Refinement {
    /// Charts of which triangles were bisected because their maps ask for it.
    pub charts: usize,
    /// Triangles before.
    pub triangles_before: usize,
    /// Triangles after.
    pub triangles_after: usize,
    /// How many of those that were added no map asked for: they are there so that no node hangs.
    pub by_closure: usize,
    /// The first few places: triangles of the input, and their centroids.
    pub places: Vec<(u32, Vec3)>,
}

impl ChartJob {
    /// Maps the chart ([`Self::map`]), and finds where it needs more triangles; nothing where refinement is off or elements are
    /// linear.
    ///
    /// # Errors
    /// [`ChartError`].
    pub fn survey(self, monitor: &dyn Monitor) -> Result<Surveyed, ChartError> {
        let settings = self.settings;
        let of_part = |(chart, maps): Mapped, monitor: &dyn Monitor| {
            let mapped = MappedChart { chart, settings, maps };
            let finer_one = finer(&mapped, monitor)?;
            if finer_one.is_some() {
                return Ok(vec![Part { mapped, finer: finer_one }]);
            }
            let found = freed_or_cut(mapped.chart, &settings, mapped.maps, monitor)?;
            // The whole has been looked at.
            let are_parts = found.len() > 1;
            let part = |(chart, maps)| {
                let mapped = MappedChart { chart, settings, maps };
                let finer = if are_parts { finer(&mapped, monitor)? } else { None };
                Ok(Part { mapped, finer })
            };
            found.into_iter().map(part).collect::<Result<Vec<Part>, ChartError>>()
        };
        let parts = each(self.mapped_parts(monitor)?, monitor, of_part)?;
        Ok(Surveyed { parts: parts.into_iter().flatten().collect() })
    }
}

/// A chart refined by itself, as long as its map is poor somewhere and it has not as many triangles as it may; none where that
/// makes no better map.
fn finer(coarse: &MappedChart, monitor: &dyn Monitor) -> Result<Option<Finer>, ChartError> {
    let MappedChart { chart, settings, maps } = coarse;
    let (Some(most), Order::Quadratic) = (settings.refine, settings.order) else { return Ok(None) };
    // Where the boundary is one for want of anything better, it is at fault.
    let is_makeshift = !matches!(maps.boundary, BoundaryFound::Natural | BoundaryFound::Circle { why_none: None });
    let mut least = Quality::of(chart, maps);
    if is_makeshift || least.is_fine() {
        return Ok(None);
    }
    let before = chart.triangles().len();
    let largest = before.saturating_mul(most as usize).min(settings.decompose.max_triangles);
    let room = largest.saturating_sub(before);
    let mut wanted = wanted(maps, before, room);
    let mut refined = Refined::new(chart.to_surface());
    let own: Vec<VertexId> = (0..chart.vertices().len()).map(VertexId::at).collect();
    let (mut best, mut idle) = (None, 0);
    for _ in 0..ROUNDS {
        let (had, room) = (refined.parents.len(), room.saturating_sub(refined.asked));
        refined = refined.shortened(&wanted, room);
        if refined.parents.len() == had {
            break;
        }
        let whole = vec![0; refined.parents.len()];
        let assembled = assemble(&refined.mesh, &whole).map_err(decompose::Error::from)?;
        let Some(fresh) = assembled.into_charts().pop() else { break };
        // Its surface is the chart, whose vertices it has first.
        let fresh = with_outer(fresh, chart.id(), chart.from(chart.outer()[0]));
        let inherited = maps.inherited(chart, |uv| inherited_uv(&own, uv, fresh.vertices(), &refined.ends));
        let finer = match finer_maps(&fresh, settings, inherited, monitor) {
            Ok(maps) => MappedChart { chart: fresh, settings: *settings, maps },
            Err(MapError::Interrupted(interrupted)) => return Err(interrupted.into()),
            // It has a map as it is, and may have none that is better.
            Err(_) => break,
        };
        let quality = Quality::of(&finer.chart, &finer.maps);
        wanted = self::wanted(&finer.maps, refined.parents.len(), room.saturating_sub(refined.asked));
        if quality.is_better_than(&least) {
            best = Some((refined.steps.len(), refined.asked, refined.parents[before..].to_vec(), finer));
            least = quality;
            idle = 0;
        } else {
            idle += 1;
        }
        if least.is_fine() || idle == IDLE {
            break;
        }
    }
    Ok(best.map(|(steps, asked, mut bisected, mapped)| {
        refined.steps.truncate(steps);
        bisected.sort_unstable();
        bisected.dedup();
        Finer { steps: refined.steps, asked, bisected, mapped }
    }))
}

/// The uv of the `vertices` of a refined chart, ascending: of those that it had `before` they are given; of those that were
/// added to the surface, as the last ones, half-way between their `ends`.
fn inherited_uv(before: &[VertexId], uv: &[GridPoint], vertices: &[VertexId], ends: &Ends) -> Vec<GridPoint> {
    let mut all: Vec<GridPoint> = Vec::with_capacity(vertices.len());
    for v in vertices {
        let at = before.binary_search(v).map_or_else(
            |_| {
                // Both were there before it.
                let [p, q] = ends.of(*v).map(|end| all[vertices.partition_point(|w| *w < end)]);
                GridPoint::vertex(p.midpoint(q).uv())
            },
            |old| uv[old],
        );
        all.push(at);
    }
    all
}

/// How well a mesher can follow a map.
#[derive(Clone, Copy, Debug)]
struct Quality {
    /// The share of triangles that are invalid.
    invalid: f64,
    /// Whether those are a handful.
    are_few: bool,
    /// The conformal distortion that 99 % of the area are expected not to exceed.
    p99: f64,
    /// Whether the boundary is the chart's own.
    is_own: bool,
}

impl Quality {
    fn of(chart: &Chart, maps: &Maps) -> Self {
        let invalid = maps.invalid_share(chart);
        let are_few = invalid <= FEW || maps.invalid() <= HANDFUL;
        Self { invalid, are_few, p99: maps.expected_p99(chart), is_own: maps.boundary.is_own() }
    }

    /// Whether no more than patches are left to be untangled, and a mesher can follow the rest. A disk stretches what is not
    /// round, and more triangles are no help.
    fn is_fine(&self) -> bool {
        self.are_few && (!self.is_own || self.p99 <= FOLLOWED)
    }

    /// Whether far less is invalid or stretched, and neither is much more.
    fn is_better_than(&self, other: &Self) -> bool {
        let gains = (other.invalid > FEW && self.invalid < HALF * other.invalid) || self.p99 < BETTER * other.p99;
        let loses = BETTER * self.invalid > other.invalid.max(FEW) || BETTER * self.p99 > other.p99;
        gains && !loses && (self.is_own || !other.is_own)
    }
}

/// Per triangle, how long its longest edge may be so that a map is not too poor in it: what halving would save falls with the
/// fourth power of the length. Where that would make more than `room` more triangles of the `count` that there are, only the
/// poorest are bisected.
fn wanted(maps: &Maps, count: usize, room: usize) -> Vec<f64> {
    let shares = maps.shares_saved();
    if shares.is_empty() {
        return vec![f64::INFINITY; count];
    }
    let halvings = |share: f64, poor: f64| (0.25 * (share / poor).log2()).ceil().clamp(0.0, HALVINGS);
    let added = |poor: f64| shares.iter().map(|share| (2.0 * halvings(*share, poor)).exp2() - 1.0).sum::<f64>();
    let mut poor = POOR;
    while poor < 1.0 && added(poor) > room as f64 {
        poor *= 2.0;
    }
    let length = |(share, longest): (&f64, f64)| {
        let halvings = halvings(*share, poor);
        if halvings > 0.0 { longest * (-halvings).exp2() } else { f64::INFINITY }
    };
    shares.iter().zip(maps.longest_edges()).map(length).collect()
}

/// Refines `mesh`, the surface of the surveyed charts, and makes chart jobs of it.
///
/// # Errors
/// [`Illegal`]: a fault of planish.
pub fn refine(mesh: SurfaceMesh, surveyed: Vec<Surveyed>) -> Result<(SurfaceMesh, Vec<ChartJob>, Refinement), Illegal> {
    let before = mesh.triangles().len();
    let parts: Vec<Part> = surveyed.into_iter().flat_map(|s| s.parts).collect();
    let finer = || parts.iter().filter_map(|part| part.finer.as_ref());
    let mut done = Refinement {
        charts: finer().count(),
        triangles_before: before,
        triangles_after: before,
        by_closure: 0,
        places: places(&parts),
    };
    if done.charts == 0 {
        return Ok((mesh, parts.into_iter().map(|part| part.mapped.into_job()).collect(), done));
    }
    let steps = finer().map(|finer| finer.steps.len()).max().unwrap_or(0);
    let mut refined = Refined::new(mesh);
    for step in 0..steps {
        refined = refined.repeated(finer().filter_map(|finer| finer.steps.get(step)));
    }
    let Refined { mesh, parents, ends, .. } = refined;
    let mesh = mesh.refined_by(parents.len() - before);
    done.triangles_after = parents.len();
    done.by_closure = parents.len() - before - finer().map(|finer| finer.asked).sum::<usize>();
    let mut labels = vec![0; before];
    for (part, label) in parts.iter().zip(0..) {
        part.mapped.chart.faces().iter().for_each(|face| labels[face.index()] = label);
    }
    let labels: Vec<u32> = parents.iter().map(|parent| labels[parent.index()]).collect();
    let mut is_touched = vec![false; parts.len()];
    labels[before..].iter().for_each(|label| is_touched[*label as usize] = true);
    let mut fresh = vec![None; parts.len()];
    for chart in assemble(&mesh, &labels)?.into_charts() {
        let label = labels[chart.faces()[0].index()] as usize;
        fresh[label] = Some(chart);
    }
    let mut jobs = Vec::with_capacity(parts.len());
    for ((part, fresh), is_touched) in parts.into_iter().zip(fresh).zip(is_touched) {
        jobs.push(match fresh {
            Some(fresh) if is_touched => job_of(part, fresh, &ends),
            _ => part.mapped.into_job(),
        });
    }
    Ok((mesh, jobs, done))
}

/// The job of a chart that was refined: its maps are those that it has by itself, where it came out the same.
fn job_of(part: Part, fresh: Chart, ends: &Ends) -> ChartJob {
    let Part { mapped: MappedChart { chart, settings, maps }, finer } = part;
    let fresh = with_outer(fresh, chart.id(), chart.vertices()[chart.from(chart.outer()[0]).index()]);
    if let Some(Finer { mapped: alone, .. }) = finer {
        let is_same = alone.chart.triangles() == fresh.triangles()
            && alone.chart.points() == fresh.points()
            && alone.chart.outer() == fresh.outer()
            && alone.chart.holes() == fresh.holes();
        if is_same {
            return MappedChart { chart: fresh, ..alone }.into_job();
        }
    }
    let inherited = maps.inherited(&chart, |uv| inherited_uv(chart.vertices(), uv, fresh.vertices(), ends));
    ChartJob::refined(fresh, settings, inherited)
}

/// The first few triangles that were bisected because a map asks for it.
fn places(parts: &[Part]) -> Vec<(u32, Vec3)> {
    let mut places = Vec::new();
    for Part { mapped: MappedChart { chart, .. }, finer } in parts {
        let bisected = finer.iter().flat_map(|finer| &finer.bisected);
        for face in bisected.take(TOLD - places.len()) {
            let corners = chart.corners(face.index());
            let centroid = [0, 1, 2].map(|k| corners.iter().map(|p| p[k] / 3.0).sum());
            places.push((chart.source_triangle(face.index()), centroid));
        }
    }
    places
}
