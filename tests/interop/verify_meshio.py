"""verify_meshio.py RESULT...: meshio reads surface.vtu and param.vtu as VTK does, number by number, and atlas.msh as Gmsh
does. (meshio reads neither .vtp nor .vtm, and passes over $Parametrizations, as the format allows.)
"""
import sys
import warnings

import gmsh
import meshio
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader


def same(ours, theirs, what):
    assert ours.dtype == theirs.dtype and ours.shape == theirs.shape, f"{what}: {ours.dtype} {ours.shape}, {theirs.dtype} {theirs.shape}"
    assert ours.tobytes() == theirs.tobytes(), f"{what}: other numbers"


def arrays(data):
    return {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)) for i in range(data.GetNumberOfArrays())}


def check_grid(path):
    """Points, cells and all arrays, in their order; nothing more and nothing less."""
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid, mesh = reader.GetOutput(), meshio.read(path)
    assert [c.type for c in mesh.cells] == ["triangle6"], f"{path}: {mesh.cells}"
    same(mesh.points, vtk_to_numpy(grid.GetPoints().GetData()), f"{path}: points")
    cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 6)
    same(mesh.cells[0].data.astype(cells.dtype), cells, f"{path}: cells")
    of_cells = {name: data[0] for name, data in mesh.cell_data.items()}
    for found, expected in ((mesh.point_data, arrays(grid.GetPointData())), (of_cells, arrays(grid.GetCellData()))):
        assert list(found) == list(expected), f"{path}: arrays {list(found)}, {list(expected)}"
        for name, array in expected.items():
            same(found[name].reshape(array.shape), array, f"{path}: {name}")
    return len(cells)


def check_atlas(path):
    """The input triangulation: nodes, lines and triangles of each entity."""
    mesh = meshio.read(path, file_format="gmsh")
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.logger.start()
    gmsh.open(path)
    said = [line for line in gmsh.logger.get() if line.startswith(("Warning", "Error"))]
    assert not said, f"{path}: {said}"
    tags, points, _ = gmsh.model.mesh.getNodes()
    places = dict(zip(tags, points.reshape(-1, 3).tolist()))
    expected = []
    for dimension, entity in gmsh.model.getEntities():
        for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dimension, entity)):
            name, _, _, count, _, _ = gmsh.model.mesh.getElementProperties(kind)
            expected.append((dimension, entity, [[places[n] for n in element] for element in nodes.reshape(-1, count)]))
    gmsh.logger.stop()
    gmsh.finalize()
    entities = mesh.cell_data["gmsh:geometrical"]
    found = [(c.dim, int(e[0]), mesh.points[c.data].tolist()) for c, e in zip(mesh.cells, entities)]
    assert all((e == e[0]).all() for e in entities), f"{path}: entities"
    assert len(mesh.points) == len(tags) > 0, f"{path}: {len(mesh.points)} points, {len(tags)} nodes"
    assert found == expected, f"{path}: meshio and Gmsh read different elements"
    return sum(len(triangles) for dimension, _, triangles in found if dimension == 2)


def main():
    warnings.simplefilter("error")
    for folder in sys.argv[1:]:
        cells = [check_grid(f"{folder}/{name}") for name in ("surface.vtu", "param.vtu")]
        triangles = check_atlas(f"{folder}/atlas.msh")
        assert cells == [triangles] * 2, f"{folder}: {cells} cells, {triangles} triangles"
        print(f"ok {folder}: {triangles} triangles")


main()
