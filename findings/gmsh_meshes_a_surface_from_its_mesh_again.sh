#!/usr/bin/env bash
# Package:  gmsh 4.15.2 (PyPI wheel, Python interface)
#
# Expected: a file that holds a finished surface mesh, merged to fill the surface with tetrahedra,
#           keeps its triangles: Gmsh does not mesh discrete surfaces, unless createGeometry or a
#           parametrization tells it how. What format the mesh was written in should not matter.
# Happens:  a mesh that was made through parametrizations (classifySurfaces, createGeometry: the
#           usual way to remesh an STL) carries them into the MSH 4.1 file. Who merges it, adds a
#           volume and calls generate(3) gets the surface meshed anew, at whatever size is the default
#           now, without a word; Mesh.MeshOnlyEmpty = 1 ("mesh only entities that have no existing
#           mesh") does not keep it. Through MSH 2.2 all triangles stay.
# Seen:     remeshed sphere: 984 triangles; triangles around the tetrahedra:
#           4.1: 356; 4.1, MeshOnlyEmpty: 356; 2.2: 984
#
# Exits non-zero unless 2.2 keeps all triangles and 4.1 less than half, both times.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check gmsh==4.15.2
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import math, sys
import gmsh

def begin():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)

def triangles():
    return len(gmsh.model.mesh.getElementsByType(2)[0])

# A sphere as STL.
begin()
gmsh.model.occ.addSphere(0, 0, 0, 1)
gmsh.model.occ.synchronize()
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.1)
gmsh.model.mesh.generate(2)
gmsh.write("sphere.stl")
gmsh.finalize()

# Remeshed, as in Gmsh's tutorial t13.
begin()
gmsh.merge("sphere.stl")
gmsh.model.mesh.classifySurfaces(math.pi, True, True, math.pi)
gmsh.model.mesh.createGeometry()
gmsh.option.setNumber("Mesh.MeshSizeMin", 0.2)
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.2)
gmsh.model.mesh.generate(2)
made = triangles()
gmsh.model.addPhysicalGroup(2, [s for _, s in gmsh.model.getEntities(2)], 1, "surface")
for version in (2.2, 4.1):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.write("%s.msh" % version)
gmsh.finalize()
print("remeshed sphere: %d triangles" % made)

def filled(version, only_empty):
    begin()
    gmsh.merge("%s.msh" % version)
    gmsh.option.setNumber("Mesh.MeshOnlyEmpty", only_empty)
    loop = gmsh.model.geo.addSurfaceLoop([s for _, s in gmsh.model.getEntities(2)])
    gmsh.model.geo.addVolume([loop])
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(3)
    found, tetrahedra = triangles(), len(gmsh.model.mesh.getElementsByType(4)[0])
    gmsh.finalize()
    print("%s, MeshOnlyEmpty = %d: %d triangles around %d tetrahedra" % (version, only_empty, found, tetrahedra))
    return found

ok = filled(4.1, 0) < made / 2
ok &= filled(4.1, 1) < made / 2
ok &= filled(2.2, 0) == made
print("reproduced" if ok else "NOT reproduced")
sys.exit(not ok)
PY
