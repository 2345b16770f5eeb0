"""The summary of a servo run, at most 80 columns wide except for paths."""

import math
from collections.abc import Mapping
from pathlib import Path

import typer

from servoid.cli.rows import wrapped
from servoid.servo import (
    GoalTimes,
    Reason,
    ServoLog,
    ServoMetrics,
    verdict_of,
    why_errors_unknown,
)
from servoid.sim.trial import ServoTrial, trial_notes, trial_rows

_LABEL_WIDTH = 15
_VALUE_WIDTH = 80 - len("  ") - _LABEL_WIDTH - len(" ")


def print_servo_summary(
    trial: ServoTrial, metrics: ServoMetrics, files: Mapping[str, Path], ending: str | None = None
) -> None:
    """Print how well the arm followed, and where the files are.

    `ending` says why the run is not finished.
    """
    world = trial.settings.world
    times = GoalTimes.of(trial.log, metrics.settle_s)
    typer.echo(f"Servoed {world.arm.name} to {world.object.name}, {world.object.path}")
    rows = {
        "verdict": verdict_of(trial.log, metrics, ending).words,
        **trial_rows(trial),
        **_unreached(times),
        **_errors(trial.log, metrics),
        "tracked": f"{100.0 * metrics.tracked_share:.1f} % of {metrics.observations} observations",
        **_located(metrics),
        "held": _held(metrics),
        **dict(times.rows()),
        "control tick": metrics.control_words(),
        "tracker": metrics.track_s.in_words(),
    }
    for label, value in rows.items():
        _print(label, value)
    for note in trial_notes(trial, metrics):
        _print("note", note)
    for kind, path in files.items():
        typer.echo(f"  {kind:<{_LABEL_WIDTH}} {path}")


def _errors(log: ServoLog, metrics: ServoMetrics) -> dict[str, str]:
    if why_errors_unknown(log, metrics.settle_s) is not None:  # which the verdict names
        return dict.fromkeys(("repeatability", "accuracy"), "not known")
    true = metrics.accuracy
    return {
        "repeatability": _error(metrics.position_rms, metrics.position_95, metrics.turn_rms)
        + f", after {metrics.settle_s:g} s",
        "accuracy": _error(true.position_rms, true.position_95, true.turn_rms)
        + f"; mean offset {_mm(true.offset)} mm",
        "true object": f"middle {_mm(true.object_rms)} mm RMS off its desired position in the "
        f"hand, surface {_mm(true.surface)} mm",
        "believed": f"middle {_mm(true.middle_rms)} mm RMS off the true one, surface "
        f"{_mm(true.body)} mm",
        "fixation error": _fixation(metrics.fixation_rms_px),
    }


def _fixation(off_px: float) -> str:
    return (
        "not known: no observation after that time"
        if math.isnan(off_px)
        else f"{off_px:.2f} px RMS"
    )


def _located(metrics: ServoMetrics) -> dict[str, str]:
    """Report how often the object was located, where that was more often than it was tracked."""
    if not metrics.located_share > metrics.tracked_share:
        return {}
    return {"located": f"{100.0 * metrics.located_share:.1f} %, with or without the rotation"}


def _error(rms: float, most: float, turn: float) -> str:
    return f"{_mm(rms)} mm RMS, {_mm(most)} mm at 95 %, {_deg(turn)} degrees RMS"


def _print(label: str, words: str) -> None:
    for name, line in wrapped(label, words, _VALUE_WIDTH):
        typer.echo(f"  {name:<{_LABEL_WIDTH}} {line}")


def _held(metrics: ServoMetrics) -> str:
    if not metrics.holds:
        return "never"
    reasons = {reason.value for hold in metrics.holds for reason in hold.reasons}
    times = "once" if len(metrics.holds) == 1 else f"{len(metrics.holds)} times"
    return f"{times}, {metrics.held_s:.2f} s in all: {'; '.join(sorted(reasons))}"


def _unreached(times: GoalTimes) -> dict[str, str]:
    """Describe a goal that the arm did not reach, before all errors, which follow from it."""
    limit = times.main_limit()
    if limit is None or limit[0] is not Reason.UNREACHABLE:
        return {}
    return {"not reached": f"{limit[0].value}, for {times.in_words(limit[1])}"}


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.2f}"


def _deg(radians: float) -> str:
    return f"{math.degrees(radians):.2f}"
