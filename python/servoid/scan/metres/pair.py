"""Determines the scale of a scan from a second camera at a known distance from the first."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from servoid._native import Lens, Pose
from servoid.brief import brief
from servoid.camera import resect
from servoid.errors import ScanError
from servoid.pose import Floats, robust_fit
from servoid.scan.footage import Footage
from servoid.scan.matching import Matched, match_pairs
from servoid.scan.metres.scale import Scale
from servoid.scan.solution import Solution
from servoid.scan.staging import encode

_MOST_IMAGES = 12  # of each camera, spread over the scan: each has hundreds of points
_LEAST_POINTS = 40
_SAME_PX = 0.01  # features of one image, detected twice
_OFF_PX = 4.0  # at 1000 px of diagonal: matches with larger errors are wrong
_LOOSE_PX = 0.5  # a match with a larger error counts less than by its square
_SMALL = 1e-6
_MAD_TO_STD = 1.4826
_ROUGH = 0.05  # relative deviation of a scale that is useless


@dataclass(frozen=True)
class Partner:
    """The second camera of a pair, `metres` from the first; its images have the first one's names.

    Its lens is assumed to be the first camera's, except for the focal length. A calibration of it
    is not used: errors of the lens that the scan estimated are in both cameras, and cancel.
    """

    footage: Footage
    metres: float

    __repr__ = brief


def scale_of_partner(
    solution: Solution, partner: Partner, staged: Path, scratch: Path, threads: int | None
) -> Scale:
    """Return the scale for which both cameras are as far apart as is known.

    Points of the scan that the second camera sees, too, determine its pose relative to the first,
    which is the same in all images. `staged` is the folder of the first camera's images.

    Raises:
        ScanError: both cameras have too little in common.

    """
    names = _spread(solution.names, partner.footage.names)
    matched = _match(names, partner, staged, scratch, threads)
    points, pixels = _seen_by_both(solution, names, matched)
    lens = solution.lens
    error = _OFF_PX / 1000.0 * float(np.hypot(*lens.size_px)) / lens.focal_px[0]
    first = resect(points, lens.rays(pixels), error) if len(points) >= _LEAST_POINTS else None
    if first is None or len(first[1]) < _LEAST_POINTS:
        raise ScanError(
            f"the second camera sees too little of what the first sees, in {len(names)} images: "
            f"{len(points)} points, and at least {_LEAST_POINTS} that agree are needed; check that "
            "both films are of one pair, and start at the same time"
        )
    start, rows = first
    apart, deviation = _refined(start, points[rows], pixels[rows], lens)
    if not deviation < _ROUGH:
        how = f"to {100.0 * deviation:.0f} % only" if np.isfinite(deviation) else "not at all"
        raise ScanError(
            f"both cameras determine the scale {how}: the scene is too far for their distance of "
            f"{partner.metres:g} m; give --length or --board"
        )
    words = f"by a stereo pair in {len(names)} images"
    return Scale(partner.metres / apart, deviation, words)


def _spread(found: Sequence[str], seen: Sequence[str]) -> list[str]:
    """Return names of images of both cameras, spread over the scan."""
    both = [name for name in found if name in set(seen)]
    chosen = np.unique(np.linspace(0, len(both) - 1, _MOST_IMAGES).round()) if both else []
    return [both[int(index)] for index in chosen]


def _match(
    names: Sequence[str], partner: Partner, staged: Path, scratch: Path, threads: int | None
) -> Matched:
    """Match each image of the first camera with the second's; the second camera's come last."""
    folder = scratch / "pair"
    folder.mkdir()
    first = {Path(file).stem: file for file in sorted(p.name for p in staged.iterdir())}
    files = [first[name] for name in names]
    for file in files:
        (folder / file).symlink_to((staged / file).resolve())
    for name, image in partner.footage.images(names):
        (folder / f"{name}-second.jpg").write_bytes(encode(image))
    seconds = [f"{name}-second.jpg" for name in names]
    pairs = [(index, index + len(names)) for index in range(len(names))]
    return match_pairs(folder, [*files, *seconds], scratch / "pair.db", pairs, threads=threads)


def _seen_by_both(
    solution: Solution, names: Sequence[str], matched: Matched
) -> tuple[Floats, Floats]:
    """Return points, (N, 3) in the first camera's frame, and the second's pixels, (N, 2)."""
    points, pixels = [np.zeros((0, 3))], [np.zeros((0, 2))]
    for place, name in enumerate(names):
        rows = matched.agreeing.get((place, place + len(names)))
        index = solution.index(name)
        if rows is None or index is None:
            continue
        one, other = matched.places((place, place + len(names)), rows)
        apart = np.linalg.norm(one[:, None] - solution.marks_px[index][None], axis=2)
        nearest = apart.argmin(axis=1)
        same = apart[np.arange(len(one)), nearest] < _SAME_PX
        world = solution.points[solution.seen[index][nearest[same]]]
        points.append(solution.world_from_camera[index].inverse().transform(world))
        pixels.append(other[same])
    return np.concatenate(points), np.concatenate(pixels)


def _refined(start: Pose, points: Floats, pixels: Floats, lens: Lens) -> tuple[float, float]:
    """Return the cameras' distance in the scan's unit, and its relative deviation.

    Gauss-Newton adjusts the second camera's pose and focal length to the pixels of the points, with
    Cauchy weights.
    """
    center = np.array(lens.center_px)

    def pose(step: Floats) -> Pose:
        return Pose.exp(step[:6]) @ start

    def off(step: Floats) -> Floats:
        seen = lens.project(pose(step).transform(points))
        return (seen - center) * (1.0 + step[6]) + center - pixels

    def apart(step: Floats) -> float:
        return float(np.linalg.norm(pose(step).inverse().translation))

    fit = robust_fit(off, 7, _LOOSE_PX)
    if fit is None:
        return 1.0, np.inf
    units = apart(fit.numbers)
    way = np.array([apart(fit.numbers + _SMALL * one) - units for one in np.eye(7)]) / _SMALL
    spread_px = _MAD_TO_STD * float(np.median(np.abs(off(fit.numbers))))
    return units, spread_px * float(np.sqrt(way @ fit.inverse @ way)) / units
