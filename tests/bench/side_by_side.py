"""side_by_side.py INPUT... : planish and Gmsh's own chain on the same files, at the same mesh size, in one run.

INPUT is an STL file or a folder of them. Per file, h is the size that gives about a quarter as many triangles as the
file has, and

  ours   planish run FILE --size h, then gmsh remesh.geo -2
  gmsh   merge, classifySurfaces (40 degrees, for reparametrization), createGeometry, generate(2)

each in a process of its own, one at a time, with one thread. Times are CPU seconds (user + system) of the whole
process; on a noisy machine, --repeat 2 keeps the cheaper of two runs of each chain. A process that reaches the limit "did
not end", which is a result. Both meshes are then measured in the same way, in a process that is not timed: how good
their triangles are (gamma), and how faithful they are to the input's triangles (area, distance, topology).

--cad FOLDER adds the CAD files of FOLDER that are listed in CAD. Their triangles are long and few, so that h is what
planish takes by default: the size of as many equilateral triangles of the same area, at most 1/50 of the diagonal.
Gmsh's chain reads every file as it is; where it cannot classify a .msh, it gets an STL file of the same triangles.

Where mmgs_O3 is beside this Python, on the PATH or given by --mmgs (pip install mmgpy brings it), a table is added for mmgs
alone, which changes the mesh directly, without maps: mmgs_O3 -hsiz h -hausd h/10 -ar 40, on a MEDIT file of the same triangles.

  side_by_side.py ../shared/anchors/stl                         all of a folder; writes docs/side_by_side.md
  side_by_side.py ../shared/anchors/stl --cad ../shared/meshes  and CAD files
  side_by_side.py ../shared/anchors/stl --only 10k --limit 60   files whose name contains 10k, at most 60 s each
  side_by_side.py part.stl --chains gmsh --json gmsh.json --markdown gmsh.md

The JSON (default: side_by_side.json in the target folder) and the page are written anew after every file; what the page
holds from "## Reading" on is written by people, and kept. Run it with the Python of the tests (.venv); on Debian Gmsh needs libglu1-mesa libxcursor1 libxft2 libxinerama1 libfontconfig1.
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
CAD = ["cad_box_multi.stl", "cad_component8_p2.msh", "cad_coupling_g9.msh", "cad_featuretype_cracked.stl",
       "cad_fixture_vtk.stl", "cad_gmsh_t13.stl", "cad_imu_adis16480.stl", "cad_rear_case.stl"]
READING = "## Reading"
# Kinds of Gmsh's elements, and how many nodes each has: triangles, and those of second order.
TRIANGLES = {2: 3, 9: 6}
# What a faithful mesh keeps: its area relative to the surface's, and distances in units of the edge length h.
AREA, NODE_OFF, SURFACE_OFF = (0.95, 1.005), 0.01, 1.2
SAMPLES = 40_000
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

def surface(path):
    """The input as points and flat triangles (of second order: by their corners). In STL, equal points are one."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOGeometry import vtkSTLReader

    if path.suffix.lower() != ".stl":
        return gmsh_surface(path)
    reader = vtkSTLReader()
    reader.SetFileName(str(path))
    reader.Update()
    found = reader.GetOutput()
    return (vtk_to_numpy(found.GetPoints().GetData()).astype(float),
            vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3))


def gmsh_surface(path):
    """Points and flat triangles of a file that Gmsh reads."""
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(str(path))
    points, triangles, _ = in_memory(gmsh)
    gmsh.finalize()
    return points, triangles


def areas(points, triangles):
    """The area of each triangle."""
    import numpy

    a, b, c = (points[triangles[:, i]] for i in range(3))
    return numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1) / 2


def measure(path, cad):
    """Triangles and area of an input, and the mesh size h."""
    import numpy

    points, triangles = surface(path)
    area, many = float(areas(points, triangles).sum()), len(triangles)
    h = math.sqrt(4 / math.sqrt(3) * area / (many if cad else 0.25 * many))
    if cad:
        h = min(h, float(numpy.linalg.norm(numpy.ptp(points, axis=0))) / 50)
    return {"triangles": many, "area": area, "h": h}


def topology_of(path, arguments):
    """What the mesh should have: the counts of the surface that planish repaired (points welded, cracks closed)."""
    if arguments.chains == "gmsh" and not arguments.planish.exists():
        return None
    said = subprocess.run([arguments.planish, "info", path, "--json"], capture_output=True, text=True).stdout
    try:
        found = json.loads(said)["surface"]["repaired"]
    except (ValueError, KeyError, TypeError):
        return None
    return {"Euler number": found["euler"], "components": found["components"], "open loops": found["boundary_loops"],
            "edges of more than two triangles": found["nonmanifold_edges"]}


def write_stl(path, points, triangles):
    """An STL file of these triangles, with every digit."""
    with open(path, "w", encoding="ascii") as file:
        file.write("solid surface\n")
        for corners in points[triangles].tolist():
            lines = "".join(f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in corners)
            file.write(f"facet normal 0 0 0\nouter loop\n{lines}endloop\nendfacet\n")
        file.write("endsolid surface\n")


def write_medit(path, points, triangles):
    """A MEDIT file of these triangles, with every digit."""
    with open(path, "w", encoding="ascii") as file:
        file.write(f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(points)}\n")
        file.writelines(f"{x!r} {y!r} {z!r} 0\n" for x, y, z in points.tolist())
        file.write(f"Triangles\n{len(triangles)}\n")
        file.writelines(f"{a} {b} {c} 1\n" for a, b, c in (triangles + 1).tolist())
        file.write("End\n")


# Gmsh's chain, in a child process.

def gmsh_chain(path, h, mesh_file, result):
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
    gmsh.option.setNumber("Mesh.SaveAll", 1)
    gmsh.write(mesh_file)
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


# Measures of a mesh, in a child process.

def mesh_quality(mesh, source, h, result):
    """The child that measures a mesh file beside the input that it should represent."""
    import gmsh

    points, triangles = surface(Path(source))
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(mesh)
    found = quality(gmsh)
    if found["triangles"]:
        nodes, elements, _ = in_memory(gmsh)
        found["topology"] = topology(elements)
        found.update(distance(points, triangles, nodes, elements, h))
    Path(result).write_text(json.dumps(found), encoding="utf-8")
    gmsh.finalize()


def in_memory(gmsh):
    """Points, flat triangles (indices of their corners), and tags of the triangles in Gmsh's memory."""
    import numpy

    tags, points, _ = gmsh.model.mesh.getNodes()
    index = numpy.zeros(int(tags.max(initial=0)) + 1, int)
    index[tags.astype(int)] = numpy.arange(len(tags))
    corners, elements = [numpy.zeros((0, 3), int)], []
    for kind, own, nodes in zip(*gmsh.model.mesh.getElements(2)):
        if kind in TRIANGLES:
            corners.append(index[nodes.astype(int)].reshape(-1, TRIANGLES[kind])[:, :3])
            elements += own.tolist()
    return points.reshape(-1, 3), numpy.vstack(corners), elements


def quality(gmsh):
    """Triangles, area and gamma of the mesh in Gmsh's memory, and the surfaces without a triangle. Gamma is twice the
    radius of the inner circle over that of the outer one: 1 for an equilateral triangle, 0 for a flat one."""
    empty = sum(not any(len(t) for t in gmsh.model.mesh.getElements(2, s)[1]) for _, s in gmsh.model.getEntities(2))
    points, triangles, tags = in_memory(gmsh)
    if not tags:
        return {"triangles": 0, "empty_surfaces": empty}
    gamma = gmsh.model.mesh.getElementQualities(tags, "gamma")
    return {"triangles": len(tags), "empty_surfaces": empty, "area": float(areas(points, triangles).sum()),
            "gamma_min": float(gamma.min()), "gamma_low": int((gamma < 0.1).sum())}


def topology(triangles):
    """Counts that the mesh should share with the surface. Triangles hang together where they share a node, not where
    nodes have the same place. Open edges are those of one triangle; a loop is a set of them that hangs together."""
    import numpy

    edges = numpy.sort(numpy.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    edges, times = numpy.unique(edges, axis=0, return_counts=True)
    return {"Euler number": len(numpy.unique(triangles)) - len(edges) + len(triangles),
            "components": pieces(edges), "open loops": pieces(edges[times == 1]),
            "edges of more than two triangles": int((times > 2).sum())}


def pieces(edges):
    """How many parts the graph of these edges has."""
    parent = {}

    def root(node):
        while parent.setdefault(node, node) != node:
            parent[node] = node = parent[parent[node]]
        return node

    for a, b in edges.tolist():
        parent[root(a)] = root(b)
    return sum(node == above for node, above in parent.items())


def distance(points, triangles, nodes, elements, h):
    """How far mesh and surface are apart at most, in units of h, both ways: the mesh's nodes from the surface
    (`node_off`), and points of the surface (see `samples`) from the mesh (`surface_off`)."""
    import numpy

    used = nodes[numpy.unique(elements)]
    return {"node_off": farthest(used, points, triangles) / h,
            "surface_off": farthest(samples(points, triangles, h), nodes, elements) / h}


def samples(points, triangles, h):
    """Points of the surface, always the same: by area, as many as lie about h / 2 apart, but at most SAMPLES. Equal
    steps of the area that the triangles add up to, in their order, choose the triangle; a sequence that fills the
    square evenly (multiples of the inverses of the plastic number and its square, modulo 1) the place in it."""
    import numpy

    summed = numpy.cumsum(areas(points, triangles))
    many = max(1, min(SAMPLES, math.ceil(summed[-1] / (h / 2) ** 2)))
    count = numpy.arange(many)
    chosen = numpy.searchsorted(summed, (count + 0.5) / many * summed[-1]).clip(0, len(triangles) - 1)
    u, v = (count * 0.7548776662466927) % 1, (count * 0.5698402909980532) % 1
    beyond = u + v > 1
    u[beyond], v[beyond] = 1 - u[beyond], 1 - v[beyond]
    a, b, c = (points[triangles[chosen, i]] for i in range(3))
    return a + u[:, None] * (b - a) + v[:, None] * (c - a)


def farthest(places, points, triangles):
    """The greatest distance of these places from the triangles."""
    from vtkmodules.vtkCommonCore import reference
    from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator

    locator = vtkStaticCellLocator()
    locator.SetDataSet(polydata(points, triangles))
    locator.BuildLocator()
    nearest, cell, part, square = [0.0, 0.0, 0.0], reference(0), reference(0), reference(0.0)
    worst = 0.0
    for place in places:
        locator.FindClosestPoint(place, nearest, cell, part, square)
        worst = max(worst, float(square))
    return math.sqrt(worst)


def polydata(points, triangles):
    """Triangles for VTK."""
    import numpy
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    places, cells, data = vtkPoints(), vtkCellArray(), vtkPolyData()
    places.SetData(numpy_to_vtk(numpy.ascontiguousarray(points), deep=1))
    cells.SetData(3, numpy_to_vtkIdTypeArray(numpy.ascontiguousarray(triangles, numpy.int64).ravel(), deep=1))
    data.SetPoints(places)
    data.SetPolys(cells)
    return data


# Children.

def child(job, *arguments, limit):
    """Runs this script for one job: cost, and the JSON that it wrote."""
    with tempfile.TemporaryDirectory() as scratch:
        result = Path(scratch) / "result.json"
        cost, said = spend([sys.executable, __file__, job, *arguments, result], limit)
        written = json.loads(result.read_text(encoding="utf-8")) if result.exists() else {}
    return cost, written, said


def theirs(path, h, limit):
    """Gmsh's chain on one file; where it makes nothing of one that is no STL, on an STL file of the same triangles."""
    found = their_run(path, path, h, limit)
    if path.suffix.lower() == ".stl" or not found["ended"] or found.get("mesh", {}).get("triangles"):
        return found
    with tempfile.TemporaryDirectory() as scratch:
        same = Path(scratch) / "same.stl"
        write_stl(same, *surface(path))
        again = their_run(same, path, h, limit)
    why = (found.get("errors") or ["no triangles"])[0]
    again["errors"].insert(0, f"read as an STL file of the same triangles; as it is: {why}")
    return again


def their_run(path, source, h, limit):
    """Gmsh's chain on the file `path`, which holds the surface of `source`."""
    with tempfile.TemporaryDirectory() as scratch:
        mesh = Path(scratch) / "mesh.msh"
        cost, found, said = child("--gmsh-chain", path, repr(h), mesh, limit=limit)
        found.setdefault("phases", {})
        found.setdefault("errors", [])
        found.update(ended=cost["code"] is not None, peak_mb=cost["peak_mb"])
        if mesh.exists() and cost["code"] == 0:
            _, found["mesh"], said = child("--mesh-quality", mesh, source, repr(h), limit=limit)
    if not found.get("mesh"):
        found.pop("mesh", None)
        found["cpu"] = cost["cpu"]
        found["errors"].append(complaint(said) if found["ended"] else unended(found["phases"], limit))
    return found


def mmgs(path, h, arguments):
    """mmgs on one file: cost, mesh, what it said."""
    with tempfile.TemporaryDirectory() as scratch:
        source, mesh = Path(scratch) / "in.mesh", Path(scratch) / "out.mesh"
        write_medit(source, *surface(path))
        command = [arguments.mmgs, "-v", "1", "-hsiz", repr(h), "-hausd", repr(h / 10), "-ar", f"{FEATURE_ANGLE:g}"]
        cost, said = spend([*command, source, mesh], arguments.limit, scratch)
        found = {"run": cost, "errors": []}
        if cost["code"] is None:
            found["errors"].append(unended([], arguments.limit))
        elif cost["code"] or not mesh.exists():
            found["errors"].append(f"gave up (exit code {cost['code']}); its last words: {complaint(said)}")
        else:
            _, found["mesh"], said = child("--mesh-quality", mesh, path, repr(h), limit=arguments.limit)
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
            remesh(folder, path, h, arguments.limit, found)
        else:
            found["errors"].append("no remesh.geo was written")
    return found


def remesh(folder, path, h, limit, found):
    """gmsh remesh.geo -2, and what came out."""
    mesh = folder / "remeshed.msh"
    cost, said = spend([sys.executable, gmsh_program(), "remesh.geo", "-2", "-o", mesh.name], limit, folder)
    found["remesh"] = cost
    found["errors"] += [line.strip() for line in said.splitlines() if line.startswith("Error")][:5]
    if cost["code"] is None:
        found["errors"].append(unended(["planish run"], limit))
    elif mesh.exists():
        _, found["mesh"], said = child("--mesh-quality", mesh, path, repr(h), limit=limit)
        found["errors"] += [] if found["mesh"] else [complaint(said)]
    else:
        found["errors"].append(complaint(said))


def gmsh_program():
    """The program that the Python package of Gmsh brings."""
    found = beside_python("gmsh")
    if not found:
        sys.exit("there is no gmsh beside this Python: pip install -r tests/interop/requirements.txt")
    return found


def beside_python(name):
    """A program beside this Python, or else on the PATH."""
    beside = Path(sys.executable).parent / name
    return beside if beside.exists() else shutil.which(name)


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
    faster = f"{other / mine:.2g}" if mine and other else "–"
    cut, run = phases.get("classify", 0) + phases.get("create_geometry", 0), we.get("run", {}).get("cpu")
    share = f"{run / cut:.2f}" if run and "create_geometry" in phases else "–"
    return [row["file"], row["triangles"], cost_of(we.get("run"), limit), cost_of(we.get("remesh"), limit),
            seconds(mine), seconds(phases.get("classify")), seconds(phases.get("create_geometry")), seconds(meshed),
            total, faster, share]


def result_row(row):
    """A line of the table of triangles."""
    cells = [row["file"], f"{row['h']:.4g}"]
    for side in ("ours", "gmsh"):
        found = row.get(side, {})
        cells += [found.get("charts", "–") if "triangles" in found.get("mesh", {}) else "–", *triangle_cells(found)]
    return cells


def triangle_cells(found):
    """How many triangles, and how good."""
    mesh = found.get("mesh", {})
    worst, low, many = mesh.get("gamma_min"), mesh.get("gamma_low"), mesh.get("triangles")
    return ["–" if many is None else many, "–" if worst is None else f"{worst:.2g}",
            "–" if low is None else f"{100 * low / many:.2f} %"]


def faith_cells(row, side):
    """How faithful the mesh of one side is."""
    mesh = row.get(side, {}).get("mesh", {})
    return [f"{100 * mesh['area'] / row['area']:.1f} %" if "area" in mesh else "–",
            length(mesh.get("node_off")), length(mesh.get("surface_off")),
            "; ".join(wrong_topology(row, mesh)) or "right" if "topology" in mesh and row["topology"] else "–",
            verdict(row, side)]


def mmgs_row(row):
    """A line of the table of mmgs alone."""
    found, mine = row["mmgs"], our_total(row)
    spent = found["run"]["cpu"] if found["run"]["code"] == 0 else None
    return [row["file"], seconds(spent), f"{spent / mine:.2g}" if spent and mine else "–", *triangle_cells(found),
            *faith_cells(row, "mmgs")]


def length(value):
    """A length in units of h, for people."""
    return "–" if value is None else f"{value:.2f}" if value >= 0.005 else "0" if value < 1e-5 else f"{value:.0e}"


def wrong_topology(row, mesh):
    """The counts in which the mesh differs from the repaired input."""
    return [f"{name} {mesh['topology'][name]} instead of {right}" for name, right in (row["topology"] or {}).items()
            if mesh["topology"][name] != right]


def verdict(row, side):
    """In a word what the mesh is, or else what is wrong with it. Faithful: topology, area and distances are right
    and every chart has triangles. Sound: and no triangle has gamma below 0.1."""
    if side not in row:
        return "–"
    mesh = row[side].get("mesh", {})
    if "topology" not in mesh:
        return "did not end" if any("did not end" in e for e in row[side].get("errors", [])) else "no mesh"
    checks = [("topology", not wrong_topology(row, mesh)), ("empty charts", not mesh["empty_surfaces"]),
              ("area", AREA[0] <= mesh["area"] / row["area"] <= AREA[1]), ("nodes off", mesh["node_off"] <= NODE_OFF),
              ("surface lost", mesh["surface_off"] <= SURFACE_OFF)]
    wrong = [name for name, right in checks if not right]
    return "wrong: " + ", ".join(wrong) if wrong else ("faithful" if mesh["gamma_low"] else "**sound**")


def table(head, rows):
    """A markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(c) for c in line) + " |" for line in lines) + "\n"


def trouble(rows):
    """What went wrong, per file and chain."""
    lines = []
    for row in rows:
        for side, name in (("ours", "planish"), ("gmsh", "Gmsh"), ("mmgs", "mmgs")):
            lines += [f"- {row['file']}, {name}: {e}" for e in row.get(side, {}).get("errors", [])]
    return "\nWhat the programs said:\n\n" + "\n".join(lines) + "\n" if lines else ""


def mmgs_table(rows):
    """The section on mmgs, where it was run."""
    head = ["file", "CPU", "mmgs / ours", "triangles", "least gamma", "gamma < 0.1", "area", "nodes off", "surface off",
            "topology", "**mmgs**"]
    lines = [mmgs_row(r) for r in rows if "mmgs" in r]
    told = (f"\n## mmgs alone\n\n`mmgs_O3 -hsiz h -hausd h/10 -ar {FEATURE_ANGLE:g}`, which changes the mesh directly, without "
            "maps; measured like the others.\n\n")
    return told + table(head, lines) if lines else ""


FAITH = f"""\
Area is that of the mesh relative to the input's triangles. Distances are the greatest ones, in units of h: of the mesh's
nodes from the surface, and of points of the surface (by area, about h / 2 apart, at most {SAMPLES:,}) from the mesh.
Topology is right where Euler number, components, open loops and edges of more than two triangles are those of the input
after planish's repair (`planish info`). A mesh is faithful if that is right, every chart has triangles, the area is
{AREA[0]:g} to {AREA[1]:g}, no node is more than {NODE_OFF:g} h off and nothing of the surface more than {SURFACE_OFF:g} h; sound if also no gamma is
below 0.1. CAD files (cad_...) are meshed at planish's default size.
"""


def page(result):
    """The markdown page."""
    rows, limit, versions = result["files"], result["limit"], result["versions"]
    repeated = f"; the cheapest of {result['repeat']} runs of each chain" if result["repeat"] > 1 else ""
    costs = ["file", "triangles", "planish run", "remesh", "**ours**", "Gmsh classify", "create geometry", "mesh",
             "**Gmsh**", "Gmsh / ours", "run / (classify + create)"]
    results = ["file", "h", "our charts", "triangles", "least gamma", "gamma < 0.1",
               "Gmsh charts", "triangles", "least gamma", "gamma < 0.1"]
    faith = ["file", *["area", "nodes off", "surface off", "topology", "**ours**"],
             *["area", "nodes off", "surface off", "topology", "**Gmsh**"]]
    return (f"# Side by side with Gmsh's own chain\n\n    {result['command']}\n\n"
            f"planish {versions['planish']}, Gmsh {versions['gmsh']}; CPU seconds of whole processes on one core, "
            f"limit {limit:g} s{repeated}.\nOurs: `planish run FILE --size h`, `gmsh remesh.geo -2`. Gmsh: merge, "
            f"classifySurfaces ({FEATURE_ANGLE:g} degrees, for reparametrization),\ncreateGeometry, generate(2), at "
            "the same h.\n\n## Cost\n\n" + table(costs, [cost_row(r, limit) for r in rows])
            + "\n## Triangles\n\n" + table(results, [result_row(r) for r in rows])
            + "\n## Faithful to the surface\n\n" + FAITH + "\n" + table(faith, [[r["file"], *faith_cells(r, "ours"), *faith_cells(r, "gmsh")] for r in rows])
            + mmgs_table(rows) + trouble(rows))


# The run.

def options():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("inputs", nargs="+", type=Path, metavar="INPUT")
    parser.add_argument("--cad", type=Path, metavar="FOLDER", help="CAD files of this folder, too; those absent are told")
    parser.add_argument("--only", action="append", metavar="TEXT", help="files whose name contains this; may be repeated")
    parser.add_argument("--limit", type=float, default=300, metavar="S", help="CPU seconds per process (default 300)")
    parser.add_argument("--repeat", type=int, default=1, metavar="N",
                        help="run both chains N times, one after the other, and keep the cheaper run of each (default 1)")
    parser.add_argument("--chains", choices=["both", "ours", "gmsh"], default="both")
    parser.add_argument("--planish", type=Path, default=ROOT / "target/release/planish", metavar="PROGRAM")
    parser.add_argument("--mmgs", type=Path, default=beside_python("mmgs_O3"), metavar="PROGRAM")
    parser.add_argument("--json", type=Path, default=ROOT / "target/side_by_side.json", metavar="FILE")
    parser.add_argument("--markdown", type=Path, default=ROOT / "docs/side_by_side.md", metavar="FILE")
    return parser.parse_args()


def files(arguments):
    """The files that were asked for, by name, and whether each is one of the CAD files."""
    found = [(f, False) for i in arguments.inputs for f in (sorted(i.glob("*.stl")) if i.is_dir() else [i])]
    found += [(arguments.cad / name, True) for name in CAD if arguments.cad]
    wanted = [(f, c) for f, c in found if not arguments.only or any(text in f.name for text in arguments.only)]
    if not wanted:
        sys.exit("no STL file is named so")
    for absent in (f for f, c in wanted if c and not f.exists()):
        print(f"{absent}: not there, skipped", flush=True)
    return [(f, c) for f, c in wanted if not c or f.exists()]


def versions(arguments):
    """Versions of both programs."""
    import gmsh

    said = "not run"
    if arguments.chains != "gmsh":
        said = subprocess.run([arguments.planish, "--version"], capture_output=True, text=True, check=True).stdout
    return {"planish": said.split()[-1] if said != "not run" else said, "gmsh": gmsh.__version__}


def write(result, arguments):
    """The JSON and the page, as far as they are."""
    told = page(result) + kept(arguments.markdown)
    for path, text in ((arguments.json, json.dumps(result, indent=1)), (arguments.markdown, told)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def kept(path):
    """What people wrote at the end of the page."""
    _, heading, text = (path.read_text(encoding="utf-8") if path.exists() else "").partition(f"\n{READING}\n")
    return heading + text


def keep_cheaper(row, chain, found):
    """Keeps the run of a chain that cost least."""
    def cost(one):
        if chain == "mmgs":
            return one["run"]["cpu"] if "mesh" in one else math.inf
        total = our_total({"ours": one}) if chain == "ours" else their_total({"gmsh": one})
        return math.inf if total is None else total
    if chain not in row or cost(found) < cost(row[chain]):
        row[chain] = found


def main():
    arguments = options()
    # Where a program lies is of no interest to whoever repeats this elsewhere.
    named = [Path(a).name if Path(a).is_absolute() else a for a in sys.argv[1:]]
    command = shlex.join(["python", "tests/bench/side_by_side.py", *named])
    result = {"command": command, "versions": versions(arguments), "limit": arguments.limit,
              "repeat": arguments.repeat, "files": []}
    for path, cad in files(arguments):
        row = {"file": path.name, **measure(path, cad), "topology": topology_of(path, arguments)}
        result["files"].append(row)
        for _ in range(arguments.repeat):
            if arguments.chains != "gmsh":
                keep_cheaper(row, "ours", ours(path.resolve(), row["h"], arguments))
            if arguments.chains != "ours" and row.get("gmsh", {}).get("ended", True):
                keep_cheaper(row, "gmsh", theirs(path.resolve(), row["h"], arguments.limit))
            if arguments.chains == "both" and arguments.mmgs:
                keep_cheaper(row, "mmgs", mmgs(path.resolve(), row["h"], arguments))
        write(result, arguments)
        print(" | ".join(str(c) for c in cost_row(row, arguments.limit)), flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--gmsh-chain"]:
        gmsh_chain(sys.argv[2], float(sys.argv[3]), *sys.argv[4:])
    elif sys.argv[1:2] == ["--mesh-quality"]:
        mesh_quality(sys.argv[2], sys.argv[3], float(sys.argv[4]), sys.argv[5])
    else:
        main()
