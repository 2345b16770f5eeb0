"""What every study of sweeps says of its seeds, its failures and its factors."""

from collections.abc import Sequence

from servoid_experiments.design import Done
from servoid_experiments.sweeping.factor import Factor
from servoid_experiments.sweeping.spread import confidence

_REASONS = 3  # that are told


def band_words(seeds: int) -> str:
    """Say what lines and bands of a picture are."""
    return (
        f"Lines are the median over {seeds} seeds, bands reach from the lowest to the highest: "
        f"with {percent_sure(seeds, 1)} % confidence the median over all seeds lies within."
    )


def percent_sure(seeds: int, digits: int) -> str:
    """Write the confidence in a band of so many seeds in percent; no number makes it 100."""
    return f"{min(100.0 * confidence(seeds), 100.0 - 0.1**digits):.{digits}f}"


def failure_words(failed: Sequence[Done]) -> tuple[str, ...]:
    """Say how many trials failed and why, or nothing."""
    if not failed:
        return ()
    reasons = list(dict.fromkeys(done.failure for done in failed))
    count = "1 trial failed and is" if len(failed) == 1 else f"{len(failed)} trials failed and are"
    return (f"{count} left out; why: {'; '.join(reasons[:_REASONS])}",)


def named(factor: Factor) -> str:
    """Return a factor's name with its unit."""
    return f"{factor.title} [{factor.unit}]" if factor.unit else factor.title
