"""The share of the edges of a mesh whose length is within [1/sqrt 2, sqrt 2] of a size. Usage: verify_lengths.py MESH SIZE"""

import sys

import meshio
import numpy as np

mesh = meshio.read(sys.argv[1])
corners = np.vstack([block.data[:, :3] for block in mesh.cells if block.type.startswith("triangle")])
sides = np.sort(np.vstack([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
edges = np.unique(sides, axis=0)
lengths = np.linalg.norm(mesh.points[edges[:, 0]] - mesh.points[edges[:, 1]], axis=1) / float(sys.argv[2])
print(((lengths >= 0.5**0.5) & (lengths <= 2**0.5)).mean())
