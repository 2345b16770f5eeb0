"""What a soak counts: memory, what was not as promised, and how much was run."""

import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[2] / "tests" / "fixtures"))

from resident_memory import STATM, resident_mb

_MIB = (1 << 20) / 1e6  # in MB
_WARMING = 0.3  # share of the samples before memory must be flat
_FEWEST = 10  # samples of which a slope can be told
MOST_GROWTH_MIB = 5.0  # a thousand images; while caches fill, in the first runs, it is up to 3.4


def resident_mib() -> float:
    """Return the memory that this process uses, NaN where the system does not say.

    What its allocators keep of what was freed does not count: it sways by 100 MiB.
    """
    return resident_mb() / _MIB if STATM.is_file() else float("nan")


@dataclass(eq=False)
class Health:
    """Collects what was run and what was wrong with it."""

    began: float = field(default_factory=time.monotonic)
    images: int = 0  # that a tracker took by itself
    runs: int = 0
    servoed: int = 0  # images that trackers took while servoing
    servoed_s: float = 0.0  # of servoing, by the simulated clock
    counts: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)
    memory: list[tuple[int, float]] = field(default_factory=list)

    @property
    def servo_hours(self) -> float:
        """Return how long arms have servoed, by the clocks of their worlds."""
        return self.servoed_s / 3600.0

    @property
    def hours(self) -> float:
        """Return how long the soak has run, by the clock on the wall."""
        return (time.monotonic() - self.began) / 3600.0

    def wrong(self, words: str) -> None:
        """Note what was not as promised, and say it at once."""
        self.faults.append(words)
        print(f"WRONG: {words}", file=sys.stderr, flush=True)

    def sample(self) -> None:
        """Note how much memory is held now."""
        self.memory.append((self.images + self.servoed, resident_mib()))

    def growth_mib(self) -> float:
        """Return how much memory grows in a thousand images, NaN if that cannot be told yet.

        It is the median slope between samples, as single ones stand out where a world was drawn.
        """
        settled = self.memory[int(_WARMING * len(self.memory)) :]
        if len(settled) < _FEWEST:
            return float("nan")
        images, mib = np.array(settled, dtype=np.float64).T
        first, second = np.triu_indices(len(images), 1)
        apart = images[second] - images[first]
        later = apart > 0
        slopes = (mib[second] - mib[first])[later] / apart[later]
        return 1000.0 * float(np.median(slopes)) if len(slopes) else float("nan")

    def end(self) -> int:
        """Judge memory, say all that was found, and return the status of the command."""
        growth = self.growth_mib()
        if growth > MOST_GROWTH_MIB:
            self.wrong(f"memory grows by {growth:.2f} MiB in a thousand images")
        print(self.words())
        return int(bool(self.faults))

    def words(self) -> str:
        """Say in a few lines how much was run and what came of it."""
        held = [mib for _, mib in self.memory] or [float("nan")]
        counted = ", ".join(f"{name} {count}" for name, count in sorted(self.counts.items()))
        return "\n".join(
            (
                f"{self.images} images tracked, {self.servo_hours:.2f} simulated hours of servoing "
                f"in {self.runs} runs with {self.servoed} images, {self.hours:.2f} hours of work",
                f"memory {held[0]:.0f} MiB at first, {held[-1]:.0f} at last, at most "
                f"{max(held):.0f}; {self.growth_mib():.2f} more in a thousand images",
                counted,
                f"{len(self.faults)} not as promised",
            )
        )
