"""Stamps of a device's own clock, on the clock of the arm."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from servoid.source.device_clock import JUMP_S, WINDOW_S, DeviceClock

PERIOD_S = 1.0 / 30.0


def mapped(
    stamps: np.ndarray, delays: np.ndarray, shift_s: float = 1000.0, drift: float = 0.0
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return the true times of images, when a device's clock says they were, and its jumps."""
    clock, times, notices = DeviceClock(), [], []
    true = np.arange(len(stamps)) * PERIOD_S + shift_s
    for at, (stamp_s, delay_s) in enumerate(zip(stamps, delays, strict=True)):
        time_s, jump = clock.time_s(stamp_s * (1.0 + drift), true[at] + delay_s)
        times.append(time_s)
        notices += [] if jump is None else [jump]
    return true, np.array(times), notices


@given(st.lists(st.floats(0.0, 0.2), min_size=2, max_size=60), st.integers(0, 2**32))
def test_times_increase_and_are_never_after_the_arrival(delays: list[float], seed: int) -> None:
    steps = np.random.default_rng(seed).uniform(0.005, 0.1, len(delays))
    stamps = np.cumsum(steps)
    arrivals = (
        np.maximum.accumulate(stamps + np.array(delays) + 50.0) + np.arange(len(stamps)) / 1e6
    )
    clock = DeviceClock()
    times = [
        clock.time_s(stamp_s, arrival_s)[0]
        for stamp_s, arrival_s in zip(stamps, arrivals, strict=True)
    ]
    assert (np.diff(times) > 0.0).all()
    assert (np.array(times) <= arrivals).all()


def test_delays_that_vary_do_not_reach_the_times_of_images() -> None:
    count = 300
    delays = 0.002 + np.random.default_rng(0).exponential(0.01, count)
    true, times, notices = mapped(np.arange(count) * PERIOD_S, delays)
    assert notices == []
    late = (times - true)[60:]
    assert late.min() > 0.0015 and late.max() < 0.0035
    assert np.std(delays) > 0.008 and np.std(late) < 0.0003


def test_a_device_whose_quartz_is_off_keeps_its_offset() -> None:
    count = int(100.0 / PERIOD_S)
    delays = np.full(count, 0.004)
    true, times, notices = mapped(np.arange(count) * PERIOD_S, delays, drift=50e-6)
    assert notices == []
    assert np.abs(times - true - 0.004).max() < 50e-6 * WINDOW_S + 1e-6


@pytest.mark.parametrize(
    ("jump_s", "message"), [(-100.0, "went back by 100"), (5.0, "went ahead by 5")]
)
def test_a_clock_that_jumps_is_told_and_trusted_anew(jump_s: float, message: str) -> None:
    stamps = np.arange(90) * PERIOD_S
    stamps[45:] += jump_s
    true, times, notices = mapped(stamps, np.full(90, 0.004))
    assert len(notices) == 1 and message in notices[0]
    assert times == pytest.approx(true + 0.004, abs=1e-6)


def test_a_clock_that_is_set_back_a_little_is_told_once_it_is_sure() -> None:
    stamps = np.arange(200) * 0.5
    stamps[100:] -= 0.4
    clock, notices, last = DeviceClock(), [], 0.0
    for at, stamp_s in enumerate(stamps):
        time_s, jump = clock.time_s(stamp_s, 0.5 * at + 0.004)
        assert time_s > last
        last = time_s
        notices += [] if jump is None else [(at, jump)]
    ((at, notice),) = notices
    assert 101 <= at <= 103
    assert "was set back by 0.4" in notice
    assert last == pytest.approx(0.5 * 199 + 0.004)


def test_images_that_waited_in_a_queue_are_no_jump() -> None:
    count = 120
    delays = np.full(count, 0.004)
    delays[40:70] += np.linspace(2.0, 0.0, 30)  # a computer that stood still for two seconds
    true, times, notices = mapped(np.arange(count) * PERIOD_S, delays)
    assert notices == []
    assert delays.max() > JUMP_S
    assert times == pytest.approx(true + 0.004, abs=1e-6)


def test_a_clock_that_stands_still_is_told_as_such() -> None:
    true, times, notices = mapped(np.zeros(20), np.full(20, 0.004))
    assert set(notices) == {
        "its clock stands still, so that its images count as taken when they came"
    }
    assert times == pytest.approx(true + 0.004, abs=1e-6)


@pytest.mark.parametrize(
    ("many", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")]
)
def test_stamps_in_another_unit_than_seconds_are_told_with_the_unit(many: float, unit: str) -> None:
    true, times, notices = mapped(many * np.arange(20) * PERIOD_S, np.full(20, 0.004))
    assert set(notices) == {f"its stamps look like {unit}: they must be in seconds, or be left out"}
    assert times == pytest.approx(true + 0.004, abs=1e-6)
