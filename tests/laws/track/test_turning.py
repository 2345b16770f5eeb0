"""An object that turns on and on is known no worse for it, whoever moves and whatever else runs.

Where a bound is a number, what was measured stands beside it: `benches/track/turning.py` measures
more.
"""

import itertools
import os
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from multiprocessing import get_context

import numpy as np
import pytest
from resident_memory import STATM, resident_mb
from trust_scenes import SMALL
from turning_bodies import in_object, like, like_object
from turning_scenes import (
    PER_TURN,
    Turning,
    apart,
    deviations,
    elsewhere,
    followed,
    left_from_objects,
)

from servoid.pose import Pose
from servoid.source import Instant
from servoid.track import Followed, Tracked

HERE = Pose.identity()
IMAGES, TURNS = 24, 6
TO_AND_FRO, PART = 800, 100  # images; all is there after 200
MOST_POINTS = 640  # that are kept of a surface, with room for new ones


@dataclass(frozen=True, eq=False)
class WholeTurn:
    """A bottle that turns by 360 degrees, and its track from the first image alone."""

    turning: Turning

    @cached_property
    def instants(self) -> list[Instant]:
        return list(self.turning.instants())

    @cached_property
    def one(self) -> Followed:
        return self.turning.begin()

    @cached_property
    def tracked(self) -> list[Tracked]:
        return list(followed(self.one, self.instants[1:]))


@dataclass(frozen=True, eq=False)
class Shown:
    """An object that turns, and all images of it."""

    turning: Turning
    instants: list[Instant]

    def track(self, *, adjust: bool | None = None) -> list[Tracked]:
        """Follow it with a body of many views."""
        return self.track_elsewhere(self.instants, adjust=adjust)

    def track_elsewhere(
        self,
        moved: list[Instant],
        world_from_old: Pose = HERE,
        *,
        adjust: bool | None = None,
    ) -> list[Tracked]:
        """Follow it in another world, in which the first of the images may be another, too."""
        one, first = self.turning.begin(known=True, adjust=adjust), moved[0]
        start = world_from_old @ one.first.estimate.world_from_object
        again = one.tracker.start(0.0, first.world_from_camera, first.images, start)
        one = replace(one, first=replace(one.first, estimate=again))
        return list(followed(one, moved[1:], evolves=False))


@pytest.fixture(scope="module")
def drill() -> Shown:
    """Draw a drill that turns by 138 degrees."""
    turning = Turning("drill", 0, IMAGES)
    return Shown(turning, list(turning.instants()))


@pytest.fixture(scope="module")
def drill_track(drill: Shown) -> list[Tracked]:
    """Track the drill once, for all tests that compare another track with it."""
    return drill.track()


@pytest.fixture(scope="module")
def bottle_turn() -> WholeTurn:
    """Draw a whole turn, and track it once, for both laws of it."""
    return WholeTurn(Turning("bottle", 0, PER_TURN + 1))


def bits(tracked: list[Tracked]) -> list[tuple[bytes, bytes, float, str]]:
    """Return all that was said of poses, to the last bit."""
    return [
        (
            one.world_from_object.matrix().tobytes(),
            one.covariance.tobytes(),
            one.confidence,
            one.status,
        )
        for one in (each.estimate for each in tracked)
    ]


@contextmanager
def busy_threads(count: int) -> Iterator[None]:
    """Keep processors busy while the block runs."""
    ended = threading.Event()
    matrix = np.ones((400, 400))

    def work() -> None:
        while not ended.is_set():
            np.dot(matrix, matrix)

    threads = [threading.Thread(target=work) for _ in range(count)]
    for one in threads:
        one.start()
    try:
        yield
    finally:
        ended.set()
        for one in threads:
            one.join()


def test_the_worker_that_adjusts_changes_no_bit_from_run_to_run(
    drill: Shown, drill_track: list[Tracked]
) -> None:
    assert bits(drill.track()) == bits(drill_track)


@pytest.mark.extended
def test_the_worker_changes_no_bit_where_the_processors_are_busy(
    drill: Shown, drill_track: list[Tracked]
) -> None:
    with busy_threads(2 * (os.cpu_count() or 1)):
        assert bits(drill.track()) == bits(drill_track)


def test_without_the_worker_there_are_other_bits_and_no_wrong_pose(
    drill: Shown, drill_track: list[Tracked]
) -> None:
    without = drill.track(adjust=False)
    assert bits(without)[:4] == bits(drill_track)[:4]  # before anything is adjusted
    assert bits(without) != bits(drill_track)
    assert not drill.turning.judge(without).wrong.any()
    assert not drill.turning.judge(drill_track).wrong.any()


def test_a_world_that_is_turned_and_moved_as_a_whole_changes_no_pose_in_the_eye(
    drill: Shown, drill_track: list[Tracked]
) -> None:
    world_from_old = Pose.exp([0.3, -0.2, 0.5, 0.4, 1.0, -0.7])
    moved = elsewhere(drill.instants, lambda _: world_from_old)
    found = drill.track_elsewhere(moved, world_from_old)
    gaps = apart(left_from_objects(found, moved), left_from_objects(drill_track, drill.instants))
    assert gaps.max() < 1e-9  # 1e-13 was measured


def test_an_object_that_turns_is_one_at_rest_around_which_the_eyes_go(
    drill: Shown, drill_track: list[Tracked]
) -> None:
    moved = elsewhere(drill.instants, drill.turning.at_rest)
    found = drill.track_elsewhere(moved)
    gaps = apart(left_from_objects(found, moved), left_from_objects(drill_track, drill.instants))
    # Motion is foreseen in the world, so that the two differ by noise: by 0.9 of the standard
    # deviation that is told at most, and 0.2 in the median.
    share = gaps / deviations(drill_track)
    assert share.max() < 2.0 and np.median(share) < 0.5
    assert not drill.turning.judge(found, at_rest=True).wrong.any()


@pytest.mark.extended
def test_a_whole_turn_has_the_same_bits_twice_and_no_wrong_pose_without_the_worker(
    bottle_turn: WholeTurn,
) -> None:
    turning, shown = bottle_turn.turning, bottle_turn.instants
    twice, without = (
        list(followed(turning.begin(adjust=adjust), shown[1:])) for adjust in (None, False)
    )
    assert bits(bottle_turn.tracked) == bits(twice)
    assert bits(bottle_turn.tracked) != bits(without)
    assert not turning.judge(without).wrong.any()


@pytest.mark.extended
def test_six_turns_end_as_the_first_one() -> None:
    turning = Turning("mug", 0, TURNS * PER_TURN + 1, SMALL)
    tracked = list(followed(turning.begin(), turning.instants(range(1, turning.images))))
    found = turning.judge(tracked)
    first, last = slice(0, PER_TURN), slice(-PER_TURN, None)
    # Medians of the sixth turn are 0.7 of the first one's; its end is 1.0 mm and 1.3 degrees off.
    assert np.median(found.add[last]) <= np.median(found.add[first])
    assert np.median(found.turn[last]) <= np.median(found.turn[first])
    assert found.add[-1] < 0.002 and found.turn[-1] < np.radians(2.0)
    assert found.tracking[last].mean() > 0.9  # 1.0 was measured
    assert not found.trusted_wrong.any()


@pytest.mark.extended
@pytest.mark.parametrize("name", ["bottle", "drill"])
def test_a_turn_that_is_played_backwards_gives_the_same_body(
    name: str, bottle_turn: WholeTurn
) -> None:
    turn = bottle_turn if name == "bottle" else WholeTurn(Turning(name, 0, PER_TURN + 1))
    turning, back = turn.turning, turn.turning.begin(PER_TURN)
    for tracked in (turn.tracked, followed(back, turn.instants[-2::-1])):
        assert sum(each.evolved for each in tracked) > 0
    runs = [turn.one, back]
    bodies = [in_object(turning, one) for one in runs]
    alike = like(*bodies)
    # 0.90 and 0.94 of the bottle, 0.825 and 0.92 of the drill; 0.84 before known sides were sought
    # by their own points, which gave 0.88 with another seed, and gives 0.90 now.
    assert alike.volume > 0.82 and alike.silhouette > 0.89
    for one, body in zip(runs, bodies, strict=True):
        first, last = (
            like_object(each, name) for each in (in_object(turning, one, one.initial), body)
        )
        assert last.volume > max(first.volume, 0.8)  # 0.83 was measured, and 0.72 of first looks


def sizes_to_and_fro() -> tuple[list[tuple[float, int]], int]:
    """Let an object turn to and fro; return what it takes after each part of the images.

    That is the memory of this process in MB and of the appearance in bytes; then comes the largest
    number of points that were kept.
    """
    turning = Turning("drill", 0, PER_TURN + 1)
    shown = list(turning.instants())
    one = turning.begin()
    way = itertools.islice(itertools.cycle([*shown[1:], *shown[-2::-1]]), TO_AND_FRO)
    sizes, most = [], 0
    for count, _ in enumerate(followed(one, way), 1):
        most = max(most, len(one.surface[0]))
        if count % PART == 0:
            sizes.append((resident_mb(), len(one.appearance() or b"")))
    return sizes, most


@pytest.mark.extended
def test_memory_is_bounded_however_long_an_object_turns_to_and_fro() -> None:
    if not STATM.exists():
        pytest.skip("this system does not say how large a process is")
    # A process of 950 MB, as other tests leave it, once grew by 21 MB on a busy computer.
    with ProcessPoolExecutor(1, get_context("spawn")) as own:
        sizes, most_points = own.submit(sizes_to_and_fro).result()
    all_mb, (_, early, *_, late) = zip(*sizes, strict=True)
    assert most_points <= MOST_POINTS
    # What the worker takes just then changes that by 6 MB, up and down; what is kept only grows.
    growth_mb = np.polyfit(np.arange(len(all_mb) - 1), all_mb[1:], 1)[0]  # in a part
    assert growth_mb < PART / 30.0, all_mb
    assert late < 1.05 * early  # 1.0005 was measured
