"""Bodies of solids that a mesh or a cloud tells, and what they miss of them."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from body_measures import WorldBody, overlap
from recordings import run_servoid
from scene_table import Figures, scene
from scipy.spatial.transform import Rotation

from servoid.model import ModelResult, Request, fit_mesh
from servoid.shape import BodyFile, load_body

if TYPE_CHECKING:
    import trimesh

TURN = Rotation.from_euler("xyz", (30, -40, 70), degrees=True).as_matrix()
RADII = np.array([0.08, 0.05, 0.03])
PLACE = np.array([0.4, -0.1, 0.2])
EYE = np.array([0.4, -0.1, -0.4])
MISSED = {"missed": "1"}


def put(mesh: "trimesh.Trimesh") -> "trimesh.Trimesh":
    """Turn and move a mesh."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = TURN, PLACE
    return mesh.apply_transform(pose)


def stretched_ball() -> "trimesh.Trimesh":
    import trimesh

    return put(trimesh.creation.icosphere(subdivisions=3).apply_scale(RADII))


def brick() -> "trimesh.Trimesh":
    import trimesh

    return put(trimesh.creation.box(extents=(0.12, 0.08, 0.05)))


def volume_figures(file: BodyFile, mesh: "trimesh.Trimesh") -> Figures:
    """Say how much of the body and the mesh together is not in both."""
    low, high = mesh.bounds
    points = np.random.default_rng(0).uniform(low - 0.01, high + 0.01, (20_000, 3))
    # Both solids are convex, so that their half-spaces say what is inside.
    out = (points - mesh.triangles_center[:1]) @ mesh.face_normals.T
    out -= np.einsum(
        "fi,fi->f", mesh.triangles_center - mesh.triangles_center[0], mesh.face_normals
    )
    inside = (out < 0.0).all(axis=1)
    return {"missed": 1.0 - overlap(WorldBody.of(file).holds(points), inside)}


def modelled(folder: Path, file: Path, *options: object) -> BodyFile:
    out = folder / "body.json"
    run_servoid(folder, "model", file, "--out", out, *options)
    return load_body(out)


def radii_figures(file: BodyFile) -> Figures:
    """Say how far the radii of the first ellipsoid are from those of the stretched ball."""
    off = np.array(sorted(file.ellipsoids[0].radii)) / np.array(sorted(RADII)) - 1.0
    return {"radius off": float(np.abs(off).max())}


@scene("solid ball", {**MISSED, "radius off": "1"})
def solid_ball(seed: int, folder: Path) -> Figures:
    mesh, path = stretched_ball(), folder / "mesh.ply"
    mesh.export(path)
    file = modelled(folder, path, "--max-ellipsoids", 1, "--delta", 0, "--seed", seed)
    return {**volume_figures(file, mesh), **radii_figures(file)}


@scene("solid brick", MISSED)
def solid_brick(seed: int, folder: Path) -> Figures:
    mesh, path = brick(), folder / "mesh.stl"
    mesh.export(path)
    options = ("--max-ellipsoids", 8, "--delta", 0, "--seed", seed)
    return volume_figures(modelled(folder, path, *options), mesh)


def fit_box(seed: int | None = None) -> tuple[ModelResult, ModelResult]:
    """Model a box, and the same one twenty times as large and elsewhere."""
    import trimesh

    box = trimesh.creation.box((0.3, 0.2, 0.1))
    request = Request(max_ellipsoids=4, delta=0.0, seed=seed)
    faces = np.ascontiguousarray(box.faces, dtype=np.int64)
    one = fit_mesh(np.ascontiguousarray(box.vertices), faces, request)
    turn = Rotation.from_euler("xyz", (20, 40, 60), degrees=True).as_matrix()
    moved = 20.0 * box.vertices @ turn.T + (3.0, -1.0, 7.0)
    return one, fit_mesh(np.ascontiguousarray(moved), faces, request)


def scaled_figures(one: ModelResult, two: ModelResult) -> Figures:
    """Compare the fitness and the volume of two models of one box."""
    first, second = (result.body.mass_properties()[0] for result in (one, two))
    return {
        "fitness off": abs(two.fitness - one.fitness),
        "volume off": abs(second / (8000.0 * first) - 1.0),
    }


@scene("solid scaled", {"fitness off": "1", "volume off": "1"})
def solid_scaled(seed: int, _folder: Path) -> Figures:
    return scaled_figures(*fit_box(seed))


def cloud(eye: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Make points on the whole ellipsoid, or on what an eye sees of it, and their normals."""
    ways = np.random.default_rng(1).normal(size=(3000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    points = (ways * RADII) @ TURN.T + PLACE
    normals = (ways / RADII) @ TURN.T
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    if eye is not None:
        seen = np.einsum("ni,ni->n", eye - points, normals) > 0.0
        points, normals = points[seen], normals[seen]
    return points, normals


def write_cloud(path: Path, points: np.ndarray, normals: np.ndarray | None) -> Path:
    rows = points if normals is None else np.hstack([points, normals])
    names = ("x", "y", "z", "nx", "ny", "nz")[: rows.shape[1]]
    head = ["ply", "format ascii 1.0", f"element vertex {len(rows)}"]
    head += [f"property double {name}" for name in names] + ["end_header"]
    lines = [" ".join(f"{value:.9g}" for value in row) for row in rows]
    path.write_text("\n".join([*head, *lines, ""]))
    return path


@scene("solid cloud", MISSED)
def solid_cloud(seed: int, folder: Path) -> Figures:
    path = write_cloud(folder / "cloud.ply", *cloud())
    file = modelled(folder, path, "--max-ellipsoids", 1, "--seed", seed)
    return volume_figures(file, stretched_ball())


def seen_figures(file: BodyFile, points: np.ndarray) -> Figures:
    """Say how far the points that were seen are from the body."""
    off = np.quantile(WorldBody.of(file).distances(points), 0.95)
    return {"points off": 1e3 * float(off)}


@scene("solid cloud from one eye", {"points off": "mm"})
def solid_cloud_from_one_eye(seed: int, folder: Path) -> Figures:
    points, _ = cloud(EYE)
    path = write_cloud(folder / "cloud.ply", points, None)
    at = ",".join(map(str, EYE))
    options = ("--max-ellipsoids", 1, "--viewpoint", at, "--seed", seed)
    return seen_figures(modelled(folder, path, *options), points)
