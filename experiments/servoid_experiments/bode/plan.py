"""The settings of the study of frequency responses and margins, and their runs."""

from collections.abc import Iterator, Sequence
from typing import Annotated

import msgspec
from msgspec.structs import asdict

from servoid.batch import Work
from servoid.errors import StudyError
from servoid.sim.world import BACKGROUNDS, OBJECTS
from servoid_experiments.bode.margin import (
    FIXED_EYES,
    MARGIN,
    NO_FEED_FORWARD,
    NO_PREDICTION,
    PAPER,
    SERVOID,
    Loop,
    MarginCase,
)
from servoid_experiments.bode.response import RESPONSE, ResponseCase
from servoid_experiments.design import Count, NotNegative, Positive, about
from servoid_experiments.sweep import check_names

VARIANTS: dict[str, tuple[bool, bool]] = {
    "feed-forward, eyes follow": (True, True),
    "feed-forward, fixed cameras": (True, False),
    "no feed-forward, eyes follow": (False, True),
    "no feed-forward, fixed cameras": (False, False),
}
"""Whether motion is fed forward and eyes follow, by the variant's name."""

MAPS: dict[str, tuple[Loop, str]] = {
    "servoid, eyes follow": (SERVOID, "delay"),
    "servoid, fixed eyes": (FIXED_EYES, "delay"),
    "no feed-forward, eyes follow": (NO_FEED_FORWARD, "delay"),
    "neither feed-forward nor prediction, eyes follow": (NO_PREDICTION, "delay"),
    "the paper's law, no time stamps": (PAPER, "gain"),
}
"""The loops and the sought margin at each latency and rate, by name."""

HALF = 0.5  # scale of the runs that test whether responses depend on the amplitude
_HALVED = 2  # seeds of these, at most


class ResponseSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The object swings at many frequencies at once, and hand and eyes follow it."""

    object: Annotated[str, about("what is followed, as in world.object.name")] = "painted_ellipsoid"
    background: Annotated[str, about("what stands behind it")] = "cluttered"
    seeds: Annotated[
        int, about("runs of each variant, which differ in phases, noise and room", ge=2)
    ] = 6
    base_hz: Annotated[
        float, about("of which all frequencies are multiples; its period is a run", gt=0)
    ] = 0.05
    sideways_lines: Annotated[
        tuple[Count, ...], about("multiples at which the object swings to the right")
    ] = (1, 2, 4, 6, 8, 11, 15, 20, 26, 33, 40)
    depth_lines: Annotated[
        tuple[Count, ...], about("multiples at which it swings away from the hand")
    ] = (3, 5, 7, 10, 13, 17, 22, 29, 35, 39)
    speed: Annotated[float, about("greatest speed of one frequency, m/s", gt=0)] = 0.01
    amplitude: Annotated[float, about("greatest amplitude of one, m", gt=0)] = 0.02
    run_in_s: Annotated[float, about("of following before the period that counts, s", ge=3)] = 5.0
    lag_hz: Annotated[
        float, about("frequency at which lags are told; one of those sideways", gt=0)
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
        about("from the exposure to the arrival of a pose, s"),
    ] = (0.0, 0.04, 0.08, 0.12, 0.2)
    rates_hz: Annotated[tuple[Positive, ...], about("poses each second")] = (
        10.0,
        30.0,
        60.0,
        120.0,
    )
    share: Annotated[
        float, about("of the gain at which the loop swings, to use at most", gt=0, le=1)
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


def plan(settings: BodeSettings) -> Sequence[Work]:
    """List the runs with images, and the margins without images."""
    return (
        Work(RESPONSE, list(_responses(settings.response))),
        Work(MARGIN, list(_margins(settings.margin))),
    )


def _responses(settings: ResponseSettings) -> Iterator[ResponseCase]:
    fixed = asdict(settings)
    seeds = fixed.pop("seeds")
    del fixed["lag_hz"]
    runs = [(seed, *variant, 1.0) for seed in range(seeds) for variant in VARIANTS.values()]
    runs += [(seed, True, True, HALF) for seed in range(min(_HALVED, seeds // 2))]
    for seed, feed_forward, eyes_follow, scale in runs:
        yield ResponseCase(
            **fixed, seed=seed, feed_forward=feed_forward, eyes_follow=eyes_follow, scale=scale
        )


def _margins(settings: MarginSettings) -> Iterator[MarginCase]:
    for loop, seeks in MAPS.values():
        for latency_s in settings.latencies_s:
            for rate_hz in settings.rates_hz:
                yield MarginCase(loop=loop, latency_s=latency_s, rate_hz=rate_hz, seeks=seeks)
    # With timestamps the gain margin is the same everywhere, which the corners show.
    for latency_s in dict.fromkeys((min(settings.latencies_s), max(settings.latencies_s))):
        for rate_hz in dict.fromkeys((min(settings.rates_hz), max(settings.rates_hz))):
            yield MarginCase(loop=SERVOID, latency_s=latency_s, rate_hz=rate_hz, seeks="gain")
