//! `remesh.geo`: a script that merges the atlas, sets sizes, and tells its reader what to change.

use super::ATLAS;

/// From about this many triangles on, the script asks for the faster algorithm.
const MANY: u32 = 20_000;

/// What the script asks for and tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Script {
    /// The edge length, in the unit of the input.
    pub size: f64,
    /// The area of the surface.
    pub area: f64,
    /// How many surfaces the atlas holds.
    pub surfaces: usize,
    /// How many curves.
    pub curves: usize,
}

/// The bytes of `remesh.geo`.
pub fn remesh(script: &Script) -> Vec<u8> {
    let Script { size, area, surfaces, curves } = script;
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
Merge \"{ATLAS}\";

// The edge length, in the unit of the input: change this number, or give -setnumber size H.
DefineConstant[ size = {{{size}, Name \"Edge length\"}} ];

// One size everywhere. For smaller elements where the surface bends, let Mesh.MeshSizeMin be smaller and uncomment
// the line with the number of elements per full turn.
Mesh.MeshSizeMin = size;
Mesh.MeshSizeMax = size;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
// Mesh.MeshSizeFromCurvature = 20;

// 6 (Frontal-Delaunay) makes the better triangles, 5 (Delaunay) is many times faster where there are many of them;
// 8 makes triangles fit to be recombined.
If(2.31 * {area} / size^2 < {MANY})
  Mesh.Algorithm = 6;
Else
  Mesh.Algorithm = 5;
EndIf
// One triangle that leans more than 90 degrees from the input's would make Gmsh begin again with a far slower one.
Mesh.AlgorithmSwitchOnFailure = 0;
// Mesh.RecombineAll = 1; // quadrangles
// Mesh.ElementOrder = 2; // curved elements
"
    )
    .into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_script_holds_the_size_in_full() {
        let text =
            String::from_utf8(remesh(&Script { size: 0.1 + 0.2, area: 4.5, surfaces: 2, curves: 1 })).expect("UTF-8");
        assert!(text.contains("size = {0.30000000000000004, Name"), "{text}");
        assert!(text.contains("Merge \"atlas.msh\";"));
    }
}
