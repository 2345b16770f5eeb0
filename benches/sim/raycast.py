"""Time the ray-caster: a textured room with ten visuals and a mesh, images of 640x480.

Prints the milliseconds per image, the minimum and the median of several, for each number of
threads, samples and instants, and the same with more visuals, more triangles and a distorted lens.
"""

import argparse
import os
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Lighting, Paint, Scene

IMAGES = 30
SIZE_PX = (640, 480)
FOCAL = {"focal_px": (560.0, 560.0), "center_px": (319.5, 239.5)}


@dataclass(frozen=True)
class Row:
    """The content of one row of the table."""

    name: str
    samples: int = 1
    moments: int = 1
    threads: int = 2
    copies: int = 1
    triangles: int = 5_000
    model: str = "pinhole"


def pose(x: float, y: float, z: float) -> list[float]:
    """Return a pose without rotation."""
    return [1.0, 0.0, 0.0, 0.0, x, y, z]


def vase(triangles: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices and triangles of a vase, with about the requested number of triangles."""
    around = int(np.sqrt(triangles))
    up = triangles // (2 * around)
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    height = np.linspace(-0.1, 0.1, up + 1)
    radius = 0.05 + 0.02 * np.sin(35.0 * height)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    flat = radius[:, None, None] * ring[None]
    corners = np.concatenate(
        [flat, np.broadcast_to(height[:, None, None], (*flat.shape[:2], 1))], 2
    )
    level, at = (index.ravel() for index in np.meshgrid(np.arange(up), np.arange(around)))
    beside = (at + 1) % around
    low, high = level * around, (level + 1) * around
    one = np.stack([low + at, low + beside, high + beside], axis=1)
    two = np.stack([low + at, high + beside, high + at], axis=1)
    return np.ascontiguousarray(corners.reshape(-1, 3)), np.concatenate([one, two]).astype(np.int64)


def scene_of(row: Row) -> tuple[Scene, NDArray[np.float64]]:
    """Return the visuals and their poses, (1, T, 7)."""
    rng = np.random.default_rng(3)
    pattern = rng.integers(0, 256, (256, 256, 3), dtype=np.uint8)
    scene, poses = Scene(), []
    paint = Paint(texture=pattern, gloss=0.3)
    half = float(np.sqrt(0.5))
    scene.add_plane((2.0, 2.0), Paint(texture=pattern, repeat=(6.0, 6.0)))
    poses.append(pose(0.0, 0.0, 0.0))
    scene.add_plane((2.0, 1.5), Paint(texture=pattern, repeat=(4.0, 3.0)))
    poses.append([half, half, 0.0, 0.0, 0.0, 1.2, 1.0])
    vertices, faces = vase(row.triangles)
    for copy in range(row.copies):
        shift = 0.35 * np.array([copy % 4, copy // 4]) - (0.0 if row.copies == 1 else 0.5)
        adds = [
            lambda: scene.add_ellipsoid((0.08, 0.05, 0.06), paint),
            lambda: scene.add_ellipsoid((0.04, 0.04, 0.09), Paint(color=(0.8, 0.2, 0.1))),
            lambda: scene.add_capsule(0.03, 0.06, Paint(color=(0.1, 0.3, 0.8), gloss=0.4)),
            lambda: scene.add_cylinder(0.04, 0.07, paint),
            lambda: scene.add_box((0.05, 0.06, 0.04), paint),
            lambda: scene.add_box((0.03, 0.03, 0.1), Paint(color=(0.2, 0.7, 0.3))),
            lambda: scene.add_capsule(0.02, 0.1, Paint(color=(0.6, 0.6, 0.2))),
            lambda: scene.add_ellipsoid((0.05, 0.05, 0.05), Paint(gloss=0.8)),
            lambda: scene.add_mesh(vertices, faces, Paint(color=(0.7, 0.5, 0.3), gloss=0.2)),
        ]
        for index, add in enumerate(adds):
            add()
            x, y = 0.16 * (index % 3) - 0.16 + shift[0], 0.18 * (index // 3) - 0.18 + shift[1]
            poses.append(pose(x, y, 0.1))
    return scene, np.array([poses])


def lens_of(model: str) -> Lens:
    """Return a lens of 640x480."""
    distortion = {"pinhole": (), "brown_conrady": (-0.2, 0.05, 1e-3, -1e-3, 0.0)}[model]
    return Lens(model=model, size_px=SIZE_PX, distortion=distortion, **FOCAL)


def lens_pose() -> list[float]:
    """Return the pose of a lens 0.75 m away that looks down at the visuals."""
    turn = np.radians(180.0 - 55.0) / 2.0
    return [float(np.cos(turn)), -float(np.sin(turn)), 0.0, 0.0, 0.0, -0.62, 0.55]


def measure(row: Row) -> list[float]:
    """Return the milliseconds of several images."""
    scene, visuals = scene_of(row)
    world_from_lens = np.tile(lens_pose(), (row.moments, 1))
    world_from_lens[:, 4] += 0.001 * np.arange(row.moments)
    world_from_visual = np.tile(visuals, (row.moments, 1, 1))
    lens, lighting, times = lens_of(row.model), Lighting(), []
    for _ in range(IMAGES):
        begun = time.perf_counter()
        scene.render(
            lens=lens,
            world_from_lens=world_from_lens,
            world_from_visual=world_from_visual,
            lighting=lighting,
            samples=row.samples,
            noise=2.0,
            threads=row.threads,
        )
        times.append(1000.0 * (time.perf_counter() - begun))
    return times


def rows() -> list[Row]:
    """Return the rows to measure."""
    cores = os.cpu_count() or 1
    return [
        Row("one ray a pixel"),
        Row("four rays a pixel", samples=2),
        Row("one thread", samples=2, threads=1),
        Row("all cores", samples=2, threads=cores),
        Row("four moments", samples=2, moments=4),
        Row("nine rays a pixel", samples=3),
        Row("four times the visuals", samples=2, copies=4),
        Row("16 times the visuals", samples=2, copies=16),
        Row("100,000 triangles", samples=2, triangles=100_000),
        Row("a bent lens", samples=2, model="brown_conrady"),
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--image", help="write the image of the first row here, as PNG")
    path = parser.parse_args().image
    print(f"{'':22} threads  least ms  median ms  least / ray")
    for row in rows():
        times = measure(row)
        least, median = min(times), float(np.median(times))
        each = least / row.samples**2
        print(f"{row.name:22} {row.threads:7} {least:9.1f} {median:10.1f} {each:12.2f}")
    if path:
        import cv2

        scene, visuals = scene_of(Row("picture"))
        image = scene.render(
            lens=lens_of("pinhole"),
            world_from_lens=np.array([lens_pose()]),
            world_from_visual=visuals,
            lighting=Lighting(),
            samples=3,
        )
        cv2.imwrite(path, image[:, :, ::-1])


if __name__ == "__main__":
    main()
