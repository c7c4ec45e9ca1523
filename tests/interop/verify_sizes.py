"""Edges of a mesh are as long as an array of points asks for.

usage: verify_sizes.py [--break] RESULT

RESULT is that of a flat square of side 1, whose array asks for 0.01 + 0.09 x. Gmsh meshes RESULT/remesh.geo; in each of nine
bands across the square the median length of the edges whose middle lies in it is compared with the median of what is asked
for there, within 10 %.

--break asks for 0.055 everywhere: that must be found.
"""

import os
import sys

import gmsh
import numpy as np

TOLERANCE = 0.1


def edges(folder):
    gmsh.initialize(["", "-v", "1"])
    gmsh.open(os.path.join(folder, "remesh.geo"))
    gmsh.model.mesh.generate(2)
    tags, points, _ = gmsh.model.mesh.getNodes()
    place = dict(zip(tags, points.reshape(-1, 3)))
    corners = gmsh.model.mesh.getElementsByType(2)[1].reshape(-1, 3)
    gmsh.finalize()
    pairs = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    return np.array([[place[a], place[b]] for a, b in pairs])


def main():
    broken = "--break" in sys.argv
    (folder,) = [a for a in sys.argv[1:] if a != "--break"]
    ends = edges(folder)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    x = ends.mean(axis=1)[:, 0]
    asked = np.full_like(x, 0.055) if broken else 0.01 + 0.09 * x
    ratios = []
    for begin in np.linspace(0.0, 0.9, 10)[:9]:
        band = (x >= begin) & (x < begin + 0.1)
        assert band.sum() >= 5, f"{band.sum()} edges from x = {begin} on"
        ratios.append(np.median(lengths[band]) / np.median(asked[band]))
        assert abs(ratios[-1] - 1) <= TOLERANCE, f"from x = {begin:.1f} on edges are {ratios[-1]:.3f} times as long as asked for"
    print(f"ok {len(lengths)} edges, {min(ratios):.3f} to {max(ratios):.3f} times as long as asked for")


if __name__ == "__main__":
    main()
