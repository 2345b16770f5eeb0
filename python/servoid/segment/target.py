"""Targets: mark the object in one image; and their notation."""

import math
from dataclasses import dataclass
from pathlib import Path

from servoid.errors import TargetError, located
from servoid.words import number_of

_FORMS = (
    "mask:FILE, box:U0,V0,U1,V1, click:U,V, hue:LOW..HIGH or background:FILE, each with an "
    "optional @VIEW at its end, such as box:120,80,420,400@eye/0003"
)
_EXAMPLES = {
    "box": "left, top, right, bottom in pixels, such as box:120,80,420,400",
    "click": "a pixel on the object, such as click:320,240",
    "hue": "two angles in degrees, such as hue:200..260 for blue, hue:90..150 for green or "
    "hue:340..20 for red",
}
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")


@dataclass(frozen=True)
class MaskTarget:
    """Marks the object by a mask in a file: the pixels that are not zero."""

    path: Path
    view: str | None = None

    def __str__(self) -> str:
        return f"mask:{self.path}{_at(self.view)}"


@dataclass(frozen=True)
class BoxTarget:
    """Marks an object that fills a box: pixels from (u0, v0) to (u1, v1), both inclusive.

    Raises:
        TargetError: the corners are not finite or not in order.

    """

    u0: float
    v0: float
    u1: float
    v1: float
    view: str | None = None

    def __post_init__(self) -> None:
        corners = self.corners
        if not all(map(math.isfinite, corners)) or self.u0 >= self.u1 or self.v0 >= self.v1:
            raise TargetError(
                f"the box has the corners {_numbers(corners)}; write left, top, right, bottom in "
                "pixels, with left < right and top < bottom, such as box:120,80,420,400"
            )

    @property
    def corners(self) -> tuple[float, float, float, float]:
        """Return its left, top, right and bottom."""
        return self.u0, self.v0, self.u1, self.v1

    def __str__(self) -> str:
        return f"box:{_numbers(self.corners)}{_at(self.view)}"


@dataclass(frozen=True)
class ClickTarget:
    """Marks the object at the pixel (u, v).

    Raises:
        TargetError: the pixel is not finite.

    """

    u: float
    v: float
    view: str | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.u) and math.isfinite(self.v)):
            raise TargetError(
                f"the click is at {_numbers((self.u, self.v))}; write two finite numbers, such as "
                "click:320,240"
            )

    def __str__(self) -> str:
        return f"click:{_numbers((self.u, self.v))}{_at(self.view)}"


@dataclass(frozen=True)
class HueTarget:
    """Marks the object by hues from `low_deg` up to `high_deg`; the window may pass through 360.

    Red is 0, green 120, blue 240. Pixels with a saturation below `least_saturation` or a value
    below `least_value`, both from 0 to 1, have no meaningful hue and do not match.

    Raises:
        TargetError: a number is out of range, or the window is empty.

    """

    low_deg: float
    high_deg: float
    least_saturation: float = 0.25
    least_value: float = 0.15
    view: str | None = None

    def __post_init__(self) -> None:
        hues = (self.low_deg, self.high_deg)
        if not all(-360.0 <= hue <= 360.0 for hue in hues) or hues[0] == hues[1]:
            raise TargetError(
                f"the hue window is {_numbers(hues, '..')}; write two different angles in degrees, "
                "from 0 to 360, such as hue:200..260, or hue:340..20 for red"
            )
        for name in ("least_saturation", "least_value"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise TargetError(f"{name} is {getattr(self, name)}; it must be from 0 to 1")

    def __str__(self) -> str:
        return f"hue:{_numbers((self.low_deg, self.high_deg), '..')}{_at(self.view)}"


@dataclass(frozen=True)
class BackgroundTarget:
    """Marks the object as the change since an image of the empty scene from the same camera."""

    path: Path
    view: str | None = None

    def __str__(self) -> str:
        return f"background:{self.path}{_at(self.view)}"


Target = MaskTarget | BoxTarget | ClickTarget | HueTarget | BackgroundTarget


def parse_target(text: str) -> Target:
    """Parse a target as written on the command line, such as `box:120,80,420,400@eye/0003`.

    The forms are `mask:FILE`, `box:U0,V0,U1,V1`, `click:U,V`, `hue:LOW..HIGH` and
    `background:FILE`. `@VIEW` at the end names the view; without it, `view` is None. `str(target)`
    formats it again; fields that the notation lacks keep their defaults.

    Raises:
        TargetError: the text has none of these forms, or its numbers are invalid.

    """
    kind, colon, rest = text.partition(":")
    if not colon or kind not in ("mask", "box", "click", "hue", "background"):
        raise TargetError(f"the target '{text}' has no known form; write {_FORMS}")
    value, view = _split_view(rest, is_file=kind in ("mask", "background"))
    if not value or view == "":
        missing = "nothing after the colon" if not value else "no view after the @"
        raise TargetError(f"the target '{text}' has {missing}; write {_FORMS}")
    if kind == "mask":
        return MaskTarget(Path(value), view)
    if kind == "background":
        return BackgroundTarget(Path(value), view)
    separator, count = {"box": (",", 4), "click": (",", 2), "hue": ("..", 2)}[kind]
    try:
        numbers = [number_of(cell) for cell in value.split(separator)]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        raise TargetError(
            f"the target '{text}' needs {count} numbers with '{separator}' between them; "
            f"write {_EXAMPLES[kind]}"
        )
    with located(f"the target '{text}'"):
        if kind == "box":
            return BoxTarget(*numbers, view=view)
        if kind == "click":
            return ClickTarget(*numbers, view=view)
        return HueTarget(*numbers, view=view)


def _split_view(rest: str, *, is_file: bool) -> tuple[str, str | None]:
    value, at, view = rest.rpartition("@")
    # View names have no suffix, so in `mask:a@2x.png` the @ belongs to the file.
    if not at or (is_file and view.lower().endswith(IMAGE_SUFFIXES)):
        return rest, None
    return value, view


def _numbers(values: tuple[float, ...], separator: str = ",") -> str:
    return separator.join(
        str(int(value)) if math.isfinite(value) and value == int(value) else repr(value)
        for value in values
    )


def _at(view: str | None) -> str:
    return "" if view is None else f"@{view}"
