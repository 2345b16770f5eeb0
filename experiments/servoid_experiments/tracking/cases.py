"""The cases and the results of the study of tracking."""

from enum import Enum
from typing import Annotated

from msgspec import Meta, Struct

from servoid.track import Method

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Positive = Annotated[float, Meta(gt=0.0)]
NotNegative = Annotated[float, Meta(ge=0.0)]
Count = Annotated[int, Meta(ge=1)]


class Eyes(Enum):
    """Where two fixed eyes look: both at the object's start position, or both straight ahead."""

    VERGED = "verged"
    PARALLEL = "parallel"


class Scene(Struct, frozen=True, kw_only=True):
    """A sequence of images of a moving object before two fixed eyes.

    `way_mm` is the distance that the object's middle moves from one image to the next. `light` is
    the factor by which the light changes halfway. `hidden` is the share of the object that a board
    in front of it hides for a while.
    """

    object: str
    way_mm: Positive
    noise: NotNegative
    light: Positive
    hidden: Share
    baseline_mm: Positive
    eyes: Eyes
    images: Annotated[int, Meta(ge=12)]
    size_px: tuple[int, int]
    seed: Annotated[int, Meta(ge=0)]


class TrackCase(Struct, frozen=True, kw_only=True):
    """A scene, and how the object is tracked in it.

    `generations` does not apply to the paper's method, which has one per image.
    """

    scene: Scene
    method: Method
    population: Count
    generations: Count
    ellipsoids: Count


class TrackRow(Struct, frozen=True, kw_only=True):
    """What a tracker reported in each image after the first, and its errors.

    The errors are those of the object's middle in mm, of its rotation in degrees, and ADD, the mean
    distance between its surface's true and tracked points, as a share of its diameter. The paper's
    method is given the rotation, so its rotation error is not a result.
    """

    position_mm: list[float]
    turn_deg: list[float]
    add_share: list[float]
    status: Annotated[list[str], Meta(description="tracking, searching or lost")]
    evaluations: Annotated[float, Meta(description="poses scored an image, on average")]
