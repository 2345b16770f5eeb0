"""Soaks: `python -m fuzz.soak --hours 24 --images 100000`, from the repository's folder.

Hours are those of servoing by the simulated clock, without the meeting before. It ends when both
were reached, says what was run and found, and ends with 1 where anything was not as promised:
memory that grows, files that are not whole, poses that are wrong and said to be tracked more than
once in a row, exceptions that are no ServoidError, estimates that cannot be.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from fuzz.soak.health import Health
from fuzz.soak.servoing import SECONDS, soak_servoing
from fuzz.soak.tracking import soak_tracking

STRETCH = 1500  # images of a track, between servo runs
_REPORT_EVERY_S = 300.0


def soak(health: Health, hours: float, images: int, seed: int, seconds: float) -> None:
    """Track and servo in turn until so many images and simulated hours are over.

    Each run servoes for `seconds`.
    """
    reported_s = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        turn = 0
        while health.servo_hours < hours or health.images < images:
            tracking, serving = np.random.default_rng([seed, turn]).spawn(2)
            if health.images < images:
                soak_tracking(tracking, min(STRETCH, images - health.images), Path(folder), health)
            if health.servo_hours < hours:
                soak_servoing(serving, Path(folder), health, seconds)
            health.sample()
            turn += 1
            if time.monotonic() - reported_s > _REPORT_EVERY_S:
                reported_s = time.monotonic()
                print(health.words(), file=sys.stderr, flush=True)


def main() -> int:
    """Soak, and say what was run and found."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--hours", type=float, default=1.0, help="servo so long, simulated")
    parser.add_argument("--images", type=int, default=0, help="track so many by themselves")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--seconds",
        type=float,
        default=SECONDS,
        help="servo so long in each run, simulated; meeting the object takes the most time",
    )
    options = parser.parse_args()
    if not options.seconds > 0.0:
        parser.error(f"runs of {options.seconds:g} s servo to nothing; give more than 0")
    health = Health()
    try:
        soak(health, options.hours, options.images, options.seed, options.seconds)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
    return health.end()


if __name__ == "__main__":
    sys.exit(main())
