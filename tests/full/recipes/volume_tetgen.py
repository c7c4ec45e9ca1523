"""The inside of a cube of named sides by TetGen's program, from the remeshed surface."""

import numpy as np
import shapes
from recipe import Recipe

recipe = Recipe("A volume by TetGen", needs=["tetgen"])
shapes.write("cube.stl", shapes.cube())
recipe.shell()


def table(path):
    rows = [line.split() for line in open(path, encoding="ascii") if not line.startswith("#")]
    return np.array([row for row in rows[1:] if row], dtype=float)


nodes, tetrahedra, faces = (table(f"cube.1.{end}") for end in ("node", "ele", "face"))
corners = nodes[tetrahedra[:, 1:5].astype(int) - 1][:, :, 1:4]
edges = corners[:, 1:] - corners[:, :1]
recipe.near("volume", np.abs(np.linalg.det(edges)).sum() / 6, 1, 1e-9)
for tag, area in {1: 1, 2: 4, 3: 1}.items():
    corners = nodes[faces[faces[:, -1] == tag][:, 1:4].astype(int) - 1][:, :, 1:4]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    recipe.near(f"area of {tag}", np.linalg.norm(normals, axis=1).sum() / 2, area, 1e-9)
recipe.done()
