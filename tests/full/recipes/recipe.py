"""Runs a recipe of docs/simulate.md: the commands and the program of a section, as they stand there.

A recipe makes its input, calls `shell` and `python`, and compares numbers. What it ran and saw is told in a line that
begins with `full:`. `planish`, `gmsh` and the solver are those on the PATH; the packages are those of requirements.txt.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from importlib import metadata
from pathlib import Path

TOP = Path(__file__).resolve().parents[3]
DOCUMENT = TOP / "docs" / "simulate.md"


class Recipe:
    def __init__(self, title, needs=(), packages=()):
        """The section with this title; programs beyond planish and gmsh that it needs; packages to tell versions of."""
        self.name = Path(sys.argv[0]).name
        self.packages, self.seen = packages, []
        missing = [program for program in ("planish", "gmsh", *needs) if shutil.which(program) is None]
        if missing:
            print(f"full: recipes: {self.name}: skipped, {' and '.join(missing)} not on the PATH")
            sys.exit(0 if set(missing) <= set(needs) else 1)
        _, found, rest = DOCUMENT.read_text(encoding="utf-8").partition(f"\n## {title}\n")
        assert found, f"no section {title} in {DOCUMENT}"
        self.section = rest.split("\n## ")[0]
        self.folder = tempfile.TemporaryDirectory()
        os.chdir(self.folder.name)
        os.environ["PATH"] = os.pathsep.join([str(TOP / "packaging" / "gmsh"), os.environ["PATH"]])
        os.environ.setdefault("OMP_NUM_THREADS", "1")

    def block(self, language):
        found = re.findall(rf"^```{language}\n(.*?)^```$", self.section, flags=re.S | re.M)
        assert len(found) == 1, f"one block of {language} is expected, not {len(found)}"
        return found[0]

    def shell(self):
        """Runs the commands of the section; what they printed."""
        return self.run(["bash", "-euo", "pipefail", "-c", self.block("sh")])

    def run(self, command):
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert done.returncode == 0, f"{command} ended with {done.returncode}\n{done.stdout}"
        return done.stdout

    def refused(self, command):
        """Runs a command that must not succeed; what it printed."""
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert done.returncode != 0, f"{command} succeeded\n{done.stdout}"
        return done.stdout

    def python(self):
        """Runs the program of the section; its variables."""
        variables = {}
        exec(compile(self.block("python"), f"docs/simulate.md ({self.name})", "exec"), variables)
        return variables

    def near(self, what, value, expected, share):
        """A number must be the expected one up to a share of it."""
        value = float(value)
        assert abs(value - expected) <= share * abs(expected), f"{what}: {value}, where {expected} is expected"
        self.seen.append(f"{what} {value:.6g} ({expected:.6g})")

    def done(self):
        versions = ", ".join(f"{package} {metadata.version(package)}" for package in ("gmsh", *self.packages))
        print(f"full: recipes: {self.name}: {'; '.join(self.seen)}; {versions}")
