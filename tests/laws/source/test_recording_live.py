"""What a live source delivers is recorded so that its replay has the same bits."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from played_sources import FakeClock, FakeVideo, lens, live, rig

from servoid.capture import open_capture
from servoid.errors import OutputError
from servoid.pose import Pose
from servoid.record import FolderRecorder, FrozenWatch, QueuedRecording
from servoid.source import (
    Delivery,
    Feed,
    Live,
    MountedCamera,
    RawImage,
    RawInstant,
    capture_of_raw,
    read_instants,
)

NOISE = np.random.default_rng(3)
RIG = tuple(
    MountedCamera(name, lens((-0.21, 0.07, 0.001, 0.0)), Pose.from_parts((x, 0, 0), (1, 0, 0, 0)))
    for name, x in (("left", 0.0), ("right", 1.0 / 3.0))
)


def raw(index: int, *, lost: bool = False, depth: bool = False) -> RawInstant:
    """Return an observation of noise, the left image as JPEG and the right one as pixels."""
    pixels = NOISE.integers(0, 256, (48, 64, 3), np.uint8)
    data = cv2.imencode(".jpg", pixels)[1]
    decoded = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)[..., ::-1]
    depth_m = NOISE.uniform(0.2, 3.0, (48, 64)).astype(np.float32)
    depth_m[:5] = np.nan
    time_s = 100.0 + index / 29.97
    left = RawImage(
        np.ascontiguousarray(decoded), time_s, index + 1, depth_m if depth else None, data.tobytes()
    )
    right = None if lost else RawImage(pixels[::-1].copy(), time_s + 0.001, index + 7)
    return RawInstant(index, time_s, (left, right), tuple(one.rig_from_camera for one in RIG))


def same(one: object, other: object) -> bool:
    """Say if two arrays have the same bits, or both are missing."""
    if one is None or other is None:
        return one is other
    return np.asarray(one).tobytes() == np.asarray(other).tobytes()


@pytest.mark.parametrize("depth", [False, True])
def test_a_recording_replays_with_the_same_bits(tmp_path: Path, depth: bool) -> None:
    given = [raw(0, depth=depth), raw(1, lost=True, depth=depth), raw(2, depth=depth)]
    recorder = FolderRecorder(tmp_path / "run", RIG, began="noon")
    for one in given:
        recorder.add(one)
    capture = open_capture(recorder.close())
    assert capture.times_s == tuple(one.time_s for one in given)
    assert capture.rate_hz == pytest.approx(29.97)
    live_instants = [
        next(read_instants(single, single.observations()))
        for single in (capture_of_raw(tmp_path, RIG, one) for one in given)
    ]
    for one, replayed in zip(
        live_instants, read_instants(capture, capture.observations()), strict=True
    ):
        assert one.time_s == replayed.time_s
        assert all(map(same, one.images, replayed.images))
        assert len(one.depths) == len(replayed.depths) == (2 if depth else 0)
        assert all(map(same, one.depths, replayed.depths))
        for pose, other in zip(one.world_from_camera, replayed.world_from_camera, strict=True):
            assert same(pose.matrix(), other.matrix())


def test_a_recording_says_which_images_formed_each_observation(tmp_path: Path) -> None:
    recorder = FolderRecorder(tmp_path / "run", RIG)
    for one in (raw(0), raw(1, lost=True)):
        recorder.add(one)
    assert not (tmp_path / "run").exists()
    folder = recorder.close()
    lines = (folder / "images.csv").read_text().splitlines()
    assert lines[0] == "observation,camera,file,time_s,number"
    assert [line.split(",")[:3] for line in lines[1:]] == [
        ["0", "left", "left/000000.jpg"],
        ["0", "right", "right/000000.png"],
        ["1", "left", "left/000001.jpg"],
    ]
    assert lines[2].endswith(",100.001,7")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run"]


def test_a_recording_replaces_nothing_and_leaves_nothing_of_nothing(tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").touch()
    with pytest.raises(OutputError, match="the folder is not empty; name one that is empty"):
        FolderRecorder(tmp_path / "full", RIG)
    with pytest.raises(OutputError, match="no image came"):
        FolderRecorder(tmp_path / "none", RIG).close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["full"]


def test_a_camera_that_repeats_an_image_for_seconds_is_named() -> None:
    watch, stuck = FrozenWatch(RIG), raw(0)
    for index in range(120):
        fresh = raw(index)
        (left, right), (_, still) = fresh.images, stuck.images
        assert left is not None and right is not None and still is not None
        seen = replace(still, time_s=right.time_s) if index >= 30 else right
        watch.add(replace(fresh, images=(left, seen)))
    [note] = watch.notes()
    assert note.startswith("camera right sent the same image 90 times, bit by bit, from 101.0 to ")


def test_a_camera_that_repeats_an_image_for_a_moment_is_not_named() -> None:
    watch, stuck = FrozenWatch(RIG), raw(0)
    for index in range(40):
        watch.add(replace(stuck, images=(stuck.images[0], raw(index).images[1])))
    assert watch.notes() == []


def test_what_a_queued_recording_cannot_write_is_told() -> None:
    def write(waiting: object) -> None:
        next(iter(waiting))  # type: ignore
        raise OutputError("the disk is full")

    recording = QueuedRecording(write)
    with pytest.raises(OutputError, match="the disk is full"):
        for index in range(200):
            recording.add(raw(index % 2))
        recording.close()


def test_a_feed_numbers_what_it_hands_out_and_counts_what_it_did_not() -> None:
    played = live()
    assert isinstance(played.source, Live)
    kept: list[RawInstant] = []
    ended: list[bool] = []

    def turn() -> bool:
        played.pass_period()
        return bool(ended)

    feed = Feed(played.source, name="test", is_over=turn, keep=kept.append)
    capture, first = feed.first()
    assert (first.index, len(capture)) == (0, 1)
    for _ in range(40):  # more images than one come in between
        played.pass_period()
    handed = iter(feed)
    indices = [next(handed).index for _ in range(3)]
    ended.append(True)
    assert list(handed) == []
    assert indices == [1, 2, 3] == [one.index for one in kept[1:]]
    assert feed.missed >= 5
    played.close()


def test_the_eyes_of_one_device_come_together_by_its_own_clock() -> None:
    clock = FakeClock()

    class Eyes(FakeVideo):
        def retrieve(self) -> tuple[bool, Any]:
            images = tuple(np.full((48, 64), value, np.uint8) for value in (10, 20))
            return True, Delivery(images, 1e6 + self.count / 30.0, notices=("it is warm",))

    video = Eyes(clock)
    cameras = list(rig(video, video))
    with Live(cameras, clock=clock) as source:
        clock.advance(0.05)
        found = source.newest_raw()
        video.closed = True
    assert found is not None
    left, right = found.images
    assert left is not None and right is not None
    assert left.pixels.shape == (48, 64, 3) and right.pixels[0, 0].tolist() == [20, 20, 20]
    assert left.time_s == right.time_s == found.time_s <= clock()
    assert found.notices == ("camera left: it is warm",)
