"""Fuzzes all that reads: `python -m fuzz.run --seconds 3600`, from the repository's folder.

Whatever raises something else than a ServoidError, or takes longer than a few seconds, is written
to `fuzz/found`; put it into a law, and mend it.
"""

import argparse
import hashlib
import random
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from fuzz.mutations import mutate
from fuzz.targets import TARGETS, Target
from servoid.errors import ServoidError

LONGEST_S = 10.0
_FOUND = Path(__file__).parent / "found"


@dataclass(frozen=True)
class Finding:
    """An input that something did not take as it should, and what became of it."""

    target: str
    data: bytes
    words: str


def tried(name: str, target: Target, data: bytes) -> Finding | None:
    """Feed a target; return what is wrong with its answer, None if nothing is."""
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            target.run(data, Path(folder))
        except ServoidError as error:
            if "\n" in str(error).strip() and "\n" not in data.decode("latin-1"):
                return Finding(name, data, f"an error of several lines: {error}")
        except (KeyboardInterrupt, SystemExit):
            raise
        except BaseException:  # a panic of the core is no Exception
            return Finding(name, data, traceback.format_exc())
    seconds = time.perf_counter() - start
    return Finding(name, data, f"it took {seconds:.1f} s") if seconds > LONGEST_S else None


def findings(
    names: Sequence[str], seconds: float, seed: int, targets: dict[str, Target] = TARGETS
) -> Iterator[Finding]:
    """Fuzz targets in turn for so long; first each of their seeds as it is."""
    everything = tuple(data for target in targets.values() for data in target.seeds)
    rng = random.Random(seed)
    for name in names:
        for data in targets[name].seeds:
            if (found := tried(name, targets[name], data)) is not None:
                yield found
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for name in names:
            data = mutate(rng, rng.choice(targets[name].seeds), everything)
            if (found := tried(name, targets[name], data)) is not None:
                yield found


def main() -> int:
    """Fuzz, write what was found, and say how much."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--target", action="append", choices=sorted(TARGETS))
    asked = parser.parse_args()
    count = 0
    for found in findings(asked.target or list(TARGETS), asked.seconds, asked.seed):
        count += 1
        _FOUND.mkdir(exist_ok=True)
        place = _FOUND / f"{hashlib.sha256(found.data).hexdigest()[:12]}-{found.target}"
        place.write_bytes(found.data)
        print(f"{place}: {found.words}")
    print(f"{count} found in {asked.seconds:.0f} s with seed {asked.seed}")
    return int(count > 0)


if __name__ == "__main__":
    sys.exit(main())
