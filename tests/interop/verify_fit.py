"""Meshes by Gmsh have the sizes that were asked for. Shares no code with planish.

usage: verify_fit.py curvature RESULT CURVATURE EDGES     the median of length times curvature is 2 pi / EDGES within 10 %
       verify_fit.py deviation RESULT MESH D              mesh and surface are nowhere farther than D from each other
"""

import os
import sys

import gmsh
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy


def elements():
    """The nodes and triangles of the mesh that Gmsh has, in the unit of files."""
    tags, points, _ = gmsh.model.mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, int)
    number[tags.astype(int)] = np.arange(len(tags))
    triangles = [gmsh.model.mesh.getElements(2, tag)[2][0] for _, tag in gmsh.model.getEntities(2)]
    corners = np.concatenate([number[t.astype(int)].reshape(-1, 3) for t in triangles])
    return points.reshape(-1, 3) * gmsh.option.getNumber("Mesh.ScalingFactor"), corners


def curvature(folder, k, edges):
    gmsh.initialize(["", "-v", "1"])
    gmsh.open(os.path.join(folder, "remesh.geo"))
    gmsh.model.mesh.generate(2)
    points, corners = elements()
    sides = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    sides = np.unique(sides, axis=0)
    lengths = np.linalg.norm(points[sides[:, 0]] - points[sides[:, 1]], axis=1)
    ratio = np.median(lengths) * k * edges / (2 * np.pi)
    assert abs(ratio - 1) < 0.1, f"edges are {ratio} times as long as they should be"
    print(f"ok {len(corners)} triangles, median {ratio:.3f}")


def polydata(points, corners):
    data, cells = vtk.vtkPolyData(), vtk.vtkCellArray()
    places = vtk.vtkPoints()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=1))
    listed = np.c_[np.full(len(corners), 3), corners].ravel().astype(np.int64)
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(listed, deep=1))
    data.SetPoints(places)
    data.SetPolys(cells)
    return data


def farthest(samples, points, corners):
    locator = vtk.vtkStaticCellLocator()
    locator.SetDataSet(polydata(points, corners))
    locator.BuildLocator()
    near, cell, sub, squared = [0.0] * 3, vtk.reference(0), vtk.reference(0), vtk.reference(0.0)
    worst = 0.0
    for x in samples:
        locator.FindClosestPoint(x, near, cell, sub, squared)
        worst = max(worst, float(squared))
    return worst**0.5


def samples(points, corners, most):
    """Points of every triangle: its corners, and some inside, more of large ones, so many altogether."""
    p = points[corners]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    rng = np.random.default_rng(1)
    chosen = rng.choice(len(corners), most, p=area / area.sum())
    u, v = rng.random(most), rng.random(most)
    folded = u + v > 1
    u[folded], v[folded] = 1 - u[folded], 1 - v[folded]
    q = p[chosen]
    inside = q[:, 0] + u[:, None] * (q[:, 1] - q[:, 0]) + v[:, None] * (q[:, 2] - q[:, 0])
    return np.concatenate([points[np.unique(corners)], p.mean(axis=1), inside])


def deviation(folder, mesh, limit):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(os.path.join(folder, "surface.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    surface = vtk_to_numpy(grid.GetPoints().GetData()).astype(float)
    faces = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 6)[:, :3].astype(int)
    gmsh.initialize(["", "-v", "1"])
    gmsh.merge(mesh)
    points, corners = elements()
    to = farthest(samples(points, corners, 30_000), surface, faces)
    back = farthest(samples(surface, faces, 30_000), points, corners)
    assert max(to, back) <= limit * (1 + 1e-9), f"{to} from mesh to surface, {back} back, more than {limit}"
    print(f"ok {len(corners)} triangles, {to:.3e} to the surface, {back:.3e} back, at most {limit}")


if __name__ == "__main__":
    if sys.argv[1] == "curvature":
        curvature(sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))
    else:
        deviation(sys.argv[2], sys.argv[3], float(sys.argv[4]))
