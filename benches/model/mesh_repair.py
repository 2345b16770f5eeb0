"""Breaks closed meshes in some twenty ways, and measures how well they are repaired.

The meshes are expected beside the repository; a teapot of open sheets is made here. The output is
the worst intersection over union with the closed mesh over all meshes, the number of refusals, and
the longest time. Where the IoU is below 0.98, bodies of six ellipsoids are fitted to both meshes,
and the loss of overlap with the true mesh is printed. Needs `servoid[exchange]`.

Run it with: python benches/model/mesh_repair.py [MESH ...]
"""

import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

sys.path.extend(
    str(Path(__file__).resolve().parents[2] / part)
    for part in ("tests", "tests/fixtures", "tests/fixtures/shape")
)

from body_measures import WorldBody
from broken_meshes import BREAKS, Faces, Vertices, capped, joined, overlap, teapot

from servoid._native import Soup
from servoid.errors import MeshError
from servoid.exchange.shapes.mesh_closing import close_mesh
from servoid.exchange.shapes.mesh_file import read_mesh
from servoid.model import Request, fit_mesh

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
DRAGON = DATA / "mono" / "dragon_red" / "truth" / "mesh.obj"
POINTS = 60_000
COMPARED_BELOW = 0.98  # intersection over union below which bodies are compared
ELLIPSOIDS = 6

Mesh = tuple[Vertices, Faces]


def closed(vertices: Vertices, faces: Faces, truth: Mesh) -> tuple[float, float]:
    """Close a mesh; return its overlap with the true one, NaN if refused, and the seconds."""
    start = time.perf_counter()
    try:
        corners, new, _ = close_mesh(vertices, faces)
    except MeshError as refusal:
        print(f"refused: {refusal}", file=sys.stderr)
        return float("nan"), time.perf_counter() - start
    seconds = time.perf_counter() - start
    found = overlap((corners, new), truth, POINTS)
    if found < COMPARED_BELOW:
        less = body_overlap(truth, truth) - body_overlap((corners, new), truth)
        print(f"a mesh with {found:.3f}: its body has {less:.3f} less than the closed mesh's")
    return found, seconds


def body_overlap(mesh: Mesh, truth: Mesh) -> float:
    """Return the intersection over union of a body fitted to a mesh with the true mesh."""
    body = WorldBody.stood(fit_mesh(*mesh, Request(max_ellipsoids=ELLIPSOIDS)).body)
    low, high = truth[0].min(axis=0), truth[0].max(axis=0)
    places = np.random.default_rng(1).uniform(low, high, (POINTS, 3))
    held, true = body.holds(places), Soup(vertices=truth[0], faces=truth[1]).windings(places) > 0.5
    return float((held & true).sum() / (held | true).sum())


def main() -> None:
    """Print one line for each way to break a mesh, and one for the teapot."""
    paths = sorted((DATA / "meshes").glob("*.ply")) + [DRAGON] * DRAGON.is_file()
    paths = [path for path in paths if len(sys.argv) < 2 or path.stem in sys.argv[1:]]
    if not paths:
        print(f"no meshes in {DATA}; only the teapot is closed")
    found: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for path in paths:
        mesh = read_mesh(path)
        for seed, (name, broken) in enumerate(BREAKS.items()):
            random = np.random.default_rng(seed)
            truth = (mesh.vertices, mesh.faces)
            found[name].append(closed(*broken(random, *truth), truth))
    sheets = teapot()
    found["teapot of open sheets"] = [closed(*joined(sheets), joined(list(map(capped, sheets))))]
    print(f"{'broken':25}  meshes  refused  worst IoU  longest s")
    for name, rows in found.items():
        ious, seconds = np.array(rows).T
        worst = float(np.nanmin(ious)) if np.isfinite(ious).any() else float("nan")
        refused = int(np.isnan(ious).sum())
        print(f"{name:25}  {len(rows):6}  {refused:7}  {worst:9.3f}  {seconds.max():9.1f}")


if __name__ == "__main__":
    main()
