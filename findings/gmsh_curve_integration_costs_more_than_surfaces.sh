#!/usr/bin/env bash
# Package:  gmsh 4.15.2 (PyPI wheel, command-line program)
#
# Expected: meshing 840 straight curves with some dozen elements each takes a
#           moment, and an accuracy that nobody ever changes costs little.
# Happens:  the number of elements along a curve is evaluated to
#           Mesh.LcIntegrationPrecision, 1e-9 by default. Where the size comes
#           from fields with kinks (Threshold of a Distance, Min of several) that
#           is nearly all of the time; with 1e-5 the mesh has the same nodes in a
#           tenth of it. Likely cause: a quadrature by halving, which every kink
#           drives to its full depth, each evaluation a search in all fields.
# Seen:     3.9 s of CPU by default, 0.4 s with 1e-5 (ratio 10), 11,052 nodes both
#           times. In a script with 7 Distance fields on 1,960 curves of a
#           discrete model, the curves alone went from more than 170 s to 46 s.
#
# Exits non-zero if the default is less than 3 times as expensive, or if the
# numbers of nodes differ by more than 1 %.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2
cd "$tmp"
PATH="$tmp/venv/bin:$PATH" python - <<'PY'
import resource, subprocess, sys

N = 20                      # cells per side: 840 straight curves
lines = ['SetFactory("Built-in");']
node = lambda i, j: 1 + i + (N + 1) * j
for j in range(N + 1):
    for i in range(N + 1):
        lines.append(f"Point({node(i, j)}) = {{{i}, {j}, 0}};")
curves = []
for j in range(N + 1):
    for i in range(N + 1):
        for di, dj in ((1, 0), (0, 1)):
            if i + di <= N and j + dj <= N:
                curves.append(len(curves) + 1)
                lines.append(f"Line({curves[-1]}) = {{{node(i, j)}, {node(i + di, j + dj)}}};")
# Smaller elements around every seventh curve, and still smaller ones around every eleventh, and so on.
GROUPS = ((1, 7, 0.08), (3, 11, 0.06), (5, 13, 0.05), (7, 17, 0.04), (9, 19, 0.03))
for field, step, size in GROUPS:
    listed = ", ".join(map(str, curves[::step]))
    lines += [f"Field[{field}] = Distance;", f"Field[{field}].CurvesList = {{{listed}}};", f"Field[{field}].Sampling = 200;",
              f"Field[{field + 1}] = Threshold;", f"Field[{field + 1}].InField = {field};",
              f"Field[{field + 1}].SizeMin = {size};", f"Field[{field + 1}].SizeMax = 0.2;",
              f"Field[{field + 1}].DistMin = {size};", f"Field[{field + 1}].DistMax = 0.5;"]
lines += ["Field[99] = Min;", "Field[99].FieldsList = {2, 4, 6, 8, 10};", "Background Field = 99;",
          "Mesh.MeshSizeExtendFromBoundary = 0;", "Mesh.MeshSizeFromPoints = 0;"]

def mesh(extra):
    open("curves.geo", "w").write("\n".join(lines + extra) + "\n")
    cpu = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    before = cpu()
    subprocess.run([sys.executable, sys.prefix + "/bin/gmsh", "curves.geo", "-1", "-nt", "1", "-format", "msh2", "-o", "out.msh"],
                   check=True, stdout=subprocess.DEVNULL)
    text = open("out.msh").read().split("$Nodes\n")[1]
    return cpu() - before, int(text.split("\n", 1)[0])

slow, many = mesh([])
quick, same = mesh(["Mesh.LcIntegrationPrecision = 1e-5;"])
print(f"curves: {slow:.1f} s by default, {quick:.1f} s with 1e-5 (ratio {slow / quick:.0f}); {many} and {same} nodes")
sys.exit(not (slow > 3 * quick and abs(many - same) <= 0.01 * many))
PY
