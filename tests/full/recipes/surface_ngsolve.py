"""An equation on a sphere, by NGSolve: z is an eigenfunction of its Laplace operator."""

import math

import shapes
from recipe import Recipe

recipe = Recipe("A surface in NGSolve", packages=["ngsolve"])
shapes.write("sphere.stl", shapes.sphere())
recipe.shell()
found = recipe.python()
recipe.near("area", found["area"], 4 * math.pi, 2e-3)
recipe.near("1 + error", 1 + found["error"], 1, 2e-3)
# As the text says: without z where triangles have three nodes, but for `dim = 3`.
recipe.run(["planish", "run", "sphere.stl", "--out", "straight", "--size", "0.2", "-q"])
recipe.run(["gmsh", "straight/sphere.stl/remesh.geo", "-2", "-format", "msh2", "-o", "flat.msh"])
ReadGmsh, Mesh, Integrate = (found[name] for name in ("ReadGmsh", "Mesh", "Integrate"))
flat = Mesh(ReadGmsh("flat.msh"))
assert flat.dim == 2, "ReadGmsh keeps z: docs/simulate.md says otherwise"
recipe.near("area without z", Integrate(1, flat), 2 * math.pi, 2e-2)
recipe.done()
