"""How far a loop is from swinging ever wider: by more gain, or by delay that nobody told it of."""

import math
from collections.abc import Callable
from typing import Annotated, cast

import msgspec
import numpy as np
from msgspec import Meta
from msgspec.structs import replace

from servoid.batch import Experiment
from servoid.pose import Pose
from servoid.servo import Command, Controller, GazeMode, ServoSettings, as_the_paper, servo
from servoid.servo.arm import Floats
from servoid.servo.law.gaze import fixation
from servoid.servo.law.moving import change_between, shifted_and_turned
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.sim.world import BEFORE_HAND, PhysicsSettings
from servoid.track import Follower
from servoid_experiments.bode.late_sight import LateSource, Reader, Sight

GOAL_FROM_OBJECT = Pose.from_parts(BEFORE_HAND, [1.0, 0.0, 0.0, 0.0])

GAINS = (0.5, 256.0)
"""The least and the greatest factor on the hand's gains that is tried."""

DELAYS_S = (0.005, 0.64)
"""The least and the greatest unknown delay that is tried."""

_STEP = 1e-6  # m: so small that no limit is reached, and jerks are the first
_METRES_A_RADIAN = 0.3  # that count as much
_REST_S = 1.2  # before the step, beyond the delay: the filter settles
_WATCHED_S = 4.2  # after it, in three parts of which the first passes unwatched
_GROWN = 100.0  # steps: an error beyond needs no waiting
_GONE, _GONE_S = 1e-2, 0.5  # steps, and for how long: a smaller error does not come back
_HALVINGS = 4  # of the octave in which stability ends
_PERIOD_S = PhysicsSettings().period_s
_SIGMA = (0.0002, 0.003)  # m and rad: what the tracker says of small images, in the other part
_JERKS = ("linear_jerk", "angular_jerk", "gliding_jerk", "rolling_jerk")
_NO_REST = 1e2  # m per root s: what would wander so far when it rests is taken for going


class Loop(msgspec.Struct, frozen=True, kw_only=True):
    """How the loop is closed; as it is set here, it is servoid's own.

    Without `stamped` a pose is taken for one of the time at which it arrives: the object for now as
    far before the hand as it was then. With `paper` it is the paper's law, by which each pose is
    taken as it is. Without `predicts` so it is by servoid's, and the object for at rest. Eyes that
    do not `eyes_follow` are fixed.
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
# Without images nothing is gained by eyes that follow, which without stamps would be where they are
# now, not where they were: the object is before the hand as it was seen before the hand.
PAPER = Loop(stamped=False, paper=True, feed_forward=False, predicts=False, eyes_follow=False)


class MarginCase(msgspec.Struct, frozen=True, kw_only=True):
    """A loop whose poses arrive `latency_s` late, `rate_hz` a second.

    `seeks` is what is driven up until the loop is no longer stable: "gain", the factor on the
    hand's gains of position and turn, or "delay", by which poses arrive later than their time
    stamps, or the loop, know of.
    """

    loop: Loop
    latency_s: Annotated[float, Meta(description="from the exposure to the arrival of a pose, s")]
    rate_hz: Annotated[float, Meta(description="poses each second")]
    seeks: Annotated[str, Meta(description="gain, a factor, or delay, in s")]


class MarginRow(msgspec.Struct, frozen=True, kw_only=True):
    """Where stability ends: a factor, or seconds.

    None if the loop is stable at the greatest that was tried, 0 if it is not at the least.
    `swings_hz` is how fast it swings there, if it was found.
    """

    edge: Annotated[
        float | None, Meta(description="where stability ends, a factor or s; null if nowhere")
    ]
    swings_hz: Annotated[float | None, Meta(description="frequency of the swing there, Hz")]


def run_margin(case: MarginCase) -> MarginRow:
    """Double what is sought until the loop is no longer stable, then halve the last octave.

    A loop is stable if the error after a small step is smaller, as a root mean square, in the last
    third of the time that it is watched than in the third before.
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
    """Return the octave at which stability first ends, None if none, -1 if before 0."""
    first = next((octave for octave in range(octaves + 1) if not stable(octave)), None)
    if first is None or first == 0:
        return None if first is None else -1.0
    below, above = first - 1.0, float(first)
    for _ in range(_HALVINGS):
        middle = 0.5 * (below + above)
        below, above = (middle, above) if stable(middle) else (below, middle)
    return 0.5 * (below + above)


def is_stable(errors: Floats) -> bool:
    """Return whether errors (T, C) after a step fade."""
    if np.abs(errors[-1]).max() > _GROWN * _STEP:
        return False
    gone = round(_GONE_S / _PERIOD_S)
    if np.abs(errors[-gone:]).max() < _GONE * _STEP:
        return True
    _, before, after = (np.square(part).mean() for part in np.array_split(errors, 3))
    return bool(after < before)


def loop_settings(loop: Loop, factor: float, oldest_s: float) -> ServoSettings:
    """Return how a loop servos, with gains by a factor, where poses are at most so old."""
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
        # So small a step is taken for rest, or for smooth motion; what follows quick motion is the
        # quickest filter, and bears least.
        quick = {"gliding_jerk": target.linear_jerk, "gliding_s": target.going_s}
        target = replace(target, linear_rest=_NO_REST, angular_rest=_NO_REST, **quick)
    if not (loop.predicts or loop.paper):
        believing = as_the_paper(settings).target
        jerks = {key: getattr(believing, key) for key in _JERKS}
        target = replace(target, horizon_s=0.0, **jerks)
    # A hand that is held for old images says nothing of stability.
    safety = replace(settings.safety, coast_s=max(settings.safety.coast_s, oldest_s))
    return replace(settings, hand=hand, gaze=gaze, target=target, safety=safety)


def errors_after_step(case: MarginCase, factor: float, unknown_s: float) -> Floats:
    """Return errors (T, 12) after a step of the object, in m: of the hand, and of what is believed.

    They end early where they have grown a hundredfold, or are gone.
    """
    arm = start_arm(case.loop)
    home = arm.world_from_hand(arm.state().positions) @ GOAL_FROM_OBJECT
    beside = shifted_and_turned(home, np.repeat([_STEP, _STEP / _METRES_A_RADIAN], 3))
    known_s = case.latency_s if case.loop.stamped else 0.0
    sight = Sight(case.rate_hz, known_s, case.latency_s - known_s + unknown_s)
    steps_s = _REST_S + sight.delay_s
    source = LateSource(arm, lambda time_s: home if time_s < steps_s else beside, sight)
    oldest_s = sight.delay_s + 3.0 / case.rate_hz
    controller = Controller(arm, loop_settings(case.loop, factor, oldest_s))
    gone = round(_GONE_S / _PERIOD_S)
    errors: list[Floats] = []
    # Only the core makes estimates of its own type; what reads them asks for no more than this.
    tracker = cast(Follower, Reader(*_SIGMA))
    for tick in servo(arm, source, tracker, controller, lambda _: GOAL_FROM_OBJECT):
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
    """Return how far hand and belief are off (12,), in metres."""
    believed = command.world_from_object or world_from_object
    places = (world_from_hand @ GOAL_FROM_OBJECT, believed)
    off = [change_between(world_from_object, place) for place in places]
    return np.concatenate(off) * np.tile(np.repeat([1.0, _METRES_A_RADIAN], 3), 2)


def start_arm(loop: Loop) -> SerialArm:
    """Return an arm whose hand is at its goal, and whose eyes are where they are wanted."""
    arm = SerialArm(read_arm(), _PERIOD_S)
    eyes, positions = arm.eyes, arm.state().positions
    if loop.eyes_follow and eyes is not None:
        place = np.array(GOAL_FROM_OBJECT.translation)
        gaze = fixation(eyes.half_baseline, place, np.zeros(3))
        positions[[eyes.tilt, eyes.pan_left, eyes.pan_right]] = gaze.angles
    return SerialArm(read_arm(), _PERIOD_S, positions.tolist())


def _swings_hz(errors: Floats) -> float | None:
    """Return the frequency at which errors (T, C) swing most, None if they ended early."""
    late = errors[len(errors) // 3 :]
    if len(late) * _PERIOD_S < 0.5 * _WATCHED_S:
        return None
    waves = (late - late.mean(axis=0)) * np.hanning(len(late))[:, None]
    longer = 8 * len(late)  # finer steps of frequency
    power = np.square(np.abs(np.fft.rfft(waves, longer, axis=0))).sum(axis=1)
    return float(np.argmax(power) / (longer * _PERIOD_S))
