"""Surfaces of known area and volume, as text STL: one solid for each named part."""

import itertools
import math


def quad(a, b, c, d):
    return [(a, b, c), (a, c, d)]


def cube(squares=5):
    """The unit cube: `bottom`, `walls`, `top`."""
    parts = {"bottom": [], "walls": [], "top": []}
    for axis, far in itertools.product(range(3), (0, 1)):
        # The normal of a side with these axes in this order points outwards.
        first, second = (1, 2) if far else (2, 1)

        def point(i, j):
            p = [0.0, 0.0, 0.0]
            p[axis], p[(axis + first) % 3], p[(axis + second) % 3] = float(far), i / squares, j / squares
            return tuple(p)

        part = "walls" if axis < 2 else ("top" if far else "bottom")
        for i, j in itertools.product(range(squares), repeat=2):
            parts[part] += quad(point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1))
    return parts


def sphere(halvings=4):
    """The unit sphere, of 20 * 4^halvings facets; halved sides of an icosahedron."""
    t = (1 + math.sqrt(5)) / 2
    corners = [(0, a, b * t) for a, b in itertools.product((-1, 1), repeat=2)]
    corners = [on_sphere(p[k:] + p[:k]) for p in corners for k in range(3)]
    near = 1.01 * min(math.dist(corners[0], other) for other in corners[1:])
    facets = []
    for facet in itertools.combinations(corners, 3):
        if all(math.dist(p, q) < near for p, q in itertools.combinations(facet, 2)):
            a, b, c = facet
            facets.append(facet if outwards(a, b, c) else (a, c, b))
    for _ in range(halvings):
        facets = [part for facet in facets for part in quarters(*facet)]
    return {"sphere": facets}


def on_sphere(p):
    length = math.hypot(*p)
    return tuple(x / length for x in p)


def outwards(a, b, c):
    """Whether the triangle turns left as seen from outside of the sphere."""
    normal = (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0])
    return sum(x * y for x, y in zip(a, normal)) > 0


def quarters(a, b, c):
    d, e, f = (on_sphere([x + y for x, y in zip(p, q)]) for p, q in ((a, b), (b, c), (c, a)))
    return [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]


def blade():
    """A flat strip of width 1: `clamp` from x = -1 to 0, `blade` from there to 10."""

    def strip(begin, end):
        corners = itertools.product(range(4 * begin, 4 * end), range(4))
        point = lambda i, j: (i / 4, j / 4, 0.0)
        return [t for i, j in corners for t in quad(point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1))]

    return {"clamp": strip(-1, 0), "blade": strip(0, 10)}


def write(path, parts):
    with open(path, "w", encoding="ascii") as out:
        for name, facets in parts.items():
            print("solid", name, file=out)
            for facet in facets:
                print("facet normal 0 0 0\nouter loop", file=out)
                for x, y, z in facet:
                    print("vertex", repr(x), repr(y), repr(z), file=out)
                print("endloop\nendfacet", file=out)
            print("endsolid", name, file=out)
