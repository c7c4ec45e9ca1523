#!/usr/bin/env bash
# Package:  gmsh 4.15.2 (PyPI wheel, command-line program)
#
# Expected: Mesh.AlgorithmSwitchOnFailure = 0 says not to fall back to MeshAdapt.
#           When Frontal-Delaunay (Mesh.Algorithm = 6) cannot mesh a surface,
#           it should then say so: an error, a warning or a non-zero exit code.
# Happens:  the surface is a thimble (cylinder wall of radius 1 and height 8 with
#           a conical cap), given with a one-to-one map to the unit disk that is
#           linear on long thin facets. With the option at 0, Gmsh exits with 0,
#           prints no warning or error, and the mesh is a low closed cap over the
#           rim: three quarters of the surface, and the whole upper part, are
#           missing. That points could not be inserted is said at debug level
#           only. With the option at 1 (the default) Gmsh notices, meshes again
#           with MeshAdapt, and the area is right.
# Seen:     switch 0: exit code 0, nothing logged,  138 triangles, area 0.258, top 1.77 of 9
#           switch 1: exit code 0, nothing logged, 1008 triangles, area 0.990, top 8.88 of 9
#
# Exits non-zero unless: exit codes 0, no Warning/Error lines, area below 0.8 of
# the surface's with the option at 0 and above 0.95 with the option at 1.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2
cd "$tmp"
PATH="$tmp/venv/bin:$PATH" python - <<'PY'
import math, subprocess, sys

F, HEIGHT, R_IN, SIZE = 48, 8, 0.1, 0.5    # facets, wall height, uv radius of the upper ring

def area(a, b, c):
    u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]
    return 0.5 * math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])

# Nodes: lower ring (the rim), upper ring, tip. uv: rings of radius 1 and R_IN, centre.
xyz, uv = [], []
for z, r in ((0, 1), (HEIGHT, R_IN)):
    for i in range(F):
        c, s = math.cos(2 * math.pi * i / F), math.sin(2 * math.pi * i / F)
        xyz.append((c, s, z))
        uv.append((r * c, r * s))
xyz.append((0, 0, HEIGHT + 1))
uv.append((0, 0))
tris = []
for i in range(F):
    k = (i + 1) % F
    tris += [(i, k, F + k), (i, F + k, F + i), (F + i, F + k, 2 * F)]

# One-to-one: all triangles have the same orientation in uv and fill the F-gon once.
signed = [0.5 * ((uv[b][0] - uv[a][0]) * (uv[c][1] - uv[a][1]) -
                 (uv[c][0] - uv[a][0]) * (uv[b][1] - uv[a][1])) for a, b, c in tris]
assert min(signed) > 0 and abs(sum(signed) - F / 2 * math.sin(2 * math.pi / F)) < 1e-9

curves = [[(k * F // 4 + i) % F for i in range(F // 4 + 1)] for k in range(4)]
box = (-1, -1, 0, 1, 1, HEIGHT + 1)
out = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Entities", "4 4 1 0"]
put = lambda *a: out.append(" ".join(map(str, a)))
for k in range(4):
    put(k + 1, *xyz[curves[k][0]], 0)
for k in range(4):
    put(k + 1, *box, 0, 2, k + 1, -((k + 1) % 4 + 1))
put(1, *box, 0, 4, 1, 2, 3, 4)
out += ["$EndEntities", "$Parametrizations", "4 1"]
for k, nodes in enumerate(curves):
    put(k + 1, len(nodes))
    for t, n in enumerate(nodes):
        put(*xyz[n], t)
put(1, len(xyz), len(tris))
for p, q in zip(xyz, uv):
    put(*p, *q, *[0] * 6)
for t in tris:
    put(*t)
out.append("$EndParametrizations")
open("thimble.msh", "w").write("\n".join(out) + "\n")
exact = sum(area(*(xyz[n] for n in t)) for t in tris)

def mesh(switch):
    with open("run.geo", "w") as f:
        f.write('Merge "thimble.msh";\nMesh.Algorithm = 6;\nMesh.AlgorithmSwitchOnFailure = %d;\n' % switch)
        f.write("Mesh.MeshSizeMin = %r;\nMesh.MeshSizeMax = %r;\n" % (SIZE, SIZE))
    r = subprocess.run(["gmsh", "run.geo", "-2", "-nt", "1", "-format", "msh2", "-o", "out.msh"],
                       stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    complaints = [s for s in r.stdout.splitlines() if "Warning" in s or "Error" in s]
    nodes, faces = {}, []
    for p in map(str.split, open("out.msh")):
        if len(p) == 4:
            nodes[p[0]] = tuple(map(float, p[1:]))
        elif len(p) == 8 and p[1] == "2":
            faces.append(p[5:])
    ratio = sum(area(*(nodes[n] for n in t)) for t in faces) / exact
    print("switch %d: exit code %d, %d warning/error lines, %4d triangles, area / exact %.3f, top of mesh %.2f of %d"
          % (switch, r.returncode, len(complaints), len(faces), ratio, max(p[2] for p in nodes.values()), HEIGHT + 1))
    return ratio, r.returncode == 0 and not complaints

(off, quiet_off), (on, quiet_on) = mesh(0), mesh(1)
ok = quiet_off and quiet_on and off < 0.8 and on > 0.95
print("reproduced" if ok else "NOT reproduced")
sys.exit(not ok)
PY
