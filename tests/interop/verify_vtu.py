"""verify_vtu.py [--break] RESULT...: opens surface.vtu, param.vtu, seams.vtp and atlas.vtm of each result with the
real VTK, and proves from surface.vtu alone that every curved parametric triangle is valid.

This is no translation of planish's own proof: the jacobian is expanded into the monomials of a polynomial in two
variables with rational coefficients, and its minimum over the closed triangle is found from stationary points.

--break moves one node of the first triangle before the proof: then it must fail.
"""
import os
import sys
import tempfile
from fractions import Fraction

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkFileOutputWindow, vtkOutputWindow
from vtkmodules.vtkIOXML import (
    vtkXMLMultiBlockDataReader, vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader)

POINT_FIELDS = {"uv": 2, "vertex": 1}
CELL_FIELDS = ["chart", "triangle", "det_min", "det_max", "jacobian_ratio", "conformal_distortion", "area_scale", "untangled"]
SEAM_FIELDS = ["curve", "open", "sides", "chart_a", "chart_b", "length"]
QUADRATIC_TRIANGLE, VERTEX, POLYLINE, LINE = 22, 1, 4, 3


def read(path, messages, reader=None):
    reader = reader or vtkXMLUnstructuredGridReader()
    reader.AddObserver("ErrorEvent", lambda *_: messages.append(f"{path}: error"))
    reader.AddObserver("WarningEvent", lambda *_: messages.append(f"{path}: warning"))
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def check_fields(path, grid):
    cells, points = grid.GetNumberOfCells(), grid.GetNumberOfPoints()
    assert cells > 0 and points > 0, f"{path} is empty"
    types = {grid.GetCellType(i) for i in range(cells)}
    assert types == {QUADRATIC_TRIANGLE}, f"{path}: cell types {types}"
    for name, components in POINT_FIELDS.items():
        array = grid.GetPointData().GetArray(name)
        assert array is not None, f"{path}: no point field {name}"
        assert (array.GetNumberOfComponents(), array.GetNumberOfTuples()) == (components, points), f"{path}: {name}"
    for name in CELL_FIELDS:
        array = grid.GetCellData().GetArray(name)
        assert array is not None, f"{path}: no cell field {name}"
        assert array.GetNumberOfTuples() == cells, f"{path}: {name}"
        assert numpy.isfinite(vtk_to_numpy(array)).all(), f"{path}: {name} is not finite"


def check_seams(folder, messages):
    """Every curve is a polyline of its length; corners are vertex cells that come first."""
    path = f"{folder}/seams.vtp"
    seams = read(path, messages, vtkXMLPolyDataReader())
    count = seams.GetNumberOfCells()
    fields = {name: seams.GetCellData().GetArray(name) for name in SEAM_FIELDS}
    assert all(f is not None and f.GetNumberOfTuples() == count for f in fields.values()), f"{path}: cell fields"
    vertex = seams.GetPointData().GetArray("vertex")
    assert vertex is not None and vertex.GetNumberOfTuples() == seams.GetNumberOfPoints(), f"{path}: vertex"
    fields = {name: vtk_to_numpy(f) for name, f in fields.items()}
    points = vtk_to_numpy(seams.GetPoints().GetData())
    for i in range(count):
        ids = seams.GetCell(i).GetPointIds()
        nodes = points[[ids.GetId(k) for k in range(ids.GetNumberOfIds())]]
        is_corner = fields["curve"][i] == -1
        assert seams.GetCellType(i) in ([VERTEX] if is_corner else [POLYLINE, LINE]), f"{path}: cell {i}"
        length = numpy.sqrt((numpy.diff(nodes, axis=0) ** 2).sum(1)).sum()
        assert abs(length - fields["length"][i]) <= 1e-9 * length, f"{path}: length of cell {i}"
        assert is_corner or (fields["sides"][i] == 1) == (fields["open"][i] == 1) == (fields["chart_b"][i] == -1)
    curves = fields["curve"][fields["curve"] >= 0]
    assert len(curves) > 0 and (curves == numpy.arange(len(curves))).all(), f"{path}: curves {curves}"


def check_atlas(folder, grids, messages):
    """atlas.vtm opens all of the files."""
    reader = vtkXMLMultiBlockDataReader()
    read(f"{folder}/atlas.vtm", messages, reader)
    atlas = reader.GetOutput()
    names = [atlas.GetMetaData(i).Get(atlas.NAME()) for i in range(atlas.GetNumberOfBlocks())]
    assert names == ["surface", "param", "seams"], f"{folder}/atlas.vtm: blocks {names}"
    for i, grid in enumerate(grids):
        assert atlas.GetBlock(i).GetNumberOfCells() == grid.GetNumberOfCells(), f"{folder}/atlas.vtm: {names[i]}"
    assert atlas.GetBlock(2).GetNumberOfCells() > 0


def jacobian(nodes):
    """The six coefficients (1, x, y, xx, xy, yy) of the jacobian over the reference triangle, exactly."""
    p = [(Fraction(u), Fraction(v)) for u, v in nodes]

    def monomials(k):
        # The map in monomials: values at (0,0), (1,0), (0,1) and at the middles (1/2,0), (1/2,1/2), (0,1/2).
        f0, f1, f2, f01, f12, f20 = (q[k] for q in p)
        x, xx = 4 * f01 - 3 * f0 - f1, 2 * f0 + 2 * f1 - 4 * f01
        y, yy = 4 * f20 - 3 * f0 - f2, 2 * f0 + 2 * f2 - 4 * f20
        xy = 4 * (f12 - (f0 + x / 2 + y / 2 + xx / 4 + yy / 4))
        return x, y, xx, xy, yy

    (ux, uy, uxx, uxy, uyy), (vx, vy, vxx, vxy, vyy) = monomials(0), monomials(1)
    # du/dx = ux + 2 uxx x + uxy y and so on; J = du/dx dv/dy - du/dy dv/dx.
    a, b = (ux, 2 * uxx, uxy), (vy, vxy, 2 * vyy)
    c, d = (uy, uxy, 2 * uyy), (vx, 2 * vxx, vxy)

    def product(s, t):
        return (s[0] * t[0], s[0] * t[1] + s[1] * t[0], s[0] * t[2] + s[2] * t[0],
                s[1] * t[1], s[1] * t[2] + s[2] * t[1], s[2] * t[2])

    return [l - r for l, r in zip(product(a, b), product(c, d))]


def least(j):
    """The exact minimum of 1, x, y, xx, xy, yy over the closed reference triangle."""
    def value(x, y):
        return j[0] + j[1] * x + j[2] * y + j[3] * x * x + j[4] * x * y + j[5] * y * y

    candidates = [value(0, 0), value(1, 0), value(0, 1)]
    # Edges y = 0, x = 0, x + y = 1, each as a + b t + c t^2.
    edges = [(j[1], j[3], lambda t: (t, 0)), (j[2], j[5], lambda t: (0, t)),
             (j[2] - j[1] - 2 * j[3] + j[4], j[3] - j[4] + j[5], lambda t: (1 - t, t))]
    for b, c, place in edges:
        if c != 0 and 0 < -b / (2 * c) < 1:
            candidates.append(value(*place(-b / (2 * c))))
    det = 4 * j[3] * j[5] - j[4] * j[4]
    if det != 0:
        x, y = (j[4] * j[2] - 2 * j[5] * j[1]) / det, (j[4] * j[1] - 2 * j[3] * j[2]) / det
        if x > 0 and y > 0 and x + y < 1:
            candidates.append(value(x, y))
    return min(candidates)


def surely_positive(nodes):
    """A quick test in doubles with a wide margin: all Bernstein coefficients are clearly positive."""
    p = nodes - nodes[:, :1]
    c = [2 * p[:, 3 + k] - (p[:, k] + p[:, (k + 1) % 3]) / 2 for k in range(3)]
    a = [c[0] - p[:, 0], p[:, 1] - c[0], c[1] - c[2]]
    b = [c[2] - p[:, 0], c[1] - c[0], p[:, 2] - c[2]]

    def cross(s, t):
        return s[:, 0] * t[:, 1] - s[:, 1] * t[:, 0]

    size = sum(numpy.abs(v).max(1) for v in a) * sum(numpy.abs(v).max(1) for v in b)
    pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]
    values = numpy.array([cross(a[i], b[k]) + cross(a[k], b[i]) for i, k in pairs]).min(0)
    # Differences of nodes are rounded relative to their own size only where nodes are close together.
    noise = 64 * numpy.finfo(float).eps * (size + numpy.abs(nodes).max((1, 2)) * numpy.sqrt(size))
    return values > noise


def verify(folder, broken):
    messages = []
    surface, param = (read(f"{folder}/{name}", messages) for name in ("surface.vtu", "param.vtu"))
    check_seams(folder, messages)
    check_atlas(folder, (surface, param), messages)
    assert not messages, messages
    for name, grid in (("surface.vtu", surface), ("param.vtu", param)):
        check_fields(f"{folder}/{name}", grid)
    cells = vtk_to_numpy(surface.GetCells().GetConnectivityArray()).reshape(-1, 6)
    uv = vtk_to_numpy(surface.GetPointData().GetArray("uv")).copy()
    same = vtk_to_numpy(param.GetCells().GetConnectivityArray()).reshape(-1, 6)
    assert (cells == same).all(), f"{folder}: cells differ"
    if broken:
        uv[cells[0, 3]] = uv[cells[0, 2]]
    nodes = uv[cells]
    doubtful = numpy.flatnonzero(~surely_positive(nodes))
    for i in doubtful:
        if least(jacobian(nodes[i].tolist())) <= 0:
            print(f"{folder}: invalid triangle {i}")
            return False
    print(f"ok {folder}: {len(cells)} valid triangles, {len(doubtful)} of them decided in rationals")
    return True


def main():
    arguments = sys.argv[1:]
    broken = "--break" in arguments
    folders = [a for a in arguments if a != "--break"]
    with tempfile.TemporaryDirectory() as scratch:
        said = os.path.join(scratch, "vtk.txt")
        window = vtkFileOutputWindow()
        window.SetFileName(said)
        vtkOutputWindow.SetInstance(window)
        good = all([verify(folder, broken) for folder in folders])
        # VTK makes the file with its first message.
        if os.path.exists(said):
            print("VTK says:", open(said, encoding="utf-8").read())
            good = False
    sys.exit(0 if good else 1)


main()
