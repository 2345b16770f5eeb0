"""Images from several poses that contradict the calibration of a capture, and those that do not."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from true_captures import TRUE_CAPTURES, true_capture, with_focal_share

from servoid.batch.captures import CaptureCase, model_capture
from servoid.camera import Lens
from servoid.capture import (
    Capture,
    PosedImage,
    capture_of,
    doubt_calibration,
    doubt_for_model,
)
from servoid.exchange.captures.gathering import Shot, ShotCamera, gather
from servoid.model import ModelResult, Request, fit_capture, fit_capture_by_paper
from servoid.pose import Pose
from servoid.sim import MovingScene, Scenario

INDICES = range(0, 96, 8)
COUNT = len(INDICES)


@pytest.fixture(scope="module")
def hand() -> Capture:
    """Return what a hand's cameras recorded now and then while the hand moved."""
    scene = MovingScene(Scenario(count=INDICES.stop, size="small", hand=True))
    observations = []
    for place, index in enumerate(INDICES):
        look = scene.look(index)
        seen = zip(look.images, scene.room_from_cameras(index), strict=True)
        observations.append(
            [
                PosedImage(
                    camera=scene.camera,
                    world_from_camera=Pose(pose),
                    image=image,
                    mask=look.mask if place == number == 0 else None,
                )
                for number, (image, pose) in enumerate(seen)
            ]
        )
    made = capture_of(observations, rate_hz=30.0)
    cameras = zip(made.cameras, ("left", "right"), strict=True)
    return replace(made, cameras=tuple(replace(camera, name=name) for camera, name in cameras))


def with_focal(capture: Capture, *shares: float) -> Capture:
    """Let the cameras of a capture tell shares of their focal lengths."""
    cameras = tuple(
        replace(camera, lens=with_focal_share(camera.lens, share))
        for camera, share in zip(capture.cameras, shares, strict=True)
    )
    return replace(capture, cameras=cameras)


def with_center(capture: Capture, off_px: tuple[float, float]) -> Capture:
    """Let the camera of a capture tell another principal point."""
    (camera,) = capture.cameras
    known = camera.lens
    lens = Lens(
        model=known.model,
        size_px=known.size_px,
        focal_px=known.focal_px,
        center_px=(known.center_px[0] + off_px[0], known.center_px[1] + off_px[1]),
        distortion=known.distortion,
    )
    return replace(capture, cameras=(replace(camera, lens=lens),))


def named_center_px(doubt: str | None) -> tuple[float, ...]:
    """Return the principal point that a sentence names."""
    assert doubt is not None and "the images fit a principal point of about (" in doubt
    named = doubt.split("principal point of about (")[1].split(")")[0]
    return tuple(map(float, named.split(", ")))


def apart(capture: Capture, share: float) -> Capture:
    """Put the right camera nearer to the left one or farther away than it is."""
    left, right = capture.cameras
    seat = right.rig_from_camera
    moved = Pose.from_parts(share * np.array(seat.translation), seat.quaternion)
    return replace(capture, cameras=(left, replace(right, rig_from_camera=moved)))


def with_far_poses(capture: Capture, share: float) -> Capture:
    """Give the poses of a rig in another unit than metres."""
    poses = tuple(
        Pose.from_parts(share * np.array(pose.translation), pose.quaternion)
        for pose in capture.world_from_rig
    )
    return replace(capture, world_from_rig=poses)


def each_its_own(capture: Capture, shares: Sequence[float]) -> Capture:
    """Take the images of the first camera for those of as many cameras, as COLMAP does."""
    views = [view for view in capture.all_views() if view.camera_name == capture.cameras[0].name]
    cameras = [
        ShotCamera(
            f"camera_{number}",
            with_focal_share(view.lens, share),
            [Shot(view.picture, view.world_from_lens)],
        )
        for number, (view, share) in enumerate(zip(views, shares, strict=True))
    ]
    return gather(capture.path, cameras, metric=True)


@pytest.mark.parametrize("rate_hz", [30.0, None])
@pytest.mark.parametrize("count", [1, 2])
def test_a_right_rig_that_moves_is_not_doubted(
    count: int, rate_hz: float | None, hand: Capture
) -> None:
    capture = replace(hand, cameras=hand.cameras[:count], rate_hz=rate_hz)
    assert doubt_for_model(capture) is None


@pytest.mark.parametrize(("share", "rate_hz"), [(0.9, 30.0), (0.95, 30.0), (1.12, None)])
def test_a_wrong_focal_length_of_parallel_cameras_that_move_is_told(
    share: float, rate_hz: float | None, hand: Capture
) -> None:
    wrong = with_focal(replace(hand, rate_hz=rate_hz), share, share)
    doubt = doubt_for_model(wrong)
    assert doubt is not None
    assert doubt.startswith("the images fit a focal length of about")
    true_px = hand.cameras[0].lens.focal_px[0]
    assert float(doubt.split()[8]) == pytest.approx(true_px, rel=0.02)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_wrong_focal_length_of_one_camera_that_moves_is_told(share: float, hand: Capture) -> None:
    alone = with_focal(replace(hand, cameras=hand.cameras[:1]), share)
    doubt = doubt_for_model(alone)
    assert doubt is not None and doubt.startswith("the images fit a focal length of about")
    assert doubt_calibration(alone) is None  # what it sees may move


@pytest.mark.parametrize("off_px", [(12.0, 0.0), (-8.0, 9.0)])
def test_a_wrong_principal_point_is_told_and_no_focal_length_is_advised(
    off_px: tuple[float, float], hand: Capture
) -> None:
    alone = replace(hand, cameras=hand.cameras[:1])
    doubt = doubt_for_model(with_center(alone, off_px))
    assert named_center_px(doubt) == pytest.approx(alone.cameras[0].lens.center_px, abs=2.0)
    assert doubt is not None and "focal length" not in doubt


@pytest.mark.parametrize("shares", [(0.93, 1.0), (1.0, 0.93)])
def test_the_camera_of_a_pair_whose_focal_length_is_wrong_is_in_doubt(
    shares: tuple[float, float], hand: Capture
) -> None:
    doubt = doubt_for_model(with_focal(hand, *shares))
    assert doubt is not None
    wrong = "left" if shares[0] != 1.0 else "right"
    assert wrong in doubt


@pytest.mark.parametrize(("share", "rate_hz"), [(0.7, 30.0), (1.4, None)])
def test_a_wrong_distance_between_cameras_that_move_is_in_doubt_and_so_are_poses_in_another_unit(
    share: float, rate_hz: float | None, hand: Capture
) -> None:
    capture = replace(hand, rate_hz=rate_hz)
    for wrong in (apart(capture, share), with_far_poses(capture, share)):
        doubt = doubt_for_model(wrong)
        assert doubt is not None
        assert "the images contradict the poses of left and right on the rig" in doubt


def test_inverted_poses_of_a_model_are_told_as_those_of_a_track_are(hand: Capture) -> None:
    wrong = replace(hand, world_from_rig=tuple(pose.inverse() for pose in hand.world_from_rig))
    doubt = doubt_for_model(replace(wrong, cameras=wrong.cameras[:1]))
    assert doubt is not None and "the images contradict the poses of the rig" in doubt


def test_images_of_a_camera_each_are_compared_with_their_neighbours(hand: Capture) -> None:
    jitter = 1.0 + 1e-3 * np.sin(np.arange(COUNT))
    assert doubt_calibration(each_its_own(hand, jitter.tolist())) is None
    for share in (0.92, 1.1):
        doubt = doubt_calibration(each_its_own(hand, (share * jitter).tolist()))
        assert doubt is not None and doubt.startswith("the images fit a focal length of about")


def test_two_lenses_that_took_every_other_image_are_compared(hand: Capture) -> None:
    views = [view for view in hand.all_views() if view.camera_name == "left"]
    for share in (1.0, 1.1):
        cameras = [
            ShotCamera(
                name,
                with_focal_share(views[0].lens, share * by),
                [Shot(view.picture, view.world_from_lens) for view in views[first::2]],
            )
            for first, (name, by) in enumerate([("one", 1.0), ("other", 1.0001)])
        ]
        doubt = doubt_calibration(gather(hand.path, cameras, metric=True))
        assert (doubt is None) == (share == 1.0)


@pytest.mark.parametrize("fit", [fit_capture, fit_capture_by_paper])
def test_a_model_of_a_capture_is_rough_then_unless_its_calibration_is_trusted(
    fit: Callable[[Capture, Request], ModelResult], hand: Capture
) -> None:
    wrong = replace(with_focal(hand, 0.9, 0.9), rate_hz=None)
    quick = Request(max_ellipsoids=1)
    told = fit(wrong, quick)
    assert told.doubts[0].startswith("the images fit a focal length of about")
    assert told.verdict.word != "good"
    trusted = fit(wrong, replace(quick, trust_calibration=True))
    assert told.doubts == (told.doubts[0], *trusted.doubts)
    assert trusted.body == told.body


def test_what_is_doubted_of_images_in_memory_is_said_once(hand: Capture) -> None:
    alone = replace(hand, cameras=hand.cameras[:1], rate_hz=None)
    doubts = fit_capture(with_center(alone, (60.0, 0.0)), Request(max_ellipsoids=1)).doubts
    assert sum("far from the middle of its image" in doubt for doubt in doubts) == 1


@pytest.mark.extended
def test_a_batch_tells_it_as_well(hand: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = with_focal(hand, 0.9, 0.9)
    monkeypatch.setattr("servoid.batch.captures.open_any", lambda _: wrong)
    row = model_capture(CaptureCase(capture="hand", content="", max_ellipsoids=1))
    assert any("fit a focal length of about" in note for note in row.notes)
    assert row.verdict != "good"


@pytest.mark.extended
@pytest.mark.parametrize("name", TRUE_CAPTURES)
def test_recorded_captures_are_not_doubted_when_they_are_modelled(name: str) -> None:
    assert doubt_for_model(true_capture(name)) is None


@pytest.mark.extended
@pytest.mark.parametrize("share", [0.9, 0.95, 1.12])
@pytest.mark.parametrize("count", [1, 2])
def test_a_wrong_focal_length_of_a_recorded_rig_that_moves_is_told(
    count: int, share: float
) -> None:
    capture = true_capture("stereo/mustard_hand")
    some = replace(capture, cameras=capture.cameras[:count])
    doubt = doubt_for_model(with_focal(some, *[share] * count))
    assert doubt is not None and "fit a focal length of about 57" in doubt


@pytest.mark.extended
@pytest.mark.parametrize("name", ["photos/temple", "photos/skull"])
def test_a_wrong_principal_point_of_photographs_is_told(name: str) -> None:
    capture = true_capture(name)
    doubt = doubt_for_model(with_center(capture, (25.0, 0.0)))
    assert named_center_px(doubt) == pytest.approx(capture.cameras[0].lens.center_px, abs=3.0)
