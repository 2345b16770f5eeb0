"""Renders ellipsoids on a light ground plane with the ray-caster, from a distant viewpoint."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Lighting, Paint, Pose, Scene
from servoid.camera import linear_light

_AWAY = 30.0  # picture sides from the viewpoint to the middle: near parts are at most 2 % larger
_KEY, _SKY, _BOUNCE = 0.88, 0.56, 0.34  # strengths of the lamp, and of light from above and below
_PAPER = 0.92  # linear brightness of the lit ground plane
_PAPER_HALF = 100.0  # picture sides
_GLOSS = 0.10
_LAMPS = 4  # lamp samples along each of two axes; together they smooth edges and shadows
_LAMP_WIDTH = 0.07  # tangent of the angle from its middle to its edge
_LEAST_RADIUS = 1e-5  # picture sides

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Solids:
    """Ellipsoids in the world: centers (K, 3), axes as columns (K, 3, 3), radii (K, 3).

    `colors` is (K, 3) uint8 sRGB.
    """

    centers: NDArray[np.float64]
    turns: NDArray[np.float64]
    radii: NDArray[np.float64]
    colors: NDArray[np.uint8]

    @property
    def shapes(self) -> NDArray[np.float64]:
        """Return the shape matrices R diag(r²) Rᵀ (K, 3, 3)."""
        return (self.turns * self.radii[:, None, :] ** 2) @ self.turns.transpose(0, 2, 1)

    def extent(self, direction: Vector) -> tuple[float, float]:
        """Return the lowest and highest coordinate along a unit direction, in metres."""
        middle = self.centers @ direction
        reach = np.linalg.norm(self.radii * (direction @ self.turns), axis=1)
        return float((middle - reach).min()), float((middle + reach).max())


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """A distant viewpoint: `axes` (3, 3) has right, down and forward as rows, in the world.

    `metres_per_px` is the scale at `middle`, the point at the centre of the picture.
    """

    axes: NDArray[np.float64]
    middle: Vector
    metres_per_px: float
    size_px: tuple[int, int]

    @property
    def side(self) -> float:
        """Return the longer side of the picture in metres."""
        return max(self.size_px) * self.metres_per_px

    def project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pixels (N, 2) of points (N, 3) in the world."""
        x, y, z = self.axes @ (points - self.middle).T
        across = np.stack([x, y]) / (self.metres_per_px * (1.0 + z / (_AWAY * self.side)))
        return across.T + (np.array(self.size_px) - 1) / 2.0

    def finer(self, factor: float) -> "Viewpoint":
        """Return the same viewpoint with `factor` times as many pixels a side."""
        width, height = (round(side * factor) for side in self.size_px)
        return Viewpoint(self.axes, self.middle, self.metres_per_px / factor, (width, height))

    def lens(self, shift_px: tuple[float, float] = (0.0, 0.0)) -> Lens:
        """Return the lens of this viewpoint, with a shifted image."""
        center = np.array(shift_px) + (np.array(self.size_px) - 1) / 2.0
        focal = _AWAY * max(self.size_px)
        return Lens(
            model="pinhole", size_px=self.size_px, focal_px=(focal, focal), center_px=center
        )


def axes_toward(toward: Vector, up: Vector) -> NDArray[np.float64]:
    """Return axes (3, 3) of a viewpoint that looks along `toward`, with `up` upwards.

    Both are unit vectors.
    """
    right = np.cross(toward, up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


class _Staged:
    """Solids in the renderer's frame: origin at the middle, z up, the picture's side as unit."""

    def __init__(self, solids: Solids, seen: Viewpoint, up: Vector) -> None:
        level = np.eye(3)[np.abs(up).argmin()]
        right = np.cross(level, up) / np.linalg.norm(np.cross(level, up))
        self.stage_from_world = np.stack([right, np.cross(up, right), up])
        self.scene = Scene()
        self.poses: list[list[float]] = []
        centers = (solids.centers - seen.middle) @ self.stage_from_world.T / seen.side
        turns = self.stage_from_world @ solids.turns
        for center, turn, radii, color in zip(
            centers, turns, solids.radii / seen.side, solids.colors, strict=True
        ):
            paint = Paint(color=linear_light(color / 255.0).tolist(), gloss=_GLOSS)
            self.scene.add_ellipsoid(np.maximum(radii, _LEAST_RADIUS), paint)
            self.poses.append(_row(turn, center))
        eye = self.stage_from_world @ seen.axes.T
        self.eye = np.array(_row(eye, -_AWAY * eye[:, 2]))

    def put_paper(self, lowest: float, lamp: float) -> None:
        """Add a ground plane below the solids; `lamp` is the cosine of the lamp's angle to it."""
        white = min(_PAPER / (_KEY * lamp + _SKY), 1.0)
        self.scene.add_plane((_PAPER_HALF, _PAPER_HALF), Paint(color=(white, white, white)))
        self.poses.append([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, lowest])

    def render(
        self, seen: Viewpoint, toward: Vector, shift_px: tuple[float, float]
    ) -> NDArray[np.uint8]:
        """Render with one sample of the lamp, with one ray per pixel."""
        x, y, z = self.stage_from_world @ toward
        return self.scene.render(
            lens=seen.lens(shift_px),
            world_from_lens=self.eye[None],
            world_from_visual=np.array([self.poses]),
            lighting=Lighting(
                toward=(x, y, z), key=(_KEY,) * 3, sky=(_SKY,) * 3, bounce=(_BOUNCE,) * 3
            ),
            samples=1,
            noise=0.0,
        )


def covered(solids: Solids, seen: Viewpoint) -> NDArray[np.bool_]:
    """Return which pixels (H, W) show an ellipsoid."""
    staged = _Staged(solids, seen, -seen.axes[1])
    _, numbers = staged.scene.depth(
        lens=seen.lens(), world_from_lens=staged.eye, world_from_visual=np.array(staged.poses)
    )
    return np.asarray(numbers >= 0)


def render(solids: Solids, seen: Viewpoint, up: Vector, light: Vector) -> NDArray[np.uint8]:
    """Return an antialiased picture (H, W, 3) RGB of the ellipsoids on a light ground plane.

    `up` and `light`, towards the lamp, are unit vectors in the world.
    """
    staged = _Staged(solids, seen, up)
    lowest = (solids.extent(up)[0] - float(seen.middle @ up)) / seen.side
    staged.put_paper(lowest, float(up @ light))
    across = axes_toward(light, seen.axes[0])[:2]
    steps = (np.arange(_LAMPS) + 0.5) / _LAMPS - 0.5
    total = np.zeros((seen.size_px[1], seen.size_px[0], 3))
    for row, column in product(range(_LAMPS), repeat=2):
        # Permuted, so that the lamp's samples do not correlate with the positions in a pixel.
        aside = 2.0 * _LAMP_WIDTH * steps[[(column + row) % _LAMPS, (2 * column + row) % _LAMPS]]
        toward = light + aside @ across
        total += staged.render(seen, toward, (steps[column], steps[row]))
    return np.rint(total / _LAMPS**2).astype(np.uint8)


def _row(turn: NDArray[np.float64], place: Vector) -> list[float]:
    """Return a pose as (w, x, y, z, tx, ty, tz)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, place
    pose = Pose(matrix)
    return [*pose.quaternion, *pose.translation]
