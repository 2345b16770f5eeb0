"""Laws of the clock and of the moving rig that a program gives to live cameras."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from played_sources import FakeClock, FakeVideo, live, rig

from servoid.errors import CaptureError
from servoid.pose import Pose
from servoid.source import Instant, Live, Video

RATE_HZ = 100.0


class SteadyVideo:
    """A camera that delivers at its own rate, whatever any clock says."""

    def grab(self) -> bool:
        time.sleep(1.0 / RATE_HZ)
        return True

    def retrieve(self) -> tuple[bool, Any]:
        return True, np.full((48, 64, 3), 90, np.uint8)

    def release(self) -> None:
        pass


class SteppedClock:
    """A clock that goes, and that somebody sets."""

    shift_s = 100.0

    def __call__(self) -> float:
        return time.monotonic() + self.shift_s


def seen(source: Live, seconds: float) -> list[Instant]:
    found, end_s = [], time.monotonic() + seconds
    while time.monotonic() < end_s:
        instant = source.newest()
        found += [] if instant is None else [instant]
        time.sleep(0.001)
    return found


@pytest.mark.parametrize("count", [1, 2])
def test_images_go_on_when_the_clock_goes_back_and_it_is_told_once(count: int) -> None:
    clock = SteppedClock()
    with Live(rig(*(SteadyVideo() for _ in range(count))), clock=clock) as source:
        before = seen(source, 1.0)
        clock.shift_s -= 30.0
        after = seen(source, 1.5)
        assert source.silence() is None
    assert len(before) > 10 and len(after) > 10
    assert after[-1].time_s - before[-1].time_s == pytest.approx(-28.5, abs=0.4)
    words = [notice for one in after for notice in one.notices if "clock" in notice]
    (told,) = words
    assert told.startswith("the clock of Live went back by 30 s, and is now trusted again")
    later = np.array([one.time_s for one in after if one.time_s < before[0].time_s])
    assert len(later) >= len(after) - 1 and (np.diff(later) > 0.0).all()


def test_a_clock_that_goes_back_hides_no_silence() -> None:
    clock = FakeClock()
    video = FakeVideo(clock, lost=range(10, 1000))
    with Live(rig(video), clock=clock) as source:
        for _ in range(60):
            clock.advance()
            source.newest()
        clock.time_s -= 3.0
        assert source.newest() is None and source.silence() is None
        clock.time_s += 1.0
        silence = source.silence()
        video.closed = True
    assert silence is not None and silence.startswith("camera left: no image came for 1.0 s")


def test_a_clock_that_jitters_back_is_not_told() -> None:
    played, random = live(), np.random.default_rng(1)
    clock = played.now
    assert isinstance(clock, FakeClock)
    notices: list[str] = []
    for _ in range(100):
        played.pass_period()
        clock.time_s -= float(random.uniform(0.0, 0.005))
        instant = played.source.newest()
        notices += [] if instant is None else instant.notices
    played.close()
    assert not any("clock" in notice for notice in notices)


@pytest.mark.parametrize("given", ["noon", None])
def test_a_clock_that_returns_no_number_is_refused_in_words(given: Any) -> None:
    words = "the clock of Live must return a number of seconds, as time.monotonic does, but ret"
    with pytest.raises(CaptureError, match=words):
        Live(rig(SteadyVideo()), clock=lambda: given)


def test_a_clock_that_is_not_known_for_a_while_is_a_silence_with_a_reason() -> None:
    clock = SteppedClock()
    with Live(rig(SteadyVideo()), clock=clock) as source:
        assert seen(source, 0.5)
        clock.shift_s = float("nan")
        time.sleep(0.1)
        assert len(seen(source, 0.2)) <= 1  # what had arrived before
        assert "the clock of Live returned nan" in str(source.silence())
        clock.shift_s = 100.0
        assert seen(source, 0.5)


ONE = Pose.identity()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (lambda _: None, "must return 2 poses, .* for each of left, right, but returned NoneType"),
        (lambda _: ONE, "but returned Pose$"),
        (lambda _: (ONE,), "but returned 1 value$"),
        (lambda _: (ONE, np.eye(4)), r"but one it returned is ndarray; .* by Pose\(matrix\)"),
    ],
    ids=["nothing", "a pose", "one of two", "a matrix"],
)
def test_poses_of_a_moving_rig_that_cannot_be_used_are_refused_in_words(
    given: Callable[[float], Any], words: str
) -> None:
    videos: list[Video] = [SteadyVideo(), SteadyVideo()]
    with (
        pytest.raises(CaptureError, match=words),
        Live(rig(*videos), clock=time.monotonic, world_from_cameras=given) as source,
    ):
        seen(source, 2.0)


def test_poses_of_a_moving_rig_may_come_one_after_another() -> None:
    def poses(_time_s: float) -> Any:
        return iter((ONE, ONE))

    with Live(rig(SteadyVideo(), SteadyVideo()), world_from_cameras=poses) as source:
        assert seen(source, 1.0)
