#!/usr/bin/env bash
# Packages: meshio 5.3.5, numpy 2.4.6; vtk 9.7.2 to show that the file is valid (PyPI)
#
# Expected: the connectivity of cells is read as integers, whatever integer type a VTU file stores
#           it in: VTK names UInt64 among the types of a DataArray, and reads such a file.
# Happens:  meshio gives float64 for UInt64, without a word, so that the usual
#           mesh.points[mesh.cells[0].data] raises IndexError. Int64, Int32 and UInt32 stay integers.
#           Likely cause, from reading its source: the number of points of the pieces before, an
#           int64, is added, and numpy's common type of uint64 and int64 is float64. From 2^53 on,
#           nodes would be wrong ones.
# Seen:     Int32 int64; Int64 int64; UInt32 int64; UInt64 float64, IndexError: arrays used as indices
#           must be of integer (or boolean) type; VTK: nodes [0, 1, 2] for all
#
# Exits non-zero unless UInt64 alone becomes float64 and VTK reads all four.
set -euo pipefail
tmp=$(mktemp -d); trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install -q --disable-pip-version-check meshio==5.3.5 numpy==2.4.6 vtk==9.7.2
cd "$tmp"
"$tmp/venv/bin/python" - <<'PY'
import sys
import meshio, vtk

FILE = """<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<UnstructuredGrid><Piece NumberOfPoints="3" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0</DataArray></Points>
<Cells><DataArray type="%s" Name="connectivity" format="ascii">0 1 2</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>
"""
ok = True
for kind in ("Int32", "Int64", "UInt32", "UInt64"):
    open("one.vtu", "w").write(FILE % kind)
    cells = meshio.read("one.vtu").cells[0].data
    try:
        meshio.read("one.vtu").points[cells]
        usable = "usable"
    except IndexError as e:
        usable = "IndexError: %s" % e
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName("one.vtu")
    reader.Update()
    cell = reader.GetOutput().GetCell(0)
    nodes = [cell.GetPointId(i) for i in range(cell.GetNumberOfPoints())]
    print("%s: meshio %s, %s; VTK: nodes %s" % (kind, cells.dtype, usable, nodes))
    ok &= nodes == [0, 1, 2]
    ok &= (str(cells.dtype), usable[:10]) == (("float64", "IndexError") if kind == "UInt64" else ("int64", "usable"))
print("reproduced" if ok else "NOT reproduced")
sys.exit(not ok)
PY
