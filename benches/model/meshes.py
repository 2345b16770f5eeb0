"""Measures bodies of meshes: volumetric and silhouette intersection over union, and seconds.

The meshes are expected beside the repository. Needs `servoid[exchange]` and embreex or rtree.
"""

import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid._native import View, silhouette_ious
from servoid.camera import Camera
from servoid.exchange.shapes.mesh_file import MeshFile, read_mesh
from servoid.model import Request, fit_mesh
from servoid.pose import Pose
from servoid.shape import Body

MESHES = Path(__file__).parents[3] / "shared" / "data" / "meshes"
COUNTS = (1, 3, 5, 8, 16)
POINTS = 200_000
VIEWS = 20
SIDE_PX = 300


def inside(body: Body, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points (N, 3) of the world are inside a body."""
    local = body.world_from_object.inverse().transform(points)
    found = np.zeros(len(points), dtype=bool)
    for center, radii, turn in zip(body.centers, body.radii, body.rotations, strict=True):
        axes = Rotation.from_quat(turn, scalar_first=True).as_matrix()
        found |= (((local - center) @ axes / radii) ** 2).sum(axis=1) < 1.0
    return found


def mean_silhouette_iou(body: Body, mesh: MeshFile) -> float:
    """Compare silhouettes from far away in random directions, the mesh's drawn as triangles."""
    import cv2

    middle = mesh.vertices.mean(axis=0)
    reach = float(np.linalg.norm(mesh.vertices - middle, axis=1).max())
    focal = 0.45 * SIDE_PX * 50.0
    camera = Camera(
        size_px=(SIDE_PX, SIDE_PX), focal_px=(focal, focal), center_px=(SIDE_PX / 2, SIDE_PX / 2)
    )
    views = []
    for turn in Rotation.from_quat(np.random.default_rng(5).normal(size=(VIEWS, 4))):
        pose = np.eye(4)
        pose[:3, :3] = turn.as_matrix()
        pose[:3, 3] = middle - 50.0 * reach * pose[:3, 2]
        world_from_camera = Pose(pose)
        pixels = camera.project(world_from_camera.inverse().transform(mesh.vertices))
        drawn = np.zeros((SIDE_PX, SIDE_PX), np.uint8)
        for face in mesh.faces:
            corners = np.round(pixels[face] * 16).astype(np.int32)
            cv2.fillConvexPoly(drawn, corners, (255,), shift=4)
        views.append(View(camera=camera, world_from_camera=world_from_camera, mask=drawn))
    return float(silhouette_ious(body, views).mean())


def main() -> None:
    """Print one line per mesh and count."""
    import trimesh

    paths = sorted(MESHES.glob("*.ply"))
    if not paths:
        sys.exit(f"skipped: there are no meshes in {MESHES}")
    print("mesh      count  volume IoU  silhouette IoU  seconds")
    for path in paths:
        mesh = read_mesh(path)
        solid = trimesh.Trimesh(mesh.vertices, mesh.faces)
        low, high = solid.bounds[0] - 0.1 * solid.extents, solid.bounds[1] + 0.1 * solid.extents
        points = np.random.default_rng(0).uniform(low, high, (POINTS, 3))
        truth = solid.contains(points)
        for count in COUNTS:
            start = time.perf_counter()
            body = fit_mesh(
                mesh.vertices, mesh.faces, Request(max_ellipsoids=count, delta=0.0)
            ).body
            seconds = time.perf_counter() - start
            held = inside(body, points)
            volume = (truth & held).sum() / (truth | held).sum()
            outline = f"{mean_silhouette_iou(body, mesh):14.3f}" if count >= 8 else 14 * " "
            print(f"{path.stem:9} {len(body):5}  {volume:10.3f}  {outline}  {seconds:7.2f}")


if __name__ == "__main__":
    main()
