"""Names survive: from a file with named parts, through surface.vtu and atlas.msh, to every file that Gmsh writes.

usage: verify_names.py [--break] INPUT RESULT

INPUT is a text STL of named solids, or a legacy VTK file with an array `region`. Gmsh meshes RESULT/remesh.geo once and writes
the mesh in every format that knows groups; each file is read again by a reader that is neither Gmsh's nor ours, and the area
under every name is compared with that of the input: to 1e-9 where triangles are those of the input, or where the surface is
made of planes, elsewhere within what the mesh as a whole loses. Nodes on borders between names lie on the input's borders.

--break gives one triangle of the mesh another name first: that must be found.
"""

import collections
import os
import re
import shutil
import subprocess
import sys

import gmsh
import h5py
import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

EXPORTS = ["msh", "stl", "inp", "vtk", "unv", "med", "cgns"]


def area(triangles):
    sides = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return 0.5 * np.linalg.norm(np.cross(*sides), axis=1)


def group_of(name):
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name.strip())


def read_stl(path):
    """The corners of the triangles of every solid of a text file."""
    found, name, corners = collections.defaultdict(list), None, []
    for line in open(path, encoding="utf-8"):
        words = line.split()
        if words[:1] == ["solid"]:
            name = line.strip()[5:].strip()
        elif words[:1] == ["vertex"]:
            corners.append([float(w) for w in words[1:4]])
        elif words[:1] == ["endfacet"]:
            found[name].append(corners)
            corners = []
    return {name: np.array(triangles) for name, triangles in found.items()}


def read_regions(path):
    reader = vtk.vtkPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    data = reader.GetOutput()
    points = vtk_to_numpy(data.GetPoints().GetData()).astype(float)
    corners = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    regions = vtk_to_numpy(data.GetCellData().GetArray("region"))
    return {f"region_{value}": points[corners[regions == value]] for value in np.unique(regions)}


def of_result(folder):
    """The triangles under each name in surface.vtu, whose field data tell the tags of names."""
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(os.path.join(folder, "surface.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    points = vtk_to_numpy(grid.GetPoints().GetData())
    corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 6)[:, :3]
    labels = vtk_to_numpy(grid.GetCellData().GetArray("label"))
    fields = grid.GetFieldData()
    arrays = [fields.GetArray(i) for i in range(fields.GetNumberOfArrays())]
    return {a.GetName(): points[corners[labels == a.GetValue(0)]] for a in arrays}


def of_blocks(folder):
    reader = vtk.vtkXMLMultiBlockDataReader()
    reader.SetFileName(os.path.join(folder, "atlas.vtm"))
    reader.Update()
    surface = reader.GetOutput().GetBlock(0)
    found = {}
    for i in range(surface.GetNumberOfBlocks()):
        name, grid = surface.GetMetaData(i).Get(vtk.vtkCompositeDataSet.NAME()), surface.GetBlock(i)
        points = vtk_to_numpy(grid.GetPoints().GetData())
        found[name] = points[vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 6)[:, :3]]
    return found


def of_msh(path):
    mesh = meshio.read(path)
    names = {int(tag): name for name, (tag, dimension) in mesh.field_data.items() if dimension == 2}
    found = collections.defaultdict(list)
    for block, tags in zip(mesh.cells, mesh.cell_data["gmsh:physical"]):
        for tag in np.unique(tags) if block.type == "triangle" else []:
            found[names[int(tag)]].append(mesh.points[block.data[tags == tag]])
    return {name: np.concatenate(triangles) for name, triangles in found.items()}


def of_vtk(path, names):
    mesh = meshio.read(path)
    found = {}
    for block, tags in zip(mesh.cells, mesh.cell_data["CellEntityIds"]):
        tags = np.asarray(tags).ravel()
        for tag in np.unique(tags) if block.type == "triangle" else []:
            found[names[int(tag)]] = mesh.points[block.data[tags == tag]]
    return found


def of_inp(path):
    mesh = meshio.read(path)
    found = {}
    for name, sets in mesh.cell_sets.items():
        blocks = [(b, s) for b, s in zip(mesh.cells, sets) if b.type == "triangle" and s is not None and len(s)]
        if blocks and not re.fullmatch(r"Surface\d+", name):
            found[name] = np.concatenate([mesh.points[b.data[np.asarray(s, dtype=int)]] for b, s in blocks])
    return found


def of_med(path):
    mesh = meshio.read(path)
    found = collections.defaultdict(list)
    for block, tags in zip(mesh.cells, mesh.cell_data["cell_tags"]):
        for tag in np.unique(tags) if block.type == "triangle" else []:
            for name in mesh.cell_tags[int(tag)]:
                found[name].append(mesh.points[block.data[tags == tag]])
    return {name: np.concatenate(triangles) for name, triangles in found.items()}


def of_unv(path):
    """Datasets 2411 (nodes), 2412 (elements) and 2467 or 2477 (groups), as I-deas defines them."""
    text = open(path, encoding="ascii").read().replace("D+", "e+").replace("D-", "e-")
    sections = {}
    for part in re.split(r"^ {4}-1$", text, flags=re.M):
        lines = part.strip("\n").split("\n")
        if lines[0].strip().isdigit():
            sections[int(lines[0])] = lines[1:]
    nodes, elements, found = {}, {}, {}
    lines = sections[2411]
    for head, place in zip(lines[0::2], lines[1::2]):
        nodes[int(head.split()[0])] = [float(w) for w in place.split()]
    rest = iter(sections[2412])
    for head in rest:
        number, kind = [int(w) for w in head.split()[:2]]
        if kind in (11, 21, 22, 24):
            next(rest)
        corners = [int(w) for w in next(rest).split()]
        if len(corners) == 3:
            elements[number] = corners
    rest = iter(sections.get(2477) or sections[2467])
    for head in rest:
        count, name = int(head.split()[-1]), next(rest).strip()
        tags = []
        while len(tags) < count:
            words = [int(w) for w in next(rest).split()]
            tags += words[1::4]
        triangles = [[nodes[n] for n in elements[t]] for t in tags if t in elements]
        if triangles:
            found[name] = np.array(triangles)
    return found


def of_cgns(path):
    """Families name the sections whose names end as theirs do."""
    tree = h5py.File(path)
    base = next(g for g in tree.values() if isinstance(g, h5py.Group) and g.attrs.get("label") == b"CGNSBase_t")
    zones = [g for g in base.values() if g.attrs.get("label") == b"Zone_t"]
    names = {}
    for family in base.values():
        if family.attrs.get("label") == b"Family_t":
            for child in family.values():
                names[family.name.split("/")[-1]] = bytes(child[" data"][()]).decode().strip("\0")
    found = collections.defaultdict(list)
    for zone in zones:
        points = np.stack([zone[f"GridCoordinates/Coordinate{c}"][" data"][()] for c in "XYZ"], axis=1)
        for section in zone.values():
            if section.attrs.get("label") == b"Elements_t" and "_S_" in section.name:
                corners = section["ElementConnectivity"][" data"][()].reshape(-1, 3) - 1
                entity = "S_" + section.name.split("_S_")[-1]
                found[names[entity]].append(points[corners])
    return {name: np.concatenate(triangles) for name, triangles in found.items()}


def mesh_all(folder, broken):
    """Meshes once, and writes every format; the names of tags."""
    gmsh.initialize(["", "-v", "1"])
    gmsh.open(os.path.join(folder, "remesh.geo"))
    gmsh.model.mesh.generate(2)
    names = {t: gmsh.model.getPhysicalName(d, t) for d, t in gmsh.model.getPhysicalGroups(2)}
    made = os.path.join(folder, "exports")
    shutil.rmtree(made, ignore_errors=True)
    os.mkdir(made)
    if broken:
        first, second = sorted(names)[:2]
        moved = gmsh.model.getEntitiesForPhysicalGroup(2, first)[:1]
        keep = {t: set(gmsh.model.getEntitiesForPhysicalGroup(2, t)) for t in (first, second)}
        gmsh.model.removePhysicalGroups([(2, first), (2, second)])
        gmsh.model.addPhysicalGroup(2, sorted(keep[first] - set(moved)), first, names[first])
        gmsh.model.addPhysicalGroup(2, sorted(keep[second] | set(moved)), second, names[second])
    for extension in EXPORTS:
        gmsh.write(os.path.join(made, f"out.{extension}"))
    gmsh.finalize()
    return made, names


def compare(what, expected, found, tolerance):
    assert set(found) == set(expected), f"{what}: names {sorted(found)} instead of {sorted(expected)}"
    for name, triangles in expected.items():
        ratio = area(found[name]).sum() / area(triangles).sum()
        assert abs(ratio - 1) <= tolerance, f"{what}: {name} has {ratio} of its area"


def borders(parts):
    """The edges between names, as pairs of ends."""
    sides = collections.defaultdict(set)
    for name, triangles in parts.items():
        for triangle in triangles:
            corners = [tuple(p) for p in triangle]
            for k in range(3):
                sides[frozenset((corners[k], corners[(k + 1) % 3]))].add(name)
    return np.array([list(edge) for edge, names in sides.items() if len(names) > 1])


def check_borders(expected, found):
    lines = borders(expected)
    nodes = np.unique(borders(found).reshape(-1, 3), axis=0)
    assert len(nodes) > 3, "no border between names"
    points = np.concatenate([t.reshape(-1, 3) for t in expected.values()])
    diagonal = np.linalg.norm(points.max(axis=0) - points.min(axis=0))
    begin, along = lines[:, 0], lines[:, 1] - lines[:, 0]
    worst = 0.0
    for node in nodes:
        t = np.clip(((node - begin) * along).sum(axis=1) / (along * along).sum(axis=1), 0, 1)
        worst = max(worst, np.linalg.norm(begin + t[:, None] * along - node, axis=1).min())
    assert worst <= 1e-9 * diagonal, f"a node of a border lies {worst} off"
    return worst


def main():
    broken = "--break" in sys.argv
    source, folder = [a for a in sys.argv[1:] if a != "--break"]
    expected = read_stl(source) if source.endswith(".stl") else read_regions(source)
    compare("surface.vtu", expected, of_result(folder), 1e-9)
    compare("atlas.vtm", expected, of_blocks(folder), 1e-9)
    groups = {group_of(name): triangles for name, triangles in expected.items()}
    compare("atlas.msh", groups, of_msh(os.path.join(folder, "atlas.msh")), 1e-9)
    made, names = mesh_all(folder, broken)
    path = lambda extension: os.path.join(made, f"out.{extension}")
    mesh = of_msh(path("msh"))
    whole = sum(area(t).sum() for t in mesh.values()) / sum(area(t).sum() for t in groups.values())
    tolerance = 1e-9 + 2 * abs(whole - 1)
    compare("out.msh", groups, mesh, tolerance)
    # Text of six digits, or of single precision, keeps no more.
    compare("out.stl", groups, read_stl(path("stl")), tolerance + 1e-5)
    compare("out.inp", groups, of_inp(path("inp")), tolerance)
    compare("out.vtk", groups, of_vtk(path("vtk"), names), tolerance)
    compare("out.unv", groups, of_unv(path("unv")), tolerance)
    compare("out.med", groups, of_med(path("med")), tolerance)
    compare("out.cgns", groups, of_cgns(path("cgns")), tolerance)
    off = check_borders(expected, mesh)
    print(f"ok {len(groups)} names in {2 + len(EXPORTS)} files, borders off by {off:.2e}, area {whole:.9f}")


if __name__ == "__main__":
    main()
