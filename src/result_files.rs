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

/// The script that has Gmsh remesh through the maps.
pub const REMESH: &str = "remesh.geo";

/// What `planish check --mesh` found; written later than the result.
pub const MESH: &str = "mesh.json";

/// What the commands on a result did; written later than the result.
pub const HOOKS: &str = "hooks.json";

/// What planish writes beside the files that a report names as its outputs.
pub const BESIDE_OUTPUTS: [&str; 3] = [REPORT, MESH, HOOKS];

/// The blocks of [`ATLAS_VTM`], by their names in ParaView.
pub const ATLAS_BLOCKS: [(&str, &str); 3] = [("surface", SURFACE), ("param", PARAM), ("seams", SEAMS)];
