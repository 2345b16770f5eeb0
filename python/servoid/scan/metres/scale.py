"""Determines a scan's unit in metres: from a known length or a known baseline."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from servoid.config import FAR_M, implausible
from servoid.errors import ScanError
from servoid.pose import Floats
from servoid.scan.footage import image_name
from servoid.scan.solution import Solution
from servoid.words import digits, number_of

_CLICK_PX = 1.0  # standard deviation of a click
_OFF_PX = 8.0  # at 1000 px of diagonal: ends of a length with larger errors are not the same point
_APART = 0.03  # relative difference by which lengths may disagree
_LEAST_RAD = math.radians(1.5)  # between the rays to an end
_ROUNDS = 4


@dataclass(frozen=True)
class Length:
    """A length of `metres` from pixel `start` to pixel `end` of the image `name`."""

    name: str
    start: tuple[float, float]
    end: tuple[float, float]
    metres: float


@dataclass(frozen=True)
class Baseline:
    """A distance of `metres` between the camera's positions at two images."""

    first: str
    second: str
    metres: float


@dataclass(frozen=True)
class Scale:
    """One unit in metres, the relative standard deviation of that, and how it was determined."""

    metres: float
    deviation: float
    words: str


def parse_length(text: str) -> Length:
    """Parse `IMAGE:U0,V0,U1,V1=METRES`.

    Raises:
        ScanError: the text has another form, or nobody has such a length before a camera.

    """
    name, colon, rest = text.rpartition(":")
    pixels, _, metres = rest.partition("=")
    try:
        u0, v0, u1, v1 = (number_of(part) for part in pixels.split(","))
        length = number_of(metres)
    except ValueError:
        colon, length, u0, v0, u1, v1 = "", 0.0, 0.0, 0.0, 0.0, 0.0
    if not (colon and name and 0.0 < length < math.inf and (u0, v0) != (u1, v1)):
        raise ScanError(
            f"'{text}' is not a length; write IMAGE:U0,V0,U1,V1=METRES: an image's name, the "
            "pixels of both ends in it, and their distance, such as 0012:310,205,480,212=0.12"
        )
    _check_plausible(f"the length of '{text}'", length)
    return Length(name, (u0, v0), (u1, v1), length)


def parse_baseline(text: str) -> Baseline:
    """Parse `IMAGE,IMAGE=METRES`.

    Raises:
        ScanError: the text has another form, or nobody has such a length before a camera.

    """
    names, _, metres = text.rpartition("=")
    first, comma, second = names.partition(",")
    try:
        length = number_of(metres)
    except ValueError:
        length = 0.0
    if not (comma and first and second and first != second and 0.0 < length < math.inf):
        raise ScanError(
            f"'{text}' is not a baseline; write IMAGE,IMAGE=METRES: the names of two images and "
            "how far the camera moved between them, such as 0000,0040=0.3"
        )
    _check_plausible(f"the baseline of '{text}'", length)
    return Baseline(first, second, length)


def _check_plausible(name: str, length_m: float) -> None:
    absurd = implausible(name, length_m, FAR_M)
    if absurd is not None:
        raise ScanError(absurd)


def check_lengths(lengths: Sequence[Length]) -> None:
    """Check that each length is marked in two images or more, before any image is read.

    Raises:
        ScanError: one is marked in one image only.

    """
    for metres in dict.fromkeys(one.metres for one in lengths):
        names = {image_name(one.name): one.name for one in lengths if one.metres == metres}
        if len(names) > 1:
            continue
        name = next(iter(names.values()))
        others = [digits(one.metres) for one in lengths if one.metres != metres]
        unequal = f"; {' and '.join(others)} m would be another length" if others else ""
        raise ScanError(
            f"the length of {digits(metres)} m is marked only in {name}{unequal}; mark both "
            "ends in two images from different positions, with --length twice and the same metres"
        )


def scale_of_lengths(solution: Solution, lengths: Sequence[Length]) -> Scale | None:
    """Return the scale by lengths whose ends are marked in two images or more; None without any.

    Marks with the same metres belong to the same length. Each end is where its rays come closest.
    The deviation follows from a standard deviation of each mark in pixels.

    Raises:
        ScanError: a length is marked in one image only or in an image without a pose, or its marks
            are not of the same points.

    """
    check_lengths(lengths)
    found = []
    for metres in dict.fromkeys(one.metres for one in lengths):
        marks = [one for one in lengths if one.metres == metres]
        found.append(_of_length(solution, marks))
    if not found:
        return None
    return _joined(found, "by a known length")


def scale_of_baselines(solution: Solution, baselines: Sequence[Baseline]) -> Scale | None:
    """Return the scale by the distances between the camera's positions; None without any.

    Raises:
        ScanError: an image has no pose, or the camera did not move between two.

    """
    found = []
    for one in baselines:
        places = [solution.places[index_of(solution, name)] for name in (one.first, one.second)]
        units = float(np.linalg.norm(places[1] - places[0]))
        if units < 1e-6 * solution.distance:
            raise ScanError(f"the camera did not move between {one.first} and {one.second}")
        # A camera's position is about as certain as a mark, seen from the scene's distance.
        off = math.sqrt(2.0) * solution.rms_px / solution.focal_px * solution.distance
        found.append((one.metres / units, off / units))
    return _joined(found, "by a known baseline") if found else None


def index_of(solution: Solution, name: str) -> int:
    """Return the index of the image with a name, among those with poses.

    Raises:
        ScanError: there is none.

    """
    index = solution.index(image_name(name))
    if index is None:
        some = ", ".join([*solution.names[:3], "...", solution.names[-1]])
        raise ScanError(f"there is no image '{name}' among those with a pose: {some}; mark another")
    return index


def triangulate(solution: Solution, indices: Sequence[int], pixels: Floats) -> tuple[Floats, float]:
    """Return where the rays through pixels (V, 2) of images meet, and the RMS error there in px.

    The point, (3,), minimises the angles to all rays.
    """
    poses = [solution.world_from_camera[index] for index in indices]
    turns = [pose.matrix()[:3, :3] for pose in poses]
    rays = solution.lens.rays(pixels)
    toward = np.array([turn @ ray for turn, ray in zip(turns, rays, strict=True)])
    toward /= np.linalg.norm(toward, axis=1)[:, None]
    places = np.array([pose.translation for pose in poses])
    across = np.eye(3) - toward[:, :, None] * toward[:, None, :]
    weights = np.ones(len(poses))
    point = places[0]
    for _ in range(_ROUNDS):
        total = (weights[:, None, None] * across).sum(axis=0)
        point = np.linalg.lstsq(
            total, (weights[:, None] * np.einsum("vij,vj->vi", across, places)).sum(axis=0)
        )[0]
        weights = 1.0 / np.maximum(((point - places) ** 2).sum(axis=1), 1e-12)
    seen = np.concatenate(
        [solution.lens.project(pose.inverse().transform(point[None])) for pose in poses]
    )
    return point, float(np.sqrt(((seen - pixels) ** 2).sum(axis=1).mean()))


def _of_length(solution: Solution, marks: Sequence[Length]) -> tuple[float, float]:
    """Return a unit in metres from the marks of one length, and its relative deviation."""
    indices = [index_of(solution, one.name) for one in marks]
    pixels = np.array([[one.start, one.end] for one in marks], np.float64)
    _check_apart(solution, indices, marks)
    ends = [triangulate(solution, indices, pixels[:, side]) for side in (0, 1)]
    diagonal = math.hypot(*solution.lens.size_px)
    off = max(error for _, error in ends)
    if not off < _OFF_PX * diagonal / 1000.0:
        names = " and ".join(one.name for one in marks)
        raise ScanError(
            f"the ends of the length of {digits(marks[0].metres)} m in {names} are not the same "
            f"two points: their rays miss each other by {off:.0f} px; mark the same "
            "ends in the same order, in pixels of the upright images"
        )
    units = _apart(ends)
    slopes = []
    for place in np.ndindex(*pixels.shape):
        moved = pixels.copy()
        moved[place] += _CLICK_PX
        slopes.append(
            _apart([triangulate(solution, indices, moved[:, side]) for side in (0, 1)]) - units
        )
    return marks[0].metres / units, float(np.linalg.norm(slopes)) / units


def _apart(ends: Sequence[tuple[Floats, float]]) -> float:
    return float(np.linalg.norm(ends[1][0] - ends[0][0]))


def _check_apart(solution: Solution, indices: Sequence[int], marks: Sequence[Length]) -> None:
    """Check that an end is seen from different directions."""
    rays = solution.lens.rays(np.array([one.start for one in marks], np.float64))
    toward = [
        solution.world_from_camera[index].matrix()[:3, :3] @ (ray / np.linalg.norm(ray))
        for index, ray in zip(indices, rays, strict=True)
    ]
    widest = min(float(one @ other) for one in toward for other in toward)
    if widest > math.cos(_LEAST_RAD):
        raise ScanError(
            f"{' and '.join(one.name for one in marks)} show the length from nearly the same "
            "direction; mark it in two images from different sides"
        )


def _joined(found: Sequence[tuple[float, float]], words: str) -> Scale:
    """Return the mean of scales, weighted by their deviations."""
    scales = np.array([scale for scale, _ in found])
    deviations = np.maximum(np.array([deviation for _, deviation in found]), 1e-9)
    weights = deviations**-2 / (deviations**-2).sum()
    mean = float((weights * scales).sum())
    if np.ptp(scales) > _APART * mean + 3.0 * deviations.max() * mean:
        raise ScanError(
            f"the known lengths contradict each other by {100 * np.ptp(scales) / mean:.1f} %; "
            "measure and mark them again, or leave out the doubtful one"
        )
    return Scale(mean, float(np.sqrt((weights**2 * deviations**2).sum())), words)
