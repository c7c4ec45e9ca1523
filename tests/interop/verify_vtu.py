"""verify_vtu.py [--break] RESULT...: opens surface.vtu, param.vtu, seams.vtp and atlas.vtm of each result with the
real VTK, and proves from surface.vtu that every curved parametric triangle is valid, and that the boundary of every
chart is that of a disk with holes: then its map is one-to-one.

This is no translation of planish's own proof: the jacobian is expanded into the monomials of a polynomial in two
variables with rational coefficients, and its minimum over the closed triangle is found from stationary points.

Boundaries of chords are proven to be simple polygons, all pairs of sides compared, one of them turning left. Those with
arcs are proven to turn about a point, by the angle under which it sees them: the origin, and for holes the centres in
report.json.

--break moves one node of the first triangle before the proof: then it must fail.
"""
import json
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


def boundary_loops(cells):
    """Closed loops of (vertex, middle) of the edges that one cell has."""
    sides = {}
    for cell in cells.tolist():
        for k in range(3):
            sides[cell[k], cell[(k + 1) % 3]] = cell[3 + k]
    after = {a: (mid, b) for (a, b), mid in sides.items() if (b, a) not in sides}
    loops = []
    while after:
        start = node = min(after)
        loop = []
        while node in after:
            mid, end = after.pop(node)
            loop.append((node, mid))
            node = end
        assert node == start, "a loop of the boundary does not close"
        loops.append(loop)
    return loops


def exact(point):
    return Fraction(float(point[0])), Fraction(float(point[1]))


def turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def segments_meet(a, b, c, d):
    """Whether two closed segments have a point in common, their boxes overlapping."""
    of_cd, of_ab = (turn(a, b, c), turn(a, b, d)), (turn(c, d, a), turn(c, d, b))
    return not any(x * y > 0 for x, y in (of_cd, of_ab))


def polygons_are_simple(polygons):
    """No two sides of closed polygons meet but neighbours, at their corner."""
    starts = numpy.concatenate(polygons)
    follows, base = [], 0
    for polygon in polygons:
        follows += [base + (i + 1) % len(polygon) for i in range(len(polygon))]
        base += len(polygon)
    ends = starts[follows]
    low, high = numpy.minimum(starts, ends), numpy.maximum(starts, ends)
    for i in range(len(starts) - 1):
        overlap = ((low[i + 1:] <= high[i]) & (low[i] <= high[i + 1:])).all(1)
        for j in i + 1 + numpy.flatnonzero(overlap):
            a, b, c, d = (exact(p) for p in (starts[i], ends[i], starts[j], ends[j]))
            if follows[i] == j or follows[j] == i:
                # Neighbours meet elsewhere only where one runs back along the other.
                corner, p, q = (b, a, d) if follows[i] == j else (a, b, c)
                along = (p[0] - corner[0]) * (q[0] - corner[0]) + (p[1] - corner[1]) * (q[1] - corner[1])
                if turn(corner, p, q) == 0 and along > 0:
                    return False
            elif segments_meet(a, b, c, d):
                return False
    return True


def turns_about(arcs, centre, sign):
    """Whether the angle under which a point is seen only grows (or falls) along quadratic arcs, by one turn in all."""
    crossings = 0
    for p, m, q in arcs:
        p, m, q = (tuple(v[k] - centre[k] for k in range(2)) for v in (p, m, q))
        c = tuple(2 * m[k] - (p[k] + q[k]) / 2 for k in range(2))
        cross = lambda s, t: s[0] * t[1] - s[1] * t[0]
        # x(t) x x'(t) / 2 has the Bernstein coefficients p x c, (p x q) / 2, c x q.
        if min(sign * cross(p, c), sign * cross(p, q), sign * cross(c, q)) <= 0:
            return False
        crossings += (p[1] < 0) != (q[1] < 0)
    return crossings == 2


def boundary_is_proven(cells, uv, centres):
    loops = boundary_loops(cells)
    arcs = [[tuple(exact(uv[n]) for n in (v, mid, loop[(i + 1) % len(loop)][0])) for i, (v, mid) in enumerate(loop)]
            for loop in loops]
    if all(m[k] * 2 == p[k] + q[k] for loop in arcs for p, m, q in loop for k in range(2)):
        polygons = [numpy.array([uv[v] for v, _ in loop]) for loop in loops]
        areas = [sum(p[0] * q[1] - p[1] * q[0] for p, _, q in loop) for loop in arcs]
        return sum(area > 0 for area in areas) == 1 and polygons_are_simple(polygons)
    origin = (Fraction(0), Fraction(0))
    outer = [loop for loop in arcs if turns_about(loop, origin, 1)]
    holes = [loop for loop in arcs if not any(loop is o for o in outer)]
    return len(outer) == 1 and all(any(turns_about(loop, exact(c), -1) for c in centres) for loop in holes)


def check_the_checks():
    """What would prove anything proves nothing."""
    square = numpy.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    inside, across = 0.25 + 0.5 * square[::-1], 0.5 + 0.75 * square[::-1]
    assert polygons_are_simple([square, inside]) and not polygons_are_simple([square, across])
    assert not polygons_are_simple([square[[0, 2, 1, 3]]]), "a bow tie"
    assert not polygons_are_simple([square, square[::-1] - [1.0, 0.0]]), "a side in common"


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
    charts = vtk_to_numpy(surface.GetCellData().GetArray("chart"))
    with open(f"{folder}/report.json", encoding="utf-8") as report:
        report = json.load(report)
    for chart in report["charts"]:
        centres = chart["certificate"]["hole_centres"]
        if not boundary_is_proven(cells[charts == chart["id"]], uv, centres):
            print(f"{folder}: the boundary of chart {chart['id']} is not that of a disk with holes")
            return False
    print(f"ok {folder}: {len(cells)} valid triangles, {len(doubtful)} of them decided in rationals")
    return True


def main():
    check_the_checks()
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
