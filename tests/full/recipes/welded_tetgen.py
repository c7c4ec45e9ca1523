"""The input's own triangles, closed again, filled by TetGen's Python module."""

import collections

import meshio
import numpy as np
import shapes
from recipe import Recipe

recipe = Recipe("The input's own triangles: welded.vtu", packages=["tetgen", "meshio"])
shapes.write("cube.stl", shapes.cube())
recipe.shell()
found = recipe.python()
recipe.near("volume", found["volume"], 1, 1e-9)
assert found["names"] == {"bottom": 1, "walls": 2, "top": 3}, found["names"]
for name, area in {"bottom": 1, "walls": 4, "top": 1}.items():
    corners = found["nodes"][found["sides"][found["marks"] == found["names"][name]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    recipe.near(f"area of {name}", np.linalg.norm(normals, axis=1).sum() / 2, area, 1e-9)


def open_edges(path):
    mesh = meshio.read(path)
    triangles = mesh.cells[0].data.astype(int)
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]))
    return sum(uses == 1 for uses in collections.Counter(map(tuple, sides.tolist())).values())


assert open_edges("out/cube.stl/welded.vtu") == 0 and open_edges("out/cube.stl/surface.vtu") > 0
recipe.done()
