"""Model the research meshes with 1 to 16 ellipsoids, and compare volumes and silhouettes.

Prints one line a mesh and count: the volumetric intersection over union at 200000 points in the
mesh's box, made a tenth larger; at 8 and 16 ellipsoids also that of the silhouettes, from 20 random
directions; and the seconds. Skips what is not there. Names of meshes may be given as arguments.
"""

import sys
import time
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid.exchange.mesh_file import MeshFile, read_mesh
from servoid.model import Request, fit_mesh
from servoid.shape import Body

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "data" / "meshes"
COUNTS, SILHOUETTES_AT = (1, 3, 5, 8, 16), (8, 16)
POINTS, DIRECTIONS, SIDE_PX = 200_000, 20, 300

Array = NDArray[np.float64]
Part = tuple[Array, Array]


def parts_of(body: Body) -> list[Part]:
    """List centre and R diag(r²) Rᵀ of each ellipsoid in the world."""
    world = body.world_from_object.matrix()
    turns = Rotation.from_quat(np.asarray(body.rotations), scalar_first=True).as_matrix()
    centers = np.asarray(body.centers) @ world[:3, :3].T + world[:3, 3]
    turns = world[:3, :3] @ turns
    shapes = (turns * np.asarray(body.radii)[:, None, :] ** 2) @ turns.transpose(0, 2, 1)
    return list(zip(centers, shapes, strict=True))


def inside(parts: list[Part], points: Array) -> NDArray[np.bool_]:
    """Say which points, (N, D), are in one of the ellipsoids or ellipses."""
    found = np.zeros(len(points), dtype=bool)
    for center, shape in parts:
        away = points - center
        found |= np.einsum("ni,ij,nj->n", away, np.linalg.inv(shape), away) < 1.0
    return found


def overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Measure the intersection over union."""
    return float((one & other).sum() / (one | other).sum())


def silhouette_iou(mesh: MeshFile, parts: list[Part]) -> float:
    """Compare outlines along parallel rays, from random directions that are always the same."""
    random = np.random.default_rng(5)
    middle = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2.0
    radius = np.linalg.norm(mesh.vertices - middle, axis=1).max()
    scale = 0.45 * SIDE_PX / radius
    rows, columns = np.mgrid[:SIDE_PX, :SIDE_PX]
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 2).astype(np.float64)
    ious = []
    for turn in Rotation.random(DIRECTIONS, rng=random).as_matrix():
        flat = scale * turn[:2]
        drawn = np.zeros((SIDE_PX, SIDE_PX), np.uint8)
        corners = (mesh.vertices - middle) @ flat.T + SIDE_PX / 2.0
        for triangle in np.rint(16.0 * corners[mesh.faces]).astype(np.int32):
            cv2.fillConvexPoly(drawn, triangle, (255,), shift=4)
        ellipses = [
            ((center - middle) @ flat.T + SIDE_PX / 2.0, flat @ shape @ flat.T)
            for center, shape in parts
        ]
        ious.append(overlap(drawn.ravel() > 0, inside(ellipses, pixels)))
    return float(np.mean(ious))


def score(path: Path) -> None:
    """Print what each count of ellipsoids reaches."""
    import trimesh

    mesh = read_mesh(path)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    low, high = solid.bounds
    reach = 0.1 * solid.extents
    points = np.random.default_rng(0).uniform(low - reach, high + reach, (POINTS, 3))
    true = np.asarray(solid.contains(points))
    for count in COUNTS:
        start = time.perf_counter()
        result = fit_mesh(mesh.vertices, mesh.faces, Request(max_ellipsoids=count, delta=0.0))
        seconds = time.perf_counter() - start
        parts = parts_of(result.body)
        volume = overlap(inside(parts, points), true)
        line = f"{path.stem:8} {len(parts):2} ellipsoids: volume {volume:.3f}"
        if count in SILHOUETTES_AT:
            line += f", silhouettes {silhouette_iou(mesh, parts):.3f}"
        print(f"{line}, {seconds:.1f} s", flush=True)


def main() -> None:
    """Score each mesh that is there, or those that are named."""
    paths = sorted(FOLDER.glob("*.ply"))
    if not paths:
        print("the research meshes are not there, skipped")
        return
    if any(find_spec(name) is None for name in ("trimesh", "embreex")):
        print("trimesh or embreex is not installed, skipped")
        return
    for path in paths:
        if len(sys.argv) < 2 or path.stem in sys.argv[1:]:
            score(path)


if __name__ == "__main__":
    main()
