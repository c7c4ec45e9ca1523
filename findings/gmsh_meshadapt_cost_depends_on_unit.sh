#!/usr/bin/env bash
# Package:  gmsh 4.15.2 (PyPI wheel, command-line program)
#
# Expected: meshing a surface costs the same whatever the length unit is. A
#           patch of side 1024 meshed at size 1024/40 and the same patch of side
#           1/16 meshed at size (1/16)/40 are the same problem.
# Happens:  with MeshAdapt (Mesh.Algorithm = 1) on a discrete surface that has a
#           parametrization, the small-unit run takes tens of times more CPU for
#           nearly the same mesh. Likely cause, from reading Gmsh's source (not
#           profiled): discreteFace::closestPoint(point, guess) tests the triangles
#           inside a box that starts at +-0.1 in model units, whatever the unit
#           is; on the small patch that box holds the whole surface.
#           Frontal-Delaunay (Mesh.Algorithm = 6) shows no such difference.
# Seen:     algorithm 1: 0.5 s (side 1024) against 16 s (side 1/16), ratio 33;
#           algorithm 6: 0.15 s against 0.15 s, ratio 1.0.
#
# Exits non-zero if the MeshAdapt ratio is below 3 or the Frontal-Delaunay ratio
# is above 2, or if the numbers of triangles differ by more than 10 %.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2
cd "$tmp"
PATH="$tmp/venv/bin:$PATH" python - <<'PY'
import math, resource, subprocess, sys

N = 60          # grid cells per side
DIV = 40        # mesh size = side / DIV

def write_patch(path, side):
    """A bumpy square patch with uv = (x, y) / side, and its four border curves."""
    def xyz(i, j):
        x, y = i / N, j / N
        return side * x, side * y, side * 0.05 * math.sin(9 * x) * math.cos(7 * y)
    r = range(N + 1)
    curves = [[(i, 0) for i in r], [(N, j) for j in r],
              [(N - i, N) for i in r], [(0, N - j) for j in r]]
    box = (0, 0, -side, side, side, side)
    out = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Entities", "4 4 1 0"]
    put = lambda *a: out.append(" ".join(map(str, a)))
    for k in range(4):
        put(k + 1, *xyz(*curves[k][0]), 0)
    for k in range(4):
        put(k + 1, *box, 0, 2, k + 1, -((k + 1) % 4 + 1))
    put(1, *box, 0, 4, 1, 2, 3, 4)
    out += ["$EndEntities", "$Parametrizations", "4 1"]
    for k, nodes in enumerate(curves):
        put(k + 1, len(nodes))
        for t, ij in enumerate(nodes):
            put(*xyz(*ij), t)
    put(1, (N + 1) ** 2, 2 * N * N)
    for j in r:
        for i in r:
            put(*xyz(i, j), i / N, j / N, *[0] * 6)
    for j in range(N):
        for i in range(N):
            a = j * (N + 1) + i
            put(a, a + 1, a + N + 2)
            put(a, a + N + 2, a + N + 1)
    out.append("$EndParametrizations")
    open(path, "w").write("\n".join(out) + "\n")

def mesh(side, algorithm):
    write_patch("patch.msh", side)
    with open("run.geo", "w") as f:
        f.write('Merge "patch.msh";\nMesh.Algorithm = %d;\n' % algorithm)
        f.write("Mesh.MeshSizeMin = %r;\nMesh.MeshSizeMax = %r;\n" % (side / DIV, side / DIV))
    cpu = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    before = cpu()
    subprocess.run(["gmsh", "run.geo", "-2", "-nt", "1", "-format", "msh2", "-o", "out.msh"],
                   check=True, stdout=subprocess.DEVNULL)
    used = cpu() - before
    rows = (line.split() for line in open("out.msh"))
    tris = sum(1 for p in rows if len(p) == 8 and p[1] == "2")
    print("algorithm %d  side %8g  triangles %5d  CPU %6.2f s" % (algorithm, side, tris, used), flush=True)
    return used, tris

ok = True
for algorithm, name in ((1, "MeshAdapt"), (6, "Frontal-Delaunay")):
    (big, nbig), (small, nsmall) = mesh(1024.0, algorithm), mesh(0.0625, algorithm)
    ratio = small / big
    print("%s: CPU small unit / large unit = %.1f" % (name, ratio))
    ok &= abs(nsmall / nbig - 1) < 0.1
    ok &= ratio >= 3 if algorithm == 1 else ratio <= 2
print("reproduced" if ok else "NOT reproduced")
sys.exit(not ok)
PY
