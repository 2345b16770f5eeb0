"""One servo run to an unknown object: explores, models and follows it."""

import math
import tempfile
from collections.abc import Sequence
from typing import Annotated

import msgspec
import numpy as np

from servoid.batch import Experiment
from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.sim.trial.servoing import ServoTrial, run_servo_trial
from servoid.sim.trial.settings import RunSettings, TrackingSettings, TrialSettings
from servoid.sim.world import CameraSettings, ObjectSettings, WorldSettings
from servoid_experiments.design import about
from servoid_experiments.paper.servoing.followed import Followed, Track, followed
from servoid_experiments.paper.servoing.settings import Omega, Periods, Settle


class UnknownCase(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A run with servoid's own method on the paper's path, from the paper's start."""

    object: str
    seed: int
    ellipsoids: Annotated[int, about("at most, of the object's body", ge=1)]
    surface: Annotated[bool, about("track by the look of the surface, too")]
    omega: Omega
    amplitude: Annotated[float, about("half of the object's way, m", gt=0)]
    settle_s: Settle
    periods: Periods
    size_px: tuple[int, int]
    background: str


class UnknownRow(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The results of a run.

    `ellipsoids` is the count of the body that was modelled from `looks` observations.
    `hand_turn_deg` and `seen_turn_deg` are the RMS rotation errors of hand and recognition. The
    truth is the body's pose when it was modelled, moved along with the object.
    """

    ellipsoids: int
    looks: int
    followed: Followed
    hand_turn_deg: float
    seen_turn_deg: float
    held_share: float


def run_unknown(case: UnknownCase) -> UnknownRow:
    """Explore, model and follow an object, and measure the run.

    Raises:
        ServoidError: the object cannot be modelled or found.

    """
    with tempfile.TemporaryDirectory() as folder:
        return _row(case, run_servo_trial(_settings(case), folder))


def _settings(case: UnknownCase) -> TrialSettings:
    period_s = 2.0 * math.pi / case.omega
    return TrialSettings(
        run=RunSettings(
            seconds=case.settle_s + case.periods * period_s, max_ellipsoids=case.ellipsoids
        ),
        world=WorldSettings(
            ideal=True,
            object=ObjectSettings(name=case.object, path=f"sine:{case.amplitude!r}@{period_s!r}s"),
            cameras=CameraSettings(size_px=case.size_px, samples=1, moments=1),
            background=case.background,
            seed=case.seed,
            threads=1,
        ),
        track=TrackingSettings(seed=case.seed, surface=None if case.surface else False),
    )


def _row(case: UnknownCase, trial: ServoTrial) -> UnknownRow:
    """Measure a run."""
    log = trial.log
    seen = [
        (time_s, one.truth, one.estimate.world_from_object)
        for time_s, one in log.seen
        if one.truth is not None and one.estimate is not None and time_s >= 0.0
    ]
    times = np.array([time_s for time_s, *_ in seen])
    turns = [
        np.degrees(np.linalg.norm((truth.inverse() @ found).log()[3:]))
        for time_s, truth, found in seen
        if time_s >= case.settle_s
    ]
    hand_turns = np.degrees(np.linalg.norm(log.hand_errors[log.times >= case.settle_s, 3:], axis=1))
    return UnknownRow(
        ellipsoids=len(trial.exploration.body),
        looks=len(trial.exploration.looks),
        followed=followed(
            _track(trial, times, [pair for _, *pair in seen]),
            case.omega,
            case.settle_s,
            case.periods,
        ),
        hand_turn_deg=float(np.sqrt(np.mean(hand_turns**2))),
        seen_turn_deg=float(np.sqrt(np.mean(np.square(turns)))),
        held_share=float(np.mean([bool(row.tick.command.holding) for row in log.rows])),
    )


def _track(trial: ServoTrial, times: Floats, pairs: Sequence[Sequence[Pose]]) -> Track:
    """Return the truth and the estimate, a pair per time (N,), and the hand, from the start."""
    log, world = trial.log, trial.world
    start_from_world = world.world_from_object_at(log.start_s).inverse().matrix()[:3, :3]
    target, found = (
        np.array([pair[place].translation for pair in pairs]) @ start_from_world.T
        for place in (0, 1)
    )
    off = [
        np.subtract(row.world_from_hand.translation, row.world_from_goal.translation)
        for row in log.rows
        if row.world_from_goal is not None
    ]
    off = np.array(off) @ start_from_world.T
    error = np.stack([np.interp(times, log.times, column) for column in off.T], axis=1)
    first = target[0]
    return Track(
        times=times, target=target - first, seen=found - first, hand=target - first + error
    )


UNKNOWN = Experiment("servoing_unknown", run_unknown, UnknownCase, UnknownRow)
