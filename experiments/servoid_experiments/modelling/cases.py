"""The cases and the results of the study of modelling."""

from typing import Annotated

from msgspec import Meta, Struct

Share = Annotated[float, Meta(ge=0.0, le=0.9)]
NotNegative = Annotated[float, Meta(ge=0.0)]
Count = Annotated[int, Meta(ge=1)]
Views = Annotated[int, Meta(ge=2)]


class ModelCase(Struct, frozen=True, kw_only=True):
    """Outlines of an object, their noise, and the number of ellipsoids of the model.

    Of the masks, `edge_px` is the error of the outline, `flipped` the share of wrong pixels, and
    `holes` the missing share of the object. Of the cameras' poses, `place_mm` and `turn_deg` are
    the errors of position and rotation. All but shares are standard deviations, those of poses
    about each axis.
    """

    object: str
    views: Views
    ellipsoids: Count
    edge_px: NotNegative
    flipped: Share
    holes: Share
    place_mm: NotNegative
    turn_deg: NotNegative
    size_px: tuple[int, int]
    seed: Annotated[int, Meta(ge=0)]


class ModelRow(Struct, frozen=True, kw_only=True):
    """The quality of a body, and the time that modelling took.

    Intersections over unions: of the volume with that of the design, and of the outlines in views
    that were not used, on average and in the worst view. Masks and poses of these are exact.
    """

    volume_iou: float
    outline_iou: float
    worst_outline_iou: float
    volume_share: float
    seconds: Annotated[
        float, Meta(description="of one processor for modelling; differs from run to run")
    ]
