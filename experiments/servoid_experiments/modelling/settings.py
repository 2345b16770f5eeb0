"""The settings of the study of modelling: factors, centre, and every number."""

from typing import Annotated

from msgspec import Meta, Struct

from servoid_experiments.modelling.cases import Count, NotNegative, Share, Views
from servoid_experiments.modelling.designs import DESIGNS
from servoid_experiments.sweeping import check_names, check_varied


class CenterSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The case in the centre: factors that are not varied have these values."""

    views: Annotated[Views, Meta(description="masks from all sides")] = 12
    ellipsoids: Annotated[Count, Meta(description="of the body")] = 5
    edge_px: Annotated[NotNegative, Meta(description="by which outlines are off")] = 0.0
    flipped: Annotated[Share, Meta(description="share of a mask's pixels that are wrong")] = 0.0
    holes: Annotated[Share, Meta(description="share of the object that masks miss")] = 0.0
    place_mm: Annotated[NotNegative, Meta(description="by which cameras are off")] = 0.0
    turn_deg: Annotated[NotNegative, Meta(description="by which cameras are turned off")] = 0.0


class SweepSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The values of each factor, which are varied one at a time; empty: not varied."""

    views: Annotated[tuple[Views, ...], Meta(description="masks")] = (2, 3, 4, 6, 8, 16, 24)
    ellipsoids: Annotated[tuple[Count, ...], Meta(description="of the body")] = (1, 2, 3, 8, 12)
    edge_px: Annotated[tuple[NotNegative, ...], Meta(description="pixels")] = (1.0, 2.0, 4.0, 8.0)
    flipped: Annotated[tuple[Share, ...], Meta(description="share of the pixels")] = (
        0.02, 0.05, 0.1, 0.2, 0.3,
    )  # fmt: skip
    holes: Annotated[tuple[Share, ...], Meta(description="share of the object")] = (
        0.05, 0.1, 0.2, 0.4,
    )  # fmt: skip
    place_mm: Annotated[tuple[NotNegative, ...], Meta(description="mm")] = (1.0, 2.0, 5.0, 10.0)
    turn_deg: Annotated[tuple[NotNegative, ...], Meta(description="degrees")] = (
        0.1, 0.2, 0.5, 1.0, 2.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Check that something is varied.

        Raises:
            StudyError: nothing is.

        """
        check_varied(self)


class ModelStudySettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of the study of modelling."""

    objects: Annotated[
        tuple[str, ...],
        Meta(min_length=1, description="the sample's bird, and shipped objects"),
    ] = ("bird", "bottle", "drill", "mug")
    seeds: Annotated[
        int, Meta(ge=1, description="trials a case: where views begin, noise and searches")
    ] = 5
    size_px: Annotated[tuple[Count, Count], Meta(description="width and height of a mask")] = (
        320,
        240,
    )
    center: CenterSettings = CenterSettings()
    sweep: SweepSettings = SweepSettings()

    def __post_init__(self) -> None:
        """Check that there are such objects.

        Raises:
            StudyError: there is no such object.

        """
        check_names(self.objects, DESIGNS)


QUICK = ModelStudySettings(
    objects=("bottle", "drill"),
    seeds=2,
    center=CenterSettings(views=6, ellipsoids=3),
    sweep=SweepSettings(
        views=(3,),
        ellipsoids=(1,),
        edge_px=(4.0,),
        flipped=(0.1,),
        holes=(0.2,),
        place_mm=(10.0,),
        turn_deg=(1.0,),
    ),
)
