import numpy as np
import pytest

pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

from servoid._native import change_between
from servoid.pose import Pose
from servoid.servo import Controller
from servoid.source import Source
from servoid_experiments.bode.late_sight import LateSensor, Sight
from servoid_experiments.bode.margin import (
    DELAYS_S,
    FIXED_EYES,
    PAPER,
    SERVOID,
    Loop,
    MarginCase,
    errors_after_step,
    is_stable,
    run_margin,
    start_arm,
)

OBJECT = Pose.from_parts([-1.43, -0.1, 0.6], [0.5, -0.5, -0.5, 0.5])
TURNING = np.array([0.2, -0.1, 0.0, 0.3, 0.0, 0.0, 0.1, 0.4, -0.3, 0.2])


def case(
    loop: Loop, latency_s: float = 0.04, rate_hz: float = 30.0, seeks: str = "delay"
) -> MarginCase:
    return MarginCase(loop=loop, latency_s=latency_s, rate_hz=rate_hz, seeks=seeks)


def stable(
    loop: Loop, latency_s: float, rate_hz: float, factor: float = 1.0, unknown_s: float = 0.0
) -> bool:
    return is_stable(errors_after_step(case(loop, latency_s, rate_hz), factor, unknown_s))


def seen(sight: Sight, seconds: float = 1.0) -> list[tuple[float, float, np.ndarray]]:
    """Turn joints, and list when each pose arrived, its stamp, and how far it is off."""
    arm = start_arm(SERVOID)
    sensor = LateSensor(arm, lambda _: OBJECT, sight, (1e-4, 1e-3))
    assert isinstance(sensor, Source)
    found = []
    while arm.time_s < seconds:
        instant = sensor.newest()
        if instant is not None:
            estimate = sensor.step(instant.time_s, instant.world_from_camera, instant.images)
            off = change_between(OBJECT, estimate.world_from_object)
            found.append((arm.time_s, instant.time_s, off))
        arm.command(TURNING)
    return found


def test_poses_come_at_the_rate_and_as_late_as_they_are_said_to() -> None:
    found = seen(Sight(rate_hz=20.0, latency_s=0.05, unknown_s=0.01))
    stamps = np.array([stamp for _, stamp, _ in found])
    np.testing.assert_allclose(stamps, 0.01 + np.arange(len(stamps)) / 20.0)
    late = np.array([arrived - stamp for arrived, stamp, _ in found])
    assert np.all((late > 0.05 - 1e-9) & (late < 0.05 + 0.008))


def test_with_right_stamps_a_resting_object_rests_while_arm_and_eyes_move() -> None:
    offs = [off for _, _, off in seen(Sight(rate_hz=50.0, latency_s=0.1))]
    assert np.abs(offs).max() < 2e-5  # joints are taken to turn evenly within a control period


def test_with_wrong_stamps_the_motion_of_the_arm_becomes_the_object_s() -> None:
    offs = [off for _, _, off in seen(Sight(rate_hz=50.0, latency_s=0.1, unknown_s=0.02))]
    assert np.linalg.norm(offs[-1][:3]) > 0.003


def test_errors_that_fade_are_stable_and_errors_that_grow_are_not() -> None:
    times = 0.008 * np.arange(500)
    for rate, fades in ((-0.3, True), (0.3, False), (3.0, False), (-5.0, True)):
        errors = 1e-5 * np.exp(rate * times) * np.cos(9.0 * times)
        assert is_stable(np.repeat(errors[:, None], 12, axis=1)) is fades


def critical_factor() -> float:
    """Return the factor on a gain of 4 per second at which a joint with a lag of 20 ms swings.

    Its speed is told every 8 ms: 4 a second of the error less a tenth of the speed.
    """

    def radius(gain: float) -> float:
        fade = np.exp(-0.008 / 0.02)
        law = np.array([-gain, -0.1])
        speed = law * (1.0 - fade) + [0.0, fade]
        place = [1.0, 0.0] + law * 0.008 + (np.array([0.0, 1.0]) - law) * 0.02 * (1.0 - fade)
        return float(np.abs(np.linalg.eigvals([place, speed])).max())

    gains = np.geomspace(4.0, 4000.0, 20000)
    return float(next(gain for gain in gains if radius(gain) > 1.0)) / 4.0


@pytest.mark.extended
@pytest.mark.parametrize(("latency_s", "rate_hz"), [(0.0, 120.0), (0.04, 30.0), (0.2, 10.0)])
def test_with_stamps_the_gain_is_bounded_by_the_joints_alone(
    latency_s: float, rate_hz: float
) -> None:
    critical = critical_factor()
    assert stable(SERVOID, latency_s, rate_hz, factor=0.95 * critical)
    assert not stable(SERVOID, latency_s, rate_hz, factor=1.05 * critical)


@pytest.mark.extended
def test_without_stamps_the_gain_is_bounded_by_the_latency() -> None:
    assert stable(PAPER, 0.0, 60.0, factor=8.0)
    assert not stable(PAPER, 0.12, 60.0, factor=8.0)
    assert stable(PAPER, 0.12, 60.0, factor=1.0)


@pytest.mark.extended
def test_eyes_that_follow_bear_less_delay_than_fixed_ones() -> None:
    # Less than a slower filter bears, 0.02 to 0.035 s: the quicker it is, the more it takes the
    # hand's own motion in wrong stamps for the object's.
    assert stable(SERVOID, 0.04, 30.0, unknown_s=0.016)
    assert not stable(SERVOID, 0.04, 30.0, unknown_s=0.02)
    assert stable(FIXED_EYES, 0.04, 30.0, unknown_s=0.025)


@pytest.mark.extended
def test_the_edge_that_is_found_parts_stable_from_unstable() -> None:
    row = run_margin(case(FIXED_EYES))
    assert row.edge is not None and DELAYS_S[0] < row.edge < DELAYS_S[1]
    assert stable(FIXED_EYES, 0.04, 30.0, unknown_s=row.edge / 1.05)
    assert not stable(FIXED_EYES, 0.04, 30.0, unknown_s=row.edge * 1.05)
    assert row.swings_hz == pytest.approx(3.1, abs=0.4)


def test_the_same_case_gives_the_same_errors() -> None:
    first, again = (errors_after_step(case(PAPER, 0.2, 10.0), 1.0, 0.05) for _ in range(2))
    np.testing.assert_array_equal(first, again)


def test_the_step_is_so_small_that_no_limit_is_near() -> None:
    arm = start_arm(SERVOID)
    controller = Controller(arm)
    command = controller.command(arm.state(), None)
    assert not command.velocities.any()
    errors = errors_after_step(case(SERVOID), 64.0, 0.0)
    assert np.abs(errors).max() * 64.0 * 4.0 < 2.0 * 0.008  # m/s² of the hand, over a period
