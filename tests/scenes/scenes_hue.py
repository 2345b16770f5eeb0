"""The paper's own method, on pairs that the tests draw: what it finds by hue alone."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from recordings import run_servoid
from scene_table import Figures, scene
from scipy.spatial.transform import Rotation

from conftest import Drawing
from servoid.camera import Camera
from servoid.model import PaperSettings, Step, fit_paper_views
from servoid.model.paper import hue_window
from servoid.pose import Pose
from servoid.shape import load_body

SIZE_PX, FOCAL_PX, CENTER_PX = (640, 480), 600.0, (319.5, 239.5)
CENTER = np.array([0.0, -0.090, 0.545])
RADII = np.array([0.045, 0.0225, 0.0225])
GREEN, GREY = (40, 160, 70), (150, 148, 140)
QUICK = PaperSettings(max_ellipsoids=1, generations=20, points=100)


@dataclass(frozen=True)
class Pair:
    """A stereo pair of one plain ellipsoid."""

    baseline: float = 0.24
    turn: Rotation = Rotation.identity()  # noqa: RUF009
    color: tuple[int, int, int] = GREEN

    @property
    def poses(self) -> list[Pose]:
        sides = (-self.baseline / 2, self.baseline / 2)
        return [Pose.from_parts([x, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]) for x in sides]

    @property
    def cameras(self) -> list[Camera]:
        return [Camera(size_px=SIZE_PX, focal_px=(FOCAL_PX, FOCAL_PX), center_px=CENTER_PX)] * 2

    def silhouettes(self) -> list[NDArray[np.bool_]]:
        """Cast a ray through each pixel's centre, in the frame where the ellipsoid is a ball."""
        u, v = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
        rays = np.stack([u - CENTER_PX[0], v - CENTER_PX[1], np.full(u.shape, FOCAL_PX)], axis=-1)
        rays = rays @ self.turn.as_matrix() / RADII
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        seen = []
        for pose in self.poses:
            ball = (CENTER - pose.translation) @ self.turn.as_matrix() / RADII
            seen.append(np.linalg.norm(np.cross(rays, ball), axis=-1) < 1.0)
        return seen

    def images(self) -> list[NDArray[np.uint8]]:
        return [
            np.where(seen[..., None], np.array(self.color, np.uint8), np.array(GREY, np.uint8))
            for seen in self.silhouettes()
        ]


def fit_pair(pair: Pair, chosen: PaperSettings = QUICK) -> list[Step]:
    images = pair.images()
    window = hue_window(images[0], pair.silhouettes()[0].astype(np.uint8))
    return fit_paper_views(images, pair.cameras, pair.poses, window, settings=chosen)


TURNS = ((0.24, (0, 0, 0)), (0.24, (30, 0, 60)), (0.24, (0, 50, -20)), (0.1, (10, 20, 90)))
RED = (200, 30, 32)


def off_center(step: Step) -> NDArray[np.float64]:
    """Return how far a body is from the true place along each axis, in metres."""
    return np.abs(np.array(step.body.world_from_object.translation) - CENTER)


@scene("hue pair", {"off across": "mm", "off along": "mm", "radius off": "1"})
def hue_pair(seed: int, _folder: Path) -> Figures:
    """Model a pair, turned in one of a few ways."""
    baseline, turn_deg = TURNS[seed % len(TURNS)]
    pair = Pair(baseline, Rotation.from_euler("xyz", turn_deg, degrees=True))
    [step] = fit_pair(pair, PaperSettings(max_ellipsoids=1, seed=seed))
    x, y, z = off_center(step)
    return {
        "off across": 1e3 * max(x, y),
        "off along": 1e3 * z,
        "radius off": abs(float(step.body.radii.max() / RADII.max()) - 1.0),
    }


@scene("hue around", {"off": "mm"})
def hue_around(seed: int, folder: Path) -> Figures:
    """Model what four views show from around."""
    drawing = Drawing(ellipsoids=Drawing().ellipsoids[:1], views=4)
    capture = drawing.write(folder / "photos")
    options = ("--method", "paper", "--max-ellipsoids", 1, "--seed", seed)
    run_servoid(folder, "model", capture, "--out", "body.json", *options)
    place = load_body(folder / "body.json").world_from_object[:3]
    off = np.linalg.norm(np.subtract(place, drawing.ellipsoids[0].center))
    return {"off": 1e3 * float(off)}


@scene("hue red", {"off across": "mm"})
def hue_red(seed: int, _folder: Path) -> Figures:
    """Model a target whose hues go through zero."""
    settings = PaperSettings(max_ellipsoids=1, generations=20, points=100, seed=seed)
    [step] = fit_pair(Pair(color=RED), settings)
    return {"off across": 1e3 * float(off_center(step)[:2].max())}
