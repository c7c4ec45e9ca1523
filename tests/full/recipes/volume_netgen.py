"""The inside of a cube of named sides by Netgen, from the remeshed surface."""

import shapes
from recipe import Recipe

recipe = Recipe("A volume by Netgen", packages=["netgen-mesher"])
shapes.write("cube.stl", shapes.cube())
recipe.shell()
found = recipe.python()
mesh, Integrate = found["mesh"], found["Integrate"]
recipe.near("volume", Integrate(1, mesh), 1, 1e-9)
assert mesh.GetMaterials() == ("body",) and mesh.ne > 100
for name, area in {"bottom": 1, "walls": 4, "top": 1}.items():
    recipe.near(f"area of {name}", Integrate(1, mesh.Boundaries(name)), area, 1e-9)
recipe.done()
