import math
from itertools import pairwise

import numpy as np
import pytest

from servoid.errors import SimError
from servoid.pose import Pose
from servoid.sim.world.events.paths import KINDS, Recorded, parse_path, twist_at

PATHS = (
    "still",
    "line:0.2@5s",
    "line:0.2@5s:-z",
    "circle:0.1@10s",
    "circle:0.1@4s:y",
    "sine:0.15@10s",
    "sine:0.15@10s:y",
    "random:3",
    "random:9:0.1@3s",
)


def place(text: str, time_s: float) -> np.ndarray:
    return np.array(parse_path(text).start_from_object(time_s).translation)


@pytest.mark.parametrize("text", PATHS)
def test_a_path_begins_at_rest_where_the_object_starts(text: str) -> None:
    path = parse_path(text)
    for time_s in (-1.0, 0.0):
        assert np.abs(path.start_from_object(time_s).log()).max() < 1e-12
    assert np.abs(path.start_from_object(1e-3).log()).max() < 1e-6


@pytest.mark.parametrize("text", PATHS)
def test_a_twist_says_where_the_object_is_a_moment_later(text: str) -> None:
    path, step = parse_path(text), 2e-3
    for time_s in np.linspace(0.1, 12.0, 40):
        before = path.start_from_object(time_s - step)
        after = path.start_from_object(time_s + step)
        twist = twist_at(path.start_from_object, time_s)
        gone = np.subtract(after.translation, before.translation)
        turned = Pose.exp([0, 0, 0, *(2 * step * twist[3:])]) @ before
        assert np.abs(gone - 2 * step * twist[:3]).max() < 1e-6
        relative = (turned.inverse() @ after).log()[3:]
        assert np.abs(relative).max() < 1e-6


@pytest.mark.parametrize("text", PATHS)
def test_a_path_never_jumps(text: str) -> None:
    path = parse_path(text)
    times = np.arange(0.0, 15.0, 0.01)
    poses = [path.start_from_object(time) for time in times]
    steps = [(a.inverse() @ b).log() for a, b in pairwise(poses)]
    assert np.abs(steps).max() < 0.01
    assert np.abs(np.diff(steps, axis=0)).max() < 1e-3


def test_the_sine_is_the_papers() -> None:
    for time_s in np.linspace(0.0, 20.0, 33):
        wanted = 0.15 - 0.15 * math.cos(2 * math.pi * time_s / 10.0)
        assert place("sine:0.15@10s", time_s) == pytest.approx((wanted, 0.0, 0.0), abs=1e-12)


def test_a_line_ends_at_its_length_and_stays_there() -> None:
    assert place("line:0.2@5s", 5.0) == pytest.approx((0.2, 0.0, 0.0))
    assert place("line:0.2@5s:-y", 9.0) == pytest.approx((0.0, -0.2, 0.0))


@pytest.mark.parametrize("axis", ["x", "y", "z", "-x", "-y", "-z"])
def test_a_circle_keeps_its_radius_across_its_axis(axis: str) -> None:
    places = np.array([place(f"circle:0.1@4s:{axis}", time) for time in np.arange(0, 8, 0.05)])
    along = "xyz".index(axis[-1])
    across = np.delete(places, along, axis=1)
    assert np.abs(places[:, along]).max() < 1e-12
    middle = 0.5 * (across.max(axis=0) + across.min(axis=0))
    assert np.linalg.norm(across - middle, axis=1) == pytest.approx(0.1, abs=1e-3)


def test_a_random_path_depends_on_its_seed_alone_and_keeps_its_size() -> None:
    times = np.arange(0.0, 60.0, 0.25)
    one, same, other = (
        np.array([parse_path(text).start_from_object(time).log() for time in times])
        for text in ("random:5:0.08@6s", "random:5:0.08@6s", "random:6:0.08@6s")
    )
    assert np.array_equal(one, same)
    assert not np.allclose(one, other)
    assert (np.abs(one).max(axis=0) > 0.02).all()
    places = [place("random:5:0.08@6s", time) for time in times]
    assert np.abs(places).max() <= 0.08


def test_a_recorded_path_goes_through_its_poses_and_starts_at_the_start() -> None:
    first = Pose.from_parts((1.0, 2.0, 3.0), (0.5, 0.5, 0.5, 0.5))
    moves = [Pose.exp([0.1 * k, 0.02 * k, 0.0, 0.0, 0.1 * k, 0.0]) for k in range(4)]
    path = Recorded([5.0, 6.0, 6.5, 8.0], [first @ move for move in moves])
    for since, move in zip((0.0, 1.0, 1.5, 3.0), moves, strict=True):
        assert np.abs(path.start_from_object(since).matrix() - move.matrix()).max() < 1e-12
    assert np.abs(path.start_from_object(9.0).matrix() - moves[3].matrix()).max() < 1e-12
    half = path.start_from_object(0.5)
    assert (half @ half).log() == pytest.approx(moves[1].log(), abs=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wobble", KINDS["random"]),
        ("", KINDS["circle"]),
        ("sine", KINDS["sine"]),
        ("sine:0.15", "'0.15'"),
        ("sine:0.15@", "0.15@10s"),
        ("sine:-0.15@10s", "above 0"),
        ("sine:nan@10s", "above 0"),
        ("sine:0.15@10s:w", "'w'"),
        ("line:0.1@2s:x:y", KINDS["line"]),
        ("random:one", "'one'"),
        ("random", KINDS["random"]),
        ("recorded:run.csv", "Recorded(times, poses)"),
    ],
)
def test_a_path_that_is_none_is_refused_with_how_to_write_it(text: str, words: str) -> None:
    with pytest.raises(SimError) as caught:
        parse_path(text)
    assert words in str(caught.value)
    assert f"'{text}'" in str(caught.value)


@pytest.mark.parametrize(
    ("times", "count"), [([0.0], 1), ([0.0, 1.0], 3), ([0.0, 0.0], 2), ([1.0, 0.5], 2)]
)
def test_a_recording_without_growing_times_is_refused(times: list[float], count: int) -> None:
    with pytest.raises(SimError, match="a recorded path needs"):
        Recorded(times, [Pose.identity()] * count)
