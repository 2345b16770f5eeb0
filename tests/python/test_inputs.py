"""Whatever a user has becomes a body: captures without masks, one look, meshes, clouds."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from conftest import CENTER_PX, FOCAL_PX, SIZE_PX, Command, Drawing, hit_depths, write_png
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid.exchange import open_any
from servoid.model import Request, fit_capture, fit_mesh
from servoid.observe import open_capture, parse_target
from servoid.shape import Body, load_body


def unmask(capture: Path) -> list[NDArray[np.uint8]]:
    """Take the masks out of a capture; return them."""
    masks = [view.mask() for view in open_capture(capture).views()]
    text = (capture / "capture.toml").read_text()
    (capture / "capture.toml").write_text(text.replace('masks = "masks/*.png"\n', ""))
    return masks


def box_around(mask: NDArray[np.uint8], margin_px: int = 3) -> str:
    rows, columns = np.nonzero(mask)
    first, last = (columns.min(), rows.min()), (columns.max(), rows.max())
    return ",".join(str(int(x)) for x in (*np.subtract(first, margin_px), *np.add(last, margin_px)))


def ious(body: Body, capture: Path, masks: list[NDArray[np.uint8]]) -> NDArray[np.float64]:
    found = []
    for view, mask in zip(open_capture(capture).all_views(), masks, strict=True):
        drawn = body.silhouette(view.camera, view.world_from_camera) != 0
        found.append((drawn & (mask != 0)).sum() / (drawn | (mask != 0)).sum())
    return np.array(found)


def made_by(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text())["made_by"]


@pytest.mark.parametrize("kind", ["box", "mask", "background"])
def test_an_object_marked_in_one_view_is_modelled_from_all(
    kind: str, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    masks = unmask(drawn_capture)
    write_png(tmp_path / "mark.png", masks[3])
    write_png(tmp_path / "empty.png", np.full((SIZE_PX[1], SIZE_PX[0], 3), 90, np.uint8))
    target = {
        "box": f"box:{box_around(masks[3])}@eye/0003",
        "mask": f"mask:{tmp_path / 'mark.png'}@eye/0003",
        "background": f"background:{tmp_path / 'empty.png'}@eye/0003",
    }[kind]
    out = tmp_path / "body.json"
    ended = servoid_command(
        "model", drawn_capture, "--out", out, "--target", target, "--max-ellipsoids", 2
    )
    assert ended.code == 0, ended.err
    found = ious(load_body(out).body(), drawn_capture, masks)
    assert found.mean() > 0.9, found
    assert made_by(out)["targets"] == [target]
    assert len(made_by(out)["views"]) == len(masks)


def test_the_same_target_gives_the_same_file_on_any_number_of_threads(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    masks = unmask(drawn_capture)
    files = []
    for threads in (1, 2):
        out = tmp_path / f"{threads}.json"
        ended = servoid_command(
            "model", drawn_capture, "--out", out, "--threads", threads, "--max-ellipsoids", 2,
            "--target", f"box:{box_around(masks[0])}",
        )  # fmt: skip
        assert ended.code == 0, ended.err
        files.append(out.read_bytes())
    assert files[0] == files[1]


@pytest.mark.parametrize(
    ("target", "words"),
    [
        (None, "--target"),
        ("box:10,10,50,50@eye/0099", "eye/0099"),
        ("hue:170..175", "hue"),
        ("box:900,900,950,950", "box"),
        ("circle:3,4", "no known form"),
    ],
)
def test_a_target_that_finds_nothing_is_refused_in_a_line(
    target: str | None,
    words: str,
    drawn_capture: Path,
    tmp_path: Path,
    servoid_command: Command,
) -> None:
    unmask(drawn_capture)
    options = [] if target is None else ["--target", target]
    ended = servoid_command("model", drawn_capture, "--out", tmp_path / "body.json", *options)
    assert ended.code == 1
    assert words in ended.err
    assert ended.err.startswith("error: ")
    assert ended.err.count("\n") == 1
    assert not (tmp_path / "body.json").exists()


def textured(world_from_camera: NDArray[np.float64]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Draw a ball of 50 mm with a pattern before a patterned wall; return image and depth."""
    center = np.array([0.0, 0.0, 0.5])
    depth = hit_depths(world_from_camera, np.eye(3) / 0.05**2, center)
    x, y = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
    rays = np.stack(
        [(x - CENTER_PX[0]) / FOCAL_PX, (y - CENTER_PX[1]) / FOCAL_PX, np.ones(x.shape)], axis=-1
    )
    on_ball = np.isfinite(depth)
    wall = 0.9 - world_from_camera[2, 3]
    points = rays * np.where(on_ball, depth, wall)[..., None] + world_from_camera[:3, 3]
    waves = sum(
        np.sin(points @ np.array(k)) for k in ((310, 90, 40), (-120, 260, 90), (70, -330, 200))
    )
    shade = (0.5 + waves / 6.0)[..., None]
    colors = np.where(on_ball[..., None], (230, 120, 40), (60, 90, 120))
    return np.clip(colors * (0.4 + 0.8 * shade), 0, 255).astype(np.uint8), depth


def write_pair(folder: Path, *, with_depth: bool, cameras: int = 2) -> Path:
    tables = []
    for index, name in enumerate(["left", "right"][:cameras]):
        pose = np.eye(4)
        pose[0, 3] = 0.06 * index
        image, depth = textured(pose)
        (folder / name).mkdir(parents=True)
        write_png(folder / name / "0000.png", image)
        lines = [
            "[[camera]]", f'name = "{name}"', f'images = "{name}/*.png"',
            f"size_px = {list(SIZE_PX)}", 'model = "pinhole"',
            f"focal_px = [{FOCAL_PX}, {FOCAL_PX}]", f"center_px = {list(CENTER_PX)}",
            f"rig_from_camera = {pose.tolist()}",
        ]  # fmt: skip
        if index == 0:
            lines.append('masks = "masks/*.png"')
            (folder / "masks").mkdir()
            mask = np.where(np.isfinite(depth), 255, 0).astype(np.uint8)
            write_png(folder / "masks" / "0000.png", mask)
            if with_depth:
                lines += ['depths = "depth/*.png"', "depth_scale_m = 0.0001"]
                (folder / "depth").mkdir()
                counts = np.where(np.isfinite(depth), depth * 1e4, 0).astype(np.uint16)
                assert cv2.imwrite(str(folder / "depth" / "0000.png"), counts)
        tables.append("\n".join(lines))
    (folder / "capture.toml").write_text("version = 1\n\n" + "\n\n".join(tables) + "\n")
    return folder


@pytest.mark.parametrize(("cameras", "with_depth"), [(2, False), (2, True), (1, True)])
def test_one_look_finds_the_seen_side_and_says_which_side_it_never_saw(
    cameras: int, with_depth: bool, tmp_path: Path, servoid_command: Command
) -> None:
    capture = write_pair(tmp_path / "pair", with_depth=with_depth, cameras=cameras)
    out = tmp_path / "body.json"
    ended = servoid_command("model", capture, "--out", out, "--max-ellipsoids", 1)
    assert ended.code == 0, ended.err
    assert "was never seen" in " ".join(ended.out.split())
    file = load_body(out)
    assert file.seen is not None
    assert 0.2 < file.seen.share < 0.65
    body = file.body()
    turn = body.world_from_object.matrix()[:3, :3]
    assert (turn @ np.array(file.seen.unseen_toward))[2] > 0.7
    seen = np.array([0.0, 0.0, 0.45])
    center = turn @ body.centers[0] + body.world_from_object.translation
    toward = seen - center
    axes = turn @ Rotation.from_quat(body.rotations[0], scalar_first=True).as_matrix()
    reach = 1.0 / np.linalg.norm(axes.T @ (toward / np.linalg.norm(toward)) / body.radii[0])
    assert abs(np.linalg.norm(toward) - reach) < 0.004


def test_a_recording_is_looked_at_where_the_target_is_unless_told_otherwise(
    drawn_capture: Path,
) -> None:
    text = (drawn_capture / "capture.toml").read_text()
    (drawn_capture / "capture.toml").write_text(
        text.replace("version = 1", "version = 1\nrate_hz = 10")
    )
    capture = open_any(drawn_capture)
    assert capture.is_recording
    with pytest.raises(Exception, match="at least two views"):
        fit_capture(capture, Request(max_ellipsoids=1))
    result = fit_capture(capture, Request(max_ellipsoids=1), observations=slice(0, 4))
    assert [view.index for view in result.used_views] == [0, 1, 2, 3]


def test_the_count_is_chosen_by_held_out_views(drawn_capture: Path) -> None:
    result = fit_capture(open_any(drawn_capture), Request(seed=1))
    assert result.settings.held_out  # type: ignore[union-attr]
    assert len(result.body) in (2, 3)


def test_a_target_in_python_is_the_same_as_on_the_command_line(drawn_capture: Path) -> None:
    masks = unmask(drawn_capture)
    target = parse_target(f"box:{box_around(masks[2])}@eye/0002")
    result = fit_capture(open_any(drawn_capture), Request(max_ellipsoids=2), targets=[target])
    assert result.targets == (str(target),)
    assert ious(result.body, drawn_capture, masks).mean() > 0.9


def test_a_mesh_becomes_as_many_ellipsoids_as_asked_with_a_report(
    tmp_path: Path, servoid_command: Command
) -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(subdivisions=3)
    mesh.apply_scale([0.09, 0.05, 0.03])
    mesh.export(tmp_path / "egg.ply")
    out = tmp_path / "egg.json"
    ended = servoid_command(
        "model", tmp_path / "egg.ply", "--out", out, "--max-ellipsoids", 1, "--delta", 0,
        "--report", tmp_path / "report",
    )  # fmt: skip
    assert ended.code == 0, ended.err
    body = load_body(out).body()
    assert np.sort(body.radii[0]) == pytest.approx([0.03, 0.05, 0.09], rel=0.03)
    assert (tmp_path / "report" / "report.html").exists()
    assert not (tmp_path / "report" / "contact_sheet.png").exists()
    refused = servoid_command("model", tmp_path / "egg.ply", "--out", out, "--target", "click:3,4")
    assert refused.code == 1
    assert "--target" in refused.err


def test_the_scale_and_the_place_of_a_mesh_do_not_change_how_well_it_is_modelled() -> None:
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((0.3, 0.2, 0.1))
    turn = Rotation.from_euler("xyz", (20, 40, 60), degrees=True).as_matrix()
    request = Request(max_ellipsoids=4, delta=0.0)
    faces = np.ascontiguousarray(box.faces, dtype=np.int64)
    one = fit_mesh(np.ascontiguousarray(box.vertices), faces, request)
    moved = 20.0 * box.vertices @ turn.T + (3.0, -1.0, 7.0)
    two = fit_mesh(np.ascontiguousarray(moved), faces, request)
    assert len(one.body) == len(two.body) == 4
    assert two.fitness == pytest.approx(one.fitness, abs=0.01)
    assert two.body.mass_properties()[0] == pytest.approx(
        8000.0 * one.body.mass_properties()[0], rel=0.02
    )


def test_a_cloud_needs_normals_or_a_place_from_which_it_was_seen(
    tmp_path: Path, servoid_command: Command
) -> None:
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(3000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points = normals * 0.05
    for name, values in (("with", np.hstack([points, normals])), ("without", points)):
        properties = ("x", "y", "z", "nx", "ny", "nz")[: values.shape[1]]
        header = ["ply", "format ascii 1.0", f"element vertex {len(values)}"]
        header += [f"property float {name}" for name in properties] + ["end_header"]
        rows = [" ".join(f"{x:.6g}" for x in row) for row in values]
        (tmp_path / f"{name}.ply").write_text("\n".join([*header, *rows]) + "\n")
    out = tmp_path / "body.json"
    ended = servoid_command("model", tmp_path / "with.ply", "--out", out, "--max-ellipsoids", 1)
    assert ended.code == 0, ended.err
    assert load_body(out).body().radii[0] == pytest.approx([0.05] * 3, rel=0.06)
    refused = servoid_command("model", tmp_path / "without.ply", "--out", out)
    assert refused.code == 1
    assert "--viewpoint" in refused.err


def test_the_papers_method_finds_a_plain_ellipsoid_from_the_command_line(
    tmp_path: Path, servoid_command: Command
) -> None:
    drawing = Drawing(ellipsoids=(Drawing().ellipsoids[0],), views=4)
    capture = drawing.write(tmp_path / "photos")
    out = tmp_path / "body.json"
    ended = servoid_command(
        "model", capture, "--out", out, "--method", "paper", "--max-ellipsoids", 1
    )
    assert ended.code == 0, ended.err
    assert made_by(out)["method"] == "paper"
    place = load_body(out).body().world_from_object.translation
    assert np.linalg.norm(np.subtract(place, drawing.ellipsoids[0].center)) < 0.01
