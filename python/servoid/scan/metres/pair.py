"""Determines the scale of a scan from a second camera at a known distance from the first."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Pose
from servoid.brief import brief
from servoid.errors import ScanError
from servoid.pose import Floats
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
_TRIES = 1000
_ROUNDS, _SMALL = 15, 1e-6
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
    first = None if len(points) < _LEAST_POINTS else _rough(points, pixels, lens)
    if first is None or len(first[1]) < _LEAST_POINTS:
        raise ScanError(
            f"the second camera sees too little of what the first sees, in {len(names)} images: "
            f"{len(points)} points, and at least {_LEAST_POINTS} that agree are needed; check that "
            "both films are of one pair, and start at the same time"
        )
    start, rows = first
    apart, deviation = _refined(start, points[rows], pixels[rows], lens)
    if not deviation < _ROUGH:
        raise ScanError(
            "both cameras determine the scale to "
            f"{100.0 * deviation:.0f} % only: the scene is too far for their distance of "
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


def _rough(points: Floats, pixels: Floats, lens: Lens) -> tuple[Pose, NDArray[np.int64]] | None:
    """Return the first camera's pose in the second's frame, and the points that agree with it."""
    import cv2

    rays = lens.rays(pixels)
    flat = rays[:, :2] / rays[:, 2:]
    limit = _OFF_PX / 1000.0 * float(np.hypot(*lens.size_px)) / lens.focal_px[0]
    found, turn, shift, rows = cv2.solvePnPRansac(
        points,
        flat,
        np.eye(3),
        None,
        iterationsCount=_TRIES,
        reprojectionError=limit,
        flags=cv2.SOLVEPNP_SQPNP,
    )
    if not found or rows is None:
        return None
    return Pose.from_rvec_tvec(turn.ravel(), shift.ravel()), rows.ravel().astype(np.int64)


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

    step = np.zeros(7)
    normal = np.eye(len(step))
    for _ in range(_ROUNDS):
        residual = off(step)
        weights = 1.0 / (1.0 + (residual**2).sum(axis=1) / _LOOSE_PX**2)
        slopes = np.stack(
            [(off(step + _SMALL * way) - residual) / _SMALL for way in np.eye(len(step))], axis=-1
        )
        normal = np.einsum("n,nik,nil->kl", weights, slopes, slopes)
        step = step - np.linalg.pinv(normal) @ np.einsum("n,nik,ni->k", weights, slopes, residual)
    units = apart(step)
    way = np.array([(apart(step + _SMALL * one) - units) / _SMALL for one in np.eye(len(step))])
    spread_px = _MAD_TO_STD * float(np.median(np.abs(off(step))))
    return units, spread_px * float(np.sqrt(way @ np.linalg.pinv(normal) @ way)) / units
