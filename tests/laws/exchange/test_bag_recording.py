"""Recordings as MCAP: they replay to the same bits, and readers that did not write them agree."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from bag_writing import reads_with, write_bag
from hypothesis import given
from hypothesis import strategies as st
from scenes_bags import LENSES, drawn_capture, pixels, stereo_entries, world_from_rig

from conftest import Drawing
from servoid.camera import Lens
from servoid.capture import Capture, open_capture
from servoid.errors import MissingExtraError, OutputError
from servoid.exchange import open_bag
from servoid.exchange.bags.writing import RawObservation, raw_observations, write_mcap_recording
from servoid.pose import Pose
from servoid.pose.parts import joined, parts_of

numbers = st.floats(-3.0, 3.0)


def check_same(found: Capture, expected: Capture) -> None:
    assert [one.name for one in found.cameras] == [one.name for one in expected.cameras]
    assert found.times_s == expected.times_s
    assert found.world_from_rig == expected.world_from_rig
    for one, other in zip(found.cameras, expected.cameras, strict=True):
        assert one.lens == other.lens and one.rig_from_camera == other.rig_from_camera
        for index, (a, b) in enumerate(zip(one.pictures, other.pictures, strict=True)):
            assert (a is None) == (b is None)
            if a is not None and b is not None:
                size = other.lens.size_px
                assert (a.read(size) == b.read(size)).all()
            depths = one.recorded_depth(index), other.recorded_depth(index)
            assert (depths[0] is None) == (depths[1] is None)
            if depths[0] is not None and depths[1] is not None:
                assert np.array_equal(depths[0], depths[1], equal_nan=True)


def record(path: Path, capture: Capture) -> Capture:
    assert write_mcap_recording(path, capture.cameras, raw_observations(capture)) == len(capture)
    return open_bag(path)


@pytest.mark.parametrize("lens", LENSES, ids=range(len(LENSES)))
def test_a_recording_replays_to_the_same_bits(tmp_path: Path, lens: Lens) -> None:
    capture = drawn_capture(lens=lens)
    found = record(tmp_path / "run.mcap", capture)
    check_same(found, capture)
    assert found.notes == ()
    check_same(record(tmp_path / "again.mcap", found), capture)


def test_observations_that_lack_images_stay_what_they_were(tmp_path: Path) -> None:
    capture = drawn_capture()
    left, right = capture.cameras
    gone = replace(left, pictures=(None, *left.pictures[1:]), depths_m=(None, *left.depths_m[1:]))
    lone = replace(right, pictures=(*right.pictures[:2], None, None, right.pictures[4]))
    check_same(
        record(tmp_path / "run.mcap", replace(capture, cameras=(gone, lone))),
        replace(capture, cameras=(gone, lone)),
    )


def test_image_files_are_passed_through_byte_by_byte(tmp_path: Path, drawing: Drawing) -> None:
    capture = open_capture(drawing.write(tmp_path / "drawn"))
    path = tmp_path / "run.mcap"
    check_same(record(path, capture), capture)
    reader = reads_with("mcap_ros2.reader")
    stored = [
        bytes(one.ros_msg.data)
        for one in reader.read_ros2_messages(str(path), topics=["/eye/image_raw/compressed"])
    ]
    assert stored == [file.read_bytes() for file in sorted((tmp_path / "drawn/images").iterdir())]


@pytest.mark.parametrize("is_jpeg", [True, False])
@pytest.mark.parametrize("name", ["in.bag", "in.mcap"])
def test_a_bag_is_recorded_again_without_decoding_its_images(
    tmp_path: Path, name: str, is_jpeg: bool
) -> None:
    capture = open_bag(write_bag(tmp_path / name, stereo_entries(3, is_jpeg=is_jpeg)))
    check_same(record(tmp_path / "run.mcap", capture), capture)
    (one, *_) = raw_observations(capture)
    assert one.images[0] is not None
    data = one.images[0].data
    assert data.startswith(b"\xff\xd8") if is_jpeg else hasattr(data, "header")


def test_another_reader_finds_standard_messages_with_their_types_embedded(tmp_path: Path) -> None:
    reader = reads_with("mcap_ros2.reader")
    capture, path = drawn_capture(), tmp_path / "run.mcap"
    record(path, capture)
    seen = {}
    for one in reader.read_ros2_messages(str(path)):
        assert one.schema.encoding == "ros2msg" and one.channel.message_encoding == "cdr"
        seen.setdefault(one.channel.topic, (one.schema.name, []))[1].append(one.ros_msg)
    assert {topic: (kind, len(found)) for topic, (kind, found) in seen.items()} == {
        "/left/camera_info": ("sensor_msgs/msg/CameraInfo", 5),
        "/left/depth/image_raw": ("sensor_msgs/msg/Image", 5),
        "/left/image_raw": ("sensor_msgs/msg/Image", 5),
        "/right/camera_info": ("sensor_msgs/msg/CameraInfo", 5),
        "/right/image_raw": ("sensor_msgs/msg/Image", 5),
        "/servoid/time_s": ("std_msgs/msg/Float64", 5),
        "/tf": ("tf2_msgs/msg/TFMessage", 5),
        "/tf_static": ("tf2_msgs/msg/TFMessage", 1),
    }
    image = seen["/left/image_raw"][1][3]
    assert (image.encoding, image.step, image.header.frame_id) == ("rgb8", 120, "left_optical")
    assert bytes(image.data) == pixels(6).tobytes()
    assert image.header.stamp.nanosec == 100_000_000
    assert seen["/left/camera_info"][1][0].k == pytest.approx([50, 0, 19.3, 0, 51, 14.7, 0, 0, 1])
    link = seen["/tf"][1][2].transforms[0]
    assert (link.header.frame_id, link.child_frame_id) == ("world", "rig")
    where = link.transform.translation
    assert (where.x, where.y, where.z) == world_from_rig(2).translation
    assert [one.child_frame_id for one in seen["/tf_static"][1][0].transforms] == [
        "left_optical",
        "right_optical",
    ]
    summary = pytest.importorskip("mcap.reader").make_reader(path.open("rb"))
    assert summary.get_header().profile == "ros2"


def test_names_that_ros_does_not_allow_are_turned_into_ones_that_it_does(tmp_path: Path) -> None:
    capture = drawn_capture(2)
    both = zip(capture.cameras, ("0 left", "rück"), strict=True)
    cameras = tuple(replace(camera, name=name) for camera, name in both)
    named = replace(capture, cameras=cameras)
    found = record(tmp_path / "run.mcap", named)
    assert [camera.name for camera in found.cameras] == ["_0_left", "r_ck"]


@given(twist=st.tuples(*[numbers] * 6), further=st.tuples(*[numbers] * 6))
def test_parts_of_a_pose_join_to_the_same_bits(
    twist: tuple[float, ...], further: tuple[float, ...]
) -> None:
    for pose in (Pose.exp(twist), Pose.exp(twist) @ Pose.exp(further)):
        again = joined(*parts_of(pose))
        assert again == pose and again.__reduce__()[1] == pose.__reduce__()[1]
        assert joined(again.translation, again.quaternion) == pose


def test_a_quaternion_that_is_not_of_unit_length_is_brought_to_it_or_refused() -> None:
    longer = joined((1.0, 2.0, 3.0), (1.0004, 0.0, 0.0, 0.0))
    assert longer.quaternion == (1.0, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="must have length 1"):
        joined((1.0, 2.0, 3.0), (1.1, 0.0, 0.0, 0.0))


def test_a_recording_that_fails_leaves_nothing_and_keeps_what_was_there(tmp_path: Path) -> None:
    path, capture = tmp_path / "run.mcap", drawn_capture()
    path.write_bytes(b"precious")

    def failing() -> Iterator[RawObservation]:
        yield from list(raw_observations(capture))[:3]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_mcap_recording(path, capture.cameras, failing())
    backwards = list(raw_observations(capture))[::-1]
    with pytest.raises(OutputError, match=r"0\.1 s is not after the one before, at 0\.133"):
        write_mcap_recording(path, capture.cameras, backwards)
    early = [replace(one, time_s=one.time_s - 1.0) for one in raw_observations(capture)]
    with pytest.raises(
        OutputError, match="-1 s is before 0, which a ROS recording cannot represent"
    ):
        write_mcap_recording(path, capture.cameras, early)
    with pytest.raises(OutputError, match="there is no observation to record"):
        write_mcap_recording(path, capture.cameras, [])
    assert path.read_bytes() == b"precious"
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap"]


def test_a_recording_is_named_as_one(tmp_path: Path) -> None:
    capture = drawn_capture()
    with pytest.raises(OutputError, match=r"ends in \.mcap"):
        write_mcap_recording(tmp_path / "run.bag", capture.cameras, raw_observations(capture))
    with pytest.raises(OutputError, match="there is no folder"):
        write_mcap_recording(tmp_path / "a/run.mcap", capture.cameras, raw_observations(capture))


def test_a_missing_library_is_told_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_bag(tmp_path / "run.mcap", stereo_entries(2))
    for name in ("rosbags", "rosbags.highlevel", "rosbags.rosbag2", "rosbags.typesys"):
        monkeypatch.setitem(__import__("sys").modules, name, None)
    with pytest.raises(MissingExtraError, match=r"pip install 'servoid\[bags\]'"):
        open_bag(path)
    capture = drawn_capture()
    with pytest.raises(MissingExtraError, match=r"pip install 'servoid\[bags\]'"):
        write_mcap_recording(tmp_path / "b.mcap", capture.cameras, raw_observations(capture))


def test_a_grey_image_file_is_seen_as_the_folder_sees_it(tmp_path: Path) -> None:
    folder = tmp_path / "grey"
    folder.mkdir()
    for index in range(2):
        cv2.imwrite(str(folder / f"{index}.png"), pixels(index, (30, 40)))
    (folder / "capture.toml").write_text(
        'version = 1\nrate_hz = 30\n[[camera]]\nname = "eye"\nimages = "*.png"\n'
        "size_px = [40, 30]\nfocal_px = [50, 50]\n"
    )
    check_same(record(tmp_path / "run.mcap", open_capture(folder)), open_capture(folder))
