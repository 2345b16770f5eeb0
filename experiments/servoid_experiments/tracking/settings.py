"""The settings of the study of tracking: factors, centre, and every number."""

from typing import Annotated

from msgspec import Meta, Struct

from servoid.sim.world.objects import OBJECTS
from servoid_experiments.sweeping import check_names, check_varied
from servoid_experiments.tracking.cases import Count, Eyes, NotNegative, Positive, Share


class CenterSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The case in the centre: factors that are not varied have these values."""

    object: Annotated[str, Meta(description="a shipped object")] = "bottle"
    way_mm: Annotated[
        Positive, Meta(description="of the object's middle from one image to the next")
    ] = 12.0
    population: Annotated[
        Count | None, Meta(description="hypotheses a generation; none: each tracker's default")
    ] = None
    generations: Annotated[
        Count | None, Meta(description="an image; none: the tracker's default")
    ] = None
    ellipsoids: Annotated[Count, Meta(description="of the body that is tracked")] = 5
    noise: Annotated[
        NotNegative, Meta(description="standard deviation of a pixel's noise in grey levels")
    ] = 2.0
    light: Annotated[Positive, Meta(description="what the light is multiplied by halfway")] = 1.0
    hidden: Annotated[
        Share, Meta(description="share of the object that is hidden in the third quarter")
    ] = 0.0
    baseline_mm: Annotated[Positive, Meta(description="from eye to eye")] = 120.0
    eyes: Annotated[Eyes, Meta(description="verged or parallel")] = Eyes.VERGED

    def __post_init__(self) -> None:
        """Check that there is such an object.

        Raises:
            StudyError: there is none.

        """
        check_names([self.object], OBJECTS)


class SweepSettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The values of each factor, which are varied one at a time; empty: not varied."""

    way_mm: Annotated[tuple[Positive, ...], Meta(description="mm an image")] = (
        2.0, 5.0, 20.0, 30.0, 45.0, 60.0, 90.0,
    )  # fmt: skip
    population: Annotated[tuple[Count, ...], Meta(description="hypotheses a generation")] = (
        8, 16, 50, 100, 200,
    )  # fmt: skip
    generations: Annotated[tuple[Count, ...], Meta(description="an image")] = (2, 4, 8)
    ellipsoids: Annotated[tuple[Count, ...], Meta(description="of the body")] = (1, 2, 3, 8)
    noise: Annotated[tuple[NotNegative, ...], Meta(description="grey levels")] = (
        0.0, 6.0, 12.0, 24.0, 48.0,
    )  # fmt: skip
    light: Annotated[tuple[Positive, ...], Meta(description="what it is multiplied by")] = (
        0.1, 0.2, 0.4, 0.7, 1.5, 2.5,
    )  # fmt: skip
    hidden: Annotated[tuple[Share, ...], Meta(description="share of the object")] = (
        0.25, 0.5, 0.75, 1.0,
    )  # fmt: skip
    baseline_mm: Annotated[
        tuple[Positive, ...], Meta(description="mm, with eyes of both kinds")
    ] = (20.0, 60.0, 240.0, 400.0)
    object: Annotated[tuple[str, ...], Meta(description="shipped objects")] = (
        "mug", "drill", "two_ellipsoids",
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Check that something is varied, and that there are such objects.

        Raises:
            StudyError: nothing is, or there is no such object.

        """
        check_varied(self)
        check_names(self.object, OBJECTS)


class TrackStudySettings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of the study of tracking."""

    seeds: Annotated[
        int, Meta(ge=1, description="scenes a case: paths, rooms, noise and searches")
    ] = 8
    images: Annotated[int, Meta(ge=12, description="a scene")] = 48
    size_px: Annotated[tuple[Count, Count], Meta(description="width and height of an image")] = (
        320,
        240,
    )
    near: Annotated[
        float,
        Meta(gt=0.0, description="ADD up to which a pose counts as right, in object diameters"),
    ] = 0.1
    center: CenterSettings = CenterSettings()
    sweep: SweepSettings = SweepSettings()


QUICK = TrackStudySettings(
    seeds=2,
    images=24,
    sweep=SweepSettings(
        way_mm=(30.0, 90.0),
        population=(8,),
        generations=(4,),
        ellipsoids=(1,),
        noise=(24.0,),
        light=(0.2,),
        hidden=(0.75,),
        baseline_mm=(30.0,),
        object=(),
    ),
)
