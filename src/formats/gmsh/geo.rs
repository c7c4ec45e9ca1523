//! `remesh.geo`: a script that merges the atlas, sets sizes, and tells its reader what to change.

use crate::result_files::{ATLAS_MSH as ATLAS, ENLARGED_MSH as ENLARGED};
use planish_core::measure::spikes::Spike;
use planish_core::vec3::Vec3;

/// What the script asks for where sizes vary.
///
/// Along curves Gmsh integrates the number of elements, by halving to 1e-9 of one by default; sizes that fields tell have kinks,
/// and each takes thousands of evaluations. The 1,960 curves of generic_twin_7081 take 8 s with 1e-3, 16 s with 1e-4, 37 s
/// with 1e-5, more than 170 s without; the nodes are 622,235, 622,231, 622,227 then.
///
/// With one pass of smoothing, which is the default, single elements stay flat: of face_bff one of 39,165, at gamma 0.07, comes and
/// goes with the last digits of sizes. With two its least gamma is 0.25, those of 22 files are never lower, and Gmsh takes a third
/// longer.
const VARYING: &str =
    "// To a thousandth of an element along curves: with less, sizes that have kinks take many times as long.
Mesh.LcIntegrationPrecision = 1e-3;
// One pass more than by default: where sizes change, single elements stay flat otherwise.
Mesh.Smoothing = 2;
";

/// From about this many triangles on, the script asks for the faster algorithm, which makes the worse triangles. Below
/// it, meshing took 0.5 to 1.9 seconds on the files of docs/side_by_side.md.
const MANY: u32 = 20_000;

/// What the script asks for and tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Script {
    /// The edge length, in the unit of the input.
    pub size: f64,
    /// The area of the surface.
    pub area: f64,
    /// How many surfaces the atlas holds.
    pub surfaces: usize,
    /// How many curves.
    pub curves: usize,
    /// By which algorithms.
    pub algorithms: Algorithms,
    /// Where elements are smaller.
    pub narrow: Vec<Narrow>,
    /// Where they are, too: around places that are narrow.
    pub balls: Vec<Ball>,
    /// And in spikes and pits.
    pub spikes: Vec<Spike>,
}

/// Curves along places that are narrower than an edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Narrow {
    /// The size of elements there, in the unit of the input.
    pub size: f64,
    /// The curves, counted from 0.
    pub curves: Vec<usize>,
    /// Surfaces that have elements of this size all over, counted from 0.
    pub surfaces: Vec<usize>,
    /// The length of the longest of them.
    pub longest: f64,
}

/// A ball in which elements are smaller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its middle.
    pub centre: Vec3,
    /// How far elements of this size reach, in the unit of the input.
    pub radius: f64,
    /// Over which distance from there they become as large as elsewhere.
    pub thickness: f64,
    /// Their size.
    pub size: f64,
}

impl Narrow {
    /// The sizes of narrow places: the size halved so often at most, to a thousandth. By experience: elements of less could
    /// outnumber all others.
    pub const HALVINGS: u32 = 10;

    /// Points of a curve from which distances are measured, at most: curves are polylines of many more. By experience: with
    /// fewer, distances between them are off by more; every one costs time wherever Gmsh asks for a size.
    const MOST_SAMPLES: f64 = 500.0;

    /// How much larger elements may become over a distance. By experience: less makes more small elements around narrow places,
    /// more makes elements lean where sizes change.
    pub const GRADATION: f64 = 0.4;
}

/// The algorithms that the script asks for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Algorithms {
    /// The surfaces, counted from 0, that MeshAdapt must mesh; the others fare better with Frontal-Delaunay.
    pub adapted: Vec<usize>,
    /// By how much all lengths are multiplied in the file that is merged, a power of two; 1: the atlas itself is merged.
    pub enlarged: f64,
}

/// The bytes of `remesh.geo`.
pub fn remesh(script: &Script) -> Vec<u8> {
    let Script { size, area, surfaces, curves, algorithms, narrow, balls, spikes } = script;
    let factor = algorithms.enlarged;
    let is_uniform = narrow.is_empty() && balls.is_empty() && spikes.is_empty();
    format!(
        "// Remesh this surface through its certified maps:
//
//     gmsh remesh.geo -2                        writes remesh.msh beside this file
//     gmsh remesh.geo -2 -o part.stl            another name, another format
//     gmsh remesh.geo -2 -setnumber size {size}
//     gmsh remesh.geo                           opens it; press 2 for the mesh
//
// {ATLAS} holds {surfaces} surface(s), one per chart, and {curves} curve(s). Charts that share a curve share its nodes.
// Do not call CreateGeometry or ClassifySurfaces: they would replace the certified maps by other ones.

SetFactory(\"Built-in\");
{merge}
// The edge length, in the unit of the input: change this number, or give -setnumber size H.
DefineConstant[ size = {{{size}, Name \"Edge length\"}} ];

// One size everywhere{but}. For smaller elements where the surface bends, let Mesh.MeshSizeMin be smaller and
// uncomment the line with the number of elements per full turn.
Mesh.MeshSizeMin = {least}size{times};
Mesh.MeshSizeMax = size{times};
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
{varying}// Mesh.MeshSizeFromCurvature = 20;
{fields}
// 6 (Frontal-Delaunay) makes the better triangles, 5 (Delaunay) is many times faster where there are many of them;
// 8 makes triangles fit to be recombined.
If(2.31 * {area} / size^2 < {MANY})
  Mesh.Algorithm = 6;
Else
  Mesh.Algorithm = 5;
EndIf
{adapted}// One triangle that leans more than 90 degrees from the input's would make Gmsh begin again with a far slower one.
Mesh.AlgorithmSwitchOnFailure = 0;
// Mesh.RecombineAll = 1; // quadrangles

// Curved elements: uncomment both. Without the second, elements are inverted where the surface bends sharply.
// Mesh.ElementOrder = 2;
// Mesh.HighOrderOptimize = 1;
",
        merge = merge(factor),
        times = if factor == 1.0 { String::new() } else { format!(" * {factor}") },
        but = if is_uniform { "" } else { ", but in narrow places" },
        varying = if is_uniform { "" } else { VARYING },
        least = if is_uniform { String::new() } else { format!("1 / {} * ", 2_u32.pow(Narrow::HALVINGS)) },
        fields = fields(narrow, balls, spikes, factor),
        adapted = adapted(&algorithms.adapted),
    )
    .into_bytes()
}

/// What reads the atlas.
fn merge(factor: f64) -> String {
    if factor == 1.0 {
        return format!("Merge \"{ATLAS}\";\n");
    }
    format!(
        "
// The same atlas with all lengths {factor} times as large: MeshAdapt looks for the closest point of a surface within 0.1
// of whatever unit, which takes minutes where that is many edges. What is written to files has the unit of the input.
Merge \"{ENLARGED}\";
Mesh.ScalingFactor = 1 / {factor};
"
    )
}

/// What asks for MeshAdapt.
fn adapted(surfaces: &[usize]) -> String {
    if surfaces.is_empty() {
        return String::new();
    }
    format!(
        "// Maps that stretch: there the algorithms above leave parts of the surface out, or make slivers. MeshAdapt does not,
// but takes ten times as long.
MeshAlgorithm Surface {{{}}} = 1;

",
        tags(surfaces)
    )
}

/// Smaller elements in narrow places and spikes, and ever larger ones away from them.
fn fields(narrow: &[Narrow], balls: &[Ball], spikes: &[Spike], factor: f64) -> String {
    let mut fields = Fields { factor, ..Fields::default() };
    if !narrow.is_empty() {
        fields.text += "
// Smaller elements around curves that are shorter than an edge, or bound charts that are narrower.
";
    }
    for place in narrow {
        fields.around_curves(place);
        fields.on_surfaces(place);
    }
    if !balls.is_empty() {
        fields.text += "
// Smaller elements where the boundary of a surface passes close to itself.
";
    }
    balls.iter().for_each(|ball| fields.in_ball(ball));
    if !spikes.is_empty() {
        fields.text += "
// Smaller elements in spikes and pits, the tips of which would be cut off.
";
    }
    for Spike { centre, radius, size } in spikes.iter().copied() {
        fields.in_ball(&Ball { centre, radius, thickness: radius, size });
    }
    fields.finished()
}

/// Size fields of Gmsh, the smallest of which counts.
#[derive(Default)]
struct Fields {
    text: String,
    /// How many fields there are.
    last: usize,
    /// The fields that tell sizes.
    sizes: Vec<usize>,
    /// By how much lengths are multiplied.
    factor: f64,
}

impl Fields {
    /// Begins a field of a kind, and gives its number.
    fn begin(&mut self, kind: &str) -> usize {
        self.last += 1;
        self.text += &format!("Field[{}] = {kind};\n", self.last);
        self.last
    }

    /// Gives the last field an option.
    fn option(&mut self, name: &str, value: impl std::fmt::Display) {
        self.text += &format!("Field[{}].{name} = {value};\n", self.last);
    }

    /// `size`, unless the user asks for less.
    fn at_most(&self, size: f64) -> String {
        format!("(size < {size} ? size : {size}) * {}", self.factor)
    }

    fn around_curves(&mut self, place: &Narrow) {
        if place.curves.is_empty() {
            return;
        }
        let (size, factor) = (place.size, self.factor);
        let distance = self.begin("Distance");
        self.option("CurvesList", format!("{{{}}}", tags(&place.curves)));
        self.option("Sampling", (place.longest / size).ceil().clamp(10.0, Narrow::MOST_SAMPLES));
        let threshold = self.begin("Threshold");
        self.option("InField", distance);
        self.option("SizeMin", self.at_most(size));
        self.option("SizeMax", format!("size * {factor}"));
        self.option("DistMin", format!("{size} * {factor}"));
        let far = format!("(size < {size} ? {size} : size) / {} * {factor}", Narrow::GRADATION);
        self.option("DistMax", far);
        self.sizes.push(threshold);
    }

    fn on_surfaces(&mut self, place: &Narrow) {
        if place.surfaces.is_empty() {
            return;
        }
        let constant = self.begin("Constant");
        self.option("SurfacesList", format!("{{{}}}", tags(&place.surfaces)));
        self.option("IncludeBoundary", 1);
        self.option("VIn", self.at_most(place.size));
        self.option("VOut", format!("size * {}", self.factor));
        self.sizes.push(constant);
    }

    fn in_ball(&mut self, place: &Ball) {
        let factor = self.factor;
        let ball = self.begin("Ball");
        for (axis, c) in ["XCenter", "YCenter", "ZCenter"].into_iter().zip(place.centre) {
            self.option(axis, format!("{c} * {factor}"));
        }
        self.option("Radius", format!("{} * {factor}", place.radius));
        self.option("Thickness", format!("{} * {factor}", place.thickness));
        self.option("VIn", self.at_most(place.size));
        self.option("VOut", format!("size * {factor}"));
        self.sizes.push(ball);
    }

    /// The text, with the field that is the smallest of all.
    fn finished(mut self) -> String {
        if self.sizes.is_empty() {
            return self.text;
        }
        let one_less: Vec<usize> = self.sizes.iter().map(|f| f - 1).collect();
        let all = self.begin("Min");
        self.option("FieldsList", format!("{{{}}}", tags(&one_less)));
        self.text + &format!("Background Field = {all};\n")
    }
}

/// The tags of entities that are counted from 0, in lines of twenty.
fn tags(entities: &[usize]) -> String {
    let lines = entities.chunks(20).map(|line| line.iter().map(|e| (e + 1).to_string()).collect::<Vec<_>>().join(", "));
    lines.collect::<Vec<_>>().join(",\n  ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn script(algorithms: Algorithms, narrow: Vec<Narrow>) -> String {
        script_with(algorithms, narrow, vec![], vec![])
    }

    fn script_with(algorithms: Algorithms, narrow: Vec<Narrow>, balls: Vec<Ball>, spikes: Vec<Spike>) -> String {
        let script = Script { size: 0.1 + 0.2, area: 4.5, surfaces: 2, curves: 1, algorithms, narrow, balls, spikes };
        String::from_utf8(remesh(&script)).expect("UTF-8")
    }

    #[test]
    fn the_script_holds_the_size_in_full() {
        let text = script(Algorithms { adapted: vec![], enlarged: 1.0 }, vec![]);
        assert!(text.contains("size = {0.30000000000000004, Name"), "{text}");
        assert!(text.contains("Merge \"atlas.msh\";"));
        assert!(!text.contains("MeshAlgorithm") && !text.contains("ScalingFactor"), "{text}");
    }

    #[test]
    fn surfaces_are_counted_from_one_and_lengths_are_enlarged_alike() {
        let text = script(Algorithms { adapted: (0..22).collect(), enlarged: 1024.0 }, vec![]);
        assert!(text.contains("MeshAlgorithm Surface {1, 2,") && text.contains(", 20,\n  21, 22} = 1;"), "{text}");
        assert!(text.contains("Merge \"atlas-enlarged.msh\";\nMesh.ScalingFactor = 1 / 1024;"), "{text}");
        assert!(text.contains("MeshSizeMax = size * 1024;"), "{text}");
    }

    #[test]
    fn narrow_places_have_fields_of_their_own() {
        let place = |size, curves| Narrow { size, curves, surfaces: vec![4], longest: 1.0 };
        let algorithms = Algorithms { adapted: vec![], enlarged: 4.0 };
        let text = script(algorithms, vec![place(0.15, vec![0, 6]), place(0.075, vec![2])]);
        for line in [
            "Mesh.MeshSizeMin = 1 / 1024 * size * 4;",
            "Field[1].CurvesList = {1, 7};",
            "Field[3].SurfacesList = {5};",
            "Field[4].CurvesList = {3};",
            "Field[5].SizeMin = (size < 0.075 ? size : 0.075) * 4;",
            "Field[7].FieldsList = {2, 3, 5, 6};",
            "Background Field = 7;",
        ] {
            assert!(text.contains(line), "{line} is not in\n{text}");
        }
    }

    #[test]
    fn spikes_and_gaps_have_balls() {
        let spike = Spike { centre: [0.5, -1.0, 2e-7], radius: 0.6, size: 0.15 };
        let gap = Ball { centre: [3.0, 0.0, 0.0], radius: 0.05, thickness: 0.4, size: 0.025 };
        let text = script_with(Algorithms { adapted: vec![], enlarged: 4.0 }, vec![], vec![gap], vec![spike]);
        for line in [
            "Field[1].XCenter = 3 * 4;",
            "Field[1].Thickness = 0.4 * 4;",
            "Field[1].VIn = (size < 0.025 ? size : 0.025) * 4;",
            "Field[2] = Ball;",
            "Field[2].Thickness = 0.6 * 4;",
            "Field[2].YCenter = -1 * 4;",
            "Field[2].ZCenter = 0.0000002 * 4;",
            "Field[2].Radius = 0.6 * 4;",
            "Field[2].VIn = (size < 0.15 ? size : 0.15) * 4;",
            "Background Field = 3;",
        ] {
            assert!(text.contains(line), "{line} is not in\n{text}");
        }
    }
}
