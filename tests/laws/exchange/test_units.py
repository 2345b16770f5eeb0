"""Lengths of files of other programs are in metres only if they, or their users, say so."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import Command

from servoid.capture import Capture, open_capture
from servoid.errors import CaptureError
from servoid.exchange import open_any
from servoid.shape import load_body

GL_FROM_LENS = np.diag([1.0, -1.0, -1.0, 1.0])


def as_transforms(capture: Capture, unit_m: float) -> Path:
    """Write the views of a capture as a transforms.json in another unit, beside their images."""
    folder = capture.path.parent
    frames = []
    for view in capture.views():
        matrix = view.world_from_lens.matrix()
        matrix[:3, 3] /= unit_m
        assert view.mask_path is not None
        frames.append(
            {
                "file_path": str(view.image_path.relative_to(folder)),
                "mask_path": str(view.mask_path.relative_to(folder)),
                "transform_matrix": (matrix @ GL_FROM_LENS).tolist(),
            }
        )
    lens = capture.cameras[0].lens
    table = {"w": lens.size_px[0], "h": lens.size_px[1], "frames": frames}
    table |= {"fl_x": lens.focal_px[0], "fl_y": lens.focal_px[1]}
    table |= {"cx": lens.center_px[0] + 0.5, "cy": lens.center_px[1] + 0.5}
    path = folder / "transforms.json"
    path.write_text(json.dumps(table))
    return path


def as_colmap(capture: Capture) -> Path:
    """Write the views of a capture as a COLMAP model in text."""
    model = capture.path.parent / "model"
    model.mkdir()
    lens = capture.cameras[0].lens
    numbers = (*lens.size_px, *lens.focal_px, *(one + 0.5 for one in lens.center_px))
    (model / "cameras.txt").write_text("1 PINHOLE " + " ".join(map(str, numbers)) + "\n")
    lines = []
    for number, view in enumerate(capture.views(), 1):
        pose = view.world_from_lens.inverse()
        lines.append(
            " ".join(map(str, (number, *pose.quaternion, *pose.translation, 1)))
            + f" {view.image_path.name}\n\n"
        )
    (model / "images.txt").write_text("".join(lines))
    return model


def test_a_known_unit_alone_makes_metres(drawn_capture: Path) -> None:
    right = open_capture(drawn_capture)
    images = right.views()[0].image_path.parent
    assert right.metric
    for path, given, unit_m in (
        (as_transforms(right, 0.25), {}, 0.25),
        (as_colmap(right), {"images": images}, 1.0),
    ):
        assert not open_any(path, **given).metric
        scaled = open_any(path, **given, unit_m=unit_m)
        assert scaled.metric
        for one, view in zip(scaled.views() or scaled.all_views(), right.views(), strict=True):
            np.testing.assert_allclose(
                one.world_from_lens.matrix(), view.world_from_lens.matrix(), atol=1e-9
            )


def test_the_unit_of_depth_follows_that_of_lengths(drawn_capture: Path) -> None:
    path = as_transforms(open_capture(drawn_capture), 0.25)
    one, scaled = open_any(path), open_any(path, unit_m=0.25)
    assert one.cameras[0].depth_scale_m == 0.001
    assert scaled.cameras[0].depth_scale_m == 0.00025


@pytest.mark.parametrize("unit_m", [0.0, -1.0, float("nan"), float("inf")])
def test_a_unit_that_is_no_length_is_refused(unit_m: float, drawn_capture: Path) -> None:
    path = as_transforms(open_capture(drawn_capture), 1.0)
    with pytest.raises(CaptureError, match="give the metres of one unit"):
        open_any(path, unit_m=unit_m)


def test_a_capture_that_has_a_unit_takes_none(drawn_capture: Path) -> None:
    with pytest.raises(CaptureError, match="neither a COLMAP model nor a"):
        open_any(drawn_capture, unit_m=1.0)


def test_a_body_has_the_unit_that_is_given_or_none(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    path, body = as_transforms(open_capture(drawn_capture), 0.25), tmp_path / "body.json"
    model = ("model", path, "--out", body, "--max-ellipsoids", 1, "--delta", 0)
    done = servoid_command(*model)
    assert done.code == 0, done.err
    assert "lengths are not in metres" in " ".join(done.out.split())
    unknown = json.loads(body.read_text())
    assert unknown["units"] == "unknown"
    done = servoid_command("export", body, "--out", tmp_path / "body.urdf")
    assert "the lengths of the body are in an unknown unit" in " ".join(done.out.split())
    done = servoid_command(*model, "--unit", 0.25)
    assert done.code == 0, done.err
    assert "not in metres" not in " ".join(done.out.split())
    known = json.loads(body.read_text())
    assert known["units"] == "m"
    radii = [np.array(one["ellipsoids"][0]["radii"]) for one in (unknown, known)]
    np.testing.assert_allclose(radii[1], 0.25 * radii[0], rtol=1e-3)


def test_a_track_takes_the_unit_as_a_model_does(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    path, out = as_transforms(open_capture(drawn_capture), 0.25), tmp_path / "poses.csv"
    track = ("track", path, "--observations", ":2", "--distance", 0.6, "--out", out)
    depths = []
    for unit in (1.0, 0.5):
        done = servoid_command(*track, "--unit", unit)
        assert done.code == 0, done.err
        assert "not in metres" not in " ".join(done.out.split())
        place = np.genfromtxt(out, delimiter=",", skip_header=1, max_rows=1)[1:4]
        depths.append(np.linalg.norm(place))
    assert depths[0] != depths[1]
    done = servoid_command("track", drawn_capture, "--unit", 1.0, "--out", out)
    assert done.code == 1
    assert "neither a COLMAP model nor a transforms.json" in " ".join(done.err.split())
    done = servoid_command("track", "0", "--unit", 1.0, "--out", out)
    assert done.code == 2
    assert "leave --unit out" in " ".join(done.err.split())


@pytest.mark.parametrize("name", ["ball.stl", "ball.ply"], ids=["mesh", "cloud"])
def test_a_shape_in_millimetres_is_doubted_and_with_its_unit_the_same_as_in_metres(
    name: str, tmp_path: Path, servoid_command: Command
) -> None:
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(2, 0.05)
    if name.endswith("ply"):
        ball = trimesh.PointCloud(ball.vertices)
    bodies = {}
    for scale, unit in ((1.0, ()), (1000.0, ()), (1000.0, ("--unit", 0.001))):
        ball.copy().apply_scale(scale).export(tmp_path / name)
        eye = 1.0 if unit or scale == 1.0 else 1000.0
        view = ("--viewpoint", f"0,0,{eye}") if name.endswith("ply") else ()
        out = ("--out", tmp_path / "body.json", "--max-ellipsoids", 1)
        done = servoid_command("model", tmp_path / name, *view, *unit, *out)
        assert done.code == 0, done.err
        is_doubted = "scale it by 0.001, as model --unit does" in " ".join(done.out.split())
        assert is_doubted == (scale != 1.0 and not unit)
        bodies[scale, bool(unit)] = load_body(tmp_path / "body.json").body()
    same, given = bodies[1.0, False], bodies[1000.0, True]
    # The optimisation takes another way for each rounding of the file's single precision.
    assert given.radii == pytest.approx(same.radii, rel=0.03)


def test_a_unit_of_a_mesh_that_is_no_length_is_refused(
    tmp_path: Path, servoid_command: Command
) -> None:
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.icosphere(1, 0.05).export(tmp_path / "ball.stl")
    out = ("--out", tmp_path / "body.json")
    for unit in ("0", "-1"):
        done = servoid_command("model", tmp_path / "ball.stl", f"--unit={unit}", *out)
        assert done.code == 1 and "a positive number" in " ".join(done.err.split())
