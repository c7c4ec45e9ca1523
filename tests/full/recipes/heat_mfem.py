"""Heat through a cube, from the red-hot top to the cold bottom, by MFEM."""

import shapes
from recipe import Recipe

recipe = Recipe("Heat in MFEM", packages=["mfem"])
shapes.write("cube.stl", shapes.cube())
recipe.shell()
found = recipe.python()
recipe.near("flux", found["flux"], 1, 1e-9)
# The same file, curved or not, in the other version that MFEM reads.
recipe.run(["volume.py", "cube.msh", "-o", "cube-volume.msh", "--msh", "2.2"])
recipe.near("from MSH 2.2", recipe.python()["flux"], 1, 1e-9)
recipe.done()
