"""Describes a run for its summary, its page and its summary.json, which so say the same."""

from typing import Any

from servoid.servo import GoalTimes, LimitingKind, Reason, ServoMetrics, verdict_of
from servoid.sim.trial.servoing import ServoTrial
from servoid.words import counted, digits

_SPEEDS = {
    Reason.HAND_SPEED: "servo.hand.linear_speed or servo.hand.angular_speed",
    Reason.JOINT_SPEED: "the speeds of the arm's joints (world.arm.speed of an arm's file)",
}
_MOSTLY = 0.5  # share of the time from which on a limit of speed is no ordinary one


def trial_rows(trial: ServoTrial) -> dict[str, str]:
    """Return what was servoed with, as text by name: the world's errors, and the body."""
    looks, parts = len(trial.exploration.looks), len(trial.exploration.body)
    ideal = trial.settings.world.ideal
    return {
        "world": "ideal" if ideal else "with the errors of a laboratory, [world.lab]",
        "modelled": f"{counted(parts, 'ellipsoid')}, from {counted(looks, 'viewpoint')}",
    }


def trial_notes(trial: ServoTrial, metrics: ServoMetrics) -> tuple[str, ...]:
    """Return the notes on the path, the world, the looks, the body, the arm and the control."""
    notes = (*trial.notes, *trial.world.notes, *trial.exploration.all_notes)
    found = (_lag_note(trial), metrics.late_note(), _speed_note(trial, metrics.settle_s))
    return (*notes, *(note for note in found if note is not None))


def _speed_note(trial: ServoTrial, settle_s: float) -> str | None:
    """Return a note on a limit of speed that acted for most of a run, None if none did."""
    rows = [row for row in trial.log.rows if row.time_s - trial.log.start_s >= settle_s]
    for reason, key in _SPEEDS.items():
        acted = sum(reason in row.tick.command.limiting for row in rows)
        if rows and acted > _MOSTLY * len(rows):
            return (
                f"{reason.value} for {100 * acted // len(rows)} % of the time: the object is "
                f"faster than the arm may be, so raise {key}, or move it more slowly"
            )
    return None


def _lag_note(trial: ServoTrial) -> str | None:
    """Return a note on joints that were later than their bounds allow for, None if none were."""
    late_s = max((row.tick.command.late_s for row in trial.log.rows), default=0.0)
    if late_s == 0.0:
        return None
    allowed = digits(trial.settings.servo.joints.reaction_s)
    return (
        f"the joints followed their commands {late_s:.2f} s late, and servo.joints.reaction_s "
        f"allows for {allowed} s; they braked as much earlier once it was measured, so set "
        f"servo.joints.reaction_s = {late_s:.2f}"
    )


def trial_numbers(
    trial: ServoTrial, metrics: ServoMetrics, ending: str | None = None
) -> dict[str, Any]:
    """Return the verdict, the notes and the figures of a run, ready for JSON.

    `ending` says why the run is not finished.
    """
    verdict = verdict_of(trial.log, metrics, ending)
    times = GoalTimes.of(trial.log, metrics.settle_s)
    return {
        "verdict": verdict.word,
        "reasons": list(verdict.reasons),
        "notes": list(trial_notes(trial, metrics)),
        "world": "ideal" if trial.settings.world.ideal else "laboratory",
        "ellipsoids": len(trial.exploration.body),
        "viewpoints": len(trial.exploration.looks),
        "counted_s": times.whole_s,
        "limited_by": _by_name(times.reasons(LimitingKind.LIMITED)),
        "goal_in_doubt": _by_name(times.reasons(LimitingKind.DOUBTED)),
        "off_its_goal_s": times.by_kind[LimitingKind.AWAY],
        **metrics.numbers(),
    }


def _by_name(seconds: dict[Reason, float]) -> dict[str, float]:
    return {reason.name.lower(): times for reason, times in seconds.items()}
