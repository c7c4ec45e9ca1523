"""Heat through a cube, by NGSolve."""

import shapes
from recipe import Recipe

recipe = Recipe("Heat in NGSolve", packages=["ngsolve"])
shapes.write("cube.stl", shapes.cube())
recipe.shell()
found = recipe.python()
recipe.near("flux", found["flux"], 1, 1e-9)
areas = {name: found["Integrate"](1, found["mesh"].Boundaries(name)) for name in ("bottom", "walls", "top")}
for name, area in areas.items():
    recipe.near(f"area of {name}", area, {"bottom": 1, "walls": 4, "top": 1}[name], 1e-9)
recipe.done()
