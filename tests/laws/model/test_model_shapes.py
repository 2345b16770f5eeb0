"""Meshes and point clouds become bodies, without any image."""

from collections.abc import Callable
from pathlib import Path

import pytest
from body_measures import WorldBody
from scene_table import Scene
from scenes_solids import (
    EYE,
    PLACE,
    brick,
    cloud,
    fit_box,
    radii_figures,
    scaled_figures,
    seen_figures,
    solid_ball,
    solid_brick,
    solid_cloud,
    solid_cloud_from_one_eye,
    solid_scaled,
    stretched_ball,
    volume_figures,
    write_cloud,
)
from tiers import tiered

from conftest import Command
from servoid.model import Request, fit_mesh, fit_range_samples, range_samples_of_cloud
from servoid.shape import load_body

trimesh = pytest.importorskip("trimesh")


@pytest.mark.parametrize(
    ("make", "count", "one", "ending"),
    tiered([(stretched_ball, 1, solid_ball, "ply"), (brick, 8, solid_brick, "stl")]),
)
def test_a_mesh_becomes_a_body_of_the_count_asked_for(
    make: "Callable[[], trimesh.Trimesh]",
    count: int,
    one: Scene,
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
    assert one.beyond(volume_figures(body, mesh)) == []
    assert body.seen is None
    assert "silhouette IoU" not in outcome.out


@pytest.mark.parametrize("what", ["mesh", "cloud"])
@pytest.mark.parametrize(
    ("scale", "words"),
    [(1e3, "if its unit is the millimetre"), (1e-3, "if its unit is the kilometre or the inch")],
)
def test_a_body_of_a_size_that_hardly_any_object_has_is_in_doubt(
    scale: float, words: str, what: str
) -> None:
    mesh = stretched_ball()
    corners = mesh.vertices * scale
    request = Request(max_ellipsoids=1, delta=0.0)
    if what == "mesh":
        made = fit_mesh(corners, mesh.faces, request)
    else:
        samples = range_samples_of_cloud(corners, mesh.vertex_normals, None)
        made = fit_range_samples(samples, request)
    (doubt,) = made.all_doubts
    assert words in doubt
    assert made.fitness > 0.8
    assert made.verdict.word == "rough"


def test_a_mesh_has_a_report_without_views(tmp_path: Path, servoid_command: Command) -> None:
    report = tmp_path / "report"
    stretched_ball().export(tmp_path / "mesh.ply")
    outcome = servoid_command(
        "model", tmp_path / "mesh.ply", "--out", tmp_path / "body.json",
        "--max-ellipsoids", 1, "--report", report,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert solid_ball.beyond(radii_figures(load_body(tmp_path / "body.json"))) == []
    drawn = {path.name for path in report.iterdir()}
    assert drawn == {"report.html", "body.png", "curve.png", "summary.json"}
    assert all(str(report / name) in outcome.out for name in drawn)


@pytest.mark.extended
def test_the_scale_and_the_place_of_a_mesh_do_not_change_how_well_it_is_modelled() -> None:
    one, two = fit_box()
    assert len(one.body) == len(two.body) == 4
    assert solid_scaled.beyond(scaled_figures(one, two)) == []


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
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert f"{name} does not apply; leave it out" in outcome.err
    assert not out.exists()


def test_a_cloud_with_normals_becomes_a_body(tmp_path: Path, servoid_command: Command) -> None:
    points, normals = cloud()
    file = write_cloud(tmp_path / "cloud.ply", points, normals)
    out = tmp_path / "body.json"
    outcome = servoid_command("model", file, "--out", out, "--max-ellipsoids", 1)
    assert outcome.code == 0, outcome.err
    body = load_body(out)
    assert solid_cloud.beyond(volume_figures(body, stretched_ball())) == []
    assert body.made_by is not None
    assert body.made_by.seen_points == len(points)


def test_a_cloud_without_normals_needs_the_place_it_was_seen_from(
    tmp_path: Path, servoid_command: Command
) -> None:
    points, _ = cloud(EYE)
    file = write_cloud(tmp_path / "cloud.ply", points, None)
    out = tmp_path / "body.json"
    outcome = servoid_command("model", file, "--out", out, "--max-ellipsoids", 1)
    assert outcome.code == 1
    assert outcome.err.count("\n") == 1
    assert "--viewpoint X,Y,Z" in outcome.err
    assert not out.exists()
    at = ",".join(map(str, EYE))
    outcome = servoid_command("model", file, "--out", out, "--max-ellipsoids", 1, "--viewpoint", at)
    assert outcome.code == 0, outcome.err
    body = load_body(out)
    assert solid_cloud_from_one_eye.beyond(seen_figures(body, points)) == []
    assert body.seen is not None
    assert body.seen.unseen_toward is not None
    toward = WorldBody.of(body).world_from_object @ body.seen.unseen_toward
    assert toward @ (PLACE - EYE) > 0.0


def test_a_viewpoint_that_is_no_place_is_wrong_usage(
    tmp_path: Path, servoid_command: Command
) -> None:
    for text in ("1,2", "a,b,c", "0,0,inf"):
        outcome = servoid_command(
            "model", "c.ply", "--out", tmp_path / "b.json", "--viewpoint", text
        )
        assert outcome.code == 2
        assert "write three numbers" in " ".join(outcome.err.split())
