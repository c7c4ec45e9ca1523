//! `remesh.geo`: a script that merges the atlas, sets sizes, and tells its reader what to change.

use crate::result_files::{ATLAS_MSH as ATLAS, ENLARGED_MSH as ENLARGED, FINER, SIZES, SIZES_OF_ARRAY as ARRAY};

/// What the script asks for where sizes vary.
///
/// Along curves Gmsh integrates the number of elements, by halving to 1e-9 of one by default; sizes that fields tell have kinks,
/// and each takes thousands of evaluations. The 1,960 curves of generic_twin_7081 take 8 s with 1e-3, 16 s with 1e-4, 37 s
/// with 1e-5, more than 170 s without; the nodes are 622,235, 622,231, 622,227 then.
///
/// With one pass of smoothing, which is the default, single elements stay flat: of face_bff one of 39,165, at gamma 0.07, comes and
/// goes with the last digits of sizes. With two its least gamma is 0.25, those of 22 files are never lower, and Gmsh takes a third
/// longer.
fn varying(is_told: bool, has_array: bool, heeds_finer: bool) -> String {
    let mut text = String::from("\ncount = 0;\nsizes() = {};\n");
    if is_told {
        text += "// Smaller elements in narrow places and spikes, and where they were asked for: a view tells sizes around the surface.\n";
        text += &view(&format!("\"{SIZES}\""), 1);
    }
    if has_array {
        text += "// And what the array of the input asks for between its points.\n";
        text += &view(&format!("\"{ARRAY}\""), 5);
        // Where it asks for nothing, the nearest value counts otherwise.
        text += "  Field[5].UseClosest = 0;\n";
    }
    if heeds_finer {
        text += "// And where planish check --deviation D --finer found earlier meshes too far from the surface.\n";
    }
    for (file, field) in FINER.iter().zip(2..).filter(|_| heeds_finer) {
        let path = format!("StrCat(CurrentDirectory, \"{file}\")");
        text += &format!("If(FileExists({path}))\n{}EndIf\n", view(&path, field));
    }
    text + "If(count > 0)
  Field[9] = Min;
  Field[9].FieldsList = {sizes()};
  Background Field = 9;
EndIf
// To a thousandth of an element along curves: with less, sizes that have kinks take many times as long.
Mesh.LcIntegrationPrecision = 1e-3;
// One pass more than by default: where sizes change, single elements stay flat otherwise.
Mesh.Smoothing = 2;
"
}

/// What reads a view as a field.
fn view(path: &str, field: u32) -> String {
    format!(
        "  Merge {path};
  View[PostProcessing.NbViews - 1].Visible = 0;
  Field[{field}] = PostView;
  Field[{field}].ViewIndex = PostProcessing.NbViews - 1;
  sizes() += {{{field}}};
  count = count + 1;
"
    )
}

/// From about this many triangles on, the script asks for the faster algorithm, which makes the worse triangles. Below
/// it, meshing took 0.5 to 1.9 seconds on the files of docs/side_by_side.md.
const MANY: u32 = 20_000;

/// What the script asks for and tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Script {
    /// The edge length, in the unit of the input.
    pub size: f64,
    /// The least edge length anywhere, in the unit of the input; none where sizes do not vary.
    pub least: Option<f64>,
    /// The area of the surface.
    pub area: f64,
    /// How many surfaces the atlas holds.
    pub surfaces: usize,
    /// How many curves.
    pub curves: usize,
    /// By which algorithms.
    pub algorithms: Algorithms,
    /// The order of the elements: 1 or 2.
    pub order: u8,
    /// Whether an array of the input asks for sizes.
    pub has_array: bool,
    /// Whether it heeds shorter edges that are asked for once meshes are looked at.
    pub heeds_finer: bool,
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
    let Script { size, least, area, surfaces, curves, algorithms, order, has_array, heeds_finer } = script;
    let factor = algorithms.enlarged;
    format!(
        "// Remesh this surface through its certified maps:
//
//     gmsh remesh.geo -2                        writes remesh.msh beside this file
//     gmsh remesh.geo -2 -o part.stl            another name, another format
//     gmsh remesh.geo -2 -setnumber size {size}
//     gmsh remesh.geo                           opens it; press 2 for the mesh
//
// {ATLAS} holds {surfaces} surface(s), one per chart, and {curves} curve(s). Charts that share a curve share its nodes.
// Its physical groups go into every file that Gmsh writes: one for each named part of the surface, or else one for each
// chart. What is in no group is not saved: the lines along seams (Mesh.SaveAll = 1 saves them, too).
// Do not call CreateGeometry or ClassifySurfaces: they would replace the certified maps by other ones.

SetFactory(\"Built-in\");
{merge}
// The edge length, in the unit of the input: change this number, or give -setnumber size H.
DefineConstant[ size = {{{size}, Name \"Edge length\"}} ];

// One size everywhere{but}. (For smaller elements where the surface bends, give planish --size-curvature; Mesh.MeshSizeFromCurvature
// would take the kinks of seams for curvature.)
Mesh.MeshSizeMin = {least}{times};
Mesh.MeshSizeMax = size{times};
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
{varying}
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

// In STL files a solid for each group, by its name.
Mesh.StlOneSolidPerSurface = 2;

{curved}",
        merge = merge(factor),
        curved = curved(*order),
        times = if factor == 1.0 { String::new() } else { format!(" * {factor}") },
        but = if least.is_none() && !heeds_finer { "" } else { ", but where a view tells a smaller one" },
        varying = if least.is_none() && !heeds_finer { String::new() } else { varying(least.is_some(), *has_array, *heeds_finer) },
        least = match least {
            _ if *heeds_finer => "0".to_owned(),
            Some(least) => format!("(size < {least} ? size : {least})"),
            None => "size".to_owned(),
        },
        adapted = adapted(&algorithms.adapted),
    )
    .into_bytes()
}

/// What asks for curved elements, or tells how.
fn curved(order: u8) -> &'static str {
    if order == 1 {
        return "// Curved elements: uncomment both, or give planish --mesh-order 2. Without the second, elements are inverted where the
// surface bends sharply.
// Mesh.ElementOrder = 2;
// Mesh.HighOrderOptimize = 1;
";
    }
    "// Curved elements, whose nodes in the middle of sides lie on the surface, too. The optimiser unfolds nearly all that
// are inverted where the surface bends sharply (4 in its place does nothing); planish check --mesh tells of others.
Mesh.ElementOrder = 2;
Mesh.HighOrderOptimize = 1;
"
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

/// The tags of entities that are counted from 0, in lines of twenty.
fn tags(entities: &[usize]) -> String {
    let lines = entities.chunks(20).map(|line| line.iter().map(|e| (e + 1).to_string()).collect::<Vec<_>>().join(", "));
    lines.collect::<Vec<_>>().join(",\n  ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn script(algorithms: Algorithms, least: Option<f64>) -> String {
        let script = Script {
            size: 0.1 + 0.2,
            least,
            area: 4.5,
            surfaces: 2,
            curves: 1,
            algorithms,
            order: 1,
            has_array: false,
            heeds_finer: false,
        };
        String::from_utf8(remesh(&script)).expect("UTF-8")
    }

    #[test]
    fn the_script_holds_the_size_in_full() {
        let text = script(Algorithms { adapted: vec![], enlarged: 1.0 }, None);
        assert!(text.contains("size = {0.30000000000000004, Name"), "{text}");
        assert!(text.contains("Merge \"atlas.msh\";") && text.contains("MeshSizeMin = size;"), "{text}");
        assert!(!text.contains("MeshAlgorithm") && !text.contains("ScalingFactor"), "{text}");
        assert!(!text.contains(SIZES) && !text.contains("PostView"), "{text}");
    }

    #[test]
    fn surfaces_are_counted_from_one_and_lengths_are_enlarged_alike() {
        let text = script(Algorithms { adapted: (0..22).collect(), enlarged: 1024.0 }, Some(0.01));
        assert!(text.contains("MeshAlgorithm Surface {1, 2,") && text.contains(", 20,\n  21, 22} = 1;"), "{text}");
        assert!(text.contains("Merge \"atlas-enlarged.msh\";\nMesh.ScalingFactor = 1 / 1024;"), "{text}");
        assert!(text.contains("MeshSizeMax = size * 1024;"), "{text}");
        assert!(text.contains("MeshSizeMin = (size < 0.01 ? size : 0.01) * 1024;"), "{text}");
        // What is merged last is the last view.
        let [atlas, sizes] = ["Merge \"atlas-enlarged.msh\"", "Merge \"sizes.pos\""].map(|line| text.find(line));
        assert!(atlas.is_some() && atlas < sizes && text.contains("Field[1] = PostView;"), "{text}");
        assert!(!text.contains("finer"), "{text}");
    }
}
