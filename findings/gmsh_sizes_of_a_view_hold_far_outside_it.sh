#!/usr/bin/env bash
# Package:  gmsh 4.15.2 (PyPI wheel, Python interface)
#
# Expected: a size field read from a view (PostView) says something where the view has elements;
#           elsewhere the mesh has the size that holds everywhere (Mesh.MeshSizeMax).
# Happens:  everywhere else it says what the view has at its nearest node, however far that is: one
#           small triangle with fine sizes in a corner makes all of a domain fine. The option that
#           decides (UseClosest) is on unless it is switched off; with 0 the view holds for itself.
#           So a view of the few places that need small elements must also hold the places around
#           them, up to the coarsest size.
# Seen:     a square of side 10 with edges of 2, and a view of one triangle of side 0.5 with 0.1:
#           as it is:      23268 triangles
#           UseClosest 1:  23268 triangles
#           UseClosest 0:  135 triangles
#
# Exits non-zero unless the first two are alike and the third has less than a twentieth of that.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2
"$tmp/venv/bin/python" - <<'PY'
import gmsh

SIDE, COARSE, FINE = 10.0, 2.0, 0.1
# One triangle: its x, its y, its z, and the size at its corners.
TRIANGLE = [0, 0.5, 0, 0, 0, 0.5, 0, 0, 0] + 3 * [FINE]


def triangles(closest):
    gmsh.clear()
    geo, field = gmsh.model.geo, gmsh.model.mesh.field
    corners = [geo.addPoint(x, y, 0) for x, y in [(0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE)]]
    lines = [geo.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]
    geo.addPlaneSurface([geo.addCurveLoop(lines)])
    geo.synchronize()
    view = gmsh.view.add("sizes")
    gmsh.view.addListData(view, "ST", 1, TRIANGLE)
    number = field.add("PostView")
    field.setNumber(number, "ViewTag", view)
    if closest is not None:
        field.setNumber(number, "UseClosest", closest)
    field.setAsBackgroundMesh(number)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMax", COARSE)
    gmsh.model.mesh.generate(2)
    return len(gmsh.model.mesh.getElementsByType(2)[0])


gmsh.initialize(["", "-v", "0"])
found = {how: triangles(closest) for how, closest in [("as it is", None), ("UseClosest 1", 1), ("UseClosest 0", 0)]}
for how, count in found.items():
    print(f"{how + ':':14} {count} triangles")
assert found["as it is"] == found["UseClosest 1"] > 20 * found["UseClosest 0"]
PY
