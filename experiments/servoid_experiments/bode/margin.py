"""Stability margins of a loop: by additional gain, or by additional delay without a timestamp."""

import math
from collections.abc import Callable
from typing import Annotated, cast

import msgspec
import numpy as np
from msgspec.structs import replace

from servoid._native import change_between, shifted_and_turned
from servoid.batch import Experiment
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.servo import Command, Controller, GazeMode, ServoSettings, as_the_paper, servo
from servoid.servo.law.gaze import fixation
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.sim.world import BEFORE_HAND, PhysicsSettings
from servoid.track import Follower
from servoid_experiments.bode.late_sight import LateSensor, Sight
from servoid_experiments.design import about

GOAL_FROM_OBJECT = Pose.from_parts(BEFORE_HAND, [1.0, 0.0, 0.0, 0.0])

GAINS = (0.5, 256.0)
"""The smallest and largest factor on the hand's gains that is tried."""

DELAYS_S = (0.005, 0.64)
"""The smallest and largest unknown delay that is tried."""

_STEP = 1e-6  # m: so small that no limit is reached; limits of jerk would be the first
_METRES_A_RADIAN = 0.3  # that count as much as a radian
_REST_S = 1.2  # before the step, beyond the delay: the filter settles
_WATCHED_S = 4.2  # after it, in three parts, of which the first is ignored
_GROWN = 100.0  # steps: a larger error ends the run early
_GONE, _GONE_S = 1e-2, 0.5  # steps, and for how long: a smaller error has decayed
_HALVINGS = 4  # bisections of the octave in which stability ends
_PERIOD_S = PhysicsSettings().period_s
_SIGMAS = (0.0002, 0.003)  # m and rad: as the tracker reports for small images, in the other part
_JERKS = ("linear_jerk", "angular_jerk", "gliding_jerk", "rolling_jerk")
_NO_REST = 1e2  # m per root s: so large that the target always counts as moving


class Loop(msgspec.Struct, frozen=True, kw_only=True):
    """How the loop is closed; the defaults are servoid's own.

    Without `stamped`, a pose is used as one of its arrival time: the object is assumed to be
    relative to the hand now as it was when the image was taken. With `paper`, the control law is
    the paper's, which uses each pose as it is. Without `predicts`, servoid's law does so too, and
    assumes a static object. Without `eyes_follow`, the eyes are fixed.
    """

    stamped: bool = True
    paper: bool = False
    feed_forward: bool = True
    predicts: bool = True
    eyes_follow: bool = True


SERVOID = Loop()
FIXED_EYES = Loop(eyes_follow=False)
NO_FEED_FORWARD = Loop(feed_forward=False)
NO_PREDICTION = Loop(feed_forward=False, predicts=False)
# Without images, eyes that follow have no benefit. Without timestamps, their current pose would be
# used instead of that at the exposure: the object is relative to the hand as it was seen.
PAPER = Loop(stamped=False, paper=True, feed_forward=False, predicts=False, eyes_follow=False)


class MarginCase(msgspec.Struct, frozen=True, kw_only=True):
    """A loop with poses of `latency_s` at `rate_hz`.

    `seeks` is what is increased until the loop is no longer stable: "gain", the factor on the
    hand's gains of position and rotation, or "delay", by which poses arrive later than their
    timestamps, or the loop, account for.
    """

    loop: Loop
    latency_s: Annotated[float, about("from the exposure to the arrival of a pose, s")]
    rate_hz: Annotated[float, about("poses each second")]
    seeks: Annotated[str, about("gain, a factor, or delay, in s")]


class MarginRow(msgspec.Struct, frozen=True, kw_only=True):
    """Where stability ends: a factor, or seconds.

    None if the loop is stable at the largest value tried, 0 if it is unstable at the smallest.
    `swings_hz` is the frequency of the oscillation there, if it was found.
    """

    edge: Annotated[float | None, about("where stability ends, a factor or s; null if nowhere")]
    swings_hz: Annotated[float | None, about("frequency of the swing there, Hz")]


def run_margin(case: MarginCase) -> MarginRow:
    """Double the sought value until the loop is no longer stable, then bisect the last octave.

    A loop is stable if the RMS error after a small step is smaller in the last third of the
    observed time than in the third before.
    """

    def errors_at(octave: float) -> Floats:
        value = least * 2.0**octave
        return (
            errors_after_step(case, 1.0, value)
            if case.seeks == "delay"
            else errors_after_step(case, value, 0.0)
        )

    least, most = DELAYS_S if case.seeks == "delay" else GAINS
    edge = _edge(lambda octave: is_stable(errors_at(octave)), round(math.log2(most / least)))
    if edge is None or edge < 0.0:
        return MarginRow(edge=None if edge is None else 0.0, swings_hz=None)
    return MarginRow(edge=least * 2.0**edge, swings_hz=_swings_hz(errors_at(edge)))


MARGIN = Experiment("bode.margin", run_margin, MarginCase, MarginRow)


def _edge(stable: Callable[[float], bool], octaves: int) -> float | None:
    """Return the octave at which stability first ends, None if nowhere, -1 if before 0."""
    first = next((octave for octave in range(octaves + 1) if not stable(octave)), None)
    if first is None or first == 0:
        return None if first is None else -1.0
    below, above = first - 1.0, float(first)
    for _ in range(_HALVINGS):
        middle = 0.5 * (below + above)
        below, above = (middle, above) if stable(middle) else (below, middle)
    return 0.5 * (below + above)


def is_stable(errors: Floats) -> bool:
    """Return whether errors (T, C) after a step decay."""
    if np.abs(errors[-1]).max() > _GROWN * _STEP:
        return False
    gone = round(_GONE_S / _PERIOD_S)
    if np.abs(errors[-gone:]).max() < _GONE * _STEP:
        return True
    _, before, after = (np.square(part).mean() for part in np.array_split(errors, 3))
    return bool(after < before)


def loop_settings(loop: Loop, factor: float, oldest_s: float) -> ServoSettings:
    """Return the servo settings of a loop, with scaled gains, for poses of a maximum age."""
    settings = as_the_paper(ServoSettings()) if loop.paper else ServoSettings()
    hand, gaze, target = settings.hand, settings.gaze, settings.target
    hand = replace(
        hand,
        position_gain=factor * hand.position_gain,
        turn_gain=factor * hand.turn_gain,
        feed_forward=loop.feed_forward,
    )
    gaze = replace(
        gaze,
        feed_forward=loop.feed_forward,
        mode=GazeMode.FIXATE if loop.eyes_follow else GazeMode.PARALLEL,
    )
    if not loop.paper:
        # So small a step is taken for a static target, or for smooth motion; the fastest filter is
        # that for fast motion, which has the smallest margins.
        quick = {"gliding_jerk": target.linear_jerk, "gliding_s": target.going_s}
        target = replace(target, linear_rest=_NO_REST, angular_rest=_NO_REST, **quick)
    if not (loop.predicts or loop.paper):
        believing = as_the_paper(settings).target
        jerks = {key: getattr(believing, key) for key in _JERKS}
        target = replace(target, horizon_s=0.0, **jerks)
    # A hand that is held because of old images would not test stability.
    safety = replace(settings.safety, coast_s=max(settings.safety.coast_s, oldest_s))
    return replace(settings, hand=hand, gaze=gaze, target=target, safety=safety)


def errors_after_step(case: MarginCase, factor: float, unknown_s: float) -> Floats:
    """Return errors (T, 12) after a step of the object, in m: of the hand, and of the estimate.

    They end early once they have grown a hundredfold or have decayed.
    """
    arm = start_arm(case.loop)
    home = arm.world_from_hand(arm.state().positions) @ GOAL_FROM_OBJECT
    beside = shifted_and_turned(home, np.repeat([_STEP, _STEP / _METRES_A_RADIAN], 3))
    known_s = case.latency_s if case.loop.stamped else 0.0
    sight = Sight(case.rate_hz, known_s, case.latency_s - known_s + unknown_s)
    steps_s = _REST_S + sight.delay_s
    sensor = LateSensor(arm, lambda time_s: home if time_s < steps_s else beside, sight, _SIGMAS)
    oldest_s = sight.delay_s + 3.0 / case.rate_hz
    controller = Controller(arm, loop_settings(case.loop, factor, oldest_s))
    gone = round(_GONE_S / _PERIOD_S)
    errors: list[Floats] = []
    # Only the core makes estimates of its own type; servoing uses only these fields.
    tracker = cast(Follower, sensor)
    for tick in servo(arm, sensor, tracker, controller, lambda _: GOAL_FROM_OBJECT):
        since = tick.state.time_s - steps_s
        if since < 0.0:
            continue
        hand = arm.world_from_hand(tick.state.positions)
        errors.append(_error(hand, tick.command, beside))
        recent = np.abs(errors[-gone:]).max()
        done = recent > _GROWN * _STEP or (len(errors) >= gone and recent < _GONE * _STEP)
        if done or since >= _WATCHED_S:
            break
    return np.array(errors)


def _error(world_from_hand: Pose, command: Command, world_from_object: Pose) -> Floats:
    """Return the errors of hand and estimate (12,), in metres."""
    believed = command.world_from_object or world_from_object
    places = (world_from_hand @ GOAL_FROM_OBJECT, believed)
    off = [change_between(world_from_object, place) for place in places]
    return np.concatenate(off) * np.tile(np.repeat([1.0, _METRES_A_RADIAN], 3), 2)


def start_arm(loop: Loop) -> SerialArm:
    """Return an arm whose hand is at its goal, and whose eyes point at theirs."""
    arm = SerialArm(read_arm(), _PERIOD_S)
    eyes, positions = arm.eyes, arm.state().positions
    if loop.eyes_follow and eyes is not None:
        place = np.array(GOAL_FROM_OBJECT.translation)
        gaze = fixation(eyes.half_baseline, place, np.zeros(3))
        positions[[eyes.tilt, eyes.pan_left, eyes.pan_right]] = gaze.angles
    return SerialArm(read_arm(), _PERIOD_S, positions.tolist())


def _swings_hz(errors: Floats) -> float | None:
    """Return the main frequency of oscillation in errors (T, C), None if they ended early."""
    late = errors[len(errors) // 3 :]
    if len(late) * _PERIOD_S < 0.5 * _WATCHED_S:
        return None
    waves = (late - late.mean(axis=0)) * np.hanning(len(late))[:, None]
    longer = 8 * len(late)  # zero padding for a finer frequency resolution
    power = np.square(np.abs(np.fft.rfft(waves, longer, axis=0))).sum(axis=1)
    return float(np.argmax(power) / (longer * _PERIOD_S))
