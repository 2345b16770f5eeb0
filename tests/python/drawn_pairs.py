"""Stereo pairs that the tests draw: a red ellipsoid with a pattern before a grey wall."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from conftest import write_png
from drawn import once
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
SIZE_PX = (280, 210)
FOCAL_PX, CENTER_PX = 340.0, (139.5, 104.5)
BASELINE, WALL = 0.07, 0.9
RADII = np.array([0.06, 0.045, 0.05])
TURN = Rotation.from_euler("xyz", (20, -30, 25), degrees=True).as_matrix()
RED, GRAY = np.array([1.0, 0.25, 0.2]), np.array([0.6, 0.6, 0.6])
DEPTH_SCALE_M = 0.0001


@dataclass(frozen=True)
class Pair:
    """One ellipsoid, at `centers[i]` in the left camera's frame at observation i.

    The rig stands at `world_from_left`; without `patterned` all is of one colour. The wall may have
    a `poster` in the object's red, (x, y, x, y) in the left camera's frame.
    """

    centers: tuple[tuple[float, float, float], ...] = ((0.012, -0.008, 0.42),)
    patterned: bool = True
    poster: tuple[float, float, float, float] | None = None

    @property
    def world_from_left(self) -> Array:
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_euler("xyz", (-100, 15, 40), degrees=True).as_matrix()
        pose[:3, 3] = (0.3, -0.2, 0.5)
        return pose

    def to_left(self, points: Array) -> Array:
        """Take points (N, 3) from the world to the left camera's frame."""
        pose = self.world_from_left
        return (points - pose[:3, 3]) @ pose[:3, :3]

    def draw(self, index: int, offset: float) -> tuple[NDArray[np.uint8], Array, NDArray[np.bool_]]:
        """Draw what a camera `offset` to the right sees; return image, depth and mask."""
        columns, rows = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
        rays = np.ones((*columns.shape, 3))
        rays[..., 0] = (columns - CENTER_PX[0]) / FOCAL_PX
        rays[..., 1] = (rows - CENTER_PX[1]) / FOCAL_PX
        origin = np.array([offset, 0.0, 0.0])
        shape = (TURN / RADII**2) @ TURN.T
        away = origin - self.centers[index]
        a = np.einsum("hwi,ij,hwj->hw", rays, shape, rays)
        b = rays @ shape @ away
        root = b * b - a * (away @ shape @ away - 1.0)
        mask = root > 0.0
        depth = np.where(mask, (-b - np.sqrt(np.maximum(root, 0.0))) / a, WALL)
        places = origin + depth[..., None] * rays
        shades = self._shades(places, self.centers[index], mask)
        red = mask
        if self.poster is not None:
            corner, end = np.array(self.poster[:2]), np.array(self.poster[2:])
            red = mask | ((places[..., :2] > corner) & (places[..., :2] < end)).all(axis=2)
        color = np.where(red[..., None], RED, GRAY) * shades[..., None]
        return np.clip(np.rint(color), 0, 255).astype(np.uint8), depth, mask

    def _shades(self, points: Array, center: tuple[float, ...], mask: NDArray[np.bool_]) -> Array:
        if not self.patterned:
            return np.full(points.shape[:2], 180.0)
        random = np.random.default_rng(3)
        ways, phases = random.normal(size=(40, 3)), random.uniform(0.0, 2.0 * np.pi, 40)
        lengths = random.uniform(0.008, 0.05, 40)
        ways *= (2.0 * np.pi / (lengths * np.linalg.norm(ways, axis=1)))[:, None]
        own = np.where(mask[..., None], points - np.array(center), points)
        return np.clip(180.0 + 11.0 * np.sin(own @ ways.T + phases).sum(axis=-1), 90.0, 255.0)

    def seen_points(self, index: int = 0) -> Array:
        """Return the true surface that the left camera sees, (N, 3), in the world."""
        _, depth, mask = self.draw(index, 0.0)
        rows, columns = np.nonzero(mask)
        pixels = np.stack([columns, rows], axis=1)[::7]
        z = depth[rows, columns][::7, None]
        points = np.hstack([(pixels - CENTER_PX) / FOCAL_PX * z, z])
        pose = self.world_from_left
        return points @ pose[:3, :3].T + pose[:3, 3]

    @once
    def write(
        self,
        folder: Path,
        *,
        masked: tuple[int, ...] = (0,),
        rate_hz: float | None = None,
        depths: bool = False,
        cameras: int = 2,
    ) -> Path:
        """Write the pair, or its left camera alone, as a capture with left masks here and there."""
        for name in ("left", "right", "masks", "depths"):
            (folder / name).mkdir(parents=True)
        for index in range(len(self.centers)):
            image, depth, mask = self.draw(index, 0.0)
            write_png(folder / "left" / f"{index:04}.png", image)
            write_png(folder / "right" / f"{index:04}.png", self.draw(index, BASELINE)[0])
            if index in masked:
                pixels = mask.astype(np.uint8) * np.uint8(255)
                write_png(folder / "masks" / f"{index:04}.png", pixels)
            stored = np.rint(depth / DEPTH_SCALE_M).astype(np.uint16)
            assert cv2.imwrite(str(folder / "depths" / f"{index:04}.png"), stored)
        more = 'masks = "masks/*.png"\n'
        if depths:
            more += f'depths = "depths/*.png"\ndepth_scale_m = {DEPTH_SCALE_M}\n'
        rate = "" if rate_hz is None else f"rate_hz = {rate_hz}\n"
        tables = [_camera("left", 0.0, more), _camera("right", BASELINE, "")][:cameras]
        (folder / "capture.toml").write_text(
            f'version = 1\n{rate}\n{"".join(tables)}[rig]\nposes = "poses.csv"\n'
        )
        x, y, z, w = Rotation.from_matrix(self.world_from_left[:3, :3]).as_quat()
        row = ",".join(f"{one:.12g}" for one in (*self.world_from_left[:3, 3], w, x, y, z))
        lines = [f"{0.1 * index:.1f},{row}" for index in range(len(self.centers))]
        (folder / "poses.csv").write_text("\n".join(["time_s,x,y,z,qw,qx,qy,qz", *lines, ""]))
        return folder


def _camera(name: str, offset: float, more: str) -> str:
    return f"""[[camera]]
name = "{name}"
images = "{name}/*.png"
{more}size_px = [{SIZE_PX[0]}, {SIZE_PX[1]}]
model = "pinhole"
focal_px = [{FOCAL_PX}, {FOCAL_PX}]
center_px = [{CENTER_PX[0]}, {CENTER_PX[1]}]
distortion = []
rig_from_camera = [[1, 0, 0, {offset}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]

"""
