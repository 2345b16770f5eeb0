import numpy as np
import pytest

from servoid_experiments.bode.curves import HALF_POWER, Bode, leaving
from servoid_experiments.bode.response import Answer, ResponseRow
from servoid_experiments.bode.swinging import Swing, Swinging, amplitudes

LINES = (1, 2, 4, 7, 11, 20)


def swing(seed: int = 0, **changes: float) -> Swing:
    bounds = {"speed": 0.01, "amplitude": 0.02} | changes
    return Swing.of(LINES, 0.05, seed=(seed,), **bounds)


def test_no_sine_is_faster_or_wider_than_it_may_be() -> None:
    heights, rates = swing().heights, 2.0 * np.pi * 0.05 * np.array(LINES)
    assert np.all(heights <= 0.02) and np.all(heights * rates <= 0.01 + 1e-12)
    assert np.all(np.isclose(heights, 0.02) | np.isclose(heights * rates, 0.01))


def test_the_phases_of_any_seed_make_the_acceleration_peak_little() -> None:
    times = np.arange(4000) / 200.0
    rates = 2.0 * np.pi * 0.05 * np.array(LINES)

    def peak(phases: np.ndarray) -> float:
        waves = one.heights * rates**2 * np.cos(np.outer(times, rates) + phases)
        return float(np.abs(waves.sum(axis=1)).max())

    random = np.random.default_rng(5)
    for seed in range(3):
        one = swing(seed)
        others = [peak(random.uniform(0.0, 2.0 * np.pi, len(LINES))) for _ in range(100)]
        assert peak(one.phases) < np.percentile(others, 5)


def test_two_seeds_differ_and_the_same_seed_does_not() -> None:
    np.testing.assert_array_equal(swing(3).phases, swing(3).phases)
    assert not np.allclose(swing(3).phases, swing(4).phases)


def test_an_object_begins_to_swing_where_it_is_and_from_rest() -> None:
    path = Swinging(swing(0), swing(1))
    for time_s in (-1.0, 0.0, 1e-3):
        assert np.linalg.norm(path.start_from_object(time_s).translation) < 1e-8
    later = path.start_from_object(7.3)
    expected = [path.sideways.at(7.3), 0.0, path.depth.at(7.3)]
    assert later.translation == pytest.approx(expected)
    assert later.quaternion == pytest.approx((1.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("begin_s", [0.0, 5.016])
def test_every_sine_is_heard_as_it_was_made(begin_s: float) -> None:
    one = swing()
    times = begin_s + 0.008 * np.arange(2500)
    values = np.array([[one.at(time_s), 3.0] for time_s in times])
    spectrum = amplitudes(times, values, 0.05, 25)
    made = np.zeros(25, dtype=complex)
    made[np.array(LINES) - 1] = one.heights * np.exp(1j * one.phases)
    np.testing.assert_allclose(spectrum[:, 0], made, atol=1e-12)
    np.testing.assert_allclose(spectrum[:, 1], 0.0, atol=1e-12)


def test_what_comes_later_lags_by_its_delay() -> None:
    one, late_s = swing(), 0.05
    times = np.arange(600) / 30.0
    values = np.array([[one.at(time_s), one.at(time_s - late_s)] for time_s in times])
    spectrum = amplitudes(times, values, 0.05, 25)[np.array(LINES) - 1]
    phases = np.angle(spectrum[:, 1] / spectrum[:, 0])
    np.testing.assert_allclose(phases, -2.0 * np.pi * 0.05 * np.array(LINES) * late_s, atol=1e-9)


def lagging(corner_hz: float) -> ResponseRow:
    """Make a run whose hand answers with a first-order lag."""
    hz = np.geomspace(0.05, 4.0, 40)
    ratio = 1.0 / (1.0 + 1j * hz / corner_hz)
    answer = Answer(
        signal="hand",
        axis="sideways",
        hz=hz.tolist(),
        real=ratio.real.tolist(),
        imag=ratio.imag.tolist(),
        floor=0.0,
    )
    return ResponseRow(
        answers=[answer],
        images=1,
        joint_speed_share=0.1,
        joint_acceleration_share=0.1,
        limited_share=0.0,
    )


def test_a_first_order_lag_has_its_bandwidth_at_its_corner() -> None:
    bode = Bode.of([lagging(0.9), lagging(1.0), lagging(1.3)], "hand", "sideways")
    assert bode is not None
    band = bode.bandwidth_hz
    assert (band.low, band.middle, band.high) == pytest.approx((0.9, 1.0, 1.3), rel=0.01)
    assert bode.phase_at(1.0).middle == pytest.approx(-45.0, abs=3.0)
    assert bode.peak.high == pytest.approx(1.0, abs=0.01)
    assert Bode.of([lagging(1.0)], "gaze", "sideways") is None


def test_a_gain_leaves_its_bounds_where_it_first_crosses_one() -> None:
    hz = np.array([0.1, 0.2, 0.4, 0.8])
    rising = np.array([1.0, 1.0, 2.0, 0.1])
    assert leaving(hz, rising, (HALF_POWER, np.inf)) == pytest.approx(0.4, rel=0.3)
    crossing = leaving(hz, rising, (HALF_POWER, 1.0 / HALF_POWER))
    assert crossing == pytest.approx(0.2 * 2.0**0.5)
    assert leaving(hz, np.ones(4), (HALF_POWER, np.inf)) is None
    assert leaving(hz, np.full(4, 0.5), (HALF_POWER, np.inf)) == 0.1
