"""render.py RESULT PICTURE.png [FIELD] [--beside RESULT] [--around X Y RADIUS] [--limits LOW HIGH] [--size W H]

The surface and its parametric plane side by side, with the curved edges of the triangles, coloured by a cell field
(default: conformal_distortion, from 1 to 2). With --beside, the planes of two results; with --around, only what is
around a point of the plane.

Needs the environment of the tests (.venv) and, off-screen, an EGL library (Debian: libegl1 libgl1-mesa-dri).
"""
import argparse
import itertools

import vtk

# Pale, blue, orange, red, by their share of the range.
COLOURS = ((0, (0.84, 0.88, 0.92)), (0.35, (0.45, 0.68, 0.85)), (0.7, (0.95, 0.7, 0.3)), (1, (0.75, 0.15, 0.15)))

# An edge is drawn as so many segments.
SEGMENTS = 8


def faces(reader, field, limits):
    """The cells, curved as they are."""
    skin = vtk.vtkDataSetSurfaceFilter()
    skin.SetInputConnection(reader.GetOutputPort())
    skin.SetNonlinearSubdivisionLevel(3)
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputConnection(skin.GetOutputPort())
    mapper.SetScalarModeToUseCellFieldData()
    mapper.SelectColorArray(field)
    low, high = limits or reader.GetOutput().GetCellData().GetArray(field).GetRange()
    colours = vtk.vtkColorTransferFunction()
    for share, rgb in COLOURS:
        colours.AddRGBPoint(low + share * (high - low), *rgb)
    mapper.SetColorModeToMapScalars()
    mapper.SetLookupTable(colours)
    # Edges lie upon the faces: faces are drawn a little further back.
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2, 2)
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetAmbient(0.45)
    actor.GetProperty().SetDiffuse(0.6)
    return actor


def edges(reader):
    """The edges, each a quadratic curve through its ends (a and b) and its middle node."""
    grid = reader.GetOutput()
    points, lines, seen = vtk.vtkPoints(), vtk.vtkCellArray(), set()
    for i in range(grid.GetNumberOfCells()):
        nodes = grid.GetCell(i).GetPointIds()
        for a, b, middle in ((0, 1, 3), (1, 2, 4), (2, 0, 5)):
            a, b, middle = (nodes.GetId(k) for k in (a, b, middle))
            if middle in seen:
                continue
            seen.add(middle)
            ends = [grid.GetPoint(n) for n in (a, middle, b)]
            lines.InsertNextCell(SEGMENTS + 1)
            for k in range(SEGMENTS + 1):
                t = k / SEGMENTS
                weights = ((1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1))
                place = [sum(w * p[axis] for w, p in zip(weights, ends)) for axis in range(3)]
                lines.InsertCellPoint(points.InsertNextPoint(place))
    curves = vtk.vtkPolyData()
    curves.SetPoints(points)
    curves.SetLines(lines)
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(curves)
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.15, 0.15, 0.2)
    actor.GetProperty().SetOpacity(0.6)
    return actor


def show(window, path, left, args, tilt=0, around=None):
    """Half of the picture: what is in a file, all of it or what is around a point, seen from above or tilted."""
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    renderer.SetViewport(left, 0, left + 0.5, 1)
    renderer.AddActor(faces(reader, args.field, args.limits))
    renderer.AddActor(edges(reader))
    window.AddRenderer(renderer)
    renderer.ResetCamera()
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.Elevation(tilt)
    if around:
        x, y, radius = around
        _, _, z = camera.GetPosition()
        camera.SetFocalPoint(x, y, 0)
        camera.SetPosition(x, y, z)
        camera.SetParallelScale(radius)
    else:
        # The corners of the box around everything, as the camera sees them from its focal point.
        bounds = reader.GetOutput().GetBounds()
        corners = itertools.product(bounds[:2], bounds[2:4], bounds[4:])
        seen = [camera.GetViewTransformMatrix().MultiplyPoint((*corner, 1)) for corner in corners]
        across, up = (max(abs(p[axis]) for p in seen) for axis in (0, 1))
        width, height = args.size
        camera.SetParallelScale(1.04 * max(up, across * height / (width / 2)))
    renderer.ResetCameraClippingRange()


def arguments():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("result")
    parser.add_argument("picture")
    parser.add_argument("field", nargs="?", default="conformal_distortion")
    parser.add_argument("--beside")
    parser.add_argument("--around", nargs=3, type=float)
    parser.add_argument("--limits", nargs=2, type=float)
    parser.add_argument("--size", nargs=2, type=int, default=(1200, 600))
    args = parser.parse_args()
    if args.limits is None and args.field == "conformal_distortion":
        args.limits = (1.0, 2.0)
    return args


def main():
    args = arguments()
    window = vtk.vtkEGLRenderWindow() if hasattr(vtk, "vtkEGLRenderWindow") else vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(*args.size)
    if args.beside:
        show(window, f"{args.result}/param.vtu", 0.0, args, around=args.around)
    else:
        show(window, f"{args.result}/surface.vtu", 0.0, args, tilt=-50)
    show(window, f"{args.beside or args.result}/param.vtu", 0.5, args, around=args.around)
    window.Render()
    image = vtk.vtkWindowToImageFilter()
    image.SetInput(window)
    writer = vtk.vtkPNGWriter()
    writer.SetCompressionLevel(9)
    writer.SetFileName(args.picture)
    writer.SetInputConnection(image.GetOutputPort())
    writer.Write()


main()
