"""Reading a result folder for pictures and measurements: nodes that charts share are found again by their place.

    atlas = read("out/bunny.stl")     # surface.vtu
    seams = find_seams(atlas)         # edges between charts and open boundaries, corners
    for curve in curves(seams): ...   # chains of vertices from corner to corner
"""
from collections import defaultdict
from dataclasses import dataclass
from errno import ENOENT

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

MID_NODE, ADDED = -1, -2


@dataclass
class Atlas:
    """The cells of surface.vtu. `place` numbers the nodes anew, so that nodes at one vertex have one number."""
    points: numpy.ndarray   # (nodes, 3)
    cells: numpy.ndarray    # (cells, 6) nodes
    chart: numpy.ndarray    # (cells,)
    place: numpy.ndarray    # (nodes,) of vertices; -1 for middles of edges
    where: numpy.ndarray    # (places, 3)
    colour: numpy.ndarray | None

    @property
    def corners(self):
        """The three places of every cell."""
        return self.place[self.cells[:, :3]]


@dataclass
class Seams:
    """Edges on the boundary of a chart, each once."""
    ends: numpy.ndarray     # (edges, 2) places
    middle: numpy.ndarray   # (edges, 3) positions of the middle nodes
    sides: list             # per edge the charts beside it, sorted; a single one at open boundaries
    corners: list           # places where other than two edges of one kind meet


def find(out):
    """Name and folder of every result below OUT, by name."""
    found = {p.parent for name in ("report.json", "surface.vtu") for p in out.rglob(name)}
    return sorted((f.relative_to(out).as_posix() if f != out else f.resolve().name, f) for f in found)


def load(path):
    """A .vtu file as VTK's grid; an error where it is missing or damaged."""
    if not path.exists():
        raise FileNotFoundError(ENOENT, "not there", str(path))
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    if reader.GetErrorCode() or not grid.GetNumberOfCells():
        raise ValueError(f"{path.name} is empty or damaged")
    return grid


def array(data, name):
    """A named array, or None."""
    found = data.GetArray(name)
    return None if found is None else vtk_to_numpy(found)


def sixes(grid):
    """The nodes of the 6-node triangles."""
    return vtk_to_numpy(grid.GetCells().GetConnectivityArray()).astype(numpy.int64).reshape(-1, 6)


def read(folder):
    """The atlas of a result folder."""
    grid = load(folder / "surface.vtu")
    points = vtk_to_numpy(grid.GetPoints().GetData()).astype(float)
    vertex, chart = array(grid.GetPointData(), "vertex"), array(grid.GetCellData(), "chart")
    if vertex is None or chart is None:
        raise ValueError("surface.vtu has no array vertex or chart")
    place = places(points, vertex)
    where = numpy.empty((place.max() + 1, 3))
    where[place[place >= 0]] = points[place >= 0]
    return Atlas(points, sixes(grid), chart, place, where, array(grid.GetCellData(), "colour"))


def places(points, vertex):
    """One number per vertex: by its id, and by its position where planish added it."""
    place = numpy.full(len(points), -1, numpy.int64)
    known, added = vertex >= 0, vertex == ADDED
    place[known] = numpy.unique(vertex[known], return_inverse=True)[1]
    if added.any():
        first = place.max() + 1
        place[added] = first + numpy.unique(points[added], axis=0, return_inverse=True)[1].ravel()
    return place


def find_seams(atlas):
    """The edges on boundaries of charts."""
    cells, chart = atlas.cells, atlas.chart
    ends = numpy.concatenate([cells[:, [i, (i + 1) % 3]] for i in range(3)])
    middle, beside = numpy.concatenate([cells[:, 3], cells[:, 4], cells[:, 5]]), numpy.tile(chart, 3)
    # Nodes belong to one chart each: an edge that occurs once lies on the boundary of its chart.
    _, index, count = numpy.unique(codes(ends), return_index=True, return_counts=True)
    rim = index[count == 1]
    key = codes(atlas.place[ends[rim]])
    _, first, edge = numpy.unique(key, return_index=True, return_inverse=True)
    sides = [[] for _ in first]
    for e, c in zip(edge.tolist(), beside[rim].tolist()):
        sides[e].append(c)
    sides = [tuple(sorted(s)) for s in sides]
    ends = atlas.place[ends[rim[first]]]
    return Seams(ends, atlas.points[middle[rim[first]]], sides, find_corners(ends, sides))


def codes(pairs):
    """One number per unordered pair."""
    low, high = pairs.min(1), pairs.max(1)
    return low * (high.max(initial=0) + 1) + high


def find_corners(ends, sides):
    """Places where other than two edges of the same sides meet."""
    kinds = defaultdict(list)
    for (a, b), s in zip(ends.tolist(), sides):
        kinds[a].append(s)
        kinds[b].append(s)
    return sorted(p for p, s in kinds.items() if len(s) != 2 or s[0] != s[1])


def curves(seams):
    """Chains of edges from corner to corner, and closed chains: (sides, places); closed ones end where they begin."""
    beside = defaultdict(list)
    for e, (a, b) in enumerate(seams.ends.tolist()):
        beside[a].append((e, b))
        beside[b].append((e, a))
    stops, used = set(seams.corners), set()
    for start in [*seams.corners, *seams.ends[:, 0].tolist()]:
        for edge, _ in beside[start]:
            if edge not in used:
                yield seams.sides[edge], walk(start, edge, beside, stops, used)


def walk(start, edge, beside, stops, used):
    """The chain that leaves `start` by `edge`, to the next corner or back."""
    chain = [start]
    while edge is not None:
        used.add(edge)
        chain.append(next(to for e, to in beside[chain[-1]] if e == edge))
        at_end = chain[-1] in stops or chain[-1] == start
        edge = None if at_end else next((e for e, _ in beside[chain[-1]] if e not in used), None)
    return chain


def lengths(seams, where):
    """The length of every seam edge."""
    return numpy.linalg.norm(where[seams.ends[:, 0]] - where[seams.ends[:, 1]], axis=1)


def diagonal(points):
    """The diagonal of the bounding box."""
    return float(numpy.linalg.norm(points.max(0) - points.min(0)))
