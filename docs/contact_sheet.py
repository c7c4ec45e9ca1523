"""contact_sheet.py OUT SHEET.png [--columns N] [--order NAME...] [--size PIXELS]: every atlas of a folder on one page.

Per result folder: the surface from the front and from the back, and its parametric plane. Neighbouring charts differ
in colour (or have the colours of the cell array `colour`, small whole numbers, where surface.vtu has one); dark lines
are seams, red lines open boundaries, dots corners (from seams.vtp where it is there, else found in surface.vtu).
Refused inputs, and results with a file missing, get a tile that says so.

--order puts the named inputs first, in this order. Needs the environment of the tests (.venv) and, off-screen, an EGL
library (Debian: libegl1 libgl1-mesa-dri).
"""
import argparse
import json
import textwrap
from pathlib import Path

import numpy
import vtk
from PIL import Image, ImageDraw, ImageFont
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

import atlas as results

PALETTE = numpy.array([(141, 186, 219), (244, 190, 118), (150, 204, 150), (231, 150, 144), (186, 169, 218),
                       (240, 226, 136), (133, 208, 200), (238, 176, 209), (190, 190, 186), (196, 214, 118),
                       (205, 160, 124), (160, 172, 240)], numpy.uint8)
SEAM, OPEN, CORNER = (0.10, 0.11, 0.16), (0.78, 0.10, 0.16), (0.05, 0.05, 0.08)
INK, QUIET, ALARM, PAPER, CARD = (34, 36, 44), (112, 116, 128), (186, 40, 48), (255, 255, 255), (246, 247, 249)
# Below this many triangles the edges of the triangles are drawn too.
FEW = 6000
# The four triangles of a 6-node triangle.
QUARTERS = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]


# Colours.

def neighbours(atlas):
    """Per chart the charts that share a vertex with it, and how many charts there are."""
    charts = int(atlas.chart.max()) + 1
    pairs = numpy.unique(atlas.corners.ravel() * charts + numpy.repeat(atlas.chart, 3))
    place, chart = pairs // charts, pairs % charts
    beside = [set() for _ in range(charts)]
    starts = numpy.flatnonzero(numpy.r_[True, place[1:] != place[:-1]])
    for group in numpy.split(chart, starts[1:]):
        if len(group) > 1:
            for c in group.tolist():
                beside[c].update(group.tolist())
    return [others - {c} for c, others in enumerate(beside)]


def greedy(beside):
    """A colour per chart: those with many neighbours first, the least used colour that no neighbour has."""
    colour, used = [-1] * len(beside), [0] * len(PALETTE)
    for chart in sorted(range(len(beside)), key=lambda c: (-len(beside[c]), c)):
        taken = [colour[n] for n in beside[chart] if colour[n] >= 0]
        best = min(range(len(PALETTE)), key=lambda c: (taken.count(c), used[c], c))
        colour[chart] = best
        used[best] += 1
    return numpy.array(colour)


def colours(atlas):
    """The colour of every cell."""
    if atlas.colour is not None:
        return PALETTE[atlas.colour.astype(int) % len(PALETTE)]
    return PALETTE[greedy(neighbours(atlas))][atlas.chart]


# Things to draw.

def polydata(points, triangles=None, lines=None, dots=None):
    """A VTK surface from arrays."""
    data, holder = vtk.vtkPolyData(), vtk.vtkPoints()
    holder.SetData(numpy_to_vtk(numpy.ascontiguousarray(points, dtype=float), deep=1))
    data.SetPoints(holder)
    for cells, put in ((triangles, data.SetPolys), (lines, data.SetLines), (dots, data.SetVerts)):
        if cells is not None and len(cells):
            put(cell_array(cells))
    return data


def cell_array(cells):
    """Cells of equal size."""
    cells = numpy.asarray(cells)
    found = vtk.vtkCellArray()
    offsets = numpy.arange(0, cells.size + 1, cells.shape[1])
    found.SetData(numpy_to_vtkIdTypeArray(offsets, deep=1), numpy_to_vtkIdTypeArray(cells.ravel(), deep=1))
    return found


def painted(points, triangles, colour):
    """A surface with a colour per triangle."""
    data = polydata(points, triangles)
    values = numpy_to_vtk(numpy.ascontiguousarray(colour), deep=1)
    values.SetName("paint")
    data.GetCellData().SetScalars(values)
    return data


def rounded(data):
    """Normals for a smooth look, with creases where the surface has them."""
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputData(data)
    normals.SetFeatureAngle(40)
    normals.ConsistencyOff()
    normals.Update()
    return normals.GetOutput()


def faces(data, lit):
    """The actor of a surface."""
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(data)
    mapper.SetScalarModeToUseCellData()
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2, 2)
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetAmbient(0.38 if lit else 1)
    actor.GetProperty().SetDiffuse(0.68 if lit else 0)
    return actor


def strokes(data, colour, width, opacity=1.0):
    """The actor of lines, or of dots."""
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(data)
    mapper.ScalarVisibilityOff()
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(-2, -2)
    mapper.SetRelativeCoincidentTopologyPointOffsetParameter(-6)
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetColor(colour)
    look.SetLineWidth(width)
    look.SetPointSize(width)
    look.SetOpacity(opacity)
    look.SetLighting(False)
    look.SetRenderPointsAsSpheres(True)
    return actor


def mesh_lines(points, cells):
    """The edges of the cells, thin, where there are few of them."""
    if len(cells) > FEW:
        return []
    halves = numpy.concatenate([cells[:, [i, 3 + i]] for i in range(3)] + [cells[:, [3 + i, (i + 1) % 3]] for i in range(3)])
    return [strokes(polydata(points, lines=halves), SEAM, 1, 0.16)]


class Lines:
    """Seams, open boundaries and corners in space, and the length of the seams."""

    def __init__(self, folder, atlas):
        self.seam, self.open, self.dots, self.length = self.found(atlas)
        if (folder / "seams.vtp").exists():
            self.seam, self.open, self.dots = self.published(folder / "seams.vtp")

    @staticmethod
    def found(atlas):
        """From the boundaries of the charts."""
        seams = results.find_seams(atlas)
        shared = numpy.array([len(s) > 1 for s in seams.sides], bool)
        count, places = len(seams.ends), len(atlas.where)
        points = numpy.concatenate([atlas.where, seams.middle])
        middle = places + numpy.arange(count)
        lines = numpy.stack([seams.ends[:, 0], middle, seams.ends[:, 1]], 1)
        dots = numpy.array(seams.corners, int).reshape(-1, 1)
        length = float(results.lengths(seams, atlas.where)[shared].sum())
        return (polydata(points, lines=lines[shared]), polydata(points, lines=lines[~shared]),
                polydata(points, dots=dots), length)

    @staticmethod
    def published(path):
        """From seams.vtp."""
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(path))
        reader.Update()
        data = reader.GetOutput()
        curve, is_open = (results.array(data.GetCellData(), name) for name in ("curve", "open"))
        if reader.GetErrorCode() or curve is None or is_open is None:
            raise ValueError("seams.vtp is damaged")
        return [picked(data, cells) for cells in ((curve >= 0) & (is_open == 0), (curve >= 0) & (is_open != 0), curve < 0)]


def picked(data, wanted):
    """Some cells of a surface."""
    copy = vtk.vtkPolyData()
    copy.DeepCopy(data)
    copy.BuildCells()
    for cell in numpy.flatnonzero(~wanted).tolist():
        copy.DeleteCell(cell)
    copy.RemoveDeletedCells()
    return copy


# Views.

def outlook(points, triangles):
    """From where to look, and what is up: along the least principal axis, with y or z up, whichever is longer. A
    surface that mostly faces one way is looked at from there."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    normal = numpy.cross(b - a, c - a) / 2
    area = numpy.linalg.norm(normal, axis=1) + 1e-300
    middle = (a + b + c) / 3
    centred = middle - numpy.average(middle, axis=0, weights=area)
    _, axes = numpy.linalg.eigh((centred * area[:, None]).T @ centred)
    away = axes[:, 0] * numpy.sign(axes[numpy.abs(axes[:, 0]).argmax(), 0])
    if normal.sum(0) @ away < -0.2 * area.sum():
        away = -away
    size = numpy.ptp(points, axis=0) * (numpy.abs(away) < 0.75)
    return away, numpy.eye(3)[1 if size[1] > size[2] else 2]


def turned(away, up, turn, lift):
    """A direction turned to the right and lifted, by degrees."""
    right = unit(numpy.cross(up, away))
    turn, lift = numpy.radians((turn, lift))
    level = numpy.cos(turn) * away + numpy.sin(turn) * right
    return numpy.cos(lift) * level + numpy.sin(lift) * numpy.cross(away, right)


def unit(vector):
    return vector / numpy.linalg.norm(vector)


def aim(renderer, points, away, up):
    """Looks at the points so that they fill the picture."""
    right = unit(numpy.cross(up, away))
    axes = numpy.stack([right, numpy.cross(away, right), away])
    seen = points @ axes.T
    low, high = seen.min(0), seen.max(0)
    middle = (low + high) / 2 @ axes
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetFocalPoint(*middle)
    camera.SetPosition(*(middle + 4 * (high - low).max() * away))
    camera.SetViewUp(*axes[1])
    camera.SetParallelScale(0.53 * (high - low)[:2].max())
    renderer.ResetCameraClippingRange()


class Studio:
    """An off-screen window with three pictures side by side."""

    def __init__(self, size):
        self.size = size
        self.window = vtk.vtkEGLRenderWindow() if hasattr(vtk, "vtkEGLRenderWindow") else vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(8)
        self.window.SetSize(3 * size, size)

    def shoot(self, scenes):
        """One picture of three scenes: (actors, points, direction, up)."""
        renderers = [self.place(i, *scene) for i, scene in enumerate(scenes)]
        self.window.Render()
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.Update()
        pixels = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())[:, :3]
        for renderer in renderers:
            self.window.RemoveRenderer(renderer)
        return Image.fromarray(pixels.reshape(self.size, -1, 3)[::-1].copy())

    def place(self, index, actors, points, away, up):
        """A third of the window."""
        renderer = vtk.vtkRenderer()
        renderer.SetBackground(1, 1, 1)
        renderer.SetViewport(index / 3, 0, (index + 1) / 3, 1)
        for actor in actors:
            renderer.AddActor(actor)
        self.window.AddRenderer(renderer)
        aim(renderer, points, away, up)
        return renderer


def space_scenes(atlas, lines, paint, scale):
    """The surface from the front and, exactly opposite, from the back."""
    middle, size = box(atlas.where)
    points = (atlas.points - middle) / size
    corners = (atlas.where - middle) / size
    surface = rounded(painted(corners, atlas.corners, paint))
    for data in (lines.seam, lines.open, lines.dots):
        shrink(data, middle, size)
    actors = [faces(surface, lit=True), *mesh_lines(points, atlas.cells), strokes(lines.seam, SEAM, 2.4 * scale),
              strokes(lines.open, OPEN, 2.4 * scale), strokes(lines.dots, CORNER, 7 * scale)]
    away, up = outlook(corners, atlas.corners)
    front = turned(away, up, 25, 25)
    return [(actors, corners, front, up), (actors, corners, -front, up)]


def box(points):
    """Middle and diagonal of the bounding box."""
    return (points.min(0) + points.max(0)) / 2, max(results.diagonal(points), 1e-300)


def shrink(data, middle, size):
    """Moves a surface into the unit box."""
    points = (vtk_to_numpy(data.GetPoints().GetData()) - middle) / size if data.GetNumberOfPoints() else numpy.zeros((0, 3))
    data.GetPoints().SetData(numpy_to_vtk(points, deep=1))


def plane_scene(folder, paint, scale):
    """The parametric plane."""
    grid = results.load(folder / "param.vtu")
    points, cells = vtk_to_numpy(grid.GetPoints().GetData()).astype(float), results.sixes(grid)
    if len(cells) != len(paint):
        raise ValueError("param.vtu and surface.vtu differ")
    quarters = cells[:, QUARTERS].reshape(-1, 3)
    rim = polydata(points, lines=rims(cells))
    actors = [faces(painted(points, quarters, numpy.repeat(paint, 4, axis=0)), lit=False),
              *mesh_lines(points, cells), strokes(rim, SEAM, 1.4 * scale)]
    return actors, points, numpy.array((0.0, 0, 1)), numpy.array((0.0, 1, 0))


def rims(cells):
    """The boundary edges of the charts, with their middles."""
    edges = numpy.concatenate([cells[:, [i, 3 + i, (i + 1) % 3]] for i in range(3)])
    _, index, count = numpy.unique(results.codes(edges[:, [0, 2]]), return_index=True, return_counts=True)
    return edges[index[count == 1]]


# Tiles.

def font(size):
    return ImageFont.load_default(size)


class Tile:
    """A card with pictures and a caption."""

    def __init__(self, size):
        self.size, self.pad = size, size // 24
        self.image = Image.new("RGB", (3 * size + 2 * self.pad, size + 2 * self.pad + size // 5), PAPER)
        self.draw = ImageDraw.Draw(self.image)
        self.draw.rectangle((0, size + 2 * self.pad, self.image.width, self.image.height), fill=CARD)

    def caption(self, name, facts, status, good):
        """Name and status, and a line of facts below."""
        top, small = self.size + 2 * self.pad + self.size // 28, self.size // 19
        self.draw.text((self.pad, top), name, INK, font(self.size // 15))
        where = (self.image.width - self.pad, top)
        self.draw.text(where, status, QUIET if good else ALARM, font(self.size // 15), anchor="ra")
        self.draw.text((self.pad, top + self.size // 11), facts, QUIET, font(small))

    def text(self, words):
        """Words in the place of pictures."""
        wide = max(20, int(3 * self.size / (self.size / 19 * 0.5)) - 10)
        lines = "\n".join(textwrap.wrap(words, wide))
        middle = (self.image.width // 2, self.size // 2 + self.pad)
        self.draw.multiline_text(middle, lines, ALARM, font(self.size // 19), "mm", self.size // 40, "center")


def told(report):
    """The report's own words about the input: facts for the caption."""
    surface = report.get("surface") or {}
    counts = surface.get("repaired") or surface.get("raw") or {}
    facts = [f"{counts['triangles']:,} triangles"] if "triangles" in counts else []
    charts = report.get("charts") or []
    if charts:
        facts.append(f"{len(charts)} chart" + "s" * (len(charts) != 1))
    return facts


def worst_ratio(report):
    """The largest area ratio of a chart."""
    ratios = [c["distortion"]["area_ratio"] for c in report.get("charts") or []]
    return [f"worst area ratio {max(ratios):.3g}"] if ratios else []


def make_tile(folder, name, studio):
    """The tile of a result folder, whatever is in it."""
    tile, report = Tile(studio.size), {}
    try:
        report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        status, facts = report["status"], told(report)
        if status == "certified":
            facts += pictures(tile, folder, studio) + worst_ratio(report)
            refused = len(report.get("refused_components") or [])
            status += f", {refused} components refused" if refused else ""
            tile.caption(name, "  ·  ".join(facts), status, good=not refused)
        else:
            reason = report.get("reason") or {}
            tile.text(reason.get("message", "no reason is given"))
            tile.caption(name, "  ·  ".join(facts), f"{status}: {reason.get('code')}", good=False)
    except FileNotFoundError as error:
        trouble(tile, name, f"{Path(error.filename).name} is not there")
    except ValueError as error:
        trouble(tile, name, str(error))
    except Exception as error:
        trouble(tile, name, f"{type(error).__name__}: {error}")
    return tile.image


def trouble(tile, name, words):
    """A tile that says what cannot be shown."""
    tile.text(words)
    tile.caption(name, "", "cannot be shown", good=False)


def pictures(tile, folder, studio):
    """Puts the three pictures on the tile; what was measured on the way."""
    atlas = results.read(folder)
    lines = Lines(folder, atlas)
    # Many charts, thin lines.
    scale = studio.size / 360 * min(1, (60 / len(numpy.unique(atlas.chart))) ** 0.4)
    paint = colours(atlas)
    scenes = [*space_scenes(atlas, lines, paint, scale), plane_scene(folder, paint, scale)]
    tile.image.paste(studio.shoot(scenes), (tile.pad, tile.pad))
    return [f"seams {lines.length / results.diagonal(atlas.where):.3g} diagonals"]


def sheet(tiles, columns):
    """All tiles on one page."""
    wide, high = tiles[0].size
    gap, rows = wide // 40, -(-len(tiles) // columns)
    page = Image.new("RGB", (columns * (wide + gap) + gap, rows * (high + gap) + gap), (226, 229, 235))
    for i, tile in enumerate(tiles):
        page.paste(tile, (gap + i % columns * (wide + gap), gap + i // columns * (high + gap)))
    return page


# The run.

def folders(out, order):
    """The result folders below OUT, the named ones first."""
    names = results.find(out)
    first = {name: i for i, name in enumerate(order)}
    missing = set(order) - {name for name, _ in names}
    if missing or not names:
        raise SystemExit(f"no result is named {', '.join(sorted(missing))}" if missing else f"no result below {out}")
    return sorted(names, key=lambda n: (first.get(n[0], len(first)), n[0]))


def options():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("sheet", type=Path, metavar="SHEET.png")
    parser.add_argument("--columns", type=int, metavar="N", help="tiles side by side (default 2, one for one result)")
    parser.add_argument("--order", nargs="+", default=[], metavar="NAME", help="inputs that come first")
    parser.add_argument("--size", type=int, default=360, metavar="PIXELS", help="of a picture (default 360)")
    return parser.parse_args()


def main():
    arguments = options()
    studio = Studio(arguments.size)
    tiles = [make_tile(folder, name, studio) for name, folder in folders(arguments.out, arguments.order)]
    columns = arguments.columns or min(2, len(tiles))
    sheet(tiles, max(1, columns)).save(arguments.sheet)


main()
