"""render.py RESULT PICTURE.png [FIELD]: the surface and its parametric plane side by side, with the curved edges of
the triangles, coloured by a cell field (default: conformal_distortion).

Needs the environment of the tests (.venv) and, off-screen, an EGL library (Debian: libegl1 libgl1-mesa-dri).
"""
import sys

import vtk


def bent(port):
    """A mapper for cells whose quadratic edges are drawn as the curves they are."""
    skin = vtk.vtkDataSetSurfaceFilter()
    skin.SetInputConnection(port)
    skin.SetNonlinearSubdivisionLevel(3)
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputConnection(skin.GetOutputPort())
    return mapper


def actors(path, field, limits):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    mapper = bent(reader.GetOutputPort())
    mapper.SetScalarModeToUseCellFieldData()
    mapper.SelectColorArray(field)
    reader.Update()
    low, high = limits or reader.GetOutput().GetCellData().GetArray(field).GetRange()
    colours = vtk.vtkColorTransferFunction()
    for share, rgb in ((0, (0.93, 0.95, 0.98)), (0.35, (0.45, 0.68, 0.85)), (0.7, (0.95, 0.7, 0.3)), (1, (0.75, 0.15, 0.15))):
        colours.AddRGBPoint(low + share * (high - low), *rgb)
    mapper.SetLookupTable(colours)
    # Edges lie upon the faces: faces are drawn a little further back.
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2, 2)
    surface = vtk.vtkActor()
    surface.SetMapper(mapper)
    surface.GetProperty().SetAmbient(0.45)
    surface.GetProperty().SetDiffuse(0.6)
    edges = vtk.vtkExtractEdges()
    edges.SetInputConnection(reader.GetOutputPort())
    line_mapper = bent(edges.GetOutputPort())
    line_mapper.ScalarVisibilityOff()
    lines = vtk.vtkActor()
    lines.SetMapper(line_mapper)
    lines.GetProperty().SetColor(0.15, 0.15, 0.2)
    lines.GetProperty().SetOpacity(0.6)
    return [surface, lines]


def view(window, path, field, limits, left, tilt):
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    renderer.SetViewport(left, 0, left + 0.5, 1)
    for actor in actors(path, field, limits):
        renderer.AddActor(actor)
    window.AddRenderer(renderer)
    renderer.ResetCamera()
    renderer.GetActiveCamera().Elevation(tilt)
    renderer.ResetCamera()
    renderer.GetActiveCamera().Zoom(1.35)
    renderer.ResetCameraClippingRange()


def main():
    result, picture = sys.argv[1:3]
    field = sys.argv[3] if len(sys.argv) > 3 else "conformal_distortion"
    limits = (1.0, 2.0) if field == "conformal_distortion" else None
    window = vtk.vtkEGLRenderWindow() if hasattr(vtk, "vtkEGLRenderWindow") else vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(1600, 800)
    view(window, f"{result}/surface.vtu", field, limits, 0.0, -50)
    view(window, f"{result}/param.vtu", field, limits, 0.5, 0)
    window.Render()
    image = vtk.vtkWindowToImageFilter()
    image.SetInput(window)
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(picture)
    writer.SetInputConnection(image.GetOutputPort())
    writer.Write()


main()
