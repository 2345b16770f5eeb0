"""The settings of the study of frequency responses and margins, with their defaults."""

from typing import Annotated

import msgspec
from msgspec import Meta

from servoid.errors import StudyError
from servoid.sim.world import BACKGROUNDS, OBJECTS
from servoid_experiments.sweeping import check_names

Line = Annotated[int, Meta(ge=1)]
NotNegative = Annotated[float, Meta(ge=0)]
Positive = Annotated[float, Meta(gt=0)]


class ResponseSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The object swings at many frequencies at once, and hand and eyes follow it."""

    object: Annotated[str, Meta(description="what is followed, as in world.object.name")] = (
        "painted_ellipsoid"
    )
    background: Annotated[str, Meta(description="what stands behind it")] = "cluttered"
    seeds: Annotated[
        int, Meta(ge=2, description="runs of each variant, which differ in phases, noise and room")
    ] = 6
    base_hz: Annotated[
        float, Meta(gt=0, description="of which all frequencies are multiples; its period is a run")
    ] = 0.05
    sideways_lines: Annotated[
        tuple[Line, ...], Meta(description="multiples at which the object swings to the right")
    ] = (1, 2, 4, 6, 8, 11, 15, 20, 26, 33, 40)
    depth_lines: Annotated[
        tuple[Line, ...], Meta(description="multiples at which it swings away from the hand")
    ] = (3, 5, 7, 10, 13, 17, 22, 29, 35, 39)
    speed: Annotated[float, Meta(gt=0, description="greatest speed of one frequency, m/s")] = 0.01
    amplitude: Annotated[float, Meta(gt=0, description="greatest amplitude of one, m")] = 0.02
    run_in_s: Annotated[
        float, Meta(ge=3, description="of following before the period that counts, s")
    ] = 5.0
    lag_hz: Annotated[
        float, Meta(gt=0, description="frequency at which lags are told; one of those sideways")
    ] = 0.1

    def __post_init__(self) -> None:
        """Check that the names exist, and that the frequencies are distinct.

        Raises:
            StudyError: there is no such object or background, or a line is in both lists, is twice
                in one, or is missing where a lag is to be reported.

        """
        check_names([self.object], OBJECTS)
        check_names([self.background], BACKGROUNDS, "background")
        lines = (*self.sideways_lines, *self.depth_lines)
        twice = sorted({line for line in lines if lines.count(line) > 1})
        if twice or not self.sideways_lines or not self.depth_lines:
            raise StudyError(
                f"sideways_lines are {list(self.sideways_lines)} and depth_lines "
                f"{list(self.depth_lines)}; give each of them one line or more, and none twice"
            )
        known = [line * self.base_hz for line in self.sideways_lines]
        if min(abs(hz - self.lag_hz) for hz in known) > 1e-9:
            raise StudyError(
                f"lag_hz is {self.lag_hz:g}; choose one of "
                f"{', '.join(f'{hz:g}' for hz in known)}, which sideways_lines ask for"
            )


class MarginSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The loop without images: exact poses that arrive late, at the cameras' rate."""

    latencies_s: Annotated[
        tuple[NotNegative, ...],
        Meta(description="from the exposure to the arrival of a pose, s"),
    ] = (0.0, 0.04, 0.08, 0.12, 0.2)
    rates_hz: Annotated[tuple[Positive, ...], Meta(description="poses each second")] = (
        10.0,
        30.0,
        60.0,
        120.0,
    )
    share: Annotated[
        float, Meta(gt=0, le=1, description="of the gain at which the loop swings, to use at most")
    ] = 0.5


class BodeSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Frequency responses and stability margins."""

    response: ResponseSettings = ResponseSettings()
    margin: MarginSettings = MarginSettings()


QUICK = BodeSettings(
    response=ResponseSettings(
        seeds=2,
        background="plain",
        base_hz=0.25,
        sideways_lines=(1, 3, 8),
        depth_lines=(2, 5, 7),
        run_in_s=3.0,
        lag_hz=0.25,
    ),
    margin=MarginSettings(latencies_s=(0.04,), rates_hz=(30.0,)),
)
