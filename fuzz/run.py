"""Fuzzes all that reads: `python -m fuzz.run --seconds 3600`, from the repository's folder.

Whatever raises something else than a ServoidError, takes longer than a few seconds or more than a
GiB is written to `fuzz/found`; put it into a law, and mend it.
"""

import argparse
import hashlib
import random
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from fuzz.mutations import mutate
from fuzz.targets import TARGETS, Target
from servoid.errors import ServoidError

LONGEST_S = 10.0
MOST_MIB = 1024.0
_REPORT_EVERY_S = 60.0
_MIB = 1 << (20 if sys.platform == "darwin" else 10)  # in the unit of ru_maxrss
_FOUND = Path(__file__).parent / "found"


@dataclass(frozen=True)
class Finding:
    """An input that something did not take as it should, and what became of it."""

    target: str
    data: bytes
    words: str


class Tally(Counter[str]):
    """Counts the different inputs of each target, and says now and then how far it is."""

    def __init__(self) -> None:
        super().__init__()
        self._start, self._reported_s = time.monotonic(), 0.0
        self._before: set[int] = set()

    def is_new(self, name: str, data: bytes) -> bool:
        """Count an input and return True, or False if this target had it before.

        It writes a line to standard error where the last one is long ago.
        """
        digest = hashlib.blake2b(data, digest_size=8, key=name.encode()).digest()
        known = len(self._before)
        self._before.add(int.from_bytes(digest, "little"))
        if len(self._before) == known:
            return False
        self[name] += 1
        now = time.monotonic() - self._start
        if now - self._reported_s > _REPORT_EVERY_S:
            self._reported_s = now
            print(f"{now:.0f} s: {self.total()} inputs", file=sys.stderr, flush=True)
        return True

    def words(self) -> str:
        """Say how many inputs each target had."""
        return ", ".join(f"{name} {count}" for name, count in self.most_common())


def tried(name: str, target: Target, data: bytes) -> Finding | None:
    """Feed a target; return what is wrong with its answer, None if nothing is."""
    # Of this process alone: on a machine that is busy anything takes long.
    start, peak = time.process_time(), _peak_mib()
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
    seconds = time.process_time() - start
    if seconds > LONGEST_S:
        return Finding(name, data, f"it took {seconds:.1f} s")
    grown = _peak_mib() - peak
    return Finding(name, data, f"it took {grown:.0f} MiB") if grown > MOST_MIB else None


def _peak_mib() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / _MIB


def findings(
    names: Sequence[str],
    seconds: float,
    seed: int,
    targets: dict[str, Target] = TARGETS,
    tally: Tally | None = None,
) -> Iterator[Finding]:
    """Fuzz targets in turn for so long, each input once; first each of their seeds as it is."""
    tally = Tally() if tally is None else tally
    everything = tuple(data for target in targets.values() for data in target.seeds)
    rng = random.Random(seed)
    for name in names:
        for data in targets[name].seeds:
            if tally.is_new(name, data) and (found := tried(name, targets[name], data)):
                yield found
    turn = tuple(name for name in names for _ in range(targets[name].often))
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for name in turn:
            data = mutate(rng, rng.choice(targets[name].seeds), everything)
            if tally.is_new(name, data) and (found := tried(name, targets[name], data)):
                yield found


def main() -> int:
    """Fuzz, write what was found, and say how much."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--target", action="append", choices=sorted(TARGETS))
    options = parser.parse_args()
    count, tally = 0, Tally()
    try:
        for found in findings(
            options.target or list(TARGETS), options.seconds, options.seed, tally=tally
        ):
            count += 1
            _FOUND.mkdir(exist_ok=True)
            place = _FOUND / f"{hashlib.sha256(found.data).hexdigest()[:12]}-{found.target}"
            place.write_bytes(found.data)
            print(f"{place}: {found.words}", flush=True)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
    print(f"{count} found in {tally.total()} inputs with seed {options.seed}: {tally.words()}")
    return int(count > 0)


if __name__ == "__main__":
    sys.exit(main())
