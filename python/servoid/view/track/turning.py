"""Computes an object's rotation relative to the camera, its drift and its corrections."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.pose import Floats
from servoid.track import Tracked

_STEP = np.radians(3.0)  # smaller rotations back and forth do not add up

_CORRECTED = re.compile(r"^(.*): the rotation is corrected by (\d+(?:\.\d+)?) degrees$")


class Cause(Enum):
    """Why the rotation was corrected, in the words of the tracker's notices."""

    KNOWN_SIDE = "a known side is seen again"
    ADJUSTED = "what was seen so far is adjusted"


@dataclass(frozen=True)
class Correction:
    """A correction of the rotation by `angle` radians at the estimate with index `place`."""

    place: int
    time_s: float
    cause: Cause
    angle: float


@dataclass(frozen=True, eq=False)
class Turning:
    """The rotation of an object; arrays are (N,), one entry per estimate, angles in radians.

    `turned` is the total angle through which it rotated relative to the first camera, and `away`
    the angle from its first orientation; both keep their value where it is not located. `drift` is
    the tracker's standard deviation of the rotation's drift since the first image, `deviation` the
    standard deviation of the rotation about its worst axis; NaN where they are not known.
    `located` is true where the object's position is confirmed.
    """

    turned: Floats
    away: Floats
    drift: Floats
    deviation: Floats
    located: NDArray[np.bool_]
    corrections: tuple[Correction, ...]


def turning_of(
    tracked: Sequence[Tracked], world_from_camera: Sequence[tuple[Pose, ...]]
) -> Turning:
    """Compute an object's rotation relative to the first of the cameras with the given poses.

    Rotations back and forth of less than 3 degrees do not add up; otherwise the noise of its poses
    would accumulate for an object at rest.
    """
    turns = [
        (cameras[0].inverse() @ one.estimate.world_from_object).matrix()[:3, :3]
        for one, cameras in zip(tracked, world_from_camera, strict=True)
    ]
    located = [one.estimate.located for one in tracked]
    return Turning(
        turned=_turned(turns, located),
        away=_away(turns, located),
        drift=np.array([_drift(one) for one in tracked], dtype=np.float64),
        deviation=np.array([_deviation(one) for one in tracked], dtype=np.float64),
        located=np.array(located, dtype=np.bool_),
        corrections=tuple(corrections_of(tracked)),
    )


def corrections_of(tracked: Sequence[Tracked]) -> list[Correction]:
    """List the corrections that the notices report, in their order."""
    found: list[Correction] = []
    for place, one in enumerate(tracked):
        for notice in one.notices:
            match = _CORRECTED.match(notice)
            causes = [cause for cause in Cause if match is not None and match[1] == cause.value]
            if match is not None and causes:
                angle = float(np.radians(float(match[2])))
                found.append(Correction(place, one.estimate.time_s, causes[0], angle))
    return found


def _turned(turns: Sequence[Floats], located: Sequence[bool]) -> Floats:
    """Accumulate the angles between rotations (3, 3) that are far enough apart."""
    total, most, anchor = 0.0, 0.0, None
    added = []
    for turn, known in zip(turns, located, strict=True):
        if known and anchor is None:
            anchor = turn
        elif known and anchor is not None:
            angle = _angle(anchor, turn)
            most = max(most, total + angle)
            if angle >= _STEP:
                total, anchor = total + angle, turn
        added.append(most)
    return np.array(added, dtype=np.float64)


def _away(turns: Sequence[Floats], located: Sequence[bool]) -> Floats:
    """Return the angle of each rotation from the first that is located."""
    first = next((turn for turn, known in zip(turns, located, strict=True) if known), None)
    angles: list[float] = []
    for turn, known in zip(turns, located, strict=True):
        before = angles[-1] if angles else 0.0
        angles.append(_angle(first, turn) if known and first is not None else before)
    return np.array(angles, dtype=np.float64)


def _angle(first: Floats, second: Floats) -> float:
    """Return the angle of the rotation from the first (3, 3) to the second."""
    change = np.eye(4)
    change[:3, :3] = first.T @ second
    return float(np.linalg.norm(Pose(change).log()[3:]))


def _drift(one: Tracked) -> float:
    return float((one.estimate.evidence or {}).get("drift_rad", np.nan))


def _deviation(one: Tracked) -> float:
    """Return the standard deviation of a rotation about its worst axis, NaN if not known."""
    covariance = one.estimate.covariance[3:, 3:]
    if not np.isfinite(covariance).all():
        return float("nan")
    return float(np.sqrt(max(float(np.linalg.eigvalsh(covariance)[-1]), 0.0)))
