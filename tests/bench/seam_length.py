"""seam_length.py OUT... [--bound 1.3] [--limit S] [--json FILE]: how straight are the seams of these results?

OUT is a result folder, or a folder of them. Every seam (a chain of edges with two or more chart sides, from corner to
corner) is shortened to a geodesic of the surface in its isotopy class, by edge flips (potpourri3d, MIT licence), with
its corners fixed. Told per input: the total length of the seams over that of the geodesics, and the curve that wastes
most. Exit code 1 if a total ratio is above the bound.

A closed seam would shrink to a point on a sphere. So a closed seam, with no corner or with one, is pinned at 4 equally
spaced of its vertices (a corner is one of them), and each quarter is shortened by itself.

Curves are shortened one by one, seams on sharp features like all others. What the method does not take (non-manifold
or not orientable surfaces, degenerate triangles) is told as not measurable, with the reason; so is what takes longer
than the limit (300 s of an input). The surface is that of surface.vtu, nodes joined again by `vertex`.

Needs, in the environment of the tests: pip install -r tests/bench/requirements.txt
"""
import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs"))
import atlas as results

PINS = 4


# One input, in a child process: the library may abort on what it does not like.

def oriented(where, triangles):
    """The triangles, neighbours turned alike where that is possible."""
    import vtk
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

    points, cells, data = vtk.vtkPoints(), vtk.vtkCellArray(), vtk.vtkPolyData()
    points.SetData(numpy_to_vtk(where, deep=1))
    offsets = numpy.arange(0, triangles.size + 1, 3)
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=1), numpy_to_vtkIdTypeArray(triangles.ravel(), deep=1))
    data.SetPoints(points)
    data.SetPolys(cells)
    turn = vtk.vtkPolyDataNormals()
    turn.SetInputData(data)
    turn.SplittingOff()
    turn.ConsistencyOn()
    turn.Update()
    return vtk_to_numpy(turn.GetOutput().GetPolys().GetConnectivityArray()).reshape(-1, 3)


def length(points):
    """The length of a polyline."""
    return float(numpy.linalg.norm(numpy.diff(points, axis=0), axis=1).sum())


def parts(chain):
    """Where a curve is held: its ends, and pins on closed ones."""
    if chain[0] != chain[-1]:
        return [chain]
    cuts = sorted({round(k * (len(chain) - 1) / PINS) for k in range(PINS + 1)})
    return [chain[a:b + 1] for a, b in zip(cuts, cuts[1:])]


def shortened(solver, where, chain):
    """The length of the geodesic that a curve becomes."""
    total = 0.0
    for part in parts(chain):
        path = where[part] if len(part) == 2 else solver.find_geodesic_path_poly(part)
        # Rounding must not make a straight curve longer than it was.
        total += min(length(path), length(where[part]))
    return total


def measure(folder):
    """All seams of a result."""
    import potpourri3d

    atlas = results.read(folder)
    seams = results.find_seams(atlas)
    chains = [(s, c) for s, c in results.curves(seams) if len(s) > 1]
    found = {"diagonal": results.diagonal(atlas.where), "curves": [], "pinned": sum(c[0] == c[-1] for _, c in chains)}
    if chains:
        # In the unit box, so that no tolerance of the library matters.
        where = (atlas.where - atlas.where.min(0)) / max(found["diagonal"], 1e-300)
        solver = potpourri3d.EdgeFlipGeodesicSolver(where, oriented(where, atlas.corners))
        found["curves"] = [{"charts": [int(c) for c in s], "length": length(where[c]), "edges": len(c) - 1,
                            "shortened": shortened(solver, where, c)} for s, c in chains]
    found["published"] = published(folder, found["diagonal"])
    return found


def published(folder, diagonal):
    """The length of all seams that seams.vtp tells; None where there is no such file."""
    if not (folder / "seams.vtp").exists():
        return None
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(folder / "seams.vtp"))
    reader.Update()
    curve, is_open, long = (results.array(reader.GetOutput().GetCellData(), n) for n in ("curve", "open", "length"))
    return float(long[(curve >= 0) & (is_open == 0)].sum()) / diagonal


def child(folder):
    """Measures, and prints JSON."""
    try:
        print(json.dumps(measure(folder)))
    except Exception as error:
        print(json.dumps({"trouble": str(error).strip().splitlines()[0] if str(error).strip() else repr(error)}))


# The whole.

def guarded(folder, limit):
    """The measure of a result, or why there is none."""
    command = [sys.executable, __file__, "--child", folder]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return {"trouble": f"not done in {limit:g} s"}
    if done.returncode:
        said = done.stderr.strip().splitlines()
        return {"trouble": f"the library ended with {done.returncode}" + (f": {said[-1]}" if said else "")}
    return json.loads(done.stdout.splitlines()[-1])


def verdict(found):
    """Adds totals, ratio and the curve that wastes most."""
    curves = found["curves"]
    found["length"], found["shortened"] = (sum(c[k] for c in curves) for k in ("length", "shortened"))
    found["ratio"] = ratio(found)
    found["worst"] = max(curves, key=lambda c: c["length"] - c["shortened"], default=None)
    return found


def ratio(found):
    """Length over shortened length; curves of no length are straight."""
    return found["length"] / found["shortened"] if found["shortened"] else 1.0


def line(name, found):
    """What is told of an input."""
    if "trouble" in found:
        return f"{name}: not measurable: {found['trouble']}"
    if not found["curves"]:
        return f"{name}: no seams"
    worst = found["worst"]
    text = (f"{name}: ratio {found['ratio']:.3f}, {len(found['curves'])} curves, {found['length']:.4g} diagonals over "
            f"{found['shortened']:.4g}; worst curve: charts {', '.join(map(str, worst['charts']))}, {worst['edges']} "
            f"edges, {worst['length']:.4g} over {worst['shortened']:.4g}, ratio {ratio(worst):.3f}")
    if found["pinned"]:
        text += f"; {found['pinned']} closed seams, pinned at {PINS} vertices"
    said = found["published"]
    if said is not None and abs(said - found["length"]) > 1e-6 * found["length"]:
        text += f"; seams.vtp says {said:.6g} diagonals, surface.vtu {found['length']:.6g}"
    return text


def options():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", nargs="+", type=Path, metavar="OUT")
    parser.add_argument("--bound", type=float, default=1.3, help="largest total ratio that is allowed (default 1.3)")
    parser.add_argument("--limit", type=float, default=300, metavar="S", help="seconds per input (default 300)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="all curves of all inputs")
    return parser.parse_args()


def main():
    arguments = options()
    everything, above = {}, []
    for name, folder in (found for out in arguments.out for found in results.find(out)):
        if not (folder / "surface.vtu").exists():
            print(f"{name}: not measurable: there is no surface.vtu", flush=True)
            continue
        found = guarded(folder, arguments.limit)
        everything[name] = found if "trouble" in found else verdict(found)
        above += [name] if found.get("ratio", 0) > arguments.bound else []
        print(line(name, found), flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(everything, indent=1), encoding="utf-8")
    print(f"above {arguments.bound:g}: {', '.join(above) or 'none'}")
    sys.exit(1 if above else 0)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        child(Path(sys.argv[2]))
    else:
        main()
