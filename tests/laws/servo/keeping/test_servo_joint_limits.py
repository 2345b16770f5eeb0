"""Laws of what joints may be told: their limits hold for any states, bounds and setpoints."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from servoid.pose.exact import Floats
from servoid.servo import Joints, JointState
from servoid.servo.keeping.limits import JointLimits
from servoid.servo.settings import JointSettings

COUNT = 8


def drawn(seed: int) -> tuple[Joints, JointSettings, float]:
    """Draw joints with any bounds, how they are driven, and a control period."""
    random = np.random.default_rng(seed)
    middle, half = random.uniform(-1, 1, COUNT), random.uniform(0.3, 3.0, COUNT)
    speed = random.uniform(0.5, 6.0, COUNT)
    acceleration = speed / random.uniform(0.1, 0.5, COUNT)
    joints = Joints(
        names=tuple(f"j{number}" for number in range(COUNT)),
        hand_count=5,
        lower=middle - half,
        upper=middle + half,
        speed=speed,
        acceleration=acceleration,
        jerk=acceleration / random.uniform(0.01, 0.1, COUNT) if random.random() < 0.5 else None,
    )
    asked = JointSettings(ramp_s=float(random.uniform(0.01, 0.1)))
    return joints, asked, float(random.choice([0.001, 0.002, 0.008, 0.016]))


def jerk_of(joints: Joints, asked: JointSettings) -> Floats:
    gentle = asked.acceleration_share * joints.acceleration / asked.ramp_s
    return gentle if joints.jerk is None else np.minimum(joints.jerk, gentle)


def check_limits(seed: int, lag_s: float, ticks: int = 600) -> None:
    joints, asked, period_s = drawn(seed)
    limits = JointLimits(joints, asked, period_s)
    random = np.random.default_rng([seed, 1])
    jerk = jerk_of(joints, asked)
    place = random.uniform(joints.lower + 0.05, joints.upper - 0.05)
    commanded, change, goes = np.zeros(COUNT), np.zeros(COUNT), np.zeros(COUNT)
    faded = np.exp(-period_s / lag_s) if lag_s else 0.0
    for tick in range(ticks):
        if tick % 40 == 0:
            wanted = random.choice([-1.5, -0.1, 0.0, 0.1, 1.5], COUNT) * joints.speed
        window = limits.window(JointState(0.0, place, goes), commanded, change)
        assert np.all(window.lower <= window.upper)
        last, before = commanded, change
        commanded = window.bounded(wanted)
        change = (commanded - last) / period_s
        slack = 1.0 + 1e-9
        assert np.all(np.abs(commanded) <= asked.speed_share * joints.speed * slack)
        assert np.all(
            np.abs(change) <= asked.acceleration_share * joints.acceleration * slack + 1e-9
        )
        assert np.all(np.abs(change - before) <= jerk * period_s * slack + 1e-9)
        # The joint's speed follows its command with a lag of the first order.
        after = commanded + (goes - commanded) * faded
        place = place + period_s * commanded - lag_s * (after - goes)
        goes = after
        assert np.all((place >= joints.lower) & (place <= joints.upper))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("lag_s", [0.0, 0.02])
def test_no_joint_overruns_any_of_its_limits(seed: int, lag_s: float) -> None:
    check_limits(seed, lag_s)


@pytest.mark.extended
@settings(max_examples=40, deadline=None)
@given(seed=st.integers(100, 1_000_000), lag_s=st.sampled_from([0.0, 0.01, 0.02]))
def test_no_joint_overruns_any_of_its_limits_whatever_is_drawn(seed: int, lag_s: float) -> None:
    check_limits(seed, lag_s, ticks=800)


@pytest.mark.parametrize("seed", range(6))
def test_joints_that_brake_come_to_rest_together_within_their_limits(seed: int) -> None:
    joints, asked, period_s = drawn(seed)
    limits = JointLimits(joints, asked, period_s)
    random = np.random.default_rng([seed, 2])
    jerk = jerk_of(joints, asked)
    commanded = random.uniform(-0.9, 0.9, COUNT) * joints.speed
    change, first, ends = np.zeros(COUNT), commanded, {}
    for tick in range(3000):
        last, before = commanded, change
        commanded = limits.blindly_braked(commanded, change, 1.0)
        change = (commanded - last) / period_s
        assert np.all(np.abs(change) <= joints.acceleration)
        assert np.all(np.abs(change - before) <= jerk * period_s * (1.0 + 1e-9) + 1e-9)
        for part in (slice(0, 5), slice(5, None)):
            along = commanded[part] * first[part.start]
            np.testing.assert_allclose(along, first[part] * commanded[part.start], atol=1e-9)
            if not commanded[part].any():
                ends.setdefault(part.start, tick)
        if not commanded.any() and not change.any():
            break
    slowest = (np.abs(first) / joints.acceleration).max() + 2.0 * asked.ramp_s
    assert not commanded.any() and max(ends.values()) * period_s < 2.0 * slowest + 0.2


def test_eyes_that_turn_fast_do_not_keep_the_hand_from_braking() -> None:
    joints, asked, period_s = drawn(0)
    limits = JointLimits(joints, asked, period_s)
    slow_eyes, fast_eyes = np.full(COUNT, 0.1), np.full(COUNT, 0.1)
    fast_eyes[5:] = 3.0
    braked = [limits.braked(one, np.zeros(COUNT))[:5] for one in (fast_eyes, slow_eyes)]
    np.testing.assert_array_equal(*braked)
