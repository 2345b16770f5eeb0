"""Meshes and point clouds become bodies, without any image."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from body_measures import WorldBody, overlap
from conftest import Command
from scipy.spatial.transform import Rotation

from servoid.model import Request, fit_mesh
from servoid.shape import load_body

trimesh = pytest.importorskip("trimesh")

TURN = Rotation.from_euler("xyz", (30, -40, 70), degrees=True).as_matrix()
RADII = np.array([0.08, 0.05, 0.03])
PLACE = np.array([0.4, -0.1, 0.2])


def put(mesh: "trimesh.Trimesh") -> "trimesh.Trimesh":
    """Turn and move a mesh."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = TURN, PLACE
    return mesh.apply_transform(pose)


def stretched_ball() -> "trimesh.Trimesh":
    return put(trimesh.creation.icosphere(subdivisions=3).apply_scale(RADII))


def brick() -> "trimesh.Trimesh":
    return put(trimesh.creation.box(extents=(0.12, 0.08, 0.05)))


def volume_iou(body: WorldBody, mesh: "trimesh.Trimesh") -> float:
    low, high = mesh.bounds
    random = np.random.default_rng(0)
    points = random.uniform(low - 0.01, high + 0.01, (20_000, 3))
    # Both solids are convex, so that their half-spaces say what is inside.
    out = (points - mesh.triangles_center[:1]) @ mesh.face_normals.T
    out -= np.einsum(
        "fi,fi->f", mesh.triangles_center - mesh.triangles_center[0], mesh.face_normals
    )
    return overlap(body.holds(points), (out < 0.0).all(axis=1))


@pytest.mark.parametrize(
    ("make", "count", "least", "ending"),
    [(stretched_ball, 1, 0.95, "ply"), (brick, 8, 0.85, "stl")],
)
def test_a_mesh_becomes_a_body_of_the_count_asked_for(
    make: "Callable[[], trimesh.Trimesh]",
    count: int,
    least: float,
    ending: str,
    tmp_path: Path,
    servoid_command: Command,
) -> None:
    mesh, file, out = make(), tmp_path / f"mesh.{ending}", tmp_path / "body.json"
    mesh.export(file)
    options = ("--max-ellipsoids", count, "--delta", 0)
    outcome = servoid_command("model", file, "--out", out, *options)
    assert (outcome.code, outcome.err) == (0, "")
    body = load_body(out)
    assert len(body.ellipsoids) == count
    assert volume_iou(WorldBody.of(body), mesh) > least
    assert body.seen is None
    assert "silhouette IoU" not in outcome.out


def test_a_mesh_has_a_report_without_views(tmp_path: Path, servoid_command: Command) -> None:
    report = tmp_path / "report"
    stretched_ball().export(tmp_path / "mesh.ply")
    outcome = servoid_command(
        "model", tmp_path / "mesh.ply", "--out", tmp_path / "body.json",
        "--max-ellipsoids", 1, "--report", report,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    radii = load_body(tmp_path / "body.json").ellipsoids[0].radii
    assert sorted(radii) == pytest.approx(sorted(RADII), rel=0.03)
    drawn = {path.name for path in report.iterdir()}
    assert drawn == {"report.html", "body.png", "curve.png", "summary.json"}
    assert all(str(report / name) in outcome.out for name in drawn)


def test_the_scale_and_the_place_of_a_mesh_do_not_change_how_well_it_is_modelled() -> None:
    box = trimesh.creation.box((0.3, 0.2, 0.1))
    request = Request(max_ellipsoids=4, delta=0.0)
    faces = np.ascontiguousarray(box.faces, dtype=np.int64)
    one = fit_mesh(np.ascontiguousarray(box.vertices), faces, request)
    turn = Rotation.from_euler("xyz", (20, 40, 60), degrees=True).as_matrix()
    moved = 20.0 * box.vertices @ turn.T + (3.0, -1.0, 7.0)
    two = fit_mesh(np.ascontiguousarray(moved), faces, request)
    assert len(one.body) == len(two.body) == 4
    assert two.fitness == pytest.approx(one.fitness, abs=0.01)
    volumes = [result.body.mass_properties()[0] for result in (one, two)]
    assert volumes[1] == pytest.approx(8000.0 * volumes[0], rel=0.02)


@pytest.mark.parametrize(
    ("options", "name"),
    [
        (("--target", "box:1,1,5,5"), "--target"),
        (("--method", "paper"), "--method paper"),
        (("--views", "::2"), "--views"),
        (("--observations", "0:1"), "--observations"),
        (("--bop-object", 0), "--bop-object"),
        (("--images", "images"), "--images"),
        (("--viewpoint", "0,0,1"), "--viewpoint"),
    ],
)
def test_options_that_mean_nothing_for_a_mesh_are_refused_by_name(
    options: tuple[object, ...], name: str, tmp_path: Path, servoid_command: Command
) -> None:
    brick().export(tmp_path / "mesh.ply")
    out = tmp_path / "body.json"
    outcome = servoid_command("model", tmp_path / "mesh.ply", "--out", out, *options)
    assert outcome.code == 1
    assert outcome.err.count("\n") == 1
    assert f"{name} means nothing; leave it out" in outcome.err
    assert not out.exists()


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


def test_a_cloud_with_normals_becomes_a_body(tmp_path: Path, servoid_command: Command) -> None:
    points, normals = cloud()
    file = write_cloud(tmp_path / "cloud.ply", points, normals)
    out = tmp_path / "body.json"
    outcome = servoid_command("model", file, "--out", out, "--max-ellipsoids", 1)
    assert outcome.code == 0, outcome.err
    body = load_body(out)
    assert volume_iou(WorldBody.of(body), stretched_ball()) > 0.9
    assert body.made_by is not None
    assert body.made_by.seen_points == len(points)


def test_a_cloud_without_normals_needs_the_place_it_was_seen_from(
    tmp_path: Path, servoid_command: Command
) -> None:
    eye = np.array([0.4, -0.1, -0.4])
    points, _ = cloud(eye)
    file = write_cloud(tmp_path / "cloud.ply", points, None)
    out = tmp_path / "body.json"
    outcome = servoid_command("model", file, "--out", out, "--max-ellipsoids", 1)
    assert outcome.code == 1
    assert outcome.err.count("\n") == 1
    assert "--viewpoint X,Y,Z" in outcome.err
    assert not out.exists()
    at = ",".join(map(str, eye))
    outcome = servoid_command("model", file, "--out", out, "--max-ellipsoids", 1, "--viewpoint", at)
    assert outcome.code == 0, outcome.err
    body = load_body(out)
    assert np.quantile(WorldBody.of(body).distances(points), 0.95) < 0.004
    assert body.seen is not None
    assert body.seen.unseen_toward is not None
    toward = WorldBody.of(body).world_from_object @ body.seen.unseen_toward
    assert toward @ (PLACE - eye) > 0.0


def test_a_viewpoint_that_is_no_place_is_wrong_usage(
    tmp_path: Path, servoid_command: Command
) -> None:
    for text in ("1,2", "a,b,c", "0,0,inf"):
        outcome = servoid_command(
            "model", "c.ply", "--out", tmp_path / "b.json", "--viewpoint", text
        )
        assert outcome.code == 2
        assert "write three numbers" in " ".join(outcome.err.split())
