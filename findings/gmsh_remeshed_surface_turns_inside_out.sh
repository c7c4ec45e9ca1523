#!/usr/bin/env bash
# Package:  gmsh 4.15.2 (PyPI wheel, Python interface)
#
# Expected: remeshing a discrete surface through a one-to-one parametrization
#           ($Parametrizations of MSH 4.1) keeps its orientation: the map to the plane has
#           one, and a finer or coarser mesh of it does not change that.
# Happens:  the mesh size decides. A sheet of five strips with one shallow fold is given
#           with its unrolling, an isometry. At most sizes the mesh runs counterclockwise
#           seen from above, as the sheet does but for the strip in the fold; at some it
#           comes out clockwise as a whole: every triangle is turned, not only those that
#           bridge the fold. All meshes are consistent in themselves and have the right
#           area. What is warned of ("elements remain invalid", which bridge the fold) is
#           the same where the mesh is turned and where it is not. So one part of a closed
#           surface can come out inside out between its neighbours.
# Seen:     input: signed area seen from above  8.00
#           size 0.3: 396 triangles, signed area  8.00
#           size 0.4: 242 triangles, signed area -8.00
#           size 0.5: 170 triangles, signed area  8.00, and so at 0.6 to 1.0
#           no directed edge is used twice at any size
#
# Exits non-zero unless: some areas are positive and some negative; no directed edge is
# used twice; no other warning is given.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import math, sys
from collections import Counter
import gmsh

ROWS, WIDTH, SIZES = 6, 2.0, [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]
# x and z along the sheet: it runs back over itself from 2 to 1.2, and rises by 0.2 there.
PROFILE = [(0, 0), (1, 0), (2, 0), (1.2, 0.2), (3, 0.2), (4, 0.2)]
points = [(x, WIDTH * j / ROWS, z) for j in range(ROWS + 1) for x, z in PROFILE]
m = len(PROFILE)
triangles = []
for j in range(ROWS):
    for i in range(m - 1):
        a = j * m + i
        triangles += [(a, a + 1, a + m + 1), (a, a + m + 1, a + m)]

def above(x, faces):
    return sum((x[b][0] - x[a][0]) * (x[c][1] - x[a][1]) - (x[b][1] - x[a][1]) * (x[c][0] - x[a][0])
               for a, b, c in faces) / 2

print("input: signed area seen from above %5.2f" % above(points, triangles))
# The unrolled sheet: x is the length along the profile. All triangles turn left there.
along = [0.0]
for (x0, z0), (x1, z1) in zip(PROFILE, PROFILE[1:]):
    along.append(along[-1] + math.hypot(x1 - x0, z1 - z0))
uv = [(along[k % m], p[1]) for k, p in enumerate(points)]
assert all(above(uv, [t]) > 0 for t in triangles)

front, back = list(range(m)), [ROWS * m + i for i in reversed(range(m))]
right, left = [j * m + m - 1 for j in range(ROWS + 1)], [j * m for j in reversed(range(ROWS + 1))]
curves = [front, right, back, left]
out = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Entities", "4 4 1 0"]
put = lambda *a: out.append(" ".join(map(str, a)))
box = (0, 0, 0, 4, WIDTH, 0.2)
for k in range(4):
    put(k + 1, *points[curves[k][0]], 0)
for k in range(4):
    put(k + 1, *box, 0, 2, k + 1, -((k + 1) % 4 + 1))
put(1, *box, 0, 4, 1, 2, 3, 4)
out += ["$EndEntities", "$Parametrizations", "4 1"]
for k, nodes in enumerate(curves):
    put(k + 1, len(nodes))
    for t, n in enumerate(nodes):
        put(*points[n], t)
put(1, len(points), len(triangles))
for p, q in zip(points, uv):
    put(*p, *q, *[0] * 6)
for t in triangles:
    put(*t)
out.append("$EndParametrizations")
with open("sheet.msh", "w") as f:
    f.write("\n".join(out) + "\n")

signs, fine = [], True
for size in SIZES:
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.logger.start()
    gmsh.merge("sheet.msh")
    gmsh.option.setNumber("Mesh.MeshSizeMin", size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.option.setNumber("Mesh.Algorithm", 6)
    gmsh.model.mesh.generate(2)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    x = {int(t): tuple(xyz[3 * k:3 * k + 3]) for k, t in enumerate(tags)}
    nodes = [int(n) for n in gmsh.model.mesh.getElementsByType(2)[1]]
    faces = [tuple(nodes[k:k + 3]) for k in range(0, len(nodes), 3)]
    edges = Counter(e for a, b, c in faces for e in ((a, b), (b, c), (c, a)))
    twice = sum(n > 1 for n in edges.values())
    log = gmsh.logger.get()
    said = {line.split(": ")[1].strip("0123456789 ") for line in log if line.startswith(("Warning", "Error"))}
    gmsh.logger.stop()
    area = above(x, faces)
    print("size %.1f: %3d triangles, signed area %5.2f, directed edges used twice %d, warnings: %s"
          % (size, len(faces), area, twice, "; ".join(said) or "none"))
    signs.append(area > 0)
    fine = fine and twice == 0 and said <= {"elements remain invalid in surface"}
    gmsh.finalize()
sys.exit(not (fine and True in signs and False in signs))
PY
