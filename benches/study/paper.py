"""Run the paper's own method on stereo pairs of one plain ellipsoid, and print its results.

The target is at (0, -90, 545) mm before the head, as in the paper's experiment; 640x480 pixels,
focal length 600 px. For each baseline and size, over seeds with a random rotation each: the mean
and the largest error of the centre along x, y and z, and the mean of the estimated radii, the
longest first. The last rows have the margin of the envelopes in metres. Then, for the first seed of
each row that has the default margin, F after each of three ellipsoids.
"""

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.camera import Camera
from servoid.model import PaperSettings
from servoid.model.paper import fit_paper_views, hue_window
from servoid.pose import Pose

SIZE_PX, FOCAL_PX, CENTER_PX = (640, 480), 600.0, (319.5, 239.5)
CENTER = np.array([0.0, -0.090, 0.545])
TARGET_RGB, BACKGROUND_RGB = (40, 160, 70), (150, 148, 140)
SEEDS = range(20)
ROWS = [
    (0.10, (0.045, 0.0225, 0.0225), None),
    (0.24, (0.045, 0.0225, 0.0225), None),
    (0.10, (0.090, 0.045, 0.045), None),
    (0.24, (0.090, 0.045, 0.045), None),
    (0.10, (0.045, 0.0225, 0.0225), 0.005),
    (0.24, (0.045, 0.0225, 0.0225), 0.005),
]


@dataclass(frozen=True)
class Trial:
    """One pair: where the cameras are, and the ellipsoid's radii and turn."""

    baseline: float
    radii: tuple[float, float, float]
    turn: NDArray[np.float64]

    def eyes(self) -> list[NDArray[np.float64]]:
        """Return the left and the right camera's positions."""
        return [np.array([side * self.baseline / 2, 0.0, 0.0]) for side in (-1, 1)]

    def image(self, eye: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Cast a ray through each pixel's centre, (H, W, 3) uint8 RGB."""
        u, v = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
        x, y = (u - CENTER_PX[0]) / FOCAL_PX, (v - CENTER_PX[1]) / FOCAL_PX
        rays = np.stack([x, y, np.ones(x.shape)], axis=-1) @ self.turn / self.radii
        origin = (eye - CENTER) @ self.turn / self.radii
        along = rays @ origin
        hit = along**2 > np.sum(rays**2, axis=-1) * (origin @ origin - 1.0)
        return np.where(hit[..., None], *np.array([TARGET_RGB, BACKGROUND_RGB], np.uint8))


def random_turn(seed: int) -> NDArray[np.float64]:
    """Draw a rotation, (3, 3)."""
    axes, triangle = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    axes = axes * np.sign(np.diag(triangle))
    return axes * np.linalg.det(axes)


def run(trial: Trial, settings: PaperSettings) -> tuple[NDArray[np.float64], list[float]]:
    """Return the error of the first centre and its radii in mm, (6,), and F by count."""
    images = [trial.image(eye) for eye in trial.eyes()]
    window = hue_window(images[0], (images[0] == TARGET_RGB).all(axis=2).astype(np.uint8))
    camera = Camera(size_px=SIZE_PX, focal_px=(FOCAL_PX, FOCAL_PX), center_px=CENTER_PX)
    poses = [Pose.from_parts(eye.tolist(), [1.0, 0.0, 0.0, 0.0]) for eye in trial.eyes()]
    steps = fit_paper_views(images, [camera] * 2, poses, window, settings=settings)
    first = steps[0].body
    error = np.array(first.world_from_object.translation) - CENTER
    radii = np.sort(first.radii[0])[::-1]
    return 1e3 * np.concatenate([error, radii]), [step.fitness for step in steps]


def main() -> None:
    """Print the tables."""
    print(
        "baseline  radii              alpha    mean |x|  |y|  |z|   most |x|  |y|  |z|  "
        "within 5 in x, y   radii found         s a fit"
    )
    by_count = []
    for baseline, radii, alpha_m in ROWS:
        found, start = [], time.perf_counter()
        for seed in SEEDS:
            settings = PaperSettings(max_ellipsoids=1, seed=seed, alpha_m=alpha_m)
            found.append(run(Trial(baseline, radii, random_turn(seed)), settings)[0])
        seconds = (time.perf_counter() - start) / len(SEEDS)
        off, sizes = np.abs(found)[:, :3], np.mean(found, axis=0)[3:]
        good = np.count_nonzero((off[:, :2] <= 5.0).all(axis=1))
        print(
            f"{1e3 * baseline:4.0f} mm  "
            + "{:5.1f} {:5.1f} {:5.1f}".format(*(1e3 * np.array(radii)))
            + (f"  {1e3 * alpha_m:5.1f} mm" if alpha_m else "  share   ")
            + "  {:6.1f} {:6.1f} {:6.1f}".format(*off.mean(axis=0))
            + "  {:6.1f} {:6.1f} {:6.1f}".format(*off.max(axis=0))
            + f"  {good:7} of {len(SEEDS)}      "
            + "  {:5.1f} {:5.1f} {:5.1f}".format(*sizes)
            + f"  {seconds:5.2f}",
            flush=True,
        )
        if alpha_m is None:
            three = PaperSettings(max_ellipsoids=3, delta=0.0)
            by_count.append(run(Trial(baseline, radii, random_turn(0)), three)[1])
    print(
        "F after 1, 2, 3 ellipsoids: "
        + "; ".join(" ".join(f"{fitness:.2f}" for fitness in row) for row in by_count)
    )


if __name__ == "__main__":
    main()
