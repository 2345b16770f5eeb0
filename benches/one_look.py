"""Model from one look: stereo pairs with one mask, and photographs with a box in one of them.

Prints one line an object: for pairs the mean distance from the true surface that the left camera
sees to the body of 5 ellipsoids, for photographs the silhouette intersection over union with the
true masks of all views, and the seconds. Skips what is not there.
"""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from servoid.model import Request, fit_capture
from servoid.observe import BoxTarget, Capture, CaptureView, open_capture
from servoid.pose import Pose
from servoid.shape import Body

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
PAIRS, PAIR_ELLIPSOIDS = ("mustard", "drill"), 5
PHOTOS, PHOTO_ELLIPSOIDS = ("skull",), 8
STEP_PX = 3

Array = NDArray[np.float64]


def skin(body: Body) -> Array:
    """Spread points over the surface of the union, in the world."""
    ways = np.random.default_rng(0).normal(size=(40_000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    turns = Rotation.from_quat(np.asarray(body.rotations), scalar_first=True).as_matrix()
    parts = list(zip(np.asarray(body.centers), turns, np.asarray(body.radii), strict=True))
    kept = []
    for index, (center, turn, radii) in enumerate(parts):
        points = center + (ways * radii) @ turn.T
        free = np.ones(len(points), dtype=bool)
        for other, (place, way, size) in enumerate(parts):
            if other != index:
                free &= ((((points - place) @ way) / size) ** 2).sum(axis=1) >= 1.0
        kept.append(points[free])
    return np.asarray(body.world_from_object.transform(np.concatenate(kept)))


def seen_truth(folder: Path, view: CaptureView) -> Array:
    """Find where the rays of a view's pixels meet the true mesh, in the world."""
    import trimesh

    truth = np.loadtxt(
        folder / "truth" / "left_from_object.csv", delimiter=",", skiprows=1, ndmin=2
    )
    mesh = trimesh.load_mesh(folder / "truth" / "mesh.obj", process=False)
    row = truth[view.index].tolist()
    mesh.apply_transform(Pose.from_parts(row[1:4], row[4:8]).matrix())
    camera = view.camera
    columns, rows = np.meshgrid(*(np.arange(0, size, STEP_PX) for size in camera.size_px))
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 2)
    rays = np.ones((len(pixels), 3))
    rays[:, :2] = (pixels - np.array(camera.center_px)) / np.array(camera.focal_px)
    hits, _, _ = mesh.ray.intersects_location(np.zeros_like(rays), rays, multiple_hits=False)
    return np.asarray(view.world_from_camera.transform(np.asarray(hits, dtype=np.float64)))


def look_at_pair(name: str) -> None:
    """Model the first pair of a stereo set."""
    folder = DATA / "stereo" / name
    capture = open_capture(folder)
    start = time.perf_counter()
    result = fit_capture(
        capture,
        Request(max_ellipsoids=PAIR_ELLIPSOIDS, delta=0.0),
        observations=slice(0, 1),
    )
    seconds = time.perf_counter() - start
    view = next(view for view in capture.views() if view.index == 0)
    errors_mm = 1000.0 * KDTree(skin(result.body)).query(seen_truth(folder, view))[0]
    print(
        f"{name}: {len(result.body)} ellipsoids, seen surface {errors_mm.mean():.2f} mm away, "
        f"95 of 100 within {np.quantile(errors_mm, 0.95):.2f} mm, {seconds:.1f} s",
        flush=True,
    )


def unmasked(capture: Capture) -> Capture:
    """Forget a capture's masks."""
    return replace(
        capture,
        cameras=tuple(
            replace(camera, mask_paths=(None,) * len(camera.mask_paths))
            for camera in capture.cameras
        ),
    )


def look_at_photos(name: str) -> None:
    """Model photographs from a box, 5 % larger than the object on each side, in one of them."""
    capture = open_capture(DATA / "photos" / name)
    masked = capture.views()
    rows, columns = np.nonzero(masked[0].mask())
    width, height = masked[0].camera.size_px
    du, dv = 0.05 * np.ptp(columns), 0.05 * np.ptp(rows)
    box = BoxTarget(
        max(0.0, columns.min() - du),
        max(0.0, rows.min() - dv),
        min(width - 1.0, columns.max() + du),
        min(height - 1.0, rows.max() + dv),
        view=masked[0].name,
    )
    start = time.perf_counter()
    result = fit_capture(
        unmasked(capture), Request(max_ellipsoids=PHOTO_ELLIPSOIDS, delta=0.0), targets=[box]
    )
    seconds = time.perf_counter() - start
    ious = []
    for view in masked:
        seen = result.body.silhouette(view.camera, view.world_from_camera) != 0
        true = view.mask() != 0
        ious.append((seen & true).sum() / (seen | true).sum())
    print(
        f"{name}: {len(result.body)} ellipsoids from a box in {box.view}, silhouettes "
        f"{np.mean(ious):.4f} over {len(ious)} views, worst {min(ious):.4f}, {seconds:.1f} s",
        flush=True,
    )


def main() -> None:
    """Print one line an object."""
    for kind, names, look in (
        ("stereo", PAIRS, look_at_pair),
        ("photos", PHOTOS, look_at_photos),
    ):
        for name in names:
            if (DATA / kind / name).is_dir():
                look(name)
            else:
                print(f"{name}: not there, skipped")


if __name__ == "__main__":
    main()
