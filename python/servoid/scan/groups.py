"""Checks that the images are connected as one scene, seen from several positions."""

import math

from servoid.errors import ScanError
from servoid.scan.solution import Solution

_LEAST_PARALLAX_RAD = math.radians(2.0)
_LEAST_SHARE = 0.5
_OTHER_SHARE = 0.2  # of the images: a group of this size is a scene of its own


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
    if len(solution.names) < _LEAST_SHARE * count:
        raise ScanError(
            f"only {len(solution.names)} of {count} images are connected "
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


def _listed(names: tuple[str, ...]) -> str:
    if len(names) <= 3:
        return ", ".join(names)
    return f"{names[0]}, {names[1]}, ... {names[-1]} ({len(names)} images)"
