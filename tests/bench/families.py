"""Surfaces of any size for performance.py, each made of numpy alone: binary STL files that are the same bytes every time.

  bump      a closed surface of genus 0 with hills, cut from a grid: slivers, as scanners and simulations leave them
  plate     a flat box with n x n square holes: genus n^2
  spheres   n spheres side by side: n components
  stairs    a voxel staircase, bored through: flat faces, thousands of features, genus as large
  menger    a Menger sponge: genus grows as 20^level
"""
import numpy as np


def bump(triangles):
    """About so many triangles, on the level set of a function that is sampled on a grid."""
    from vtk import vtkFlyingEdges3D, vtkImageData
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    # Triangles go with the square of the points along a side: 8.6 for each, by counting.
    n = max(8, round((triangles / 4.6) ** 0.5))
    x = np.linspace(-1.05, 1.05, n)
    step = x[1] - x[0]
    levels = []
    for z in x:
        X, Y = np.meshgrid(x, x, indexing="ij")
        r = np.sqrt(X * X + Y * Y + z * z) + 1e-12
        f = r - (0.75 + 0.08 * np.sin(7 * X / r + 1) * np.cos(6 * Y / r) + 0.06 * np.cos(9 * z / r))
        # Points of the grid nearly on the surface make triangles without area.
        levels.append(np.where(np.abs(f) < 0.02 * step, np.copysign(0.02 * step, f), f).astype(np.float32))
    image = vtkImageData()
    image.SetDimensions(n, n, n)
    image.SetSpacing(step, step, step)
    image.SetOrigin(-1.05, -1.05, -1.05)
    values = np.stack(levels, 2).ravel(order="F")
    image.GetPointData().SetScalars(numpy_to_vtk(values))
    surface = vtkFlyingEdges3D()
    surface.SetInputData(image)
    surface.SetValue(0, 0.0)
    surface.ComputeNormalsOff()
    surface.Update()
    found = surface.GetOutput()
    cells = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return vtk_to_numpy(found.GetPoints().GetData()).astype(float), cells


def of_voxels(solid):
    """The boundary of a solid of cubes, two triangles for each face of one."""
    padded = np.pad(solid, 1)
    corners, faces = [], []
    for axis in range(3):
        for side in (0, 1):
            inside = padded[tuple(slice(1, -1) for _ in range(3))]
            beyond = np.roll(padded, 1 - 2 * side, axis)[tuple(slice(1, -1) for _ in range(3))]
            at = np.argwhere(inside & ~beyond)
            u, v = [k for k in range(3) if k != axis]
            quad = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = at.copy()
                corner[:, axis] += side
                corner[:, u] += a
                corner[:, v] += b
                quad.append(corner)
            # Counterclockwise, seen from outside.
            if (side == 1) != (axis != 1):
                quad.reverse()
            corners.append(np.stack(quad, 1).reshape(-1, 3))
            first = 4 * np.arange(len(at))[:, None] + sum(len(c) for c in corners[:-1])
            faces.append(np.concatenate([first + [0, 1, 2], first + [0, 2, 3]]))
    points, number = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    return points.astype(float), number.ravel()[np.concatenate(faces)]


def plate(triangles):
    n = max(1, round((triangles / 22) ** 0.5))
    solid = np.ones((2 * n + 1, 2 * n + 1, 1), bool)
    solid[1::2, 1::2] = False
    return of_voxels(solid)


def spheres(triangles):
    rows = 10
    angles = np.linspace(0, np.pi, rows + 1)[1:-1]
    turns = 2 * np.pi * np.arange(2 * rows) / (2 * rows)
    ring = np.stack([np.outer(np.sin(angles), np.cos(turns)), np.outer(np.sin(angles), np.sin(turns)),
                     np.outer(np.cos(angles), np.ones(2 * rows))], 2).reshape(-1, 3)
    points = np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    cells = []
    for j in range(2 * rows):
        k = (j + 1) % (2 * rows)
        cells += [[len(ring), j, k], [len(ring) + 1, (rows - 2) * 2 * rows + k, (rows - 2) * 2 * rows + j]]
        for i in range(rows - 2):
            a, b, c, d = (i * 2 * rows + j, (i + 1) * 2 * rows + j, (i + 1) * 2 * rows + k, i * 2 * rows + k)
            cells += [[a, b, c], [a, c, d]]
    cells = np.array(cells)
    count = max(1, round(triangles / len(cells)))
    side = int(np.ceil(count ** (1 / 3)))
    at = np.array([[k % side, k // side % side, k // side // side] for k in range(count)]) * 2.5
    return (at[:, None] + points).reshape(-1, 3), (np.arange(count)[:, None, None] * len(points) + cells).reshape(-1, 3)


def stairs(triangles):
    n = max(4, round((triangles / 16) ** 0.5))
    height = np.add.outer(np.arange(n), np.arange(n)) // 2 + 1
    solid = np.arange(n)[None, None, :] < height[:, :, None]
    solid[1::4, 1::4, :] = False
    return of_voxels(solid)


def menger(triangles):
    level = max(1, round(np.log(triangles / 36) / np.log(20)) + 1)
    solid = np.ones((1, 1, 1), bool)
    for _ in range(level):
        size = 3 * solid.shape[0]
        fine = np.kron(solid, np.ones((3, 3, 3), bool))
        middle = np.arange(size) % 3 == 1
        holes = (middle[:, None, None] & middle[None, :, None]) | (middle[:, None, None] & middle[None, None, :]) | (
            middle[None, :, None] & middle[None, None, :])
        solid = fine & ~holes
    return of_voxels(solid)


FAMILIES = {f.__name__: f for f in (bump, plate, spheres, stairs, menger)}


def write(path, family, triangles):
    """Writes a surface as STL; how many triangles it has."""
    points, cells = FAMILIES[family](triangles)
    corners = points[cells].astype("<f4")
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    facets = np.zeros(len(cells), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["normal"], facets["corners"] = normals, corners
    with open(path, "wb") as file:
        file.write(family.encode().ljust(80, b"\0") + np.uint32(len(cells)).tobytes() + facets.tobytes())
    return len(cells)


if __name__ == "__main__":
    import sys

    if len(sys.argv) != 4 or sys.argv[1] not in FAMILIES:
        sys.exit(f"usage: families.py {'|'.join(FAMILIES)} TRIANGLES FILE.stl")
    print(write(sys.argv[3], sys.argv[1], int(sys.argv[2])))
