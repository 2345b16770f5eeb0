"""Computes the figures and sentences of the report of a track."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.track import History, Tracked, TrackResult
from servoid.view.track.growth_picture import NAMED_SIDES, solids_of
from servoid.view.track.sides import Sides, sides_of
from servoid.view.track.timeline_plot import notice_times
from servoid.view.track.turning import Cause, Turning, turning_of
from servoid.words import counted, finite, four_digits, joined

_MOST_GAPS = 4
_LEAST_DEG = 0.05  # below which an angle would be rounded to 0
_MS_PER_S = 1e3
_NEVER = "The rotation was never corrected"


@dataclass(frozen=True, eq=False)
class TrackFigures:
    """The figures of a track and its history."""

    result: TrackResult
    history: History

    @cached_property
    def sides(self) -> Sides:
        """Return the directions from which the object was seen."""
        return sides_of(self.result.tracked, self.history)

    @cached_property
    def turning(self) -> Turning:
        """Return the object's rotation relative to the first camera."""
        return turning_of(self.result.tracked, self.history.world_from_camera)

    @cached_property
    def is_tracked(self) -> NDArray[np.bool_]:
        """Return for each observation whether the images confirm the pose, (N,)."""
        return np.array([one.is_tracked for one in self.result.tracked], dtype=np.bool_)

    @cached_property
    def sides_seen(self) -> dict[str, float | None]:
        """Return when each of the six named sides was first seen, in seconds; None if never."""
        when = self.sides.first_seen(np.stack(list(NAMED_SIDES.values())))
        return {name: finite(time_s) for name, time_s in zip(NAMED_SIDES, when, strict=True)}

    def summary(self) -> dict[str, Any]:
        """Return the figures of the report, ready for JSON: SI units, and radians."""
        result, turning = self.result, self.turning
        return {
            "object": result.name,
            "verdict": result.verdict,
            "reasons": result.reasons,
            "doubts": list(self._doubts()),
            "notes": [note for note in result.notes if note not in result.doubts],
            "observations": len(result),
            "tracked": result.tracked_count,
            "tracked_share": result.tracked_share,
            "gaps": [
                {"first_s": gap.first_s, "last_s": gap.last_s, "count": gap.count}
                for gap in result.gaps
            ],
            "turned_rad": float(turning.turned[-1]),
            "sides_seen_share": self.sides.share,
            "sides_first_seen_s": self.sides_seen,
            "corrections": [
                {
                    "observation": result.tracked[one.place].index,
                    "time_s": one.time_s,
                    "cause": one.cause.value,
                    "angle_rad": one.angle,
                }
                for one in turning.corrections
            ],
            "ellipsoids": len(result.body),
            "evolutions": result.evolutions,
            "starting_s": result.starting_s,
            "starting_iou": result.overlap,
            "step_s": {
                "median": finite(result.step_percentile(50.0)),
                "p95": finite(result.step_percentile(95.0)),
                "p99": finite(result.step_percentile(99.0)),
                "stages": result.stage_seconds,
            },
            "notices": [{"notice": words, "count": count} for words, count in result.notices],
            "steps": [self._step(place, one) for place, one in enumerate(result.tracked)],
        }

    def verdict(self) -> Iterator[str]:
        """Yield sentences: whether the tracking is good and why not, and what the body shows."""
        result = self.result
        told = "; ".join((result.verdict, *result.capture_notices))
        yield f"Tracking: {told}; it was {self._tracked_words()}"
        for doubt in result.doubts:
            yield f"In doubt since the start: {doubt}."
        if result.nowhere is not None:
            yield f"{result.nowhere[0].upper()}{result.nowhere[1:]}."
        if result.gone is not None:
            yield f"{result.gone[0].upper()}{result.gone[1:]}."
        notices = notice_times([one for one in result.tracked if not one.is_tracked])
        if notices:
            words, times = next(iter(notices.items()))
            yield f"The most frequent notice while it was not, {_times(len(times))}: {words}."
        yield self._seen_words()
        unchecked = [] if result.overlap is None else ["the first mask was the object's"]
        if result.evolutions:
            changed = f"which changed {_times(result.evolutions)}"
            unchecked.append(f"the body, {changed} while it was tracked, is right")
        if unchecked:
            yield (
                f"No figure shows whether {' and whether '.join(unchecked)}: compare the pictures "
                "with the object."
            )

    def words(self) -> Iterator[str]:
        """Yield the sentences of the page about rotation, corrections, body and speed."""
        yield self._turned_words()
        yield self._corrected_words()
        yield self._body_words()
        if self.result.overlap is not None:
            yield (
                "At the start the body's silhouette and the masks of the first observation had an "
                f"intersection over union of {self.result.overlap:.2f}."
            )
        if len(self.result) > 1:
            median, p95 = (
                f"{_MS_PER_S * self.result.step_percentile(percent):.1f} ms"
                for percent in (50.0, 95.0)
            )
            yield (
                f"The start took {self.result.starting_s:.1f} s. A step took {median} in the "
                f"median and {p95} at the 95th percentile, without reading the images."
            )

    def _doubts(self) -> Iterator[str]:
        result = self.result
        yield from result.doubts
        yield from result.capture_doubts

    def _step(self, place: int, one: Tracked) -> dict[str, Any]:
        turning = self.turning
        return {
            "observation": one.index,
            "time_s": one.estimate.time_s,
            "state": one.state,
            "confidence": one.estimate.confidence,
            "turned_rad": float(turning.turned[place]),
            "away_rad": float(turning.away[place]),
            "drift_rad": finite(float(turning.drift[place])),
            "std_rad": finite(float(turning.deviation[place])),
            "seconds": one.seconds,
        }

    def _tracked_words(self) -> str:
        result = self.result
        words = (
            f"tracked in {result.tracked_count} of {counted(len(result), 'observation')} "
            f"({100.0 * result.tracked_share:.1f} %)"
        )
        longest = sorted(result.gaps, key=lambda gap: -gap.count)[:_MOST_GAPS]
        spans = [
            f"at {gap.first_s:.2f} s"
            if gap.count == 1
            else f"from {gap.first_s:.2f} to {gap.last_s:.2f} s"
            for gap in sorted(longest, key=lambda gap: gap.first_s)
        ]
        more = len(result.gaps) - len(longest)
        rest = f", and in {more} more gaps" if more else ""
        return f"{words}, and not {', '.join(spans)}{rest}." if spans else f"{words}."

    def _seen_words(self) -> str:
        share = round(100.0 * self.sides.share)
        if share == 100:
            return "The cameras saw all of its sides."
        return (
            f"The cameras saw {share} % of its sides. The depth of the others is a guess, unless "
            "a given body has it from other images."
        )

    def _turned_words(self) -> str:
        unseen = [name for name, when in self.sides_seen.items() if when is None]
        words = (
            f"It rotated by {np.degrees(self.turning.turned[-1]):.0f} degrees in total relative to "
            "the first camera"
        )
        if not unseen or len(unseen) == len(NAMED_SIDES):
            return f"{words}."
        return f"{words}; no camera came within 45 degrees of its {joined(unseen)}."

    def _corrected_words(self) -> str:
        parts = []
        for cause in Cause:
            angles = [one.angle for one in self.turning.corrections if one.cause is cause]
            if angles:
                most = "by" if len(angles) == 1 else "by at most"
                degrees = np.degrees(max(angles))
                parts.append(f"{_times(len(angles))} {most} {degrees:.1f} degrees: {cause.value}")
        corrected = f"The rotation was corrected {'; '.join(parts)}" if parts else _NEVER
        drift = self.turning.drift[np.isfinite(self.turning.drift)]
        if not len(drift):
            return f"{corrected}."
        largest, last = np.degrees([drift.max(), drift[-1]])
        if largest < _LEAST_DEG:
            return (
                f"{corrected}. Its estimated drift stayed {_degrees(largest)} (one standard "
                "deviation)."
            )
        return (
            f"{corrected}. Its estimated drift was {_degrees(largest)} at most, and "
            f"{_degrees(last)} at the end (one standard deviation)."
        )

    def _body_words(self) -> str:
        result, first = self.result, len(self.history.initial)
        solids = solids_of(result.body, self.history.surface, self.sides.sides_from_object)
        spans = [high - low for low, high in (solids.extent(axis) for axis in np.eye(3))]
        size = " × ".join(f"{_MS_PER_S * span:.0f}" for span in spans) + " mm"
        if not result.is_metric:
            size = " × ".join(map(four_digits, spans)) + " of an unknown unit"
        before = (
            f"{first} at the start, " if result.evolutions and first != len(result.body) else ""
        )
        return (
            f"The body has {counted(len(result.body), 'ellipsoid')}, {before}and seen from the "
            f"front it is {size} wide, high and deep."
        )


def _degrees(angle: float) -> str:
    """Return an angle in words, and never as 0."""
    return f"{angle:.1f} degrees" if angle >= _LEAST_DEG else f"below {_LEAST_DEG:g} degrees"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
