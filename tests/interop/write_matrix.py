"""write_matrix.py FOLDER [SIZE]: writes one surface in every format and encoding of VTK, meshio and Gmsh, and tells in
matrix.json what should be read back. SIZE is the number of points along a side.

Coordinates are multiples of 1/64: text and single precision hold them exactly.
"""
import json
import os
import sys

import gmsh
import meshio
import numpy
import vtk
from vtkmodules.util.numpy_support import numpy_to_vtk

SIZE = int(sys.argv[2]) if len(sys.argv) > 2 else 40


def surface():
    """A bumpy square: points, triangles of one half and quadrilaterals of the other."""
    i, j = numpy.meshgrid(numpy.arange(SIZE), numpy.arange(SIZE), indexing="ij")
    z = ((i * 7 + j * 3) % 5) / 64
    points = numpy.stack([i / 4, j / 4, z], axis=-1).reshape(-1, 3)
    corner = (i * SIZE + j)[:-1, :-1].ravel()
    squares = numpy.stack([corner, corner + SIZE, corner + SIZE + 1, corner + 1], axis=1)
    half = len(squares) // 2
    triangles = numpy.concatenate([squares[:half, [0, 1, 2]], squares[:half, [0, 2, 3]]])
    return points, triangles, squares[half:]


def quadratic(points, triangles):
    """The triangles with nodes in the middle of their edges."""
    edges = numpy.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, at = numpy.unique(edges, axis=0, return_inverse=True)
    nodes = numpy.concatenate([points, points[edges].mean(axis=1)])
    return nodes, numpy.concatenate([triangles, len(points) + at.reshape(-1, 3)], axis=1)


POINTS, TRIANGLES, QUADS = surface()
NODES, QUADRATIC = quadratic(POINTS, TRIANGLES)
# What each kind of mesh holds: points, and cells of VTK's types and of meshio's.
KINDS = {
    "triangles": (POINTS, [(5, "triangle", TRIANGLES)]),
    "mixed": (POINTS, [(5, "triangle", TRIANGLES), (9, "quad", QUADS)]),
    "quadratic": (NODES, [(22, "triangle6", QUADRATIC)]),
}


def vtk_points(points, single):
    held = vtk.vtkPoints()
    held.SetData(numpy_to_vtk(points.astype(numpy.float32 if single else numpy.float64), deep=True))
    return held


def with_fields(data):
    """Fields on points, cells and the whole, with names of components: none of it is geometry."""
    for held, count in ((data.GetPointData(), data.GetNumberOfPoints()), (data.GetCellData(), data.GetNumberOfCells())):
        array = numpy_to_vtk(numpy.linspace(0, 1, 2 * count).reshape(-1, 2), deep=True)
        array.SetName("a field")
        array.SetComponentName(0, "POINTS")
        held.AddArray(array)
    names = vtk.vtkStringArray()
    names.SetName("names")
    for name in ("", "POINTS 3 float", "", "a & b < c"):
        names.InsertNextValue(name)
    data.GetFieldData().AddArray(names)
    time = numpy_to_vtk(numpy.array([0.5]), deep=True)
    time.SetName("TIME")
    data.GetFieldData().AddArray(time)
    return data


def grid(kind, single=False):
    points, blocks = KINDS[kind]
    data = vtk.vtkUnstructuredGrid()
    data.SetPoints(vtk_points(points, single))
    for cell_type, _, cells in blocks:
        for cell in cells.tolist():
            data.InsertNextCell(cell_type, len(cell), cell)
    return with_fields(data)


def polydata(kind, single=True):
    points, blocks = KINDS[kind]
    data = vtk.vtkPolyData()
    data.SetPoints(vtk_points(points, single))
    polygons = vtk.vtkCellArray()
    for _, _, cells in blocks:
        for cell in cells.tolist():
            polygons.InsertNextCell(len(cell), cell)
    data.SetPolys(polygons)
    return with_fields(data)


def strips():
    stripper = vtk.vtkStripper()
    stripper.SetInputData(polydata("triangles"))
    stripper.Update()
    assert stripper.GetOutput().GetNumberOfStrips() > 0
    return with_fields(stripper.GetOutput())


def xml_styles():
    """Every way in which VTK writes XML: a name and what it sets on a writer."""
    modes = [("ascii", False), ("binary", False), ("appended", False), ("appended", True)]
    compressors = ["None", "ZLib", "LZ4", "LZMA"]
    for mode, base64 in modes:
        for compressor in compressors if mode != "ascii" else compressors[:1]:
            for wide in (False, True):
                for big in (False, True):
                    def style(writer, mode=mode, base64=base64, compressor=compressor, wide=wide, big=big):
                        {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary,
                         "appended": writer.SetDataModeToAppended}[mode]()
                        writer.SetEncodeAppendedData(base64)
                        getattr(writer, f"SetCompressorTypeTo{compressor}")()
                        (writer.SetHeaderTypeToUInt64 if wide else writer.SetHeaderTypeToUInt32)()
                        (writer.SetIdTypeToInt64 if wide else writer.SetIdTypeToInt32)()
                        (writer.SetByteOrderToBigEndian if big else writer.SetByteOrderToLittleEndian)()
                        writer.SetBlockSize(4096 if big else 32768)
                    name = f"{mode}{'_base64' if base64 else ''}_{compressor}_{64 if wide else 32}{'big' if big else ''}"
                    yield name, style


def by_vtk(add):
    data = {"mixed.vtp": polydata("mixed"), "strips.vtp": strips(), "mixed.vtu": grid("mixed"),
            "quadratic.vtu": grid("quadratic", single=True)}
    for what, held in data.items():
        kind, extension = what.split(".")
        writer_type = vtk.vtkXMLPolyDataWriter if extension == "vtp" else vtk.vtkXMLUnstructuredGridWriter
        for name, style in xml_styles():
            writer = writer_type()
            style(writer)
            write_vtk(writer, held, add(f"vtk_{kind}_{name}.{extension}", kind.replace("strips", "triangles")))
        for binary in (False, True):
            for version in (42, 51):
                writer = vtk.vtkPolyDataWriter() if extension == "vtp" else vtk.vtkUnstructuredGridWriter()
                (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
                writer.SetFileVersion(version)
                name = f"vtk_{kind}_{extension}_{version}_{'binary' if binary else 'ascii'}.vtk"
                write_vtk(writer, held, add(name, kind.replace("strips", "triangles")))
    write_vtk(vtk.vtkOBJWriter(), polydata("triangles"), add("vtk_triangles.obj", "triangles"))
    for binary in (False, True):
        how = "binary" if binary else "ascii"
        for extension, writer in (("stl", vtk.vtkSTLWriter()), ("ply", vtk.vtkPLYWriter())):
            (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
            write_vtk(writer, polydata("triangles"), add(f"vtk_triangles_{how}.{extension}", "triangles"))
    writer = vtk.vtkPLYWriter()
    writer.SetDataByteOrderToBigEndian()
    write_vtk(writer, polydata("triangles"), add("vtk_triangles_big.ply", "triangles"))
    for extension in ("gltf", "glb"):
        writer = vtk.vtkGLTFWriter()
        writer.InlineDataOn()
        write_vtk(writer, blocks_of(polydata("triangles")), add(f"vtk_triangles.{extension}", "triangles"))
    pieces = vtk.vtkExtractPolyDataPiece()
    pieces.SetInputData(polydata("triangles"))
    pieces.CreateGhostCellsOff()
    writer = vtk.vtkXMLPolyDataWriter()
    writer.SetInputConnection(pieces.GetOutputPort())
    writer.SetNumberOfPieces(3)
    writer.SetFileName(add("vtk_pieces.vtp", "triangles"))
    assert writer.Write() == 1


def blocks_of(data):
    """Two levels of blocks, as the writer of glTF wants them."""
    inner, outer = vtk.vtkMultiBlockDataSet(), vtk.vtkMultiBlockDataSet()
    inner.SetBlock(0, data)
    outer.SetBlock(0, inner)
    return outer


def write_vtk(writer, data, path):
    writer.SetInputData(data)
    writer.SetFileName(path)
    assert writer.Write() == 1 and os.path.getsize(path) > 0, path


def by_meshio(add):
    def write(name, kind, file_format, **options):
        points, blocks = KINDS[kind]
        mesh = meshio.Mesh(points, [(name_of, cells) for _, name_of, cells in blocks])
        if file_format == "gmsh":
            # It wants a surface for each type of cell; nodes may lie on any.
            mesh.point_data["gmsh:dim_tags"] = numpy.array([[2, 1]] * len(points))
            mesh.cell_data["gmsh:geometrical"] = [
                numpy.full(len(cells), i + 1) for i, (_, _, cells) in enumerate(blocks)]
            mesh.cell_data["gmsh:physical"] = [numpy.zeros(len(cells), dtype=int) for _, _, cells in blocks]
        meshio.write(add(f"meshio_{name}", kind), mesh, file_format=file_format, **options)

    for binary in (False, True):
        how = "binary" if binary else "ascii"
        write(f"{how}.stl", "triangles", "stl", binary=binary)
        write(f"{how}.ply", "mixed", "ply", binary=binary)
        for kind in KINDS:
            write(f"{kind}_42_{how}.vtk", kind, "vtk42", binary=binary)
            write(f"{kind}_51_{how}.vtk", kind, "vtk51", binary=binary)
            write(f"{kind}_22_{how}.msh", kind, "gmsh22", binary=binary)
            write(f"{kind}_41_{how}.msh", kind, "gmsh", binary=binary)
    write("mixed.obj", "mixed", "obj")
    write("triangles.off", "triangles", "off")
    write("triangles.mesh", "triangles", "medit")
    write("mixed.mesh", "mixed", "medit")
    # What Gmsh neither writes nor reads: binary files of version 4.0. (meshio has no name for its writer of these.)
    for kind in KINDS:
        points, blocks = KINDS[kind]
        mesh = meshio.Mesh(points, [(name_of, cells) for _, name_of, cells in blocks])
        for binary in (False, True):
            name = add(f"meshio_{kind}_40_{'binary' if binary else 'ascii'}.msh", kind)
            meshio.gmsh._gmsh40.write(name, mesh, binary=binary)
    for kind in KINDS:
        write(f"{kind}_ascii.vtu", kind, "vtu", binary=False)
        for compression in (None, "zlib", "lzma"):
            write(f"{kind}_{compression}.vtu", kind, "vtu", compression=compression)


def by_gmsh(add):
    gmsh.initialize(["gmsh", "-v", "1"])
    for kind, (points, blocks) in KINDS.items():
        gmsh.clear()
        gmsh.model.addDiscreteEntity(2, 1)
        gmsh.model.mesh.addNodes(2, 1, list(range(1, len(points) + 1)), points.ravel())
        for cell_type, _, cells in blocks:
            gmsh.model.mesh.addElementsByType(1, {5: 2, 9: 3, 22: 9}[cell_type], [], (cells + 1).ravel())
        for binary in (0, 1):
            gmsh.option.setNumber("Mesh.Binary", binary)
            how = "binary" if binary else "ascii"
            for version in (2.2, 4.1) if binary else (2.2, 4.0, 4.1):
                gmsh.option.setNumber("Mesh.MshFileVersion", version)
                gmsh.write(add(f"gmsh_{kind}_{version}_{how}.msh", kind))
            gmsh.write(add(f"gmsh_{kind}_{how}.vtk", kind))
        gmsh.write(add(f"gmsh_{kind}.mesh", kind))
        # Its OFF takes the corners of quadratic triangles, and writes all nodes.
        gmsh.write(add(f"gmsh_{kind}.off", kind))
        if kind == "triangles":
            gmsh.write(add("gmsh.stl", kind))
    gmsh.finalize()


def main():
    folder = sys.argv[1]
    files = []

    def add(name, kind):
        files.append({"file": name, "kind": kind})
        return os.path.join(folder, name)

    for write in (by_vtk, by_meshio, by_gmsh):
        write(add)
    cells = {kind: [c[:4 if name == "quad" else 3] for _, name, block in blocks for c in block.tolist()]
             for kind, (_, blocks) in KINDS.items()}
    with open(os.path.join(folder, "matrix.json"), "w", encoding="utf-8") as out:
        json.dump({"points": POINTS.tolist(), "cells": cells, "files": files}, out)


main()
