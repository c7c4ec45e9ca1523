#!/usr/bin/env bash
# Packages: meshio 5.3.5, gmsh 4.15.2 (PyPI)
#
# Expected: physical groups of Gmsh are optional, entity by entity. meshio, which gives the group of
#           each cell as cell_data "gmsh:physical", reads a file in which some entities are in a
#           group and some are not, with 0 or the like for the latter.
# Happens:  with MSH 4.1, Gmsh's default, meshio.read raises ValueError, as it keeps the numbers of
#           entities in groups only. Such a file is what Gmsh writes with Mesh.SaveAll = 1, which is
#           what one turns on to lose nothing. Where all saved entities are in groups, or none is,
#           the file is read.
# Seen:     all in groups (SaveAll = 0), 4.1: read
#           some in groups (SaveAll = 1), 4.1: ValueError: Incompatible cell data 'gmsh:physical'.
#           9 cell blocks, but 'gmsh:physical' has 1 blocks.
#           none in groups, 4.1: read
#
# Exits non-zero unless all three are as seen.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2 meshio==5.3.5
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import sys
import gmsh, meshio, numpy as np

def write(path, group, save_all):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    if group:
        gmsh.model.addPhysicalGroup(2, [1], 7, "plate")
    gmsh.model.mesh.generate(2)
    gmsh.option.setNumber("Mesh.SaveAll", save_all)
    gmsh.write(path)
    gmsh.finalize()

def read(what, *how):
    write("mesh.msh", *how)
    try:
        mesh = meshio.read("mesh.msh")
        groups = mesh.cell_data.get("gmsh:physical", [])
        result = "read, groups %s" % sorted({int(g) for block in groups for g in np.ravel(block)})
    except ValueError as e:
        result = "ValueError: %s" % e
    print("%s: %s" % (what, result))
    return result

ok = read("all in groups, 4.1", True, 0) == "read, groups [7]"
ok &= read("some in groups, 4.1", True, 1).startswith("ValueError: Incompatible cell data 'gmsh:physical'")
ok &= read("none in groups, 4.1", False, 1) == "read, groups []"
print("reproduced" if ok else "NOT reproduced")
sys.exit(not ok)
PY
