"""Finds faults of a URDF that MuJoCo takes without a word, or reports without their place."""

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from servoid.errors import SimError

_NUMBERS = ("xyz", "rpy", "lower", "upper", "effort", "velocity", "value")
_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def check_elements(path: Path, root: ElementTree.Element) -> None:
    """Check the names, numbers and masses of a URDF's links and joints.

    Raises:
        SimError: two links or two joints have one name, a number is none, or a mass, a
            velocity or an effort is negative.

    """
    for kind in ("link", "joint"):
        elements = root.findall(kind)
        names = [element.get("name", "") for element in elements]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise SimError(
                f"{path}: {names.count(twice)} {kind}s have the name '{twice}'; give each its own"
            )
        for element, name in zip(elements, names, strict=True):
            for attribute, text in _no_numbers(element):
                raise SimError(
                    f"{path}: {kind} '{name}' has {attribute}=\"{text}\"; write finite numbers"
                )
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        for attribute in ("velocity", "effort"):
            if limit is not None and float(limit.get(attribute, "0")) < 0.0:
                raise SimError(
                    f"{path}: joint '{joint.get('name', '')}' has a limit of {attribute} of "
                    f"{limit.get(attribute)}; it holds in both directions, so write it without "
                    "the sign"
                )
    for link in root.findall("link"):
        mass = link.find("inertial/mass")
        if mass is not None and float(mass.get("value", "0")) < 0.0:
            raise SimError(
                f"{path}: link '{link.get('name', '')}' has a mass of {mass.get('value')} kg; a "
                "mass is positive, so correct the file"
            )


def _no_numbers(element: ElementTree.Element) -> Iterator[tuple[str, str]]:
    """Yield the attributes below an element that should hold numbers, and do not."""
    for part in element.iter():
        for attribute in (*_NUMBERS, *_INERTIA):
            text = part.get(attribute)
            if text is not None and not all(map(_is_finite, text.split())):
                yield attribute, text


def _is_finite(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
