#!/usr/bin/env bash
# Packages: ngsolve and netgen-mesher 6.2.2608, gmsh 4.15.2 to make the file (PyPI)
#
# Expected: netgen.read_gmsh.ReadGmsh reads a surface mesh in space (MSH 2.2) as one, whatever the
#           order of its elements, or refuses it. The nodes have three coordinates.
# Happens:  the highest number of an element type decides about the dimension: triangles of 3 nodes
#           (type 2) make a mesh of the plane, and z is left out without a word. A cube has the area 2
#           then: top and bottom lie on each other, the walls have none. The same surface with
#           triangles of 6 nodes (type 9) makes a mesh of space, as numbers above 3 mean volumes.
#           With mesh.dim = 3, before it is handed to NGSolve, the former is right, too.
# Seen:     3 nodes: dimension 2, area 2.000000
#           3 nodes, dim = 3: dimension 3, area 6.000000
#           6 nodes: dimension 3, area 6.000000
#
# Exits non-zero unless all three are as seen.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check ngsolve==6.2.2608 netgen-mesher==6.2.2608 gmsh==4.15.2
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import sys
import gmsh
from netgen.read_gmsh import ReadGmsh
from ngsolve import BND, VOL, Integrate, Mesh

for order in (1, 2):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.ElementOrder", order)
    gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
    gmsh.model.mesh.generate(2)
    gmsh.model.addPhysicalGroup(2, [s for _, s in gmsh.model.getEntities(2)], 1, "side")
    gmsh.write("cube%d.msh" % order)
    gmsh.finalize()

def area(what, order, dimension=None):
    read = ReadGmsh("cube%d.msh" % order)
    if dimension:
        read.dim = dimension
    mesh = Mesh(read)
    found = Integrate(1, mesh, VOL if mesh.dim == 2 else BND)
    print("%s: dimension %d, area %.6f" % (what, mesh.dim, found))
    return mesh.dim, round(found, 6)

ok = area("3 nodes", 1) == (2, 2.0)
ok &= area("3 nodes, dim = 3", 1, 3) == (3, 6.0)
ok &= area("6 nodes", 2) == (3, 6.0)
print("reproduced" if ok else "NOT reproduced")
sys.exit(not ok)
PY
