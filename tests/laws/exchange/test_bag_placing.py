"""Where the cameras of a bag were: by the tree of transforms, or by their calibrations."""

from pathlib import Path

import numpy as np
import pytest
from bag_writing import image, info, tf, write_bag
from scenes_bags import (
    BASELINE_M,
    FRAMES,
    SIZE_PX,
    STILL,
    K,
    link,
    only_camera,
    pixels,
    stamp,
    stereo_entries,
    world_from_rig,
)

from servoid.errors import CaptureError
from servoid.exchange import open_bag
from servoid.pose import Pose
from servoid.words import measured


def test_the_world_is_the_top_of_the_tree_or_any_frame_that_is_named(tmp_path: Path) -> None:
    base_from_world = Pose.exp([0.3, -0.2, 0.1, 0.4, 0.1, -0.2])
    entries = [tf(stamp(0), [link("map", "base", Pose.identity())], "/tf_static")]
    entries += [tf(stamp(0), [link("base", "world", base_from_world)], "/tf_static")]
    path = write_bag(tmp_path / "run.mcap", [*entries, *stereo_entries()])
    capture = open_bag(path)
    assert "poses are in the frame 'map', the top of TF's tree" in capture.notes
    for index in range(6):
        off = capture.world_from_rig[index].inverse() @ base_from_world @ world_from_rig(index)
        assert np.abs(off.log()).max() < 1e-12
    below = open_bag(path, world="world")
    assert np.abs((below.world_from_rig[3].inverse() @ world_from_rig(3)).log()).max() < 1e-12
    with pytest.raises(CaptureError, match="no TF leads from 'moon' to 'rig'; the frames"):
        open_bag(path, world="moon")


def test_a_camera_beside_the_tree_may_be_the_world(tmp_path: Path) -> None:
    """Poses are then told by a frame on another branch, against the direction of the tree."""
    rest = Pose.exp([0.1, 0.2, 0.3, 0.5, 0.6, 0.7])
    entries = [tf(stamp(0), [link("world", "table", rest)], "/tf_static"), *stereo_entries()]
    capture = open_bag(write_bag(tmp_path / "run.mcap", entries), world="table")
    for index in range(6):
        off = capture.world_from_rig[index].inverse() @ rest.inverse() @ world_from_rig(index)
        assert np.abs(off.log()).max() < 1e-12


def test_transforms_between_stamps_go_straight_at_constant_speed(tmp_path: Path) -> None:
    a, b = Pose.identity(), Pose.from_euler("z", [0.8], [0.4, 0.0, 0.2])
    entries = only_camera([one for one in stereo_entries(5) if one.topic != "/tf"])
    entries += [tf(stamp(0), [link("world", "rig", a)]), tf(stamp(4), [link("world", "rig", b)])]
    capture = open_bag(write_bag(tmp_path / "run.bag", entries))
    for index in range(5):
        pose = capture.world_from_rig[index]
        assert pose.translation == pytest.approx((0.1 * index, 0.0, 0.05 * index))
        assert pose.euler("xyz") == pytest.approx((0.0, 0.0, 0.2 * index))


def test_gaps_of_transforms_are_told_and_observations_beyond_them_left_out(tmp_path: Path) -> None:
    entries = only_camera([one for one in stereo_entries(90) if one.topic != "/tf"])
    known = [*range(20, 30), *range(60, 70)]
    entries += [tf(stamp(i), [link("world", "rig", world_from_rig(i))]) for i in known]
    capture = open_bag(write_bag(tmp_path / "run.mcap", entries))
    # A tenth of a second beyond the first and the last transform is three images each.
    assert capture.times_s is not None
    assert (capture.times_s[0], capture.times_s[-1]) == (stamp(17) / 10**9, stamp(72) / 10**9)
    notes = "; ".join(capture.notes)
    assert "TF from world to rig has gaps of up to 1 s; poses of 30 observations" in notes
    assert "nearest transform was used for 6 observations" in notes
    assert "34 of 90 observations were left out" in notes


def test_a_transform_that_never_changes_holds_at_any_time(tmp_path: Path) -> None:
    """Publishers of ROS 1 repeat static transforms on /tf, with stamps that lie ahead."""
    entries = only_camera(
        [one for one in stereo_entries() if one.topic not in ("/tf", "/tf_static")]
    )
    entries += [tf(stamp(i) + 10**9, [("world", FRAMES[0], (1, 2, 3), STILL)]) for i in (0, 3, 5)]
    capture = open_bag(write_bag(tmp_path / "run.bag", entries))
    assert {pose.translation for pose in capture.world_from_rig} == {(1.0, 2.0, 3.0)}
    assert not any("TF from" in note for note in capture.notes)


def test_cameras_that_move_against_each_other_are_refused(tmp_path: Path) -> None:
    entries = [one for one in stereo_entries() if one.topic != "/tf_static"]
    for index in range(6):
        poses = [Pose.exp([0.0, side * 0.1, index * side * 0.002, 0, 0, 0]) for side in (0, 1)]
        links = [link("rig", frame, pose) for frame, pose in zip(FRAMES, poses, strict=True)]
        entries.append(tf(stamp(index), links))
    path = write_bag(tmp_path / "run.mcap", entries)
    with pytest.raises(CaptureError, match=r"move relative to each other, by up to 10 mm"):
        open_bag(path)
    assert len(open_bag(path, ["/stereo/left/image_raw"]).cameras) == 1


def test_without_transforms_a_stereo_pair_is_placed_by_its_calibration(tmp_path: Path) -> None:
    """Both images name the left camera's frame, as ROS asks of rectified pairs."""
    turn = Pose.from_euler("y", [0.05])
    entries = []
    for index in range(3):
        for side in (0, 1):
            name = ("left", "right")[side]
            p = (60, 0, 20, -60 * BASELINE_M * side, 0, 60, 15, 0, 0, 0, 1, 0)
            r = turn.matrix()[:3, :3].ravel() if side else np.eye(3).ravel()
            entries.append(image(f"/{name}/image_raw", stamp(index), "left", pixels(side)))
            entries.append(image(f"/{name}/image_rect", stamp(index), "left", pixels(side)))
            at = stamp(index)
            entries.append(info(f"/{name}/camera_info", at, "left", SIZE_PX, K, r=r, p=p))
    path = write_bag(tmp_path / "run.mcap", entries)
    raw = open_bag(path)
    assert [camera.lens.focal_px for camera in raw.cameras] == [(50.0, 51.0)] * 2
    expected = Pose.from_parts([BASELINE_M, 0, 0], [1, 0, 0, 0]) @ turn
    off = raw.cameras[1].rig_from_camera.inverse() @ expected
    assert np.abs(off.log()).max() < 1e-12
    assert any("the rig is assumed to be static" in note for note in raw.notes)
    rectified = open_bag(path, ["/left/image_rect", "/right/image_rect"])
    assert [camera.lens.focal_px for camera in rectified.cameras] == [(60.0, 60.0)] * 2
    between = rectified.cameras[0].rig_from_camera.inverse() @ rectified.cameras[1].rig_from_camera
    assert np.abs(between.log() - [BASELINE_M, 0, 0, 0, 0, 0]).max() < 1e-12


@pytest.mark.parametrize(("share", "noted"), [(0.6, True), (1.02, False), (1.0, False)])
def test_a_baseline_that_differs_between_tf_and_the_calibrations_is_noted_with_both(
    tmp_path: Path, share: float, noted: bool
) -> None:
    entries = [one for one in stereo_entries() if not one.topic.endswith("camera_info")]
    for side, name in enumerate(("left", "right")):
        p = (50, 0, 20, -50 * BASELINE_M * share * side, 0, 50, 15, 0, 0, 0, 1, 0)
        entries.append(info(f"/stereo/{name}/camera_info", stamp(0), FRAMES[side], SIZE_PX, K, p=p))
    capture = open_bag(write_bag(tmp_path / "run.mcap", entries))
    between = capture.cameras[0].rig_from_camera.inverse() @ capture.cameras[1].rig_from_camera
    found = float(np.linalg.norm(between.translation))
    wanted = f"{measured(1e3 * found)} mm apart by TF, but {measured(1e3 * BASELINE_M * share)} mm"
    assert any(wanted in note and "TF is used" in note for note in capture.notes) == noted


def test_two_cameras_of_which_nothing_says_how_they_are_placed_are_refused(tmp_path: Path) -> None:
    entries = [one for one in stereo_entries() if not one.topic.startswith("/tf")]
    with pytest.raises(CaptureError, match=r"no TF, and no offset in P .* record /tf_static"):
        open_bag(write_bag(tmp_path / "run.mcap", entries))
