"""verify_remesh.py [--seconds N] [--any-size] [--keep] RESULT...: remeshes each result with the real Gmsh (`gmsh remesh.geo -2`,
no other flags, in a copy of the hand-off) and looks at what came out:

- Gmsh reads the triangles of the input from atlas.msh, and its maps are those of surface.vtu, or lead from the surface to the
  plane and back to the same place where the report says that a chart has another one;
- Gmsh ends in time and without an error, and writes remesh.msh;
- the mesh has the Euler number of the input, open edges only along open edges of the input, edges of more than two
  triangles only along such edges, and no two triangles on the same three nodes;
- every node lies on the input surface, within 1e-9 of the diagonal of its bounding box;
- within a chart triangles agree about the direction of shared edges, and face the side that the input faces;
- edges, those along curves too, have about the length that the report says.

The input surface is read from surface.vtu, with vertices joined that are one in the input.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile

import gmsh
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

TOLERANCE = 1e-9
# Triangles whose middles are off their chords by less than this share of the least height may be handed over whole, of charts with so many.
BEND = 1 / 32
FEW = 500


def read_grid(path):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def read_surface(path):
    """Points and triangles of the input, and the chart of each triangle."""
    grid = read_grid(path)
    points = vtk_to_numpy(grid.GetPoints().GetData()).astype(float)
    cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 6)[:, :3]
    used, triangles = numpy.unique(cells, return_inverse=True)
    # Copies of a vertex have the same place, to the bit.
    places, number = numpy.unique(points[used] + 0.0, axis=0, return_inverse=True)
    return places, number.reshape(-1)[triangles.reshape(-1, 3)], vtk_to_numpy(grid.GetCellData().GetArray("chart"))


def remesh(folder, seconds, keep):
    """Runs Gmsh on a copy of the hand-off; nodes, triangles with their surfaces, and edges along curves."""
    with tempfile.TemporaryDirectory() as scratch:
        for name in ("atlas.msh", "atlas-enlarged.msh", "sizes.pos", "remesh.geo"):
            if os.path.exists(os.path.join(folder, name)):
                shutil.copy(os.path.join(folder, name), scratch)
        command = [sys.executable, os.path.join(os.path.dirname(sys.executable), "gmsh"), "remesh.geo", "-2"]
        # Edges along seams are in no group, and looked at here all the same.
        command.append("-save_all")
        done = subprocess.run(command, cwd=scratch, timeout=seconds, capture_output=True, text=True)
        said = [line for line in (done.stdout + done.stderr).splitlines() if line.startswith(("Error", "Warning"))]
        assert done.returncode == 0, f"Gmsh ends with {done.returncode}: {said}"
        assert not any(line.startswith("Error") for line in said), said
        if keep:
            shutil.copy(os.path.join(scratch, "remesh.msh"), folder)
        return read_mesh(os.path.join(scratch, "remesh.msh")) + (said,)


def read_mesh(path):
    gmsh.initialize(["", "-v", "1"])
    try:
        gmsh.open(path)
        tags, points, _ = gmsh.model.mesh.getNodes()
        number = numpy.full(int(tags.max()) + 1, -1)
        number[tags.astype(int)] = numpy.arange(len(tags))
        triangles, surfaces, lines = [], [], []
        for dimension, tag in gmsh.model.getEntities():
            for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dimension, tag)):
                if kind == 2:
                    triangles.append(number[nodes.astype(int)].reshape(-1, 3))
                    surfaces.append(numpy.full(len(triangles[-1]), tag - 1))
                if kind == 1:
                    lines.append(number[nodes.astype(int)].reshape(-1, 2))
        assert triangles and lines, "the mesh is empty"
        return points.reshape(-1, 3), numpy.concatenate(triangles), numpy.concatenate(surfaces), numpy.concatenate(lines)
    finally:
        gmsh.finalize()


def inner_nodes(cells):
    """Nodes of 6-node triangles that do not lie on the boundary; a few hundred of them."""
    middles, count = numpy.unique(cells[:, 3:], return_counts=True)
    open_side = numpy.isin(cells[:, 3:], middles[count == 1])
    outer = numpy.unique(numpy.concatenate(
        [cells[open_side[:, k]][:, [k, (k + 1) % 3, 3 + k]].ravel() for k in range(3)]))
    inner = numpy.setdiff1d(cells, outer)
    return inner[:: max(1, len(inner) // 300)]


def allowed_off(cells, places, nodes, is_small):
    """How far from its place Gmsh's map may take each node: corners nowhere; middles of sides, in charts that are not small, as far as
    the chord of a side that is nearly straight is from it, at most."""
    if is_small:
        return numpy.zeros(len(nodes))
    corners = places[cells[:, :3]]
    longest = numpy.linalg.norm(corners - numpy.roll(corners, 1, axis=1), axis=2).max(1)
    allowed = numpy.zeros(cells.max() + 1)
    for k in range(3, 6):
        numpy.maximum.at(allowed, cells[:, k], BEND * longest)
    return allowed[nodes]


def verify_atlas(folder, scales, linear_charts, natural_charts, diagonal):
    """Gmsh reads the triangles of the input from atlas.msh, and its maps are those of surface.vtu times the `uv_scale` of each
    chart: exactly at corners of triangles, and at middles of sides as well as straight triangles can be."""
    grid = read_grid(os.path.join(folder, "surface.vtu"))
    places, uv = vtk_to_numpy(grid.GetPoints().GetData()), vtk_to_numpy(grid.GetPointData().GetArray("uv"))
    cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 6)
    charts = vtk_to_numpy(grid.GetCellData().GetArray("chart"))
    gmsh.initialize(["", "-v", "1"])
    try:
        gmsh.open(os.path.join(folder, "atlas.msh"))
        for chart in numpy.unique(charts):
            mine, tag = cells[charts == chart], int(chart) + 1
            count = sum(len(tags) for tags in gmsh.model.mesh.getElements(2, tag)[1])
            assert count == len(mine), f"atlas.msh holds {count} triangles of chart {chart}, the input {len(mine)}"
            nodes = inner_nodes(mine)
            thickness = numpy.linalg.svd(places[mine[:, :3].ravel()] - places[mine[0, 0]], compute_uv=False)[-1]
            if chart in linear_charts or not len(nodes) or thickness <= 1e-6 * diagonal:
                # Other places in the plane, or a flat chart, which Gmsh projects.
                continue
            if chart in natural_charts:
                there = gmsh.model.getParametrization(2, tag, places[nodes].ravel())
            else:
                there = (uv[nodes] * scales[chart]).ravel()
            x = numpy.array(gmsh.model.getValue(2, tag, there)).reshape(-1, 3)
            off = numpy.abs(x - places[nodes]).max(1)
            allowed = allowed_off(mine, places, nodes, len(mine) < FEW) + TOLERANCE * diagonal
            worst = numpy.argmax(off - allowed)
            assert off[worst] < allowed[worst], f"chart {chart}: Gmsh's map is off by {off[worst] / diagonal:.1e} of the diagonal"
    finally:
        gmsh.finalize()


def edges_of(triangles):
    """Directed sides, their undirected edges, and per side the number of its edge; how many sides each edge has."""
    sides = numpy.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges, number, count = numpy.unique(numpy.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    return sides, edges, number.reshape(-1), count


def euler(triangles):
    return len(numpy.unique(triangles)) - len(edges_of(triangles)[1]) + len(triangles)


def distance_to_segments(points, a, b):
    """The distance of each point to the nearest of some segments."""
    least = numpy.full(len(points), numpy.inf)
    d = b - a
    for first in range(0, len(a), 256):
        s, e = a[first:first + 256], d[first:first + 256]
        t = ((points[:, None] - s) * e).sum(2) / numpy.maximum((e * e).sum(1), 1e-300)
        gap = points[:, None] - s - numpy.clip(t, 0, 1)[:, :, None] * e
        least = numpy.minimum(least, numpy.sqrt((gap * gap).sum(2)).min(1))
    return least


def distance_to_triangles(p, a, b, c):
    """The distance of p[i] to the triangle a[i] b[i] c[i], exact up to rounding."""
    n = numpy.cross(b - a, c - a)
    area = (n * n).sum(1)
    with numpy.errstate(all="ignore"):
        # Barycentric coordinates of the foot of the perpendicular.
        v = (numpy.cross(p - a, c - a) * n).sum(1) / area
        w = (numpy.cross(b - a, p - a) * n).sum(1) / area
        inside = (area > 0) & (v >= 0) & (w >= 0) & (v + w <= 1)
        height = numpy.abs(((p - a) * n).sum(1)) / numpy.sqrt(area)
    least = numpy.where(inside, height, numpy.inf)
    for s, e in ((a, b - a), (b, c - b), (c, a - c)):
        t = numpy.clip(((p - s) * e).sum(1) / numpy.maximum((e * e).sum(1), 1e-300), 0, 1)
        gap = p - s - t[:, None] * e
        least = numpy.minimum(least, numpy.sqrt((gap * gap).sum(1)))
    return least


class Grid:
    """Boxes of space, each with the triangles whose own boxes touch it."""

    def __init__(self, points, triangles, slack):
        corners = points[triangles]
        low, high = corners.min(1) - slack, corners.max(1) + slack
        self.corners, self.origin = corners, low.min(0)
        extent = (high.max(0) - self.origin).max()
        self.size = max(extent / 256, numpy.median((high - low).max(1)), extent * 1e-6)
        first, last = (numpy.floor((x - self.origin) / self.size).astype(numpy.int64) for x in (low, high))
        span = last - first + 1
        counts = span.prod(1)
        owner = numpy.repeat(numpy.arange(len(triangles)), counts)
        rank = numpy.arange(counts.sum()) - numpy.repeat(numpy.cumsum(counts) - counts, counts)
        sx, sy = span[owner, 0], span[owner, 1]
        offset = numpy.stack([rank % sx, rank // sx % sy, rank // (sx * sy)], 1)
        key = self.key(first[owner] + offset)
        order = numpy.argsort(key, kind="stable")
        self.keys, self.owner = key[order], owner[order]

    @staticmethod
    def key(cell):
        return cell[:, 0] + (cell[:, 1] << 20) + (cell[:, 2] << 40)

    def nearest(self, points):
        """Per point its distance to the nearest triangle whose box it is in, and which that is."""
        key = self.key(numpy.floor((points - self.origin) / self.size).astype(numpy.int64))
        begin, end = numpy.searchsorted(self.keys, key), numpy.searchsorted(self.keys, key, side="right")
        count = end - begin
        distance, which = numpy.full(len(points), numpy.inf), numpy.zeros(len(points), int)
        for some in numpy.array_split(numpy.arange(len(points)), max(1, int(count.sum() // 500_000))):
            query = numpy.repeat(some, count[some])
            rank = numpy.arange(len(query)) - numpy.repeat(numpy.cumsum(count[some]) - count[some], count[some])
            triangle = self.owner[begin[query] + rank]
            d = distance_to_triangles(points[query], *(self.corners[triangle][:, k] for k in range(3)))
            order = numpy.lexsort((d, query))
            last = numpy.append(True, query[order][1:] != query[order][:-1])[: len(order)]
            best = order[last] if len(order) else order
            distance[query[best]], which[query[best]] = d[best], triangle[best]
        return distance, which


def unit_normals(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    n = numpy.cross(b - a, c - a)
    return n / numpy.maximum(numpy.sqrt((n * n).sum(1)), 1e-300)[:, None]


def verify_edges(points, triangles, surface, faces, diagonal):
    """Open and non-manifold edges lie along those of the input."""
    _, edges, _, count = edges_of(triangles)
    _, old, _, old_count = edges_of(faces)
    for what, some, where in (("open", count == 1, old_count == 1), ("non-manifold", count > 2, old_count > 2)):
        middles = points[edges[some]].mean(1)
        if not len(middles):
            assert not where.any(), f"the input has {what} edges, the mesh has none"
            continue
        assert where.any(), f"{len(middles)} {what} edges; the input has none"
        ends = points[edges[some]].reshape(-1, 3)
        a, b = surface[old[where, 0]], surface[old[where, 1]]
        off = distance_to_segments(ends, a, b).max()
        assert off <= TOLERANCE * diagonal, f"{what} edges end {off / diagonal:.1e} of the diagonal off those of the input"


def verify_orientation(points, triangles, surfaces, which, normals, charts):
    """Within a chart, no side is there twice, and normals are those of the input."""
    sides = numpy.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    directed = numpy.column_stack([sides, numpy.tile(surfaces, 3)])
    assert len(numpy.unique(directed, axis=0)) == len(directed), "neighbours in a chart disagree about their direction"
    of_mesh = unit_normals(points, triangles)
    for chart in numpy.unique(surfaces):
        mine = surfaces == chart
        # The nodes of a triangle lie on triangles of the input: only those of the same chart count.
        on = which[triangles[mine]]
        same = charts[on] == chart
        cosine = (of_mesh[mine][:, None] * normals[on]).sum(2)[same].mean()
        assert cosine > 0.5, f"chart {chart} faces the wrong way: mean cosine {cosine:.2f}"


def verify_sizes(points, triangles, lines, size):
    for what, ends in (("all edges", edges_of(triangles)[1]), ("edges along curves", lines)):
        gap = points[ends[:, 0]] - points[ends[:, 1]]
        median = numpy.median(numpy.sqrt((gap * gap).sum(1)))
        assert 0.5 * size < median < 1.5 * size, f"{what}: median length {median:.4g}, asked for {size:.4g}"


def verify(folder, seconds, sizes, keep):
    report = json.load(open(os.path.join(folder, "report.json"), encoding="utf-8"))
    surface, faces, charts = read_surface(os.path.join(folder, "surface.vtu"))
    diagonal = numpy.linalg.norm(surface.max(0) - surface.min(0))
    scales = [chart["uv_scale"] for chart in report["charts"]]
    verify_atlas(folder, scales, report["hand_off"]["linear_charts"], report["hand_off"]["natural_charts"], diagonal)
    points, triangles, surfaces, lines, said = remesh(folder, seconds, keep)
    assert sorted(set(surfaces)) == sorted(set(charts)), "every chart has triangles"
    assert len(numpy.unique(numpy.sort(triangles, 1), axis=0)) == len(triangles), "two triangles on the same nodes"
    assert euler(triangles) == euler(faces), f"Euler number {euler(triangles)}, the input has {euler(faces)}"
    verify_edges(points, triangles, surface, faces, diagonal)
    distance, which = Grid(surface, faces, 2 * TOLERANCE * diagonal).nearest(points)
    off = distance.max() / diagonal
    assert off <= TOLERANCE, f"a node lies {off:.1e} of the diagonal off the surface"
    verify_orientation(points, triangles, surfaces, which, unit_normals(surface, faces), charts)
    if sizes:
        verify_sizes(points, triangles, lines, report["hand_off"]["size"])
    print(f"ok {folder}: {len(triangles)} triangles in {len(set(surfaces))} charts, off by {off:.1e}; {said}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=120.0, help="time that Gmsh may take for one result")
    parser.add_argument("--any-size", action="store_true", help="do not look at the lengths of edges")
    parser.add_argument("--keep", action="store_true", help="leave remesh.msh in the result folder")
    parser.add_argument("results", nargs="+")
    arguments = parser.parse_args()
    good = True
    for folder in arguments.results:
        try:
            verify(folder, arguments.seconds, not arguments.any_size, arguments.keep)
        except (AssertionError, subprocess.TimeoutExpired) as problem:
            print(f"{folder}: {problem}")
            good = False
    sys.exit(0 if good else 1)


main()
