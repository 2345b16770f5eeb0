"""Measures bodies from one observation and from photographs without masks.

The captures are expected beside the repository; true surfaces need trimesh and embreex.
"""

import csv
import sys
import time
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from servoid.exchange import open_any
from servoid.model import Request, fit_capture
from servoid.pose import Pose
from servoid.segment import BoxTarget
from servoid.shape import Body

DATA = Path(__file__).parents[3] / "shared" / "data"


def surface(body: Body, count: int = 40_000) -> np.ndarray:
    """Sample points (N, 3) on a body's surface, in the world."""
    rng = np.random.default_rng(0)
    units = rng.normal(size=(count, 3))
    units /= np.linalg.norm(units, axis=1)[:, None]
    axes = [Rotation.from_quat(q, scalar_first=True).as_matrix() for q in body.rotations]
    parts = list(zip(body.centers, body.radii, axes, strict=True))
    kept = []
    for index, (center, radii, turn) in enumerate(parts):
        points = center + (units * radii) @ turn.T
        out = np.ones(count, dtype=bool)
        for other, (middle, reach, frame) in enumerate(parts):
            if other != index:
                out &= (((points - middle) @ frame / reach) ** 2).sum(axis=1) >= 1.0
        kept.append(points[out])
    return body.world_from_object.transform(np.concatenate(kept))


def measure_pair(name: str) -> None:
    """Model the first pair of a recording with five ellipsoids."""
    import trimesh

    folder = DATA / "stereo" / name
    capture = open_any(folder)
    start = time.perf_counter()
    result = fit_capture(capture, Request(max_ellipsoids=5, delta=0.0))
    seconds = time.perf_counter() - start
    with (folder / "truth" / "left_from_object.csv").open() as file:
        row = next(csv.DictReader(file))
    place = [float(row[key]) for key in ("x", "y", "z")]
    turn = [float(row[key]) for key in ("qw", "qx", "qy", "qz")]
    mesh = trimesh.load_mesh(folder / "truth" / "mesh.obj", process=False)
    mesh.apply_transform(Pose.from_parts(place, turn).matrix())
    camera = result.used_views[0].camera
    v, u = np.mgrid[0 : camera.size_px[1] : 3, 0 : camera.size_px[0] : 3]
    pixels = np.stack([u.ravel(), v.ravel()], axis=1)
    rays = np.ones((len(pixels), 3))
    rays[:, :2] = (pixels - camera.center_px) / camera.focal_px
    seen, _, _ = mesh.ray.intersects_location(np.zeros_like(rays), rays, multiple_hits=False)
    away_mm = 1e3 * KDTree(surface(result.body)).query(seen)[0]
    print(
        f"{name:8} seen surface to body: mean {away_mm.mean():.2f} mm, 95 % below "
        f"{np.quantile(away_mm, 0.95):.2f} mm, {seconds:.2f} s"
    )


def measure_photographs(name: str) -> None:
    """Model photographs, one of which is marked by a box 5 % larger than the object."""
    capture = open_any(DATA / "photos" / name)
    views = capture.views()
    rows, columns = np.nonzero(views[0].mask())
    width, height = views[0].camera.size_px
    u, v = 0.05 * np.ptp(columns), 0.05 * np.ptp(rows)
    box = BoxTarget(
        max(0.0, columns.min() - u),
        max(0.0, rows.min() - v),
        min(width - 1.0, columns.max() + u),
        min(height - 1.0, rows.max() + v),
        view=views[0].name,
    )
    start = time.perf_counter()
    result = fit_capture(capture, Request(max_ellipsoids=8, delta=0.0), targets=[box])
    seconds = time.perf_counter() - start
    ious = []
    for view in views:
        drawn = result.body.silhouette(view.camera, view.world_from_camera) > 0
        mask = view.mask() > 0
        ious.append((drawn & mask).sum() / (drawn | mask).sum())
    print(
        f"{name:8} a box in one of {len(views)} views: IoU with all true masks "
        f"{np.mean(ious):.4f}, {seconds:.1f} s"
    )


def main() -> None:
    """Print one line per capture."""
    if not DATA.is_dir():
        sys.exit(f"skipped: there are no captures in {DATA}")
    for name in ("mustard", "drill"):
        measure_pair(name)
    for name in ("skull", "temple"):
        measure_photographs(name)


if __name__ == "__main__":
    main()
