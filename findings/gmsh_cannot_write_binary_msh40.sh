#!/usr/bin/env bash
# Packages: gmsh 4.15.2, meshio 5.3.5 (PyPI)
#
# Expected: MSH 4.0 has an ASCII and a binary form. Gmsh has Mesh.MshFileVersion,
#           which takes 4.0, and Mesh.Binary, "write mesh files in binary format
#           (if possible)". So 4.0 with Mesh.Binary = 1 gives a binary file, or an
#           ASCII one if binary is not possible, or a failure that leaves no file
#           and shows in the exit code; and an existing binary file can be read.
# Happens:  Gmsh cannot write that form and leaves a file of 0 bytes behind. The
#           API raises an exception; the command-line program prints an error
#           after which it reports "Done writing" and exits with 0. Nor can it
#           read one: a minimal file made here (two triangles), which meshio
#           reads, is refused, while its ASCII twin is read.
# Seen:     API writes 4.0 binary: exception "Can only write MSH 4.0 format in ASCII
#           mode", 0 bytes; program: exit code 0, 0 bytes, "Done writing";
#           API reads binary: exception "Can only read MSH 4.0 format in ASCII mode".
#
# Exits non-zero if the binary form is written or read, or if the ASCII one is not.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2 meshio==5.3.5
cd "$tmp"
PATH="$tmp/venv/bin:$PATH" python - <<'PY'
import os, struct, subprocess, sys
import gmsh, meshio

got = []
def report(what, result):
    got.append(result)
    print("%s: %s" % (what, result))

# 1. Writing, with the API.
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.mesh.generate(2)
gmsh.option.setNumber("Mesh.MshFileVersion", 4.0)
for binary, name in ((0, "ASCII"), (1, "binary")):
    gmsh.option.setNumber("Mesh.Binary", binary)
    try:
        gmsh.write("api.msh")
        result = "written"
    except Exception as e:
        result = "exception: %s" % e
    report("API writes 4.0 " + name, "%s, %s" % (result, "0 bytes" if not os.path.getsize("api.msh") else "not empty"))

# 2. Writing, with the command-line program.
with open("square.geo", "w") as f:
    f.write("Point(1) = {0, 0, 0};\nPoint(2) = {1, 0, 0};\nPoint(3) = {1, 1, 0};\nPoint(4) = {0, 1, 0};\n"
            "Line(1) = {1, 2};\nLine(2) = {2, 3};\nLine(3) = {3, 4};\nLine(4) = {4, 1};\n"
            "Curve Loop(1) = {1, 2, 3, 4};\nPlane Surface(1) = {1};\n"
            "Mesh.MshFileVersion = 4.0;\nMesh.Binary = 1;\n")
r = subprocess.run(["gmsh", "square.geo", "-2", "-o", "cli.msh"], text=True,
                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
report("program writes 4.0 binary", "exit code %d, %s, %s" % (
    r.returncode, "0 bytes" if not os.path.getsize("cli.msh") else "not empty",
    "says 'Done writing'" if "Done writing 'cli.msh'" in r.stdout else "does not say 'Done writing'"))

# 3. Reading: the same two triangles on one surface, as ASCII and as binary MSH 4.0.
points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
tris = [(1, 2, 3), (1, 3, 4)]
with open("ascii.msh", "w") as f:
    f.write("$MeshFormat\n4.0 0 8\n$EndMeshFormat\n$Entities\n0 0 1 0\n1 0 0 0 1 1 0 0 0\n$EndEntities\n$Nodes\n1 4\n1 2 0 4\n")
    for n, p in enumerate(points, 1):
        f.write("%d %g %g %g\n" % (n, *p))
    f.write("$EndNodes\n$Elements\n1 2\n1 2 2 2\n")
    for n, t in enumerate(tris, 1):
        f.write("%d %d %d %d\n" % (n, *t))
    f.write("$EndElements\n")
with open("binary.msh", "wb") as f:
    put = lambda fmt, *a: f.write(struct.pack("<" + fmt, *a))
    f.write(b"$MeshFormat\n4.0 1 8\n"); put("i", 1)
    f.write(b"\n$EndMeshFormat\n$Entities\n"); put("4Q", 0, 0, 1, 0); put("i6d2Q", 1, 0, 0, 0, 1, 1, 0, 0, 0)
    f.write(b"\n$EndEntities\n$Nodes\n"); put("2Q3iQ", 1, 4, 1, 2, 0, 4)
    for n, p in enumerate(points, 1):
        put("i3d", n, *p)
    f.write(b"\n$EndNodes\n$Elements\n"); put("2Q3iQ", 1, 2, 1, 2, 2, 2)
    for n, t in enumerate(tris, 1):
        put("4i", n, *t)
    f.write(b"\n$EndElements\n")
for name in ("ascii.msh", "binary.msh"):
    mesh = meshio.read(name)
    report("meshio reads " + name, "%d nodes, %d triangles" % (len(mesh.points), len(mesh.cells[0].data)))
    gmsh.clear()
    try:
        gmsh.open(name)
        result = "%d nodes, %d triangles" % (len(gmsh.model.mesh.getNodes()[0]), len(gmsh.model.mesh.getElementsByType(2)[0]))
    except Exception as e:
        result = "exception: %s" % e
    report("API reads " + name, result)
gmsh.finalize()

same = "4 nodes, 2 triangles"
ok = (got[0] == "written, not empty"
      and got[1].startswith("exception") and got[1].endswith("0 bytes")
      and got[2] == "exit code 0, 0 bytes, says 'Done writing'"
      and got[3:6] == [same, same, same] and got[6].startswith("exception"))
print("reproduced" if ok else "NOT reproduced")
sys.exit(not ok)
PY
