"""side_by_side.py INPUT... : planish and Gmsh's own chain on the same STL files, at the same mesh size, in one run.

INPUT is an STL file or a folder of them. Per file, h is the size that gives about a quarter as many triangles as the
file has, and

  ours   planish run FILE --size h, then gmsh remesh.geo -2
  gmsh   merge, classifySurfaces (40 degrees, for reparametrization), createGeometry, generate(2)

each in a process of its own, one at a time, with one thread. Times are CPU seconds (user + system) of the whole
process; on a noisy machine, --repeat 2 keeps the cheaper of two runs of each chain. A process that reaches the limit "did not end", which is a result.

  side_by_side.py ../shared/anchors/stl                         all of a folder; writes docs/side_by_side.md
  side_by_side.py ../shared/anchors/stl --only 10k --limit 60   files whose name contains 10k, at most 60 s each
  side_by_side.py part.stl --chains gmsh --json gmsh.json --markdown gmsh.md

The JSON (default: side_by_side.json in the target folder) is written anew after every file. Run it with the Python
of the tests (.venv); on Debian Gmsh needs libglu1-mesa libxcursor1 libxft2 libxinerama1 libfontconfig1.
"""
import argparse
import json
import math
import os
import resource
import shlex
import shutil
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FEATURE_ANGLE = 40.0
# Wall clock seconds per CPU second of the limit, for what hangs without working.
PATIENCE = 3


# Processes and their cost.

def spend(command, limit, folder=None):
    """Runs a command: CPU seconds, peak MB, exit code (None: did not end), what it said."""
    with tempfile.TemporaryFile() as said:
        child = subprocess.Popen([str(c) for c in command], cwd=folder, stdout=said, stderr=subprocess.STDOUT,
                                 start_new_session=True, preexec_fn=lambda: bound(limit))
        timer = threading.Timer(PATIENCE * limit, stop, [child.pid])
        timer.start()
        _, status, used = os.wait4(child.pid, 0)
        timer.cancel()
        child.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read().decode(errors="replace")
    cpu = used.ru_utime + used.ru_stime
    ended = not (child.returncode < 0 and (cpu >= 0.98 * limit or child.returncode == -9))
    return {"cpu": round(cpu, 3), "peak_mb": used.ru_maxrss // 1024, "code": child.returncode if ended else None}, text


def bound(limit):
    """In the child: an end after so many CPU seconds."""
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(limit), math.ceil(limit) + 2))


def stop(pid):
    """Ends a child and its own children."""
    try:
        os.killpg(pid, 9)
    except ProcessLookupError:
        pass


def cpu():
    """CPU seconds of this process so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


# The input.

def measure(path):
    """Triangles and area of an STL file, and the mesh size h."""
    import numpy
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOGeometry import vtkSTLReader

    reader = vtkSTLReader()
    reader.SetFileName(str(path))
    reader.Update()
    surface = reader.GetOutput()
    points = vtk_to_numpy(surface.GetPoints().GetData()).astype(float)
    corners = points[vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)]
    normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area, triangles = float(numpy.linalg.norm(normals, axis=1).sum() / 2), len(corners)
    return {"triangles": triangles, "area": area, "h": math.sqrt(4 / math.sqrt(3) * area / (0.25 * triangles))}


# Gmsh's chain, in a child process.

def gmsh_chain(path, h, result):
    """The child: writes its phases to `result` as they end, so that a chain that is stopped tells how far it came."""
    import gmsh

    found = {"phases": {}, "errors": []}
    gmsh.initialize()
    settle(gmsh, h)
    mesh = gmsh.model.mesh
    phases = [("merge", lambda: gmsh.merge(path)),
              ("classify", lambda: mesh.classifySurfaces(math.radians(FEATURE_ANGLE), True, True, math.pi)),
              ("create_geometry", mesh.createGeometry),
              ("mesh_1d", lambda: mesh.generate(1)),
              ("mesh_2d", lambda: mesh.generate(2))]
    for name, work in phases:
        phase(found, name, work)
        found["charts"] = len(gmsh.model.getEntities(2))
        found["cpu"] = round(cpu(), 3)
        Path(result).write_text(json.dumps(found), encoding="utf-8")
    found["mesh"] = quality(gmsh)
    Path(result).write_text(json.dumps(found), encoding="utf-8")
    gmsh.finalize()


def phase(found, name, work):
    """Does one phase and notes its CPU seconds and what it threw."""
    start = cpu()
    try:
        work()
    except Exception as error:
        found["errors"].append(f"{name}: {error}")
    found["phases"][name] = round(cpu() - start, 3)


def settle(gmsh, h):
    """Options of a uniform mesh of size h."""
    for option, value in [("General.Terminal", 0), ("General.NumThreads", 1), ("Mesh.MeshSizeMin", h),
                          ("Mesh.MeshSizeMax", h), ("Mesh.MeshSizeExtendFromBoundary", 0),
                          ("Mesh.MeshSizeFromPoints", 0)]:
        gmsh.option.setNumber(option, value)


def quality(gmsh):
    """Triangles, area and gamma of the mesh in Gmsh's memory, and the surfaces without a triangle."""
    tags, empty = [], 0
    for _, surface in gmsh.model.getEntities(2):
        own = [t for some in gmsh.model.mesh.getElements(2, surface)[1] for t in some]
        empty += not own
        tags += own
    if not tags:
        return {"triangles": 0, "empty_surfaces": empty}
    gamma = gmsh.model.mesh.getElementQualities(tags, "gamma")
    return {"triangles": len(tags), "empty_surfaces": empty,
            "area": float(gmsh.model.mesh.getElementQualities(tags, "volume").sum()),
            "gamma_min": float(gamma.min()), "gamma_low": int((gamma < 0.1).sum())}


def mesh_quality(path, result):
    """The child that looks at a mesh file."""
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(path)
    Path(result).write_text(json.dumps(quality(gmsh)), encoding="utf-8")
    gmsh.finalize()


def child(job, *arguments, limit):
    """Runs this script for one job: cost, and the JSON that it wrote."""
    with tempfile.TemporaryDirectory() as scratch:
        result = Path(scratch) / "result.json"
        cost, said = spend([sys.executable, __file__, job, *arguments, result], limit)
        written = json.loads(result.read_text(encoding="utf-8")) if result.exists() else {}
    return cost, written, said


def theirs(path, h, limit):
    """Gmsh's chain on one file."""
    cost, found, said = child("--gmsh-chain", path, repr(h), limit=limit)
    found.setdefault("phases", {})
    found.update(ended=cost["code"] is not None, peak_mb=cost["peak_mb"])
    if "mesh" not in found:
        found["cpu"] = cost["cpu"]
        found.setdefault("errors", []).append(complaint(said) if found["ended"] else unended(found["phases"], limit))
    return found


def unended(phases, limit):
    """What is told of a chain that was stopped."""
    return f"did not end in {limit:g} s of CPU; done by then: {', '.join(phases) or 'nothing'}"


# Our chain.

def ours(path, h, arguments):
    """planish and the remesh through its maps, on one file."""
    with tempfile.TemporaryDirectory() as out:
        command = [arguments.planish, "run", path, "--out", out, "--size", repr(h), "-q"]
        cost, said = spend(command, arguments.limit)
        found = {"run": cost, "errors": []}
        folder = Path(out) / path.name
        if not (folder / "report.json").exists():
            found["errors"].append(complaint(said) if cost["code"] is not None else unended([], arguments.limit))
            return found
        report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        found.update(status=report["status"], charts=len(report["charts"]), timing=report.get("timing"))
        if report["status"] != "certified":
            found["errors"].append(report["reason"]["message"])
        elif (folder / "remesh.geo").exists():
            remesh(folder, arguments.limit, found)
        else:
            found["errors"].append("no remesh.geo was written")
    return found


def remesh(folder, limit, found):
    """gmsh remesh.geo -2, and what came out."""
    mesh = folder / "remeshed.msh"
    cost, said = spend([sys.executable, gmsh_program(), "remesh.geo", "-2", "-o", mesh.name], limit, folder)
    found["remesh"] = cost
    found["errors"] += [line.strip() for line in said.splitlines() if line.startswith("Error")][:5]
    if cost["code"] is None:
        found["errors"].append(unended(["planish run"], limit))
    elif mesh.exists():
        _, found["mesh"], said = child("--mesh-quality", mesh, limit=limit)
    else:
        found["errors"].append(complaint(said))


def gmsh_program():
    """The program that the Python package of Gmsh brings."""
    beside = Path(sys.executable).parent / "gmsh"
    found = beside if beside.exists() else shutil.which("gmsh")
    if not found:
        sys.exit("there is no gmsh beside this Python: pip install -r tests/interop/requirements.txt")
    return found


def complaint(text):
    """The first line that begins with "error", or else the last line with something on it."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if line.lower().startswith("error")]
    return (errors or lines[-1:] or ["said nothing"])[0]


# What is told.

def seconds(value):
    """CPU seconds for people."""
    return "–" if value is None else f"{value:.2f}" if value < 10 else f"{value:.1f}"


def cost_of(cost, limit):
    """A process's CPU seconds, or that it did not end."""
    if cost is None:
        return "–"
    if cost["code"] is None:
        return f"did not end in {limit:g}"
    return seconds(cost["cpu"]) if cost["code"] == 0 else f"failed (exit code {cost['code']})"


def our_total(row):
    """CPU seconds of our chain from STL to mesh; None unless both parts ended well."""
    parts = [row.get("ours", {}).get(part) for part in ("run", "remesh")]
    return sum(p["cpu"] for p in parts) if all(p and p["code"] == 0 for p in parts) else None


def their_total(row):
    """CPU seconds of Gmsh's chain from STL to mesh; None unless it ended."""
    theirs = row.get("gmsh", {})
    return theirs.get("cpu") if theirs.get("ended") and "mesh" in theirs else None


def cost_row(row, limit):
    """A line of the table of costs."""
    we, they = row.get("ours", {}), row.get("gmsh", {})
    phases = they.get("phases", {})
    meshed = phases.get("mesh_1d", 0) + phases["mesh_2d"] if "mesh_2d" in phases else None
    total = seconds(their_total(row)) if they.get("ended", True) else f"did not end in {limit:g}"
    mine, other = our_total(row), their_total(row)
    faster = f"{other / mine:.1f}" if mine and other else "–"
    cut, run = phases.get("classify", 0) + phases.get("create_geometry", 0), we.get("run", {}).get("cpu")
    share = f"{run / cut:.2f}" if run and "create_geometry" in phases else "–"
    return [row["file"], row["triangles"], cost_of(we.get("run"), limit), cost_of(we.get("remesh"), limit),
            seconds(mine), seconds(phases.get("classify")), seconds(phases.get("create_geometry")), seconds(meshed),
            total, faster, share]


def result_row(row):
    """A line of the table of results."""
    cells = [row["file"], f"{row['h']:.4g}"]
    for side in ("ours", "gmsh"):
        found = row.get(side, {})
        mesh = found.get("mesh", {})
        worst, low, many = mesh.get("gamma_min"), mesh.get("gamma_low"), mesh.get("triangles")
        covered = mesh.get("area")
        cells += [found.get("charts", "–") if many is not None else "–", "–" if many is None else many,
                  "–" if worst is None else f"{worst:.2g}", "–" if low is None else f"{100 * low / many:.2f} %",
                  "–" if covered is None else f"{100 * covered / row['area']:.1f} %"]
    return cells


def table(head, rows):
    """A markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(c) for c in line) + " |" for line in lines) + "\n"


def trouble(rows):
    """What went wrong, per file and chain."""
    lines = []
    for row in rows:
        for side, name in (("ours", "planish"), ("gmsh", "Gmsh")):
            lines += [f"- {row['file']}, {name}: {e}" for e in row.get(side, {}).get("errors", [])]
    return "\nWhat the programs said:\n\n" + "\n".join(lines) + "\n" if lines else ""


def page(result):
    """The markdown page."""
    rows, limit, versions = result["files"], result["limit"], result["versions"]
    repeated = f"; the cheapest of {result['repeat']} runs of each chain" if result["repeat"] > 1 else ""
    costs = ["file", "triangles", "planish run", "remesh", "**ours**", "Gmsh classify", "create geometry", "mesh",
             "**Gmsh**", "Gmsh / ours", "run / (classify + create)"]
    results = ["file", "h", "our charts", "triangles", "least gamma", "gamma < 0.1", "area",
               "Gmsh charts", "triangles", "least gamma", "gamma < 0.1", "area"]
    return (f"# Side by side with Gmsh's own chain\n\n    {result['command']}\n\n"
            f"planish {versions['planish']}, Gmsh {versions['gmsh']}; CPU seconds of whole processes on one core, "
            f"limit {limit:g} s{repeated}.\nOurs: `planish run FILE --size h`, `gmsh remesh.geo -2`. Gmsh: merge, "
            f"classifySurfaces ({FEATURE_ANGLE:g} degrees, for reparametrization),\ncreateGeometry, generate(2), at "
            "the same h.\n\n## Cost\n\n" + table(costs, [cost_row(r, limit) for r in rows])
            + "\n## Result\n\nArea is that of the mesh relative to the input's.\n\n"
            + table(results, [result_row(r) for r in rows]) + trouble(rows))


# The run.

def options():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("inputs", nargs="+", type=Path, metavar="INPUT")
    parser.add_argument("--only", action="append", metavar="TEXT", help="files whose name contains this; may be repeated")
    parser.add_argument("--limit", type=float, default=300, metavar="S", help="CPU seconds per process (default 300)")
    parser.add_argument("--repeat", type=int, default=1, metavar="N",
                        help="run both chains N times, one after the other, and keep the cheaper run of each (default 1)")
    parser.add_argument("--chains", choices=["both", "ours", "gmsh"], default="both")
    parser.add_argument("--planish", type=Path, default=ROOT / "target/release/planish", metavar="PROGRAM")
    parser.add_argument("--json", type=Path, default=ROOT / "target/side_by_side.json", metavar="FILE")
    parser.add_argument("--markdown", type=Path, default=ROOT / "docs/side_by_side.md", metavar="FILE")
    return parser.parse_args()


def files(arguments):
    """The STL files that were asked for, by name."""
    found = [f for i in arguments.inputs for f in (sorted(i.glob("*.stl")) if i.is_dir() else [i])]
    wanted = [f for f in found if not arguments.only or any(text in f.name for text in arguments.only)]
    if not wanted:
        sys.exit("no STL file is named so")
    return wanted


def versions(arguments):
    """Versions of both programs."""
    import gmsh

    said = "not run"
    if arguments.chains != "gmsh":
        said = subprocess.run([arguments.planish, "--version"], capture_output=True, text=True, check=True).stdout
    return {"planish": said.split()[-1] if said != "not run" else said, "gmsh": gmsh.__version__}


def write(result, arguments):
    """The JSON and the page, as far as they are."""
    for path, text in ((arguments.json, json.dumps(result, indent=1)), (arguments.markdown, page(result))):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def keep_cheaper(row, chain, found):
    """Keeps the run of a chain that cost least."""
    def cost(one):
        total = our_total({"ours": one}) if chain == "ours" else their_total({"gmsh": one})
        return math.inf if total is None else total
    if chain not in row or cost(found) < cost(row[chain]):
        row[chain] = found


def main():
    arguments = options()
    command = shlex.join(["python", "tests/bench/side_by_side.py", *sys.argv[1:]])
    result = {"command": command, "versions": versions(arguments), "limit": arguments.limit,
              "repeat": arguments.repeat, "files": []}
    for path in files(arguments):
        row = {"file": path.name, **measure(path)}
        result["files"].append(row)
        for _ in range(arguments.repeat):
            if arguments.chains != "gmsh":
                keep_cheaper(row, "ours", ours(path.resolve(), row["h"], arguments))
            if arguments.chains != "ours" and row.get("gmsh", {}).get("ended", True):
                keep_cheaper(row, "gmsh", theirs(path.resolve(), row["h"], arguments.limit))
        write(result, arguments)
        print(" | ".join(str(c) for c in cost_row(row, arguments.limit)), flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--gmsh-chain"]:
        gmsh_chain(sys.argv[2], float(sys.argv[3]), sys.argv[4])
    elif sys.argv[1:2] == ["--mesh-quality"]:
        mesh_quality(sys.argv[2], sys.argv[3])
    else:
        main()
