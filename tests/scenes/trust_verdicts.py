"""Whether a tracker was right in each image, and whether it said so.

Wrong is a pose whose ADD, the mean distance of the object's points from where they truly are, is
more than 20 mm or, if that is more, a tenth of the object's diameter, or that is turned by more
than 15 degrees. A body's frame is where the first pose puts it, so that motions are compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tracking_errors import TrackingErrors, tracking_errors

from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.track import Tracked

WRONG_M, WRONG_SHARE, WRONG_RAD = 0.02, 0.1, np.radians(15.0)
SCALES = np.exp(np.linspace(-0.5, 0.5, 41))  # that are tried where one camera leaves it open
POINTS, FEW = 2000, 200  # of a mesh's vertices that are compared, and for a scale
CAPPED_M = 0.05  # errors above do not count for a scale
UNTOLD_M = 1e-3  # of error that a scale must save for each factor of e: rest determines none

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Verdicts:
    """What was said and what is true, for the images after the first whose truth is known, (N,).

    `add` is in metres and `turn` in radians. `surprise` (N, 3) is the squared distance from the
    truth in units of the covariance that was told: of the place, of the turn, and of both.
    """

    index: NDArray[np.int64]
    tracking: Bools
    lost: Bools
    confidence: Floats
    add: Floats
    turn: Floats
    wrong: Bools
    surprise: Floats

    def __len__(self) -> int:
        return len(self.index)

    @property
    def right(self) -> Bools:
        """Say which images are tracked, and rightly."""
        return self.tracking & ~self.wrong

    @property
    def trusted_wrong(self) -> Bools:
        """Say which images are said to be tracked and are wrong."""
        return self.tracking & self.wrong

    @property
    def longest_wrong(self) -> int:
        """Return how many images in a row were wrong and said to be tracked, at most."""
        return max((len(one) for one in stretches(self.trusted_wrong)), default=0)

    @property
    def losses(self) -> list[int | None]:
        """Return how many images each loss took until the pose was right again, None: never."""
        found: list[int | None] = []
        for one in stretches(~self.right):
            after = one[-1] + 1
            ended = after < len(self)
            found.append(int(self.index[after] - self.index[one[0]]) if ended else None)
        return found


def stretches(chosen: Bools) -> list[NDArray[np.int64]]:
    """Return where something is so, as runs of places in a row."""
    places = np.flatnonzero(chosen)
    return np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if len(places) else []


def verdicts(
    tracked: Sequence[Tracked],
    truth: Sequence[Pose | None],
    vertices: Floats,
    *,
    scaled: bool = False,
) -> Verdicts:
    """Judge a track by the true poses, world_from_object of the capture's observations.

    `vertices` (M, 3) are the object's, in the frame of the truth. `scaled` says that the track's
    scale is open, as one camera leaves it, and is to be fitted. The first pose must be known.
    """
    known = [(one, pose) for one in tracked if (pose := truth[one.index]) is not None]
    true = [pose for _, pose in known]
    points = np.unique(vertices.round(6), axis=0)
    points = points[np.random.default_rng(0).permutation(len(points))[:POINTS]]
    estimates = [one.estimate for one, _ in known]
    found = [one.world_from_object for one in estimates]
    tracking = np.array([one.status == "tracking" for one in estimates[1:]], bool)
    scale = _scale(found, true, points, tracking) if scaled else 1.0
    found = [_shrunk(one, scale) for one in found]
    errors = _errors(found, true, points)
    far = max(WRONG_M, WRONG_SHARE * float(np.linalg.norm(np.ptp(points, axis=0))))
    units = np.diag([1.0 / scale] * 3 + [1.0] * 3)
    shift = true[0].inverse() @ found[0]
    away = [((pose @ shift).inverse() @ one).log() for one, pose in zip(found, true, strict=True)]
    surprise = [
        _surprise(off, units @ one.covariance @ units)
        for off, one in zip(away[1:], estimates[1:], strict=True)
    ]
    return Verdicts(
        index=np.array([one.index for one, _ in known[1:]], np.int64),
        tracking=tracking,
        lost=np.array([one.status == "lost" for one in estimates[1:]], bool),
        confidence=np.array([one.confidence for one in estimates[1:]]),
        add=errors.add,
        turn=errors.rotation,
        wrong=(errors.add > far) | (errors.rotation > WRONG_RAD),
        surprise=np.array(surprise).reshape(-1, 3),
    )


def _errors(found: Sequence[Pose], true: Sequence[Pose], points: Floats) -> TrackingErrors:
    matrices = [one.matrix() for one in found], [one.matrix() for one in true]
    return tracking_errors(*matrices, points)


def _scale(found: Sequence[Pose], true: Sequence[Pose], points: Floats, tracking: Bools) -> float:
    """Return the scale by which what is said to be tracked fits the truth best."""
    places = 1 + np.flatnonzero(tracking)
    chosen = [0, *places[:: max(1, len(places) // 40)]]
    some, their = [found[place] for place in chosen], [true[place] for place in chosen]

    def cost(scale: float) -> float:
        add = _errors([_shrunk(one, scale) for one in some], their, points[:FEW]).add
        return float(np.median(np.minimum(add, CAPPED_M))) + UNTOLD_M * abs(float(np.log(scale)))

    return min(map(float, SCALES), key=cost) if len(places) else 1.0


def _shrunk(pose: Pose, scale: float) -> Pose:
    place = [part / scale for part in pose.translation]
    return Pose.from_parts(place, pose.quaternion)


def _surprise(off: Floats, covariance: Floats) -> tuple[float, float, float]:
    """Return the squared lengths of a motion's place, its turn and both, in units of a covariance.

    What is not known at all is no surprise.
    """
    if not np.isfinite(covariance).all():
        return 0.0, 0.0, 0.0
    parts = (slice(0, 3), slice(3, 6), slice(0, 6))
    lengths = [off[one] @ np.linalg.solve(covariance[one, one], off[one]) for one in parts]
    return float(lengths[0]), float(lengths[1]), float(lengths[2])
