"""What is tried when tracking is studied, and what comes of a trial."""

from enum import Enum
from typing import Annotated

from msgspec import Meta, Struct

from servoid.track import Method

Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Positive = Annotated[float, Meta(gt=0.0)]
NotNegative = Annotated[float, Meta(ge=0.0)]
Count = Annotated[int, Meta(ge=1)]


class Eyes(Enum):
    """Says where two fixed eyes look: both at where the object starts, or both straight ahead."""

    VERGED = "verged"
    PARALLEL = "parallel"


class Scene(Struct, frozen=True, kw_only=True):
    """A sequence of images of an object that moves before two eyes that do not.

    `way_mm` is how far the object's middle goes from one image to the next; `light` is what the
    light is multiplied by halfway; `hidden` is the share of the object that a board before it hides
    for a while.
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

    `generations` says nothing of the paper's method, which has one an image.
    """

    scene: Scene
    method: Method
    population: Count
    generations: Count
    ellipsoids: Count


class TrackRow(Struct, frozen=True, kw_only=True):
    """What a tracker said in each image after the first, and how far off that was.

    The errors are those of the object's middle in mm, of its turn in degrees, and the mean distance
    between its surface's true and tracked points, ADD, as a share of its diameter. The paper's
    method is told the orientation, so its turn is no finding.
    """

    position_mm: list[float]
    turn_deg: list[float]
    add_share: list[float]
    status: Annotated[list[str], Meta(description="tracking, searching or lost")]
    evaluations: Annotated[float, Meta(description="poses scored an image, on average")]
