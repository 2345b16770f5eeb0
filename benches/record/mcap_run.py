"""Time the cost of recording as MCAP for the tracking thread, and count losses of a live source.

A drawn stereo pair is played at its own rate through a source of images in memory. Each step is
added to the recording while its writer runs, as `servoid track --mcap` does. The reported time is
that of adding, as wall time and as CPU time of the thread: on a busy machine, wall time includes
other programs. The time of a tracker step is printed beside it.
"""

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from servoid._native import Tracker
from servoid.capture import Capture, open_capture
from servoid.exchange.bags.writing import ObjectState, RunRig, mcap_run
from servoid.model import fit_capture
from servoid.shape import Body
from servoid.sim import write_moving_sample
from servoid.source import Instant, cameras_of, read_instants

RATE_HZ = 30.0
MOST_MS = 0.3  # largest time of the tracker's thread that adding a step may take


def main() -> None:
    """Play a recording, as it is stored and as pixels, and print the time of adding."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--passes", type=int, default=4, help="how often the recording is played")
    parser.add_argument("--rate", type=float, default=RATE_HZ, help="observations a second")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_moving_sample(folder / "moving")
        capture = open_capture(folder / "moving")
        body = fit_capture(capture).body
        instants = list(read_instants(capture, capture.observations()))
        width, height = cameras_of(capture)[0].size_px
        print(f"{len(instants)} pairs of {width}x{height}, {options.rate:g} a second")
        print(
            f"{'images':>10} {'clock ms':>9} {'p99':>7} {'thread ms':>10} {'p99':>7} {'step ms':>8}"
        )
        for label, rig in (
            ("as stored", RunRig.of_capture(capture)),
            ("pixels", RunRig.of_source(cameras_of(capture), instants[0].names)),
        ):
            path = folder / "run.mcap"
            times, notes = play(path, rig, capture, body, instants * options.passes, options.rate)
            clock, thread, step = (1e3 * np.array(one) for one in zip(*times, strict=True))
            marks = [np.percentile(one, share) for one in (clock, thread) for share in (50, 99)]
            print("{:>10} {:9.3f} {:7.3f} {:10.3f} {:7.3f}".format(label, *marks), end="")
            print(f" {np.median(step):8.2f}", *notes)
            if marks[3] > MOST_MS:
                print(f"more than the {MOST_MS} ms that it may take")


def play(
    path: Path,
    rig: RunRig,
    capture: Capture,
    body: Body,
    instants: Sequence[Instant],
    rate_hz: float,
) -> tuple[list[tuple[float, float, float]], list[str]]:
    """Track and record; return the seconds of adding and of steps, and what was lost."""
    tracker = Tracker(cameras_of(capture), body)
    spent = []
    begun = time.perf_counter()
    with mcap_run(path, rig, can_wait=False) as run:
        for number, instant in enumerate(instants):
            time_s, stepping = number / rate_hz, time.perf_counter()
            seen = (time_s, instant.world_from_camera, instant.images)
            first = number == 0
            estimate = (
                tracker.start(*seen, body.world_from_object) if first else tracker.step(*seen)
            )
            state = ObjectState("object", estimate, body if first else None)
            now = Instant(instant.index, time_s, *seen[1:], names=instant.names)
            before, busy = time.perf_counter(), time.thread_time()
            run.see(now, [state])
            busy = time.thread_time() - busy
            spent.append((time.perf_counter() - before, busy, before - stepping))
            time.sleep(max(0.0, begun + time_s + 1.0 / rate_hz - time.perf_counter()))
    return spent, run.notes()


if __name__ == "__main__":
    main()
