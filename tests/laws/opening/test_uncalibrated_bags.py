"""Bags without a calibration: they open wherever a bare video does, by what a person tells."""

from pathlib import Path

import numpy as np
import pytest
from bag_writing import Entry, info, tf, write_bag
from scenes_bags import (
    BASELINE_M,
    SIZE_PX,
    STILL,
    K,
    only_camera,
    pixels,
    stamp,
    stereo_entries,
    world_from_rig,
)

from servoid.errors import CaptureError
from servoid.exchange import open_bag
from servoid.opening import (
    GivenCalibration,
    count_uncalibrated_cameras,
    open_filmed,
    open_recorded,
    parse_source,
)
from servoid.pose import Pose
from servoid.source.instants import poses_of

NAMES = ("run.mcap", "run", "run.bag")
TOPICS = ("/stereo/left/image_raw", "/stereo/right/image_raw")
CALIBRATION = """version = 1
[[camera]]
name = "right"
size_px = [40, 30]
focal_px = [52.0, 52.5]
rig_from_camera = [[1, 0, 0, 0.2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[[camera]]
name = "left"
size_px = [40, 30]
focal_px = [51.0, 51.5]
rig_from_camera = [[1, 0, 0, 0.05], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""


def bare(entries: list[Entry], *, without: str = "") -> list[Entry]:
    """Leave out calibrations, and topics that begin with a word."""
    return [
        one
        for one in entries
        if one.kind != "info" and not (without and one.topic.startswith(without))
    ]


def at_rest(count: int = 4) -> list[Entry]:
    return bare(only_camera(stereo_entries(count)), without="/tf")


@pytest.mark.parametrize("name", NAMES)
def test_an_angle_of_view_opens_a_bag_as_it_opens_a_video(tmp_path: Path, name: str) -> None:
    word = parse_source(str(write_bag(tmp_path / name, at_rest())))
    opened = open_recorded(word, GivenCalibration(fov_deg=90.0))
    (camera,) = opened.capture.cameras
    assert count_uncalibrated_cameras(word) == 1
    assert camera.lens.focal_px == pytest.approx((20.0, 20.0))
    assert camera.lens.center_px == (19.5, 14.5)
    assert opened.capture.times_s == tuple(stamp(index) / 10**9 for index in range(4))
    assert set(opened.capture.world_from_rig) == {Pose.identity()}
    assert [note for note in opened.notes if "90 degrees from left to right" in note]
    for index, picture in enumerate(camera.pictures):
        assert picture is not None and (picture.read(SIZE_PX) == pixels(2 * index)).all()


def test_where_tf_knows_the_camera_its_poses_count(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run.mcap", bare(only_camera(stereo_entries(4))))
    opened = open_recorded(parse_source(str(path)), GivenCalibration(fov_deg=60.0))
    for one in opened.capture.observations():
        (pose,) = poses_of(opened.capture, one)
        assert np.abs((pose.inverse() @ world_from_rig(one.index)).log()).max() < 1e-12
    assert not any("origin" in note for note in opened.notes)


def test_nothing_that_is_told_is_refused_by_naming_what_would_do(tmp_path: Path) -> None:
    word = parse_source(str(write_bag(tmp_path / "run.mcap", at_rest())))
    message = (
        r"no camera_info belongs to /stereo/left/image_raw; give --fov.*--calibration FILE; .*"
        r"servoid scan estimates it; --topic chooses other cameras"
    )
    with pytest.raises(CaptureError, match=message):
        open_recorded(word)
    with pytest.raises(CaptureError, match=r"no camera_info belongs to .*; record"):
        open_bag(word.place)


def test_a_driver_that_publishes_zeros_tells_nothing(tmp_path: Path) -> None:
    entries = at_rest()
    zeros = [info("/stereo/left/camera_info", stamp(i), "a", SIZE_PX, (0.0,) * 9) for i in range(4)]
    word = parse_source(str(write_bag(tmp_path / "run.mcap", [*entries, *zeros])))
    with pytest.raises(CaptureError, match=r"camera_info has no focal length: .*; give --fov"):
        open_recorded(word)
    opened = open_recorded(word, GivenCalibration(fov_deg=90.0))
    assert opened.capture.cameras[0].lens.focal_px == pytest.approx((20.0, 20.0))
    late = info("/stereo/left/camera_info", stamp(3), "a", SIZE_PX, K)
    word = parse_source(str(write_bag(tmp_path / "late.mcap", [*entries, *zeros[:3], late])))
    assert count_uncalibrated_cameras(word) == 0
    assert open_recorded(word).capture.cameras[0].lens.focal_px == (50.0, 51.0)


def test_two_cameras_sit_where_tf_or_a_person_says(tmp_path: Path) -> None:
    lost = bare(stereo_entries(2), without="/tf")
    word = parse_source(str(write_bag(tmp_path / "lost.mcap", lost)))
    with pytest.raises(CaptureError, match=r"left, right; .*--calibration.*--baseline.*--topic"):
        open_recorded(word, GivenCalibration(fov_deg=60.0))
    assert apart_m(open_recorded(word, GivenCalibration(fov_deg=60.0, baseline_m=0.3))) == 0.3
    one = open_recorded(word, GivenCalibration(fov_deg=60.0), topics=TOPICS[1:])
    assert [camera.name for camera in one.capture.cameras] == ["right"]
    placed = parse_source(str(write_bag(tmp_path / "run.mcap", bare(stereo_entries(2)))))
    assert apart_m(open_recorded(placed, GivenCalibration(fov_deg=60.0))) == pytest.approx(
        BASELINE_M
    )
    assert apart_m(open_recorded(placed, GivenCalibration(fov_deg=60.0, baseline_m=0.3))) == 0.3


def apart_m(opened: object) -> float:
    """Return how far the second camera is to the right of the first one."""
    one, other = opened.capture.cameras  # type: ignore[attr-defined]
    shift = (one.rig_from_camera.inverse() @ other.rig_from_camera).translation
    assert shift[1:] == (0.0, 0.0)
    return shift[0]


def test_a_calibration_belongs_to_cameras_by_name(tmp_path: Path) -> None:
    calibration = tmp_path / "rig.toml"
    calibration.write_text(CALIBRATION)
    known = GivenCalibration(calibration=calibration)
    word = parse_source(
        str(write_bag(tmp_path / "run.mcap", bare(stereo_entries(2), without="/tf")))
    )
    left, right = open_recorded(word, known).capture.cameras
    assert (left.lens.focal_px, right.lens.focal_px) == ((51.0, 51.5), (52.0, 52.5))
    shifts = [camera.rig_from_camera.translation[0] for camera in (left, right)]
    assert shifts == [0.05, 0.2]  # no TF: the rig is the calibration's
    moving = parse_source(str(write_bag(tmp_path / "moving.mcap", bare(stereo_entries(2)))))
    opened = open_recorded(moving, known)
    assert apart_m(opened) == pytest.approx(0.15)
    first, _ = poses_of(opened.capture, opened.capture.observations()[1])
    assert np.abs((first.inverse() @ world_from_rig(1)).log()).max() < 1e-12


def test_a_bag_that_knows_its_cameras_is_told_nothing(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run.mcap", stereo_entries(2))
    with pytest.raises(CaptureError, match="has its own calibration; leave --fov out"):
        open_recorded(parse_source(str(path)), GivenCalibration(fov_deg=60.0))
    with pytest.raises(CaptureError, match="has its own calibration; leave"):
        open_bag(path, supplier=lambda names, sizes_px, *, is_placed: [])  # noqa: ARG005


def test_what_is_told_counts_for_all_cameras_and_unused_calibrations_are_said(
    tmp_path: Path,
) -> None:
    entries = [one for one in stereo_entries(2) if one.topic != "/stereo/right/camera_info"]
    word = parse_source(str(write_bag(tmp_path / "run.mcap", entries)))
    assert count_uncalibrated_cameras(word) == 0  # the calibrated one is guessed
    assert count_uncalibrated_cameras(word, TOPICS) == 2
    opened = open_recorded(word, GivenCalibration(fov_deg=90.0), topics=TOPICS)
    focal_px = [camera.lens.focal_px[0] for camera in opened.capture.cameras]
    assert focal_px == pytest.approx([20.0, 20.0])
    notes = "; ".join(opened.capture.notes)
    assert "/stereo/left/camera_info is not used, as another camera has none" in notes


def test_a_scan_needs_neither_a_calibration_nor_tf(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run.mcap", bare(stereo_entries(3), without="/tf"))
    word = parse_source(str(path))
    filmed = open_filmed(word)
    assert list(filmed.footage.names) == ["0000", "0001", "0002"]
    assert (filmed.lens, filmed.partner) == (None, None)
    assert any("second camera is not used" in note for note in filmed.notes)
    assert not any("TF" in note for note in filmed.notes)
    filmed = open_filmed(word, GivenCalibration(fov_deg=90.0, baseline_m=0.2))
    assert filmed.lens is not None and filmed.lens.focal_px == pytest.approx((20.0, 20.0))
    assert filmed.partner is not None and filmed.partner.metres == 0.2


@pytest.mark.parametrize("is_calibrated", [True, False])
def test_of_tf_a_scan_takes_only_how_far_two_eyes_are_apart(
    tmp_path: Path, is_calibrated: bool
) -> None:
    early = [tf(stamp(-90 - i), [("world", "rig", (i, 0, 0), STILL)]) for i in range(2)]
    entries = [one for one in stereo_entries(3) if one.topic != "/tf"]
    path = write_bag(
        tmp_path / "early.mcap", [*early, *(entries if is_calibrated else bare(entries))]
    )
    word = parse_source(str(path))
    with pytest.raises(
        CaptureError, match="TF has the cameras' poses at none of the images' times"
    ):
        open_recorded(word, GivenCalibration() if is_calibrated else GivenCalibration(fov_deg=60.0))
    filmed = open_filmed(word)
    assert len(filmed.footage.names) == 3
    assert (filmed.lens is not None) == is_calibrated
    assert filmed.partner is not None and filmed.partner.metres == pytest.approx(BASELINE_M)
    assert not any("TF" in note for note in filmed.notes)
