//! The names of the files in a result folder: the one list. Scripts rely on them.

/// What was found, done and proven.
pub const REPORT: &str = "report.json";

/// The surface as 6-node triangles, for ParaView.
pub const SURFACE: &str = "surface.vtu";

/// The same cells in the parametric plane.
pub const PARAM: &str = "param.vtu";

/// The curves between charts, and the open boundary.
pub const SEAMS: &str = "seams.vtp";

/// Opens the three above in ParaView in one go.
pub const ATLAS_VTM: &str = "atlas.vtm";

/// The charts for Gmsh: boundary representation and maps.
pub const ATLAS_MSH: &str = "atlas.msh";

/// The same in a larger unit, where Gmsh needs that.
pub const ENLARGED_MSH: &str = "atlas-enlarged.msh";

/// Sizes around the surface, where they vary, which [`REMESH`] reads; in the unit of the file that it merges.
pub const SIZES: &str = "sizes.pos";

/// What an array of the input asks for on the triangles of the surface, likewise: where `--size-from` names one.
pub const SIZES_OF_ARRAY: &str = "sizes-array.pos";

/// The script that has Gmsh remesh through the maps.
pub const REMESH: &str = "remesh.geo";

/// The surface with texture coordinates, as OBJ: where `--also obj` asks for it.
pub const SURFACE_OBJ: &str = "surface.obj";

/// The same as binary glTF: where `--also glb` asks for it.
pub const SURFACE_GLB: &str = "surface.glb";

/// The surface with one node where charts meet: where `--also welded` asks for it.
pub const WELDED: &str = "welded.vtu";

/// The surface for mmgs, with its sizes: where `--hand-off mmg` asks for it.
pub const MMG_SURFACE: &str = "mmg/surface.mesh";

/// See [`MMG_SURFACE`].
pub const MMG_SURFACE_SIZES: &str = "mmg/surface.sol";

/// The plane of a chart for mmg2d, and its metric.
pub fn mmg_chart(chart: usize) -> [String; 2] {
    [format!("mmg/chart-{chart:03}.mesh"), format!("mmg/chart-{chart:03}.sol")]
}

/// What `planish check --mesh` found; written later than the result.
pub const MESH: &str = "mesh.json";

/// Smaller sizes where `planish check --finer` found a mesh too far from the surface, time after time; written later than the
/// result, and read by [`REMESH`].
pub const FINER: [&str; 3] = ["finer-1.pos", "finer-2.pos", "finer-3.pos"];

/// What the commands on a result did; written later than the result.
pub const HOOKS: &str = "hooks.json";

/// What planish writes beside the files that a report names as its outputs.
pub const BESIDE_OUTPUTS: [&str; 6] = [REPORT, MESH, HOOKS, FINER[0], FINER[1], FINER[2]];

/// The cells of [`SURFACE`] with one label, by the name of its group: what [`ATLAS_VTM`] shows where there are labels.
pub fn surface_of(group: &str) -> String {
    format!("surface-{group}.vtu")
}
