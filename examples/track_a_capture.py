"""Tracks the toy of a moving sample, and compares its motion with the true one.

Run it after `make samples`: `.venv/bin/python examples/track_a_capture.py out/moving`
"""

import sys
from pathlib import Path

import numpy as np

from servoid.capture import open_capture
from servoid.errors import ServoidError
from servoid.record import read_trajectory
from servoid.track import TrackStep, follow


def show(step: TrackStep) -> None:
    """Show the status of the object on one line that is overwritten."""
    estimate = step.tracked[0].estimate
    words = f"{estimate.time_s:6.2f} s  {estimate.status}, {estimate.confidence:4.0%}"
    print(f"\r{words:40}", end="", file=sys.stderr)


def main(folder: str) -> None:
    """Track from the mask of the first image alone, and measure the error of each estimate."""
    truth = read_trajectory(Path(folder) / "truth" / "left_from_object.csv")
    away_mm, turned_deg, first_from_true = [], [], None
    for step in follow(open_capture(folder)):
        show(step)
        found = step.tracked[0].estimate.world_from_object
        true = truth[step.instant.index].world_from_object
        # The frames of the body and of the toy differ by a constant pose.
        first_from_true = first_from_true or found.inverse() @ true
        error = (true.inverse() @ found @ first_from_true).log()
        away_mm.append(1e3 * np.linalg.norm(error[:3]))
        turned_deg.append(np.degrees(np.linalg.norm(error[3:])))
    print(file=sys.stderr)
    print(f"{len(away_mm)} observations")
    print(f"off by {np.median(away_mm):.1f} mm, {np.median(turned_deg):.1f} degrees (median)")
    print(f"at most {max(away_mm):.1f} mm, {max(turned_deg):.1f} degrees")


if __name__ == "__main__":
    try:
        main(sys.argv[1] if len(sys.argv) > 1 else "out/moving")
    except ServoidError as error:  # says what to do
        sys.exit(f"error: {error}")
