"""Checks that the images hang together as one scene that was seen from several places."""

import math

from servoid.errors import ScanError
from servoid.scan.solution import Solution

_LEAST_PARALLAX_RAD = math.radians(2.0)
_LEAST_SHARE = 0.5
_OTHER_SHARE = 0.2  # of the images: a group so large is a scene of its own


def check_found(solution: Solution, count: int) -> None:
    """Check that most of `count` images are of one scene, and seen from places far enough apart.

    Raises:
        ScanError: they are not.

    """
    others = [group for group in solution.groups if not set(group) & set(solution.names)]
    large = [group for group in others if len(group) >= max(3, _OTHER_SHARE * count)]
    if large:
        told = "; ".join(_told(group) for group in (solution.names, *large))
        raise ScanError(
            f"the images show {1 + len(large)} scenes that have nothing in common: {told}; scan "
            "each by itself, or add images that join them"
        )
    if len(solution.names) < _LEAST_SHARE * count:
        raise ScanError(
            f"only {len(solution.names)} of {count} images hang together "
            f"({_told(solution.names)}): the others show too little of the same; take "
            "images nearer to each other, so that neighbours share most of what they show, and lay "
            "printed paper around a plain object"
        )
    if solution.parallax_rad < _LEAST_PARALLAX_RAD:
        raise ScanError(
            "the camera hardly moved to the side: what it sees is seen under "
            f"{math.degrees(solution.parallax_rad):.1f} degrees, too little to tell distances; "
            "walk around the object"
        )


def _told(names: tuple[str, ...]) -> str:
    if len(names) <= 3:
        return ", ".join(names)
    return f"{names[0]}, {names[1]}, ... {names[-1]} ({len(names)} images)"
