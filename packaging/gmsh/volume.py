#!/usr/bin/env python3
"""Fills a closed surface mesh with tetrahedra, by Gmsh, and checks that they fit.

    volume.py SURFACE.msh -o VOLUME.msh [--name body] [--size H] [--msh 2.2|4.1]

Physical groups of surfaces stay; `--name` is the group of the volume. A surface inside another one is a hole. The
order of the tetrahedra is that of the triangles: Gmsh alone puts straight tetrahedra under curved triangles, without a
word.

Refused are surfaces that are not closed, in which more than two triangles meet in an edge, whose triangles are of
several orders, inverted or in no group, and parts beside each other. Of what is written it is checked that the outer
sides of the tetrahedra are the triangles of the surface, that none of their nodes has moved, and that no tetrahedron is
inverted anywhere.

Needs Gmsh's Python module: pip install gmsh.
"""

import argparse
import collections
import sys

import gmsh
import numpy as np

TRIANGLE = {1: 2, 2: 9}  # Gmsh's number of the element of an order
TETRAHEDRON = {1: 4, 2: 11}
# The sides of a tetrahedron: three corners, then the middles of the edges between them.
SIDES = {
    1: [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]],
    2: [[0, 1, 2, 4, 5, 6], [0, 1, 3, 4, 9, 7], [0, 2, 3, 6, 8, 7], [1, 2, 3, 5, 8, 9]],
}


def refuse(why):
    sys.exit(f"volume.py: {why}")


def nodes_of(kind, entity):
    """The nodes of the elements of a kind, a row for each."""
    count = gmsh.model.mesh.getElementProperties(kind)[3]
    return gmsh.model.mesh.getElementsByType(kind, entity)[1].astype(np.int64).reshape(-1, count)


def order_of(surfaces):
    kinds = {int(kind) for entity in surfaces for kind in gmsh.model.mesh.getElementTypes(2, entity)}
    order = next((order for order, kind in TRIANGLE.items() if kinds == {kind}), None)
    if order is None:
        names = sorted(gmsh.model.mesh.getElementProperties(kind)[0] for kind in kinds)
        refuse(f"triangles are needed, all of three nodes or all of six; there are: {', '.join(names) or 'none'}")
    return order


def check_closed(triangles):
    uses = collections.Counter()
    for k in range(3):
        uses.update(map(tuple, np.sort(triangles[:, [k, (k + 1) % 3]]).tolist()))
    if alone := sum(n == 1 for n in uses.values()):
        refuse(f"the surface is open along {alone} edges, or parts of it are in no group: only what is in one is saved")
    if crowded := sum(n > 2 for n in uses.values()):
        refuse(f"more than two triangles meet in {crowded} edges: make a volume of each part")


def inverted(kind):
    """How many elements of a kind are inverted somewhere."""
    tags = gmsh.model.mesh.getElementsByType(kind)[0]
    return int((gmsh.model.mesh.getElementQualities(tags, "minDetJac") <= 0).sum())


def check_curved(order):
    """On an inverted triangle no tetrahedron is right."""
    if count := inverted(TRIANGLE[order]):
        refuse(f"{count} triangles of the surface are inverted: `planish check --mesh` tells where; take smaller ones")


def unfold(order):
    """Asks Gmsh to unfold tetrahedra; whether it could is seen afterwards."""
    if count := inverted(TETRAHEDRON[order]):
        print(f"volume.py: {count} tetrahedra are inverted; Gmsh tries to unfold them", file=sys.stderr, flush=True)
        gmsh.option.setNumber("General.AbortOnError", 0)  # its errors would end this program here, by an abort
        gmsh.model.mesh.optimize("HighOrder")


def places():
    """Where each node is."""
    tags, points, _ = gmsh.model.mesh.getNodes()
    return dict(zip(tags.tolist(), points.reshape(-1, 3).tolist()))


def shells(of_surface, place):
    """The surfaces of every connected part: those around all others first."""
    parts = []
    for entity, triangles in of_surface.items():
        entities, nodes = [entity], set(triangles.ravel().tolist())
        for part in [part for part in parts if not part[1].isdisjoint(nodes)]:
            parts.remove(part)
            entities, nodes = entities + part[0], nodes | part[1]
        parts.append((entities, nodes))
    boxes = []
    for _, nodes in parts:
        own = np.array([place[n] for n in nodes])
        boxes.append(np.concatenate([own.min(axis=0), -own.max(axis=0)]))
    outer = min(range(len(parts)), key=lambda i: boxes[i].sum())
    if any((boxes[i] <= boxes[outer]).any() for i in range(len(parts)) if i != outer):
        refuse(f"{len(parts)} parts, not all inside of one: make a volume of each")
    parts.insert(0, parts.pop(outer))
    return [entities for entities, _ in parts]


def sides_on_the_outside(tetrahedra, order):
    """The nodes of the sides that only one tetrahedron has."""
    sides = np.sort(np.concatenate([tetrahedra[:, side] for side in SIDES[order]]))
    sides, uses = np.unique(sides, axis=0, return_counts=True)
    return sides[uses == 1]


def check_filled(triangles, place, volume, order):
    tetrahedra = nodes_of(TETRAHEDRON[order], volume)
    if not len(tetrahedra):
        refuse("Gmsh made no tetrahedra; its messages say why")
    outside = sides_on_the_outside(tetrahedra, order)
    if not np.array_equal(outside, np.unique(np.sort(triangles), axis=0)):
        refuse("the outer sides of the tetrahedra are not the triangles of the surface")
    now = places()
    if any(now[node] != place[node] for node in np.unique(triangles).tolist()):
        refuse("Gmsh has moved nodes of the surface")
    if count := inverted(TETRAHEDRON[order]):
        refuse(f"{count} of {len(tetrahedra)} tetrahedra are inverted: give planish another --size, or --mesh-order 1")
    # The determinant is of degree 3 in a tetrahedron of order 2. (The quality "volume" is that of the straight one.)
    points, weights = gmsh.model.mesh.getIntegrationPoints(TETRAHEDRON[order], "Gauss3")
    determinants = gmsh.model.mesh.getJacobians(TETRAHEDRON[order], points, volume)[1]
    return len(tetrahedra), (determinants.reshape(-1, len(weights)) @ weights).sum()


def without_maps():
    """Puts what was read into a model without geometry.

    A mesh made through remesh.geo brings the maps with it, by which Gmsh would mesh the surface again, in another size.
    """
    mesh, entities = gmsh.model.mesh, gmsh.model.getEntities(1) + gmsh.model.getEntities(2)
    nodes = mesh.getNodes()
    elements = {entity: mesh.getElements(*entity) for entity in entities}
    groups = [(group, gmsh.model.getEntitiesForPhysicalGroup(*group), gmsh.model.getPhysicalName(*group))
              for group in gmsh.model.getPhysicalGroups() if group[0] in (1, 2)]
    gmsh.model.add("volume")
    for entity in entities:
        gmsh.model.addDiscreteEntity(*entity)
    mesh.addNodes(*entities[-1], nodes[0], nodes[1])
    for (dimension, tag), own in elements.items():
        mesh.addElements(dimension, tag, *own)
    mesh.reclassifyNodes()
    for (dimension, tag), members, name in groups:
        gmsh.model.addPhysicalGroup(dimension, members, tag, name)


def fill(options):
    gmsh.option.setNumber("General.Verbosity", 2)
    gmsh.merge(options.surface)
    surfaces = [entity for _, entity in gmsh.model.getEntities(2)]
    order = order_of(surfaces)
    of_surface = {entity: nodes_of(TRIANGLE[order], entity) for entity in surfaces}
    triangles = np.concatenate(list(of_surface.values()))
    check_closed(triangles)
    check_curved(order)
    place = places()
    parts = shells(of_surface, place)
    without_maps()
    volume = gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop(entities) for entities in parts])
    gmsh.model.geo.synchronize()
    gmsh.model.addPhysicalGroup(3, [volume], name=options.name)
    gmsh.option.setNumber("Mesh.Renumber", 0)  # nodes keep their numbers, by which they are compared below
    gmsh.option.setNumber("Mesh.ElementOrder", order)
    gmsh.option.setNumber("Mesh.HighOrderFixBoundaryNodes", 1)
    if options.size:
        gmsh.option.setNumber("Mesh.MeshSizeMax", options.size)
    gmsh.model.mesh.generate(3)
    unfold(order)
    count, size = check_filled(triangles, place, volume, order)
    gmsh.option.setNumber("Mesh.MshFileVersion", float(options.msh))
    gmsh.write(options.out)
    around = f"{len(triangles)} triangles around them"
    print(f"{options.out}: {count} tetrahedra of order {order}, volume {size:.8g}, {around}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("surface")
    parser.add_argument("-o", dest="out", required=True)
    parser.add_argument("--name", default="body")
    parser.add_argument("--size", type=float, help="the largest edge length inside; by default that of the surface")
    parser.add_argument("--msh", choices=["2.2", "4.1"], default="4.1", help="version of the file: NGSolve needs 2.2")
    options = parser.parse_args()
    gmsh.initialize()
    try:
        fill(options)
    except Exception as error:  # Gmsh raises nothing more special
        refuse(f"Gmsh: {error}")
    finally:
        gmsh.finalize()


if __name__ == "__main__":
    main()
