"""verify_also.py [--break WHAT] RESULT...: reads surface.obj, surface.glb and welded.vtu of each result, as `--also` writes
them, by other programs than planish: trimesh, VTK, meshio, and the few lines below that go by the specifications.

- welded.vtu is closed where the report says that the surface has no boundary, and so is surface.obj as trimesh reads it.
- Triangles are those of surface.vtu, in welded.vtu one by one.
- Texture coordinates lie in the unit square, no triangle is turned over there, and those of surface.obj and surface.glb agree,
  v up and v down.
- Labels have their names in surface.obj and surface.glb, and their tags in welded.vtu.

--break changes what was read before it is judged (open: a seam of welded.vtu is cut; flip: v of surface.glb points up; names:
a label is called otherwise; fold: a corner in surface.obj lies elsewhere): then it must be told.
"""
import json
import struct
import sys
import warnings

import meshio
import numpy
import trimesh
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader


def read_obj(path):
    """Points, texture coordinates, and per group its corners: [vertex, coordinate], from 0."""
    points, coordinates, groups = [], [], {}
    group = None
    with open(path, encoding="ascii") as file:
        lines = file.read().splitlines()
    for line in lines:
        word, *rest = line.split()
        if word == "v":
            points.append([float(x) for x in rest])
        elif word == "vt":
            coordinates.append([float(x) for x in rest])
        elif word == "g":
            group = rest[0]
            assert group not in groups, f"{path}: group {group} comes twice"
        elif word == "f":
            corners = [[int(i) - 1 for i in corner.split("/")] for corner in rest]
            groups.setdefault(group, []).append(corners)
        else:
            assert word == "#", f"{path}: {line}"
    return numpy.array(points), numpy.array(coordinates), {name: numpy.array(c) for name, c in groups.items()}


def read_glb(path):
    """By the specification: per mesh its name, points, texture coordinates, triangles."""
    with open(path, "rb") as file:
        data = file.read()
    magic, version, length, json_length, json_kind = struct.unpack_from("<4sII I4s", data)
    assert (magic, version, length, json_kind) == (b"glTF", 2, len(data), b"JSON"), path
    document = json.loads(data[20:20 + json_length])
    binary_length, binary_kind = struct.unpack_from("<I4s", data, 20 + json_length)
    assert binary_kind == b"BIN\0" and binary_length % 4 == json_length % 4 == 0, path
    binary = data[28 + json_length:28 + json_length + binary_length]
    assert document["buffers"] == [{"byteLength": len(binary)}], path

    def array(index):
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]]
        kind = {5125: "<u4", 5126: "<f4"}[accessor["componentType"]]
        found = numpy.frombuffer(binary, kind, accessor["count"] * width, view["byteOffset"]).reshape(-1, width)
        assert found.nbytes == view["byteLength"] and view["byteOffset"] % 4 == 0, path
        for name, bound in (("min", found.min(0)), ("max", found.max(0))):
            assert name not in accessor or (numpy.array(accessor[name]) == bound).all(), f"{path}: {name}"
        return found

    meshes = []
    for node in (document["nodes"][i] for i in document["scenes"][document["scene"]]["nodes"]):
        mesh = document["meshes"][node["mesh"]]
        assert mesh["name"] == node["name"] and len(mesh["primitives"]) == 1, path
        primitive = mesh["primitives"][0]
        attributes = primitive["attributes"]
        assert "min" in document["accessors"][attributes["POSITION"]], path
        points = array(attributes["POSITION"]).astype(float) + numpy.array(node["translation"])
        triangles = array(primitive["indices"]).reshape(-1, 3)
        meshes.append((mesh["name"], points, array(attributes["TEXCOORD_0"]).astype(float), triangles))
    return meshes


def read_grid(path):
    """Points, triangles of six nodes and the arrays of the cells: as VTK reads them, and meshio, too."""
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid, mesh = reader.GetOutput(), meshio.read(path)
    types = {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())}
    assert types == {22} and [c.type for c in mesh.cells] == ["triangle6"], f"{path}: {types}"
    points = vtk_to_numpy(grid.GetPoints().GetData())
    cells = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 6)
    assert (mesh.points == points).all() and (mesh.cells[0].data == cells).all(), f"{path}: meshio reads other cells"
    fields = {name: data[0] for name, data in mesh.cell_data.items()}
    return points, cells.copy(), fields


def sides(triangles):
    """How many triangles each edge has, by its ends, and whether it has them once in each direction."""
    directed = numpy.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    edges, number = numpy.unique(numpy.sort(directed, 1), axis=0, return_inverse=True)
    forward = numpy.bincount(number.reshape(-1), numpy.where(directed[:, 0] < directed[:, 1], 1, -1))
    return edges, numpy.bincount(number.reshape(-1)), (forward == 0)


def check_closed(path, triangles, points, report):
    surface = report["surface"]["repaired"]
    edges, counts, both_ways = sides(triangles)
    # Where sheets touch in a vertex, repair gives each its own, and these files join them again.
    counted = (surface, report["surface"]["raw"])
    is_manifold = all(c["nonmanifold_edges"] == c["nonmanifold_vertices"] == 0 for c in counted)
    assert ((counts == 1).sum() == 0) == (surface["boundary_loops"] == 0), f"{path}: {(counts == 1).sum()} open edges"
    if is_manifold:
        assert counts.max() <= 2, f"{path}: edges of {counts.max()} triangles"
        used = len(numpy.unique(triangles))
        euler = used - len(edges) + len(triangles)
        assert euler == surface["euler"] and used == points, f"{path}: Euler's number is {euler}, of {points} vertices {used} are used"
    if is_manifold and surface["orientable"]:
        assert both_ways[counts == 2].all(), f"{path}: triangles turn differently"


def check_welded(folder, report, broken):
    path = f"{folder}/welded.vtu"
    points, cells, fields = read_grid(path)
    apart, open_cells, open_fields = read_grid(f"{folder}/surface.vtu")
    if broken == "open":
        cells, points = open_cells, apart
    assert (points[cells] == apart[open_cells]).all(), f"{path}: other triangles than in surface.vtu"
    for name in ("chart", "triangle"):
        assert (fields[name] == open_fields[name]).all(), f"{path}: {name}"
    corners = cells[:, :3]
    check_closed(path, corners, len(numpy.unique(corners)), report)
    middles = cells[:, 3:].reshape(-1)
    ends = numpy.sort(numpy.stack([corners, numpy.roll(corners, -1, 1)], 2).reshape(-1, 2), 1)
    assert len(numpy.unique(middles)) == len(numpy.unique(ends, axis=0)), f"{path}: edges with several middles"
    assert (points[middles] == 0.5 * points[ends[:, 0]] + 0.5 * points[ends[:, 1]]).all(), f"{path}: middles"
    assert len(points) == len(numpy.unique(cells)), f"{path}: nodes that no triangle has"
    tags = sorted(label["tag"] for label in report["content"].get("labels", []))
    found = sorted(set(fields["label"].tolist())) if "label" in fields else []
    assert found == tags, f"{path}: labels {found}, not {tags}"
    return len(cells)


def check_coordinates(path, coordinates, triangles):
    assert (coordinates >= 0).all() and (coordinates <= 1).all(), f"{path}: outside of the unit square"
    a, b, c = (coordinates[triangles[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (area > 0).all(), f"{path}: {(area <= 0).sum()} triangles are turned over in the unit square"


def check_textured(folder, report, broken):
    """surface.obj and surface.glb, corner by corner."""
    obj, glb = f"{folder}/surface.obj", f"{folder}/surface.glb"
    points, coordinates, groups = read_obj(obj)
    meshes = read_glb(glb)
    labels = report["content"].get("labels", [])
    if broken == "names":
        meshes[0] = ("something else", *meshes[0][1:])
    if broken == "fold":
        corner = groups[next(iter(groups))][0][0][1]
        coordinates[corner] = 1 - coordinates[corner]
    assert list(groups) == ([label["group"] for label in labels] or [None]), f"{obj}: groups {list(groups)}"
    assert [m[0] for m in meshes] == ([label["name"] for label in labels] or ["surface"]), f"{glb}: {[m[0] for m in meshes]}"
    corners = numpy.concatenate(list(groups.values()))
    check_coordinates(obj, coordinates, corners[:, :, 1])
    check_closed(obj, corners[:, :, 0], len(points), report)
    extent = (points.max(0) - points.min(0)).max()
    for (name, places, uv, triangles), group in zip(meshes, groups.values()):
        up = uv if broken == "flip" else numpy.stack([uv[:, 0], 1 - uv[:, 1]], 1)
        distance = numpy.abs(places[triangles] - points[group[:, :, 0]]).max()
        assert distance <= 2.0**-24 * extent, f"{glb}: {name} is {distance} away from surface.obj"
        difference = numpy.abs(up[triangles] - coordinates[group[:, :, 1]]).max()
        assert difference <= 2.0**-23, f"{glb}: texture coordinates of {name} differ from those of surface.obj by {difference}"
        check_coordinates(glb, up, triangles)
    return len(corners)


def check_trimesh(folder, report):
    """What trimesh makes of both, which many programs in Python go through."""
    labels = report["content"].get("labels", [])
    is_closed = report["surface"]["repaired"]["boundary_loops"] == 0
    welded = trimesh.load(f"{folder}/surface.obj", force="mesh", process=False, maintain_order=True)
    assert not is_closed or welded.is_watertight, f"{folder}/surface.obj: trimesh reads an open surface"
    painted = trimesh.load(f"{folder}/surface.obj", force="mesh", process=False)
    assert len(painted.visual.uv) == len(painted.vertices), f"{folder}/surface.obj: trimesh reads no texture coordinates"
    scene = trimesh.load(f"{folder}/surface.glb", force="scene", process=False)
    names = [label["name"] for label in labels] or ["surface"]
    assert sorted(scene.geometry) == sorted(names), f"{folder}/surface.glb: trimesh reads {list(scene.geometry)}"
    shown = scene.to_geometry() if hasattr(scene, "to_geometry") else scene.dump(concatenate=True)
    assert numpy.allclose(shown.bounds, welded.bounds, rtol=0, atol=1e-6 * welded.extents.max()), f"{folder}: other bounds"
    return len(welded.faces), len(shown.faces)


def main():
    warnings.simplefilter("error")
    args = sys.argv[1:]
    broken = args[1] if args[0] == "--break" else None
    for folder in args[2:] if broken else args:
        with open(f"{folder}/report.json", encoding="utf-8") as file:
            report = json.load(file)
        counts = {check_welded(folder, report, broken), check_textured(folder, report, broken), *check_trimesh(folder, report)}
        assert len(counts) == 1, f"{folder}: {counts} triangles"
        print(f"ok {folder}: {counts.pop()} triangles")


main()
