//! Cutting charts that are no use to a mesher into parts that can be laid out flat.
//!
//! Some charts have a certified map that no mesher can follow: a tube of long facets, the inside of a housing with
//! eleven holes, whatever was triangulated by needles. Their maps stretch a hundredth of their area a hundred times and
//! more, and they have no [`natural`] map, either. In strips they mostly have one. So such charts are cut: through a
//! hole, where there is one, which makes two strips of a tube; otherwise where the area scale changes.
//!
//! Cutting is no end in itself: more charts mean more curves on which the nodes of a mesh are bound to lie. A cut is
//! tried, and taken only where all parts suit a mesher and are few.

use super::divided::{Piece, divided};
use super::job::{ChartError, MapError, Maps, map_whole};
use super::join::joined;
use crate::atlas::Chart;
use crate::certified::BoundaryFound;
use crate::decompose;
use crate::map::natural::{self, NoNatural};
use crate::measure::distortion;
use crate::monitor::{Interrupted, Monitor};
use crate::settings::{BoundaryShape, ChartSettings};

/// Charts whose maps stretch more than this on a hundredth of their area are cut, unless they have a natural map. Hills
/// of a terrain, at 10 to 50, and soccerball_g31, at 80, are well left whole.
const STRETCHED: f64 = 100.0;

/// The same for those that no natural boundary follows evenly: boxes with an open side, as the mirrors of milk_truck, at 34, with
/// elements of gamma 0.07.
const UNEVEN: f64 = 30.0;

/// Charts with holes on the disk are cut, too, if so much of their harmonic map is invalid: untangling takes long, and stretches
/// them (the inside of imu_adis16480, with 16 holes: 6 % invalid, an energy of nearly four times the least one, and Gmsh did not
/// end).
pub(super) const TANGLED: f64 = 0.05;

/// From here on a chart cannot be meshed at all, and any cut is better than none. In most such maps a hundredth of the
/// area is invalid before it is untangled: in 8 of 40 charts of imu_adis16480, and 5 of rear_case.
const TORN: f64 = 1000.0;

/// What the maps of all parts shall not exceed, unless they are natural. Where that takes too many parts, [`STRETCHED`]
/// will do if some are natural: of the tubes of thingi_1514499, made of needles, one strip in two is not.
const GOOD: f64 = 10.0;

/// The largest number of parts for each hole of a chart, and for one without. The halves of the plate of genus 9 in
/// tests/interop, at 400, would fall into 40 each, and are well meshed as they are.
const FEW: usize = 3;

/// Charts of more triangles than this that no natural boundary follows are cut if they stretch more than [`EVEN`] freed from the
/// disk, more than [`ROUNDED`] on it. What presses a thousandth of their area flat are fingers and folds: of brain_ch2 thirty such
/// charts of up to 19,000 triangles took 87 s to untangle, and Gmsh did not end on them in ten minutes; cut, 2 s and half a minute.
const LARGE: usize = 500;
const ROUNDED: f64 = 5.0;

/// What all their parts shall not exceed. Of brain_ch2 parts at 5 have three times as many bad elements; airplane_27_holes, freed at
/// 1.73, has one of gamma 0.096, and none below 0.41 in parts.
const EVEN: f64 = 1.6;

/// Off the disk they fall into [`FEW`] for each hole, or into parts of so many triangles on average, before small ones are joined:
/// airplane_27_holes needs that; a plate of genus 9 in two halves, whose maps stretch by 400 and are well meshed, stays whole.
const PER_PART: usize = 300;

/// On the disk they fall into so many parts for each hole at most: a crumpled disk of 6,144 triangles (bent_disk), which would
/// fall into 29, stays whole, and those of brain_ch2 take four to twelve.
const SOME: usize = 12;

/// From here on into [`MANY`]: whatever is as large takes long to untangle, and MeshAdapt minutes.
const HUGE: usize = 6_500;

/// The same for those that are torn. What was needed: 53 for three holes by menger_sponge3, whose long facets join
/// across its openings, and 37 for four by the inside of imu_adis16480. A ring of fine triangles that falls into more
/// (bent_disk) had better stay whole.
const MANY: usize = 100;

/// A ring whose map scales areas by no more than this stays one chart: of a cylinder's wall that is e^(2 L / R), for walls
/// up to one radius high.
const SHORT_RING: f64 = 8.0;

/// And if the disk does not stretch it more than this. Rings of 36 facets, five radii high, are stretched by 1.25 in four
/// rows, by 33 in two, and by 317 in one.
const ROUND: f64 = 2.0;

/// What is unrolled has no larger conformal distortion, and no larger area ratio: a quarter of a cylinder of eight facets
/// has neither.
const UNROLLED: f64 = 1.1;

/// A part that keeps more than this share of the triangles when it is cut where the area scale changes is cut in the middle the next
/// time: whatever is pressed flat there, it is not the tip of anything. Of the tubes of thingi_1514499_needles 26 single needles
/// came off one after another, and then the rest was cut in two.
const PEELED: f64 = 0.875;

/// A chart and its map.
pub(super) type Mapped = (Chart, Maps);

/// What cutting needs to know beside the chart.
#[derive(Clone, Copy)]
pub(super) struct Cutter<'a> {
    pub(super) settings: &'a ChartSettings,
    pub(super) monitor: &'a dyn Monitor,
}

/// What comes of an attempt to map a chart.
pub(super) enum Attempt {
    /// Its map.
    Mapped(Box<Maps>),
    /// Its parts: it cannot be mapped as a whole.
    Split(Vec<Chart>),
    /// Neither: it is a single triangle.
    Single,
}

/// By which map a mesher can follow a chart.
#[derive(Clone, Copy, PartialEq)]
enum Suits {
    Natural,
    Disk,
    Neither,
}

impl Cutter<'_> {
    /// The parts into which `chart` is to be cut; none where it suits a mesher as it is, or cutting does not help.
    ///
    /// # Errors
    /// [`ChartError`].
    fn parts(&self, chart: &Chart, map: &Maps) -> Result<Option<Vec<Mapped>>, ChartError> {
        if let Some(strips) = self.strips(chart, map)? {
            return Ok(Some(strips));
        }
        let stretch = map.conformal_p99(chart);
        // Only a chart that its map does not suit is asked for another one.
        let is_pierced = map.boundary != BoundaryFound::Natural && !chart.holes().is_empty();
        let is_tangled = is_pierced && map.invalid_share(chart) > TANGLED;
        let is_uneven = matches!(map.boundary, BoundaryFound::Circle { why_none: Some(NoNatural::Uneven { .. }) });
        let bearable = if is_uneven { UNEVEN } else { STRETCHED };
        if (stretch > bearable || is_tangled) && self.suits(chart, map.boundary, stretch, bearable)? != Suits::Natural {
            let most = for_each_hole(chart, if stretch > TORN || is_tangled { MANY } else { FEW });
            for bound in [GOOD, bearable] {
                if let Some((parts, naturals)) = self.parts_within(chart, map, bound, most)?
                    && (bound == GOOD || naturals > 0)
                {
                    return Ok(Some(joined(self, chart, parts)?));
                }
            }
        }
        Ok(None)
    }

    /// The parts into which a chart of many triangles is to be cut, whose map is the best that was found; none where that stretches
    /// little, or other rules are enough.
    ///
    /// # Errors
    /// [`ChartError`].
    pub(super) fn parts_of_large(&self, chart: &Chart, map: &Maps) -> Result<Option<Vec<Mapped>>, ChartError> {
        let stretch = map.conformal_p99(chart);
        let Some(Large { bearable, most }) = Large::of(chart, map.boundary, stretch) else { return Ok(None) };
        if stretch <= bearable || self.suits(chart, map.boundary, stretch, bearable)? == Suits::Natural {
            return Ok(None);
        }
        let parts = self.parts_within(chart, map, EVEN, most)?;
        parts.map(|(parts, _)| joined(self, chart, parts)).transpose()
    }

    /// The two strips into which a ring falls, where both are unrolled without stretching, as the wall of a cylinder is; none
    /// where natural boundaries were not asked for, or the ring has one that suits it.
    fn strips(&self, chart: &Chart, map: &Maps) -> Result<Option<Vec<Mapped>>, ChartError> {
        let ChartSettings { order, ref decompose, .. } = *self.settings;
        if decompose.boundary == BoundaryShape::Circle || chart.holes().len() != 1 {
            return Ok(None);
        }
        if unrolls(chart, map, SHORT_RING) {
            return Ok(None);
        }
        // Through the hole, as the disk shows it.
        let found;
        let disk = if map.boundary == BoundaryFound::Natural {
            match map_whole(chart, order, BoundaryShape::Circle, f64::INFINITY, self.monitor) {
                Ok(disk) => found = disk,
                Err(MapError::Interrupted(interrupted)) => return Err(interrupted.into()),
                Err(_) => return Ok(None),
            }
            &found
        } else {
            map
        };
        let is_short = distortion::area_ratio(chart, &disk.certified_start) <= SHORT_RING;
        if is_short && disk.conformal_p99(chart) <= ROUND {
            return Ok(None);
        }
        let Some(is_left) = left_of_hole(chart, disk) else { return Ok(None) };
        let halves = decompose::halve(chart, &is_left, decompose, self.monitor)?;
        if halves.len() != 2 {
            return Ok(None);
        }
        let mut strips = Vec::new();
        for half in halves {
            let Attempt::Mapped(map) = self.attempt(&half)? else { return Ok(None) };
            if !unrolls(&half, &map, UNROLLED) {
                return Ok(None);
            }
            strips.push((half, *map));
        }
        Ok(Some(strips))
    }

    /// Parts whose maps stretch less than `bound` or are natural, and how many are natural; none where they are more
    /// than `most`. Ends because parts are smaller, and a single triangle's map is what it is.
    fn parts_within(
        &self,
        chart: &Chart,
        map: &Maps,
        bound: f64,
        most: usize,
    ) -> Result<Option<(Vec<Mapped>, usize)>, ChartError> {
        let Some(parts) = self.halves(chart, map, false)? else { return Ok(None) };
        let few = |parts| if parts > most { Err(Stopped::Hopeless) } else { Ok(()) };
        let look = |(part, is_peeled): Marked, monitor: &dyn Monitor| {
            let cutter = Cutter { monitor, ..*self };
            cutter.look(part, is_peeled, bound)
        };
        let parts = match divided(marked(chart, parts), self.monitor, few, look) {
            Ok(parts) => parts,
            Err(Stopped::Hopeless) => return Ok(None),
            Err(Stopped::Failed(error)) => return Err(error),
        };
        let naturals = parts.iter().filter(|(_, suits)| *suits == Suits::Natural).count();
        Ok(Some((parts.into_iter().rev().map(|(mapped, _)| mapped).collect(), naturals)))
    }

    /// What becomes of a part: its map stretches less than `bound` or is natural, or it is cut again.
    fn look(&self, part: Chart, is_peeled: bool, bound: f64) -> Result<Piece<Marked, (Mapped, Suits)>, Stopped> {
        let map = match self.attempt(&part)? {
            Attempt::Mapped(map) => map,
            Attempt::Split(parts) => return Ok(Piece::Divided(marked(&part, parts))),
            // Left to the caller's rule for charts that do not map.
            Attempt::Single => return Err(Stopped::Hopeless),
        };
        let suits = self.suits(&part, map.boundary, map.conformal_p99(&part), bound)?;
        let parts = if suits == Suits::Neither { self.halves(&part, &map, is_peeled)? } else { None };
        Ok(match parts {
            // Nothing becomes smaller.
            Some(parts) if parts.len() < 2 => return Err(Stopped::Hopeless),
            Some(parts) => Piece::Divided(marked(&part, parts)),
            None => Piece::Done(((part, *map), suits)),
        })
    }

    /// The parts into which a chart is to be cut ([`Self::parts`]), or the chart with its map.
    ///
    /// # Errors
    /// [`ChartError`].
    pub(super) fn whole_or_parts(&self, chart: Chart, map: Maps) -> Result<Vec<Mapped>, ChartError> {
        let parts = self.parts(&chart, &map)?;
        Ok(parts.unwrap_or_else(|| vec![(chart, map)]))
    }

    /// A single triangle: its map is what it is.
    ///
    /// # Errors
    /// [`ChartError`].
    pub(super) fn single(&self, chart: Chart) -> Result<Vec<Mapped>, ChartError> {
        let ChartSettings { order, ref decompose, .. } = *self.settings;
        let map = map_whole(&chart, order, decompose.boundary, f64::INFINITY, self.monitor)?;
        Ok(vec![(chart, map)])
    }

    /// Maps a chart, or splits it once where it touches itself in space, cannot be mapped, or would be too distorted.
    ///
    /// # Errors
    /// [`ChartError`].
    pub(super) fn attempt(&self, chart: &Chart) -> Result<Attempt, ChartError> {
        let &Self { settings: &ChartSettings { order, ref decompose, .. }, monitor } = self;
        if let Some(parts) = decompose::separate(chart, decompose, monitor)? {
            return Ok(Attempt::Split(parts));
        }
        let error = match map_whole(chart, order, decompose.boundary, decompose.max_area_ratio, monitor) {
            Ok(map) => return Ok(Attempt::Mapped(Box::new(map))),
            Err(MapError::Interrupted(interrupted)) => return Err(interrupted.into()),
            Err(error) => error,
        };
        let parts = decompose::split(chart, error.log_scales(), decompose, monitor)?;
        Ok(parts.map_or(Attempt::Single, Attempt::Split))
    }

    /// `stretch` is how much the map of the chart stretches, `found` its boundary.
    fn suits(&self, chart: &Chart, found: BoundaryFound, stretch: f64, bound: f64) -> Result<Suits, Interrupted> {
        let on_disk = if stretch <= bound { Suits::Disk } else { Suits::Neither };
        match found {
            BoundaryFound::Natural if stretch <= bound => return Ok(Suits::Natural),
            BoundaryFound::Natural => return Ok(Suits::Neither),
            // One that was asked for, and is not there, need not be asked for again: of 411 parts of four CAD files none had one that
            // other means found.
            BoundaryFound::Circle { why_none: Some(_) } => return Ok(on_disk),
            BoundaryFound::Circle { why_none: None } | BoundaryFound::Freed { .. } => {}
        }
        let natural = natural::natural(chart, stretch, self.monitor)?;
        Ok(if natural.is_some_and(|n| n.distortion.conformal_p99 <= bound) { Suits::Natural } else { on_disk })
    }

    /// The chart cut once: through its first hole, or where the area scale changes, or, where that only `is_peeled` off before, in the
    /// middle. None for a single triangle.
    fn halves(&self, chart: &Chart, map: &Maps, is_peeled: bool) -> Result<Option<Vec<Chart>>, decompose::Error> {
        match left_of_hole(chart, map) {
            Some(is_left) => decompose::halve(chart, &is_left, &self.settings.decompose, self.monitor).map(Some),
            None => {
                let scales = (!is_peeled).then(|| distortion::log_scales(chart, &map.certified_start));
                decompose::split(chart, scales.as_deref(), &self.settings.decompose, self.monitor)
            }
        }
    }
}

/// So many parts for each hole of a chart, or for one without.
fn for_each_hole(chart: &Chart, parts: usize) -> usize {
    parts * chart.holes().len().max(1)
}

/// The rule for charts of many triangles that no natural boundary follows.
struct Large {
    /// How much the map may stretch.
    bearable: f64,
    /// How many parts there may be.
    most: usize,
}

impl Large {
    /// That for a chart with such a boundary, whose map stretches so much; none where other rules are enough.
    fn of(chart: &Chart, found: BoundaryFound, stretch: f64) -> Option<Self> {
        let triangles = chart.triangles().len();
        match found {
            BoundaryFound::Freed { .. } if triangles > LARGE => {
                Some(Self { bearable: EVEN, most: for_each_hole(chart, FEW).max(triangles / PER_PART) })
            }
            // What was asked for is no lack of another.
            BoundaryFound::Circle { why_none: None } => None,
            BoundaryFound::Circle { .. } if triangles > HUGE => {
                Some(Self { bearable: ROUNDED, most: for_each_hole(chart, MANY) })
            }
            // What stretches more has been tried to be cut already.
            BoundaryFound::Circle { .. } if triangles > LARGE && stretch <= STRETCHED => {
                Some(Self { bearable: ROUNDED, most: for_each_hole(chart, SOME) })
            }
            _ => None,
        }
    }
}

/// Why there are no parts that suit a mesher.
enum Stopped {
    /// They are too many, or one of them never will.
    Hopeless,
    Failed(ChartError),
}

impl<E: Into<ChartError>> From<E> for Stopped {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// A part of a chart, and whether little more than a peel was taken off it.
type Marked = (Chart, bool);

/// The parts of `chart`.
fn marked(chart: &Chart, parts: Vec<Chart>) -> Vec<Marked> {
    let large = PEELED * chart.triangles().len() as f64;
    let mark = |part: Chart| {
        let is_peeled = part.triangles().len() as f64 > large;
        (part, is_peeled)
    };
    parts.into_iter().map(mark).collect()
}

/// Whether a chart has a natural map that stretches hardly, and scales areas by no more than `most`.
fn unrolls(chart: &Chart, map: &Maps, most: f64) -> bool {
    map.boundary == BoundaryFound::Natural
        && map.conformal_p99(chart) <= UNROLLED
        && distortion::area_ratio(chart, &map.certified_start) <= most
}

/// Per triangle, whether it lies left of a line through the origin of the plane and the middle of the first hole, if there
/// is one.
fn left_of_hole(chart: &Chart, map: &Maps) -> Option<Vec<bool>> {
    let start = &map.certified_start;
    let node = |n: u32| start.map().nodes[n as usize].uv();
    let hole = chart.holes().first()?;
    let sum = hole.iter().map(|h| node(chart.from(*h).0)).fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
    let mean = sum.map(|c| c / hole.len() as f64);
    // On the disk a point is known that sees all of the hole.
    let centre = start.certificate().hole_centres.first().map_or(mean, |c| c.uv());
    let along = if centre == [0.0; 2] { [1.0, 0.0] } else { centre };
    let is_left = |cell: &[u32; 6]| {
        let sum = cell[..3].iter().map(|n| node(*n)).fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
        let from = [0, 1].map(|k| sum[k] / 3.0 - centre[k]);
        along[0] * from[1] > along[1] * from[0]
    };
    Some(start.map().cells.iter().map(is_left).collect())
}
