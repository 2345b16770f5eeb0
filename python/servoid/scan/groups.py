"""Checks that the images are connected as one scene, seen from several positions."""

import math

from servoid.errors import ScanError
from servoid.scan.solution import Solution

_LEAST_PARALLAX_RAD = math.radians(2.0)
LEAST_IMAGES = 3
_LEAST_SHARE = 0.5
_OTHER_SHARE = 0.2  # of the images: a group of this size is a scene of its own
_WRONG_ERROR = 0.005  # of the diagonal: a reprojection error that no right scan has


def check_found(solution: Solution, count: int) -> None:
    """Check that most of `count` images show one scene, from positions far enough apart.

    Raises:
        ScanError: they are not.

    """
    others = [group for group in solution.groups if not set(group) & set(solution.names)]
    large = [group for group in others if len(group) >= max(3, _OTHER_SHARE * count)]
    if large:
        scenes = "; ".join(_listed(group) for group in (solution.names, *large))
        raise ScanError(
            f"the images show {1 + len(large)} scenes that have nothing in common: {scenes}; scan "
            "each separately, or add images that connect them"
        )
    found = len(solution.names)
    if found < LEAST_IMAGES:
        raise ScanError(
            f"only {found} of {count} images are connected ({_listed(solution.names)}), and a scan "
            f"needs at least {LEAST_IMAGES}: fewer do not determine the focal length; take 15 to "
            "50 from all around the object, so that neighbours share most of their view"
        )
    if found < _LEAST_SHARE * count:
        raise ScanError(
            f"only {found} of {count} images are connected "
            f"({_listed(solution.names)}): the others share too little of the scene; take "
            "images closer together, so that neighbours share most of their view, and lay "
            "printed paper around a plain object"
        )
    if solution.parallax_rad < _LEAST_PARALLAX_RAD:
        raise ScanError(
            "the camera hardly moved sideways: the parallax is "
            f"{math.degrees(solution.parallax_rad):.1f} degrees, too little for distances; "
            "walk around the object"
        )
    _check_consistent(solution)


def _check_consistent(solution: Solution) -> None:
    """Check that the poses explain the images at all.

    Raises:
        ScanError: they do not.

    """
    diagonal_px = math.sqrt(sum(side**2 for side in solution.lens.size_px))
    if not math.isfinite(solution.focal_std_px):
        fault = "the images do not determine the focal length"
    elif not solution.rms_px <= _WRONG_ERROR * diagonal_px:
        fault = f"the reprojection error is {solution.rms_px:.2g} px"
    else:
        return
    raise ScanError(
        f"the images contradict each other: {fault}, so that no pose is reliable; a pattern that "
        "repeats, such as tiles or a checked cloth, makes different places look alike: cover it "
        "with printed paper, such as newspaper, and scan images that neither move nor blur"
    )


def _listed(names: tuple[str, ...]) -> str:
    if len(names) <= 3:
        return ", ".join(names)
    return f"{names[0]}, {names[1]}, ... {names[-1]} ({len(names)} images)"
