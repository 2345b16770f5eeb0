"""Images that contradict the calibration of their capture, and those that do not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import Command
from numpy.typing import NDArray
from rooms_to_scan import FOCAL_PX, SIZE_PX, write_pair
from tiers import tiered
from true_captures import TRUE_CAPTURES, true_capture, with_focal_share

from servoid._native import Camera, Lens
from servoid.camera import pinhole_lens, square_note
from servoid.capture import Capture, focal_fit
from servoid.opening import doubt_calibration
from servoid.pose import Pose

TELLING = ("stereo/teabox", "photos/temple", "photos/skull", "photos/blowtorch")


def toed_in(degrees: float) -> NDArray[np.float64]:
    """Return where a right camera is from the left one, turned towards it."""
    turn = np.radians(degrees)
    pose = np.eye(4)
    pose[:3, :3] = Pose.exp([0.0, 0.0, 0.0, 0.0, -turn, 0.0]).matrix()[:3, :3]
    pose[0, 3] = 0.1
    return pose


def with_focal(capture: Capture, share: float) -> Capture:
    """Let a capture tell a share of its focal length."""
    cameras = tuple(
        replace(camera, lens=with_focal_share(camera.lens, share)) for camera in capture.cameras
    )
    return replace(capture, cameras=cameras)


def centered(capture: Capture, center_px: tuple[float, float]) -> Capture:
    """Give the cameras of a capture another principal point."""

    def lens(known: Lens) -> Lens:
        return Lens(
            model=known.model,
            size_px=known.size_px,
            focal_px=known.focal_px,
            center_px=center_px,
            distortion=known.distortion,
        )

    cameras = tuple(replace(camera, lens=lens(camera.lens)) for camera in capture.cameras)
    return replace(capture, cameras=cameras)


def named_px(doubt: str | None) -> float:
    """Return the focal length that a sentence names."""
    assert doubt is not None and doubt.startswith("the images fit a focal length of about")
    return float(doubt.split()[8])


def test_a_wrong_focal_length_of_eyes_that_are_toed_in_is_told(tmp_path: Path) -> None:
    capture = write_pair(tmp_path, toed_in(8.0))
    assert doubt_calibration(capture) is None
    doubt = doubt_calibration(with_focal(capture, 0.9))
    assert named_px(doubt) == pytest.approx(FOCAL_PX, rel=0.02)
    assert doubt is not None and "better than 270 px" in doubt


@pytest.mark.parametrize("share", tiered([0.6, 1.5, 0.5, 1.9], 2))
def test_a_focal_length_that_is_far_off_is_told_as_well(share: float, tmp_path: Path) -> None:
    capture = write_pair(tmp_path, toed_in(8.0))
    doubt = doubt_calibration(with_focal(capture, share))
    assert named_px(doubt) == pytest.approx(FOCAL_PX, rel=0.03)


@pytest.mark.parametrize(("share", "bound"), [(0.38, "at least"), (2.5, "at most")])
def test_beyond_the_tried_focal_lengths_a_bound_is_told(
    share: float, bound: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(focal_fit, "FIT_PX", 100.0)  # the best of them fits badly
    monkeypatch.setattr(focal_fit, "_EXPLAINED", 1.0)
    capture = write_pair(tmp_path, toed_in(8.0))
    doubt = doubt_calibration(with_focal(capture, share))
    assert doubt is not None and f"fit a focal length of {bound} " in doubt


def test_a_lens_that_ends_within_the_tried_focal_lengths_is_no_trouble(tmp_path: Path) -> None:
    capture = write_pair(tmp_path, toed_in(8.0))
    bent = [
        replace(
            camera,
            lens=Lens(
                model="brown_conrady",
                size_px=SIZE_PX,
                focal_px=(0.6 * FOCAL_PX, 0.6 * FOCAL_PX),
                center_px=camera.lens.center_px,
                distortion=(-0.3, 0.0, 0.0, 0.0),
            ),
        )
        for camera in capture.cameras
    ]
    doubt = doubt_calibration(replace(capture, cameras=tuple(bent)))
    assert doubt is None or doubt.endswith("calibrate again")


def test_eyes_that_are_said_to_be_parallel_and_are_not_are_told(tmp_path: Path) -> None:
    turned = np.eye(4)
    turned[:3, :3] = Pose.exp([0.0, 0.0, 0.0, 0.03, 0.0, 0.0]).matrix()[:3, :3]
    turned[0, 3] = 0.1
    parallel = turned.copy()
    parallel[:3, :3] = np.eye(3)
    capture = write_pair(tmp_path, turned, parallel)
    doubt = doubt_calibration(replace(capture, measured=False))
    assert doubt is not None
    assert doubt.startswith("the images contradict the poses of the cameras")


@pytest.mark.extended
def test_the_summaries_of_model_and_track_tell_it(tmp_path: Path, servoid_command: Command) -> None:
    write_pair(tmp_path, toed_in(8.0))
    toml, body = tmp_path / "capture.toml", tmp_path / "body.json"
    toml.write_text(toml.read_text().replace(f"[{FOCAL_PX}, {FOCAL_PX}]", "[270.0, 270.0]"))
    target = ("--target", "box:130,70,190,150@one/p001", "--trust-targets")
    chosen = ("--observations", "1:2", "--max-ellipsoids", 2)
    done = servoid_command("model", tmp_path, *target, *chosen, "--out", body)
    assert done.code == 0, done.err
    assert "the images fit a focal length of about" in done.out
    poses = ("--observations", "1:2", "--out", tmp_path / "estimates.csv")
    done = servoid_command("track", tmp_path, "--body", body, *target, *poses)
    assert done.code == 0, done.err
    assert "the images fit a focal length of about" in done.out


@pytest.mark.extended
@pytest.mark.parametrize("name", TRUE_CAPTURES)
def test_a_true_calibration_is_not_doubted(name: str) -> None:
    assert doubt_calibration(replace(true_capture(name), measured=False)) is None


@pytest.mark.extended
@pytest.mark.parametrize("share", [0.6, 0.8, 0.92, 1.08, 1.15, 1.45, 1.6])
@pytest.mark.parametrize("name", TELLING)
def test_a_focal_length_that_photographs_contradict_is_told(name: str, share: float) -> None:
    capture = true_capture(name)
    doubt = doubt_calibration(with_focal(capture, share))
    assert named_px(doubt) == pytest.approx(capture.cameras[0].lens.focal_px[0], rel=0.03)


@pytest.mark.parametrize(
    ("stretched", "is_told"), [(1.004, False), (1.05, False), (1.08, True), (0.75, True)]
)
def test_focal_lengths_of_pixels_that_are_not_square_are_told(
    stretched: float, is_told: bool, tmp_path: Path
) -> None:
    capture = write_pair(tmp_path, toed_in(8.0))
    lens = pinhole_lens(
        Camera(
            size_px=SIZE_PX,
            focal_px=(stretched * FOCAL_PX, FOCAL_PX),
            center_px=capture.cameras[0].lens.center_px,
        )
    )
    told = doubt_calibration(
        replace(capture, cameras=tuple(replace(one, lens=lens) for one in capture.cameras))
    )
    assert ("pixels that are not square" in str(told)) == is_told
    assert (square_note("a camera", lens) is not None) == is_told


@pytest.mark.parametrize("center_px", [(640.0, 120.0), (160.0, 480.0), (-1.0, 10.0)])
def test_a_principal_point_outside_of_the_image_is_told(
    center_px: tuple[float, float], tmp_path: Path
) -> None:
    doubt = doubt_calibration(centered(write_pair(tmp_path, toed_in(8.0)), center_px))
    assert doubt is not None and doubt.startswith("the principal point of camera one, (")
    assert "is outside of its image of" in doubt


def test_a_principal_point_of_images_of_another_size_is_told(tmp_path: Path) -> None:
    capture = write_pair(tmp_path, toed_in(8.0))
    width, height = SIZE_PX
    for share in (0.5, 0.75, 1.5):
        doubt = doubt_calibration(centered(capture, (share * width / 2, share * height / 2)))
        assert doubt is not None and "is far from the middle of its image of" in doubt
    assert doubt_calibration(centered(capture, (0.53 * width, 0.47 * height))) is None


@pytest.mark.parametrize("share", [0.5, 1.3])
def test_parallel_eyes_scale_distances_alone_by_a_wrong_focal_length_and_show_none_of_it(
    share: float, tmp_path: Path
) -> None:
    beside = np.eye(4)
    beside[0, 3] = 0.1
    wrong = with_focal(write_pair(tmp_path, beside), share)
    assert doubt_calibration(replace(wrong, measured=False)) is None
    true, lens = np.array([0.07, -0.05, 0.9]), wrong.cameras[0].lens
    center, focal = np.array(lens.center_px), FOCAL_PX
    one, other = (focal * (true - [shift, 0.0, 0.0])[:2] / true[2] for shift in (0.0, 0.1))
    rays = [lens.rays((pixel + center)[None])[0] for pixel in (one, other)]
    depth = 0.1 / (rays[0][0] / rays[0][2] - rays[1][0] / rays[1][2])
    measured = rays[0] / rays[0][2] * depth
    np.testing.assert_allclose(measured, true * [1.0, 1.0, share], rtol=1e-9)
