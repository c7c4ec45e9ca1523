"""performance.py --planish NEW [--older NAME=OLD]... [INPUT]... : what planish costs, beside older builds and its peers.

Each command runs as a process of its own, pinned to one core, in turns: one run of every build and every peer, then the next.
Told are medians of CPU seconds (user + system), of the largest resident memory, and of the bytes written; ratios are medians of
the ratios within a turn, so that a machine that is slow for a while is slow for all.

  INPUT                 STL files, or folders of them
  --families LIST       surfaces that families.py makes (bump,plate,spheres,stairs,menger), for growth
  --sizes LIST          their numbers of triangles, about: 10000,100000,1000000
  --peers LIST          gmsh (classifySurfaces + createGeometry), mmgs, xatlas, pyacvd; those that are installed
  --runs N              turns [3]
  --limit S             CPU seconds after which a process "did not end" [300]
  --json FILE --markdown FILE

Growth is the exponent p in cost = c n^p between the least and the largest size of a family.

  performance.py --planish target/release/planish --older before=../old/planish ../shared/anchors/stl \\
      --families bump,plate,spheres,stairs,menger --markdown docs/performance.md

What the page holds from "## Reading" on is written by people, and kept.
"""
import argparse
import json
import math
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import families
from side_by_side import READING, beside_python, spend, surface, write_medit

GMSH = """
import gmsh, math, resource, sys
gmsh.initialize(); gmsh.option.setNumber("General.Terminal", 0); gmsh.option.setNumber("General.NumThreads", 1)
gmsh.merge(sys.argv[1])
spent = lambda: sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
before = spent()
gmsh.model.mesh.classifySurfaces(math.radians(40), True, True, math.pi)
gmsh.model.mesh.createGeometry()
print(spent() - before)
"""
XATLAS = """
import meshio, resource, sys, xatlas
mesh = meshio.read(sys.argv[1])
spent = lambda: sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
before = spent()
xatlas.parametrize(mesh.points.astype("f4"), mesh.cells_dict["triangle"].astype("u4"))
print(spent() - before)
"""
PYACVD = """
import pyacvd, pyvista, resource, sys
mesh = pyvista.read(sys.argv[1]).clean()
spent = lambda: sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
before = spent()
clusters = pyacvd.Clustering(mesh); clusters.cluster(max(100, mesh.n_points // 4)); clusters.create_mesh()
print(spent() - before)
"""


def pinned(command, options):
    """Runs a command on one core: its cost, and what it said."""
    return spend(["taskset", "-c", options.core, *command], options.limit)


def planish(program, path, options):
    """One run of a build: its cost, and the bytes that it wrote."""
    with tempfile.TemporaryDirectory() as out:
        found, _ = pinned([program, "run", "-q", "--out", out, path], options)
        found["bytes"] = sum(f.stat().st_size for f in Path(out).glob("*/*") if f.is_file())
    return found


def peer(name, path, options):
    """One run of a peer; where it tells the cost of the work itself, that, and not what its interpreter takes to start."""
    if name == "mmgs":
        return mmgs(path, options)
    script = {"gmsh": GMSH, "xatlas": XATLAS, "pyacvd": PYACVD}[name]
    found, said = pinned([sys.executable, "-c", script, path], options)
    if found["code"] == 0:
        found["cpu"] = float(said.split()[-1])
    return found


def mmgs(path, options):
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "in.mesh"
        write_medit(source, *surface(path))
        return pinned([mmgs_program(), "-v", "0", source, Path(folder) / "out.mesh"], options)[0]


def mmgs_program():
    """The wheels mmgpy and pymmg call it differently."""
    return beside_python("mmgs_O3") or beside_python("mmgs")


def is_there(name):
    if name == "mmgs":
        return mmgs_program() is not None
    return subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True).returncode == 0


def measured(path, triangles, options):
    """All builds and peers on one file, in turns."""
    row = dict(file=path.stem, triangles=triangles, runs={})
    for _ in range(options.runs):
        for name, program in options.builds:
            row["runs"].setdefault(name, []).append(planish(program, path, options))
        for name in options.found_peers:
            row["runs"].setdefault(name, []).append(peer(name, path, options))
    return row


def median(row, name, key):
    runs = row["runs"].get(name, [])
    if not runs or any(run["code"] is None or key not in run for run in runs):
        return None
    return statistics.median(run[key] for run in runs)


def ratio(row, name, key="cpu"):
    """Of the new build to another one, or a peer, turn by turn."""
    pairs = [(a, b) for a, b in zip(row["runs"]["new"], row["runs"].get(name, []))
             if a["code"] == 0 and b["code"] == 0 and b.get(key)]
    return statistics.median(a[key] / b[key] for a, b in pairs) if pairs else None


def cell(value, digits=2):
    return "-" if value is None else f"{value:.{digits}f}"


def page(rows, options):
    others = [name for name, _ in options.builds if name != "new"] + options.found_peers
    head = ["file", "triangles", "CPU s", "MB", "kB / triangle", "MB written"] + [f"CPU : {name}" for name in others]
    head += [f"{key} : {name}" for name, _ in options.builds if name != "new" for key in ("memory", "written")]
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    for row in rows:
        mb, written = median(row, "new", "peak_mb"), median(row, "new", "bytes")
        cells = [row["file"], f"{row['triangles']:,}", cell(median(row, "new", "cpu")), cell(mb, 0),
                 cell(mb and mb * 1024 / row["triangles"]), cell(written and written / 1e6, 1)]
        cells += [cell(ratio(row, name)) for name in others]
        for name, _ in options.builds:
            if name != "new":
                cells += [cell(ratio(row, name, "peak_mb")), cell(ratio(row, name, "bytes"))]
        lines.append("| " + " | ".join(cells) + " |")
    growth = ["", "## Growth", "", "| family | from | to | exponent of CPU | of memory |", "| --- | --- | --- | --- | --- |"]
    for family in options.families:
        of = [row for row in rows if row.get("family") == family and median(row, "new", "cpu")]
        if len(of) > 1:
            first, last = of[0], of[-1]
            span = math.log(last["triangles"] / first["triangles"])
            power = [math.log(median(last, "new", key) / median(first, "new", key)) / span for key in ("cpu", "peak_mb")]
            growth.append(f"| {family} | {first['triangles']:,} | {last['triangles']:,} | {power[0]:.2f} | {power[1]:.2f} |")
    title = ["# What planish costs", "",
             f"Written by `tests/bench/performance.py`: medians of {options.runs} runs on one core; ratios are medians of those within",
             "a turn, below 1 where this build is cheaper. Of Gmsh, xatlas and pyacvd only the work itself counts, not reading.", ""]
    text = "\n".join(title + lines + (growth if options.families else [])) + "\n"
    if options.markdown.exists() and READING in options.markdown.read_text():
        text += "\n" + options.markdown.read_text()[options.markdown.read_text().index(READING):]
    return text


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("inputs", nargs="*", type=Path)
    parser.add_argument("--planish", required=True)
    parser.add_argument("--older", action="append", default=[], metavar="NAME=PROGRAM")
    parser.add_argument("--families", type=lambda s: s.split(","), default=[])
    parser.add_argument("--sizes", type=lambda s: [int(n) for n in s.split(",")], default=[10_000, 100_000, 1_000_000])
    parser.add_argument("--peers", type=lambda s: s.split(","), default=["gmsh", "mmgs", "xatlas", "pyacvd"])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--limit", type=int, default=300)
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--json", type=Path, default=Path("performance.json"))
    parser.add_argument("--markdown", type=Path, default=Path("performance.md"))
    options = parser.parse_args()
    options.builds = [("new", options.planish)] + [tuple(older.split("=", 1)) for older in options.older]
    options.found_peers = [name for name in options.peers if name and is_there(name)]
    return options


def main():
    options = arguments()
    rows = []

    def add(path, triangles, **more):
        rows.append(measured(path, triangles, options) | more)
        options.json.write_text(json.dumps(rows, indent=1))
        options.markdown.write_text(page(rows, options))
        print(options.markdown.read_text().split("\n\n")[2].splitlines()[-1], flush=True)

    for given in options.inputs:
        for path in sorted(given.glob("*.stl")) if given.is_dir() else [given]:
            add(path, (path.stat().st_size - 84) // 50)
    with tempfile.TemporaryDirectory() as folder:
        for family in options.families:
            for size in options.sizes:
                path = Path(folder) / f"{family}_{size}.stl"
                add(path, families.write(path, family, size), family=family)
                path.unlink()


if __name__ == "__main__":
    main()
