"""Computes the figures of a servo run."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from servoid.pose import Floats, exact
from servoid.servo.accuracy import Accuracy, rms
from servoid.servo.keeping.safety import Reason
from servoid.servo.log import ServoLog
from servoid.words import finite


@dataclass(frozen=True)
class Hold:
    """An interval in which the hand was held, in seconds since servoing began, and why.

    `reasons` are in the order in which they occurred.
    """

    start_s: float
    end_s: float
    reasons: tuple[Reason, ...]

    @property
    def seconds(self) -> float:
        """Return the duration of the hold."""
        return self.end_s - self.start_s


@dataclass(frozen=True)
class Spread:
    """The median and the 99th percentile of some values; NaN where there are none."""

    p50: float
    p99: float

    @classmethod
    def of(cls, values: Floats) -> "Spread":
        """Compute the percentiles of values (N,)."""
        if not len(values):
            return cls(np.nan, np.nan)
        return cls(float(np.percentile(values, 50.0)), float(np.percentile(values, 99.0)))

    def numbers(self) -> dict[str, float | None]:
        """Return them by name, ready for JSON."""
        return {"p50": finite(self.p50), "p99": finite(self.p99)}

    def in_words(self) -> str:
        """Describe times in seconds as text, in milliseconds."""
        if np.isnan(self.p50):
            return "not known"
        median, most = (_in_words(1e3 * one, "ms") for one in (self.p50, self.p99))
        return f"median {median}, 99 % within {most}"


@dataclass(frozen=True)
class ServoMetrics:
    """The figures of a run; NaN where the log does not determine them.

    Errors are those after `settle_s` seconds of servoing; all other figures cover the whole run.
    `position_rms`, `position_95` (metres) and `turn_rms` (radians) are the repeatability: errors of
    the hand relative to where the body was modelled, without errors of the model. `accuracy` is
    that of the true object at its desired pose. `fixation_rms_px` is over all cameras.
    `tracked_share` is the share of the observations with the status `tracking`, and `located_share`
    that in which the object was located, with or without its rotation. `fastest_hand` is in m/s,
    `control_s` and `track_s` are wall-clock times, and `period_s` is the median control period.
    """

    settle_s: float
    position_rms: float
    position_95: float
    turn_rms: float
    fixation_rms_px: float
    tracked_share: float
    located_share: float
    observations: int
    holds: tuple[Hold, ...]
    control_s: Spread
    track_s: Spread
    fastest_hand: float
    accuracy: Accuracy
    period_s: float

    @classmethod
    def of(cls, log: ServoLog, settle_s: float) -> "ServoMetrics":
        """Compute the figures of a log."""
        errors = log.hand_errors[log.times >= settle_s]
        distances = exact.lengths(errors[:, :3])
        distances = distances[np.isfinite(distances)]
        off = [seen.off_px for time_s, seen in log.seen if time_s >= settle_s]
        estimates = [seen.estimate for _, seen in log.seen]
        tracked = [one is not None and one.status == "tracking" for one in estimates]
        located = [one is not None and one.located for one in estimates]
        ticks = [row.tick for row in log.rows]
        return cls(
            settle_s=settle_s,
            position_rms=rms(distances),
            position_95=float(np.percentile(distances, 95.0)) if len(distances) else np.nan,
            turn_rms=rms(exact.lengths(errors[:, 3:])),
            fixation_rms_px=rms(np.array([exact.norm(eye) for eyes in off for eye in eyes])),
            tracked_share=_share(tracked),
            located_share=_share(located),
            observations=len(tracked),
            holds=tuple(holds(log)),
            control_s=Spread.of(np.array([tick.control_s for tick in ticks])),
            track_s=Spread.of(np.array([one.track_s for one in ticks if one.estimate is not None])),
            fastest_hand=_fastest(log),
            accuracy=Accuracy.of(log, settle_s),
            period_s=float(np.median(log.periods_s)) if len(log) else np.nan,
        )

    @property
    def held_s(self) -> float:
        """Return the total time for which the hand was held."""
        return float(sum(hold.seconds for hold in self.holds))

    def numbers(self) -> dict[str, Any]:
        """Return the figures, ready for JSON; None where the log does not determine them."""
        return {
            "settle_s": self.settle_s,
            "repeatability": {
                "position_rms": finite(self.position_rms),
                "position_95": finite(self.position_95),
                "turn_rms": finite(self.turn_rms),
            },
            "accuracy": self.accuracy.numbers(),
            "fixation_rms_px": finite(self.fixation_rms_px),
            "tracked_share": finite(self.tracked_share),
            "located_share": finite(self.located_share),
            "observations": self.observations,
            "fastest_hand": finite(self.fastest_hand),
            "held_s": self.held_s,
            "holds": [
                {
                    "start_s": hold.start_s,
                    "end_s": hold.end_s,
                    "reasons": [reason.name.lower() for reason in hold.reasons],
                }
                for hold in self.holds
            ],
            "period_s": finite(self.period_s),
            "control_s": self.control_s.numbers(),
            "track_s": self.track_s.numbers(),
        }

    def figures(self) -> dict[str, str]:
        """Return the figures as text by name, in millimetres, degrees and milliseconds."""
        times = "once" if len(self.holds) == 1 else f"{len(self.holds)} times"
        tracked = _in_words(100.0 * self.tracked_share, "%")
        located = _in_words(100.0 * self.located_share, "%")
        return {
            "repeatability, RMS": self._both(self.position_rms, self.turn_rms),
            "repeatability, 95 %": _in_words(1e3 * self.position_95, "mm"),
            "accuracy, RMS": self._both(self.accuracy.position_rms, self.accuracy.turn_rms),
            "accuracy, 95 %": _in_words(1e3 * self.accuracy.position_95, "mm"),
            "accuracy, mean offset": _in_words(1e3 * self.accuracy.offset, "mm"),
            "true object in the hand, RMS": _in_words(1e3 * self.accuracy.object_rms, "mm"),
            "true surface in the hand, mean": _in_words(1e3 * self.accuracy.surface, "mm"),
            "believed middle off the true one, RMS": _in_words(
                1e3 * self.accuracy.middle_rms, "mm"
            ),
            "believed surface off the true one": _in_words(1e3 * self.accuracy.body, "mm"),
            "fixation error, RMS": _in_words(self.fixation_rms_px, "px"),
            "errors counted after": f"{self.settle_s:g} s",
            "fastest hand": _in_words(1e3 * self.fastest_hand, "mm/s"),
            "observations tracked": f"{tracked} of {self.observations}",
            "observations located": f"{located}, with or without the rotation",
            "hand held": f"{times}, {self.held_s:.2f} s" if self.holds else "never",
            "control tick": self.control_words(),
            "tracker": self.track_s.in_words(),
        }

    def control_words(self) -> str:
        """Describe how long control ticks take, and how long they may: one control period."""
        words = self.control_s.in_words()
        return f"{words}, of a period of {self._period_words()}" if self.period_s > 0.0 else words

    def late_note(self) -> str | None:
        """Return what ticks longer than their period mean; None if 99 % take no longer."""
        if not self.control_s.p99 > self.period_s > 0.0:
            return None
        return (
            f"more than 1 % of the control ticks took longer than the control period of "
            f"{self._period_words()}: in the simulation, which waits for them, nothing is late; on "
            "a robot the commands after them would be"
        )

    def _period_words(self) -> str:
        return f"{1e3 * self.period_s:.3g} ms"

    @staticmethod
    def _both(metres: float, radians: float) -> str:
        """Describe an error of position and rotation."""
        place, turn = _in_words(1e3 * metres, "mm"), _in_words(float(np.degrees(radians)), "deg")
        return place if np.isnan([metres, radians]).all() else f"{place}, {turn}"


def holds(log: ServoLog) -> list[Hold]:
    """List the holds of the hand; a hold lasts until the control period that ends it begins."""
    if not len(log):
        return []
    times = log.times
    ends = [*times[1:], times[-1] + log.periods_s[-1]]
    found: list[Hold] = []
    held = False
    for row, start_s, end_s in zip(log.rows, times.tolist(), ends, strict=True):
        reasons = row.tick.command.holding
        if reasons:
            before = found.pop() if held else Hold(start_s, start_s, ())
            new = sorted(reasons.difference(before.reasons), key=lambda reason: reason.value)
            found.append(Hold(before.start_s, float(end_s), (*before.reasons, *new)))
        held = bool(reasons)
    return found


def _share(which: list[bool]) -> float:
    return float(np.mean(which)) if which else np.nan


def _in_words(value: float, unit: str) -> str:
    if np.isnan(value):
        return "not known"
    digits = 0 if abs(value) >= 100.0 else 1 if abs(value) >= 10.0 or unit == "%" else 2
    return f"{value:.{digits}f} {unit}"


def _fastest(log: ServoLog) -> float:
    """Return the greatest speed of the hand between control periods."""
    places = np.array([row.world_from_hand.translation for row in log.rows])
    if len(places) < 2:
        return np.nan
    seconds = np.diff(log.times)
    later = seconds > 0.0  # without elapsed time there is no speed
    steps = exact.lengths(np.diff(places, axis=0))
    return float((steps[later] / seconds[later]).max()) if later.any() else np.nan
