#!/usr/bin/env bash
# Packages: gmsh 4.15.2, meshio 5.3.5 (PyPI)
#
# Expected: an OFF file written by Gmsh has the keyword OFF on a line of its own
#           and the three counts on the next line, as OFF files mostly do, and
#           meshio, which lists both OFF and Gmsh among what it handles, reads it.
# Happens:  Gmsh puts the counts on the line of the keyword. meshio wants the
#           first line to be exactly OFF: its OFF reader raises ReadError, and
#           meshio.read() ends in SystemExit. The same file with a line break
#           after the keyword is read.
# Seen:     first line 'OFF 98 162 0';
#           ReadError: Expected the first line to be `OFF`.
#
# Exits non-zero if Gmsh writes something else or meshio reads the file.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2 meshio==5.3.5
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import sys
import gmsh, meshio

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
gmsh.model.occ.synchronize()
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.25)
gmsh.model.mesh.generate(2)
gmsh.write("square.off")
gmsh.finalize()

text = open("square.off").read()
first = text.splitlines()[0]
print("first line written by Gmsh: %r" % first)

def attempt(what, read, path):
    try:
        mesh = read(path)
        result = "%d points, %d triangles" % (len(mesh.points), len(mesh.cells[0].data))
    except (meshio.ReadError, SystemExit) as e:
        result = "%s: %s" % (type(e).__name__, e)
    print("%s: %s" % (what, result))
    return result

a = attempt("meshio OFF reader, file as written", meshio.off.read, "square.off")
b = attempt("meshio.read(), file as written", meshio.read, "square.off")
open("split.off", "w").write(text.replace("OFF ", "OFF\n", 1))
c = attempt("meshio.read(), line break after OFF", meshio.read, "split.off")

ok = (len(first.split()) == 4 and a.startswith("ReadError")
      and b.startswith("SystemExit") and "points" in c)
print("reproduced" if ok else "NOT reproduced")
sys.exit(not ok)
PY
