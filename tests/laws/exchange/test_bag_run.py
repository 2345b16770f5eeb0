"""A run that is written as MCAP beside it: what another reader finds, and what is dropped."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_writing import reads_with
from fake_tracker import FakeEstimate, plain_body
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scenes_bags import SIZE_PX, drawn_capture

from servoid._native import Tracker
from servoid.camera import Camera
from servoid.capture import Capture
from servoid.errors import OutputError
from servoid.exchange import open_bag
from servoid.exchange.bags.mcap.background import Background
from servoid.exchange.bags.mcap.messages import ros_covariance
from servoid.exchange.bags.writing import McapRun, ObjectState, RunRig, mcap_run
from servoid.pose import Pose
from servoid.servo import JointState
from servoid.source import Instant, cameras_of, read_instants
from servoid.track import Followed, Tracked, TrackStep

AHEAD = Pose.exp([0.05, -0.02, 0.6, 0.3, -0.2, 0.1])
COLORS = np.array([[255, 0, 51], [0, 102, 255]], np.uint8)


def steps_of(capture: Capture, answers: Sequence[dict[str, Any]]) -> list[TrackStep]:
    """Make up what a tracker said of each observation."""
    steps = []
    instants = read_instants(capture, capture.observations())
    for instant, answer in zip(instants, answers, strict=True):
        estimate = FakeEstimate(instant.time_s, **({"world_from_object": AHEAD} | answer))
        tracked = Tracked(instant.index, estimate, 0.002, tuple(estimate.notices))  # type: ignore
        body = plain_body(AHEAD, count=3 if answer.get("evolved") else 2)
        one = Followed("my cup", object(), body, COLORS, (), tracked, 0.0)  # type: ignore
        steps.append(TrackStep(instant, (one,), (tracked,), 1.0))
    return steps


ANSWERS = (
    {},
    {"status": "lost", "notices": ["camera left is dark"]},
    {"status": "searching"},
    {"evolved": True, "confidence": 0.75},
    {},
)


def messages_of(path: Path) -> dict[str, list[Any]]:
    reader = reads_with("mcap_ros2.reader")
    found: dict[str, list[Any]] = {}
    for one in reader.read_ros2_messages(str(path)):
        assert one.schema.encoding == "ros2msg"
        found.setdefault(one.channel.topic, []).append(one.ros_msg)
    return found


def recorded(path: Path, answers: Sequence[dict[str, Any]] = ANSWERS) -> dict[str, list[Any]]:
    capture = drawn_capture(len(answers))
    with mcap_run(path, RunRig.of_capture(capture), can_wait=True) as run:
        for step in steps_of(capture, answers):
            run.add(step)
    assert run.notes() == []
    return messages_of(path)


def test_another_reader_finds_poses_only_where_they_are_to_be_trusted(tmp_path: Path) -> None:
    found = recorded(tmp_path / "run.mcap")
    poses = found["/my_cup/pose"]
    assert [one.header.stamp.nanosec for one in poses] == [0, 100_000_000, 133_333_333]
    assert {one.header.frame_id for one in poses} == {"world"}
    place, turn = poses[0].pose.pose.position, poses[0].pose.pose.orientation
    assert (place.x, place.y, place.z) == AHEAD.translation
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx(AHEAD.xyzw, abs=1e-15)
    expected = ros_covariance(AHEAD, FakeEstimate(0.0, AHEAD).covariance)
    assert np.array(poses[0].pose.covariance) == pytest.approx(expected.ravel())
    links = [link for one in found["/tf"] for link in one.transforms]
    to_object = [link for link in links if link.child_frame_id == "my_cup"]
    assert [link.header.frame_id for link in to_object] == ["world"] * 3
    assert to_object[0].transform.translation.z == AHEAD.translation[2]


def test_another_reader_finds_the_ellipsoids_when_they_are_new(tmp_path: Path) -> None:
    first, later = recorded(tmp_path / "run.mcap")["/my_cup/body"]
    assert [one.action for one in first.markers] == [3, 0, 0]  # all away, then one after another
    assert [one.action for one in later.markers] == [3, 0, 0, 0]
    for number, mark in enumerate(first.markers[1:]):
        assert (mark.type, mark.header.frame_id, mark.frame_locked) == (2, "my_cup", True)
        assert (mark.scale.x, mark.scale.y, mark.scale.z) == (0.08, 0.08, 0.08)
        assert mark.pose.position.x == 0.02 * number
        color = mark.color.r, mark.color.g, mark.color.b
        assert color == pytest.approx(COLORS[number] / 255.0) and mark.color.a == 1.0


def test_another_reader_finds_how_each_observation_went(tmp_path: Path) -> None:
    found = recorded(tmp_path / "run.mcap")["/diagnostics"]
    states = [one.status[0] for one in found]
    levels = [one.level if isinstance(one.level, int) else one.level[0] for one in states]
    assert levels == [0, 2, 1, 0, 0]
    assert [one.message for one in states][:3] == ["tracking", "lost", "searching"]
    assert {one.name for one in states} == {"servoid: my cup"}
    values = [{pair.key: pair.value for pair in one.values} for one in states]
    assert values[1]["notice 1"] == "camera left is dark"
    assert values[3]["confidence"] == "0.7500" and values[3]["milliseconds"] == "2.000"


def test_a_recorded_run_is_a_capture_that_can_be_tracked_again(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recorded(path)
    found, expected = open_bag(path), drawn_capture(len(ANSWERS))
    assert found.times_s == expected.times_s and found.world_from_rig == expected.world_from_rig
    for one, other in zip(found.cameras, expected.cameras, strict=True):
        for a, b in zip(one.pictures, other.pictures, strict=True):
            assert a is not None and b is not None
            assert (a.read(SIZE_PX) == b.read(SIZE_PX)).all()


def test_eyes_that_turn_by_themselves_and_joints_are_recorded(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    cameras = [Camera.from_fov(SIZE_PX, 60.0)] * 2
    state = JointState(0.5, [0.1, -0.2], [1.0, 2.0])
    with mcap_run(path, RunRig.of_source(cameras, ["left", "right"]), can_wait=True) as run:
        for index in range(3):
            poses = (Pose.exp([0, 0, 0, 0, 0.1 * index, 0]), Pose.identity())
            image = np.full((30, 40), 10 * index, np.uint8)
            instant = Instant(index, 0.1 * index, poses, (image, None), names=("left", "right"))
            run.see(instant, [ObjectState("cup", None)])
        run.feel(("shoulder", "elbow"), state)
    found = messages_of(path)
    (joints,) = found["/joint_states"]
    assert (joints.name, list(joints.position), list(joints.velocity), list(joints.effort)) == (
        ["shoulder", "elbow"],
        [0.1, -0.2],
        [1.0, 2.0],
        [],
    )
    assert joints.header.stamp.nanosec == 500_000_000
    assert [link.child_frame_id for link in found["/tf"][0].transforms] == [
        "left_optical",
        "right_optical",
    ]
    assert found["/left/image_raw"][2].encoding == "mono8" and "/right/image_raw" not in found
    seen = open_bag(path, ["/left/image_raw"])
    assert seen.world_from_rig == tuple(Pose.exp([0, 0, 0, 0, 0.1 * i, 0]) for i in range(3))
    assert found["/diagnostics"][0].status[0].message == "dark"


@given(
    twist=st.tuples(*[st.floats(-2.0, 2.0)] * 6),
    small=st.tuples(*[st.floats(-1.0, 1.0)] * 6),
    seed=st.integers(0, 1000),
)
def test_a_covariance_of_ros_is_that_of_the_origin_and_of_turns_about_fixed_axes(
    twist: tuple[float, ...], small: tuple[float, ...], seed: int
) -> None:
    """Moved by a small motion in its own frame, the pose is off by what the told axes say."""
    pose, step = Pose.exp(twist), 1e-6 * np.array(small)
    moved = pose @ Pose.exp(step)
    shift = np.array(moved.translation) - np.array(pose.translation)
    turn = (moved @ pose.inverse()).euler("xyz")  # lower case: axes that stay where they are
    off = np.concatenate([shift, turn])
    # The covariance of one motion alone is its outer product, and so is what it becomes.
    assert np.allclose(ros_covariance(pose, np.outer(step, step)), np.outer(off, off), atol=1e-17)
    root = np.random.default_rng(seed).normal(size=(6, 6))
    written = ros_covariance(pose, root @ root.T)
    assert np.allclose(written, written.T) and np.linalg.eigvalsh(written).min() > -1e-9
    assert np.trace(written) == pytest.approx(np.trace(root @ root.T))


def test_what_is_not_known_has_a_variance_that_says_nothing() -> None:
    written = ros_covariance(AHEAD, np.full((6, 6), np.nan))
    assert (written == 1e6 * np.eye(6)).all()


def held(rig: RunRig, gate: threading.Event) -> RunRig:
    """Let observations wait for a gate, as for a slow disk."""

    def observe(instant: Instant) -> Any:
        gate.wait()
        return rig.observe(instant)

    return replace(rig, observe=observe)


def test_a_live_run_drops_what_comes_too_fast_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A body whose observation was dropped comes with the next one that is written."""
    monkeypatch.setattr("servoid.exchange.bags.mcap.run.MOST_WAITING", 1)
    capture, gate = drawn_capture(5), threading.Event()
    path = tmp_path / "run.mcap"
    with mcap_run(path, held(RunRig.of_capture(capture), gate), can_wait=False) as run:
        first, *others, last = steps_of(capture, [{}, {}, {}, {"evolved": True}, {}])
        run.add(first)
        wait_until(lambda: not run._background.waiting)
        for step in others:
            run.add(step)
        gate.set()
        wait_until(lambda: not run._background.waiting)
        run.add(last)
    assert run.notes() == [
        f"{path} lacks 2 of 5 messages that were to be written: writing was too slow; "
        "use a faster disk, or record fewer images"
    ]
    found = messages_of(path)
    assert len(found["/left/image_raw"]) == 3
    assert [len(one.markers) for one in found["/my_cup/body"]] == [3, 4]


def test_a_run_that_can_wait_drops_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("servoid.exchange.bags.mcap.run.MOST_WAITING", 1)
    assert len(recorded(tmp_path / "run.mcap", [{}] * 12)["/left/image_raw"]) == 12


def test_a_run_that_fails_leaves_nothing_behind(tmp_path: Path) -> None:
    capture = drawn_capture(3)
    with (
        pytest.raises(KeyboardInterrupt),
        mcap_run(tmp_path / "run.mcap", RunRig.of_capture(capture), can_wait=True) as run,
    ):
        run.add(steps_of(capture, [{}] * 3)[0])
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_written_is_told_to_who_hands_over(tmp_path: Path) -> None:
    capture = drawn_capture(3)
    steps = steps_of(capture, [{}] * 3)

    def fill(run: McapRun) -> None:
        for step in [*steps[::-1], *steps * 20]:
            run.add(step)

    with (
        pytest.raises(OutputError, match="is not after the one before"),
        mcap_run(tmp_path / "run.mcap", RunRig.of_capture(capture), can_wait=True) as run,
    ):
        fill(run)
    assert list(tmp_path.iterdir()) == []


def test_jobs_are_done_in_their_order_in_one_other_thread() -> None:
    done: list[tuple[int, int]] = []
    background = Background[int](
        lambda job: done.append((job, threading.get_ident())), 2, can_wait=True
    )
    for job in range(50):
        assert background.put(job)
    background.close()
    assert [job for job, _ in done] == list(range(50))
    assert {thread for _, thread in done} != {threading.get_ident()}
    assert len({thread for _, thread in done}) == 1


def wait_until(holds: Callable[[], bool]) -> None:
    gone = threading.Event()
    for _ in range(2000):
        if holds():
            return
        gone.wait(0.005)
    raise AssertionError("it never came to be")


@pytest.mark.extended
def test_a_run_of_the_real_tracker_tells_the_poses_that_it_gave(
    tmp_path: Path, alone: Any, recording: Any
) -> None:
    capture: Capture = recording("colour").capture
    body, start = alone.body, alone.points[0].world_from_object
    tracker = Tracker(cameras_of(capture), body)
    given: list[NDArray[np.float64]] = []
    with mcap_run(tmp_path / "run.mcap", RunRig.of_capture(capture), can_wait=True) as run:
        for instant in read_instants(capture, capture.observations()[:8]):
            seen = (instant.time_s, instant.world_from_camera, instant.images)
            estimate = tracker.step(*seen) if instant.index else tracker.start(*seen, start)
            run.see(instant, [ObjectState("toy", estimate, body)])
            if estimate.status == "tracking":
                given.append(np.array(estimate.world_from_object.translation))
    positions = [one.pose.pose.position for one in messages_of(tmp_path / "run.mcap")["/toy/pose"]]
    assert len(positions) > 4
    assert np.array_equal(np.array([(one.x, one.y, one.z) for one in positions]), np.array(given))
