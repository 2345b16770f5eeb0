"""The runs of the study of frequency responses and margins."""

from collections.abc import Iterator, Sequence

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
from servoid_experiments.bode.settings import BodeSettings, MarginSettings, ResponseSettings
from servoid_experiments.design import Work

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


def plan(settings: BodeSettings) -> Sequence[Work]:
    """List the runs with images, and the margins without images."""
    return (
        Work(RESPONSE, list(_responses(settings.response))),
        Work(MARGIN, list(_margins(settings.margin))),
    )


def _responses(settings: ResponseSettings) -> Iterator[ResponseCase]:
    for seed in range(settings.seeds):
        for variant in VARIANTS.values():
            yield _response(settings, seed, variant, 1.0)
    for seed in range(min(_HALVED, settings.seeds // 2)):
        yield _response(settings, seed, (True, True), HALF)


def _response(
    settings: ResponseSettings, seed: int, variant: tuple[bool, bool], scale: float
) -> ResponseCase:
    feed_forward, eyes_follow = variant
    return ResponseCase(
        seed=seed,
        feed_forward=feed_forward,
        eyes_follow=eyes_follow,
        object=settings.object,
        background=settings.background,
        base_hz=settings.base_hz,
        sideways_lines=settings.sideways_lines,
        depth_lines=settings.depth_lines,
        speed=settings.speed,
        amplitude=settings.amplitude,
        run_in_s=settings.run_in_s,
        scale=scale,
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
