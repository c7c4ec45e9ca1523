//! Size fields: how long the edges of a mesh are to be, place by place.
//!
//! Sizes are asked for at places; away from one they grow with the distance, by the gradation g:
//!
//! h(x) = min over all places i of  s_i + g max(0, |x - x_i| - r_i)
//!
//! which is the largest field that is nowhere above what is asked for, and whose slope is at most g (the distance transform of
//! sampled functions; Persson 2006, *Mesh size functions for implicit geometry and PDE-based gradient limiting*, doi
//! 10.1007/s00366-006-0014-1, solves for it along a surface; here distances are those of space). Places are found in a k-d tree
//! whose boxes know the least that is asked for in them: a value costs the logarithm of their number where sizes are graded.
//!
//! Where sizes are asked for at all points of a triangle, as the values of an array at its corners tell them, the field is no more
//! than that in between.
//!
//! Meshers take values on triangles: [`SizeField::sampled`] bisects those of a surface until linear interpolation tells the
//! field, so that the long facets of CAD files do not spread small sizes over their whole length.

use crate::vec3::{BoundingBox, Vec3, distance, midpoint};

/// Fields are told up to so many times the size that is asked for everywhere: a larger one may be given to a mesher later.
pub const TOLD_UP_TO: f64 = 4.0;

/// Places of a leaf, at most. By experience: smaller leaves take more boxes, larger ones more looks at places.
const LEAF: usize = 8;

/// Linear interpolation tells a field well enough if it is off by less than this share of it. By experience: elements vary
/// by more than that around the size they are asked for.
const CLOSE: f64 = 0.1;

/// A place of small size hides between the points that are looked at where sizes could change by more than so many times
/// themselves over a triangle. Where they cannot, the points are no farther apart than the field around such a place reaches.
const STEEP: f64 = 2.0;

/// A triangle is bisected so often at most: from the length of a bounding box to a thousandth of a thousandth of it, along
/// both directions.
const MAX_BISECTIONS: u32 = 40;

/// A place at which edges of a length are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizedPlace {
    /// Where.
    pub at: Vec3,
    /// The length, in the unit of the input; positive.
    pub size: f64,
    /// How far it holds before edges become longer, in the unit of the input.
    pub reach: f64,
}

impl SizedPlace {
    /// What this place asks for at a distance.
    fn asks(&self, distance: f64, gradation: f64) -> f64 {
        self.size + gradation * (distance - self.reach).max(0.0)
    }
}

/// A triangle with the sizes at its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizedTriangle {
    /// Its corners.
    pub corners: [Vec3; 3],
    /// The sizes there.
    pub sizes: [f64; 3],
}

/// The length of edges, place by place.
///
/// ```
/// use planish_core::measure::sizes::{SizeField, SizedPlace};
///
/// let places = [0.0, 10.0].map(|x| SizedPlace { at: [x, 0.0, 0.0], size: 1.0, reach: 1.0 });
/// let field = SizeField::new(places.to_vec(), 0.5);
/// assert_eq!(field.at([0.5, 0.0, 0.0]), 1.0, "within reach");
/// assert_eq!(field.at([5.0, 0.0, 0.0]), 1.0 + 0.5 * 4.0, "half-way, as far from both");
/// assert_eq!(SizeField::new(vec![], 0.5).at([0.0; 3]), f64::INFINITY, "nothing is asked for");
/// ```
#[derive(Clone, Debug)]
pub struct SizeField {
    /// In the order of the leaves.
    places: Vec<SizedPlace>,
    /// Children `2 i + 1` and `2 i + 2` of node `i` hold the halves of its places.
    nodes: Vec<Option<Node>>,
    gradation: f64,
}

/// What is known of some places.
#[derive(Clone, Copy, Debug)]
struct Node {
    around: BoundingBox,
    /// The least size, and the largest reach.
    size: f64,
    reach: f64,
}

impl SizeField {
    /// The field of these places; sizes grow by `gradation` times the distance, which is positive.
    pub fn new(mut places: Vec<SizedPlace>, gradation: f64) -> Self {
        let depth = (places.len() / LEAF + 1).next_power_of_two().ilog2();
        // A complete binary tree, with 2^(depth + 1) - 1 nodes.
        let mut nodes = vec![None; (2 << depth) - 1];
        build(&mut places, &mut nodes, 0);
        Self { places, nodes, gradation }
    }

    /// Whether nothing is asked for anywhere.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The size at a point; infinite where nothing is asked for anywhere.
    pub fn at(&self, x: Vec3) -> f64 {
        let mut least = f64::INFINITY;
        let mut stack = vec![(0, 0, self.places.len())];
        while let Some((number, start, end)) = stack.pop() {
            if self.bound(number, x) >= least {
                continue;
            }
            let [low, high] = [2 * number + 1, 2 * number + 2];
            if high >= self.nodes.len() {
                for place in &self.places[start..end] {
                    least = least.min(place.asks(distance(place.at, x), self.gradation));
                }
                continue;
            }
            let middle = usize::midpoint(start, end);
            let mut children = [(low, start, middle), (high, middle, end)];
            // What may be less comes off the stack first.
            if self.bound(low, x) < self.bound(high, x) {
                children.reverse();
            }
            stack.extend(children);
        }
        least
    }

    /// What no place of a node asks less than, at a point.
    fn bound(&self, number: usize, x: Vec3) -> f64 {
        self.nodes[number].map_or(f64::INFINITY, |node| {
            let off = [0, 1, 2].map(|k| (node.around.min[k] - x[k]).max(x[k] - node.around.max[k]).max(0.0));
            let distance = off.iter().map(|d| d * d).sum::<f64>().sqrt();
            node.size + self.gradation * (distance - node.reach).max(0.0)
        })
    }

    /// The field on triangles that cover those of a surface where it is below `most`: each is bisected at its longest side while
    /// interpolation is off, and the side longer than the elements there. Sizes are cut off at `most`; triangles with nothing
    /// below it are left out.
    ///
    /// The sizes of the triangles that are given are asked for between their corners, too, in a straight line from one to the
    /// other; infinite ones ask for nothing. (Their corners themselves are places.)
    ///
    /// It ends: sizes are positive, and halves of a side become shorter than any of them.
    pub fn sampled(&self, surface: impl Iterator<Item = SizedTriangle>, most: f64) -> Vec<SizedTriangle> {
        let mut sampled = Vec::new();
        for SizedTriangle { corners, sizes: asked } in surface {
            let sizes = [0, 1, 2].map(|k| self.at(corners[k]).min(asked[k]).min(most));
            let mut waiting = vec![Part { triangle: SizedTriangle { corners, sizes }, asked, bisections: 0 }];
            while let Some(part) = waiting.pop() {
                match self.bisected(&part, most) {
                    Some(halves) => waiting.extend(halves),
                    None if part.triangle.sizes.iter().any(|size| *size < most) => sampled.push(part.triangle),
                    None => {}
                }
            }
        }
        sampled
    }

    /// The halves of a part, where it needs them.
    fn bisected(&self, part: &Part, most: f64) -> Option<[Part; 2]> {
        let SizedTriangle { corners, sizes } = part.triangle;
        let lengths = [0, 1, 2].map(|k| distance(corners[k], corners[(k + 1) % 3]));
        let longest = (1..3).fold(0, |best, k| if lengths[k] > lengths[best] { k } else { best });
        let centre = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 3.0);
        let inside = self.at(centre);
        // Nothing within reach of the triangle is below this.
        let is_free = inside - self.gradation * lengths[longest] >= most && sizes.iter().all(|size| *size >= most);
        if is_free || part.bisections >= MAX_BISECTIONS {
            return None;
        }
        let middles = [0, 1, 2].map(|k| midpoint(corners[k], corners[(k + 1) % 3]));
        let field = middles.map(|x| self.at(x));
        let asked = [0, 1, 2].map(|k| 0.5 * (part.asked[k] + part.asked[(k + 1) % 3]));
        let found = [0, 1, 2].map(|k| field[k].min(asked[k]).min(most));
        let at_centre = inside.min(part.asked.iter().sum::<f64>() / 3.0);
        let is_told = |found: f64, told: f64| (found - told).abs() <= CLOSE * found;
        let are_told = (0..3).all(|k| is_told(found[k], 0.5 * (sizes[k] + sizes[(k + 1) % 3])))
            && is_told(at_centre.min(most), sizes.iter().sum::<f64>() / 3.0);
        let least = found.iter().fold(at_centre, |least, size| least.min(*size));
        // What is asked for in between hides no place: only the field of places tells of others.
        let least_of_field = field.iter().fold(inside, |least, size| least.min(*size));
        let is_overlooked = self.gradation * lengths[longest] > STEEP * least_of_field.min(most);
        if lengths[longest] <= least || (are_told && !is_overlooked) {
            return None;
        }
        Some(part.halves(longest, found[longest], asked[longest]))
    }
}

/// A part of a triangle that is looked at.
struct Part {
    /// With the sizes that were found.
    triangle: SizedTriangle,
    /// The sizes that are asked for at its corners, where those in between count; else infinite.
    asked: [f64; 3],
    /// How often it was bisected.
    bisections: u32,
}

impl Part {
    /// Its halves, with what was found and what is asked for in the middle of a side.
    fn halves(&self, side: usize, size: f64, asked: f64) -> [Self; 2] {
        let SizedTriangle { corners, sizes } = self.triangle;
        let [a, b, c] = [0, 1, 2].map(|k| (side + k) % 3);
        let middle = midpoint(corners[a], corners[b]);
        let half = |corners, sizes, asked| {
            let triangle = SizedTriangle { corners, sizes };
            Self { triangle, asked, bisections: self.bisections + 1 }
        };
        let of = &self.asked;
        [
            half([corners[a], middle, corners[c]], [sizes[a], size, sizes[c]], [of[a], asked, of[c]]),
            half([middle, corners[b], corners[c]], [size, sizes[b], sizes[c]], [asked, of[b], of[c]]),
        ]
    }
}

/// Sorts places into the halves of a node, along the longest side of its box.
fn build(places: &mut [SizedPlace], nodes: &mut [Option<Node>], number: usize) {
    let Some(around) = BoundingBox::of(places.iter().map(|place| place.at)) else { return };
    let size = places.iter().map(|place| place.size).fold(f64::INFINITY, f64::min);
    let reach = places.iter().map(|place| place.reach).fold(0.0, f64::max);
    nodes[number] = Some(Node { around, size, reach });
    if 2 * number + 2 >= nodes.len() {
        return;
    }
    let extent = [0, 1, 2].map(|k| around.max[k] - around.min[k]);
    let axis = (1..3).fold(0, |best, k| if extent[k] > extent[best] { k } else { best });
    let middle = places.len() / 2;
    if middle > 0 {
        places.select_nth_unstable_by(middle, |p, q| p.at[axis].total_cmp(&q.at[axis]));
    }
    let (low, high) = places.split_at_mut(middle);
    build(low, nodes, 2 * number + 1);
    build(high, nodes, 2 * number + 2);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places that differ in all they have, without order.
    fn places(count: u32) -> Vec<SizedPlace> {
        let place = |i: u32| SizedPlace {
            at: [i * 7 % 101, i * 29 % 97, i * 53 % 89].map(f64::from),
            size: 1.0 + f64::from(i * 31 % 17),
            reach: f64::from(i % 5),
        };
        (0..count).map(place).collect()
    }

    #[test]
    fn the_tree_finds_the_least_of_all_places() {
        for count in [1, 7, 8, 9, 100, 1000] {
            let all = places(count);
            let field = SizeField::new(all.clone(), 0.3);
            for i in 0..200 {
                let x = [i * 3 % 110, i * 11 % 90, i * 17 % 70].map(f64::from);
                let least = all.iter().map(|p| p.asks(distance(p.at, x), 0.3)).fold(f64::INFINITY, f64::min);
                assert_eq!(field.at(x), least, "{count} places");
            }
        }
    }

    /// On a facet a thousand times as long as elements are at its end, interpolation tells the field, and the small ones do not
    /// spread over it. The corners alone would not tell of a place in the middle of a side.
    #[test]
    fn long_facets_are_bisected_where_sizes_change() {
        let facet = [[0.0; 3], [1000.0, 0.0, 0.0], [0.0, 10.0, 0.0]];
        for at in [[0.0; 3], [437.0, 0.0, 0.0]] {
            let field = SizeField::new(vec![SizedPlace { at, size: 1.0, reach: 2.0 }], 0.4);
            let sampled = field.sampled(std::iter::once(free(facet)), 100.0);
            assert!((20..2000).contains(&sampled.len()), "{} triangles", sampled.len());
            for SizedTriangle { corners, sizes } in &sampled {
                let centre = [0, 1, 2].map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 3.0);
                let (told, found) = (sizes.iter().sum::<f64>() / 3.0, field.at(centre).min(100.0));
                assert!((told - found).abs() <= 0.25 * found, "{told} for {found} at {centre:?}");
            }
            // What is left out has nothing below the largest size.
            let least = sampled.iter().flat_map(|t| t.sizes).fold(f64::INFINITY, f64::min);
            assert!(least < 1.5, "{least}");
        }
        assert!(SizeField::new(vec![], 0.4).sampled(std::iter::once(free(facet)), 100.0).is_empty());
    }

    /// A triangle in which nothing is asked for.
    fn free(corners: [Vec3; 3]) -> SizedTriangle {
        SizedTriangle { corners, sizes: [f64::INFINITY; 3] }
    }

    /// On a facet whose corners ask for sizes a thousandth of its length, the places alone would allow more in between: what is
    /// asked for there is a straight line. A place in the middle of it is found all the same, and no triangle more than both need.
    #[test]
    fn between_corners_that_ask_for_sizes_these_are_interpolated() {
        let facet =
            SizedTriangle { corners: [[0.0; 3], [1000.0, 0.0, 0.0], [0.0, 800.0, 0.0]], sizes: [1.0, 2.0, 1.0] };
        let mut places: Vec<SizedPlace> =
            (0..3).map(|k| SizedPlace { at: facet.corners[k], size: facet.sizes[k], reach: 0.0 }).collect();
        let asked = |x: Vec3| 1.0 + x[0] / 1000.0;
        for count in 0..2 {
            let pit = [300.0, 200.0, 0.0];
            places.extend((0..count).map(|_| SizedPlace { at: pit, size: 0.01, reach: 0.0 }));
            let sampled = SizeField::new(places.clone(), 0.4).sampled(std::iter::once(facet), 100.0);
            assert!((1..2000).contains(&sampled.len()), "{} triangles", sampled.len());
            for (at, size) in sampled.iter().flat_map(|t| t.corners.into_iter().zip(t.sizes)) {
                let by_pit = if count == 0 { f64::INFINITY } else { 0.01 + 0.4 * distance(at, pit) };
                let expected = asked(at).min(by_pit);
                assert!((size - expected).abs() <= 1e-12 * expected, "{size} for {expected} at {at:?}");
            }
            let least = sampled.iter().flat_map(|t| t.sizes).fold(f64::INFINITY, f64::min);
            assert!(if count == 0 { least == 1.0 } else { least < 0.02 }, "{least}");
        }
    }
}
