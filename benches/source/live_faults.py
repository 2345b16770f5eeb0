"""Track a stream of two cameras with injected faults, and measure how soon tracking resumes.

A server in a process of its own sends the JPEG files of a bottle's recording, back and forth, with
the timestamps of their images; `servoid track` follows them live. Each fault has a run of its own.
The output is the first notice, for how long no observation came, the time from the last observation
that reports the fault to the first that is tracked, the longest time from then on without a tracked
one, and the share of tracked observations from the first one on. The recording is expected beside
the repository; without it the bench is skipped.

Run it with: python benches/source/live_faults.py [killed] [stalled] [dropped] [small] [jump]
"""

import csv
import itertools
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "fixtures" / "source"))

from served_images import served

from servoid.capture import open_capture
from servoid.model import fit_capture
from servoid.segment import MaskTarget
from servoid.track import learn_appearance

BOTTLE = Path(__file__).resolve().parents[3] / "shared" / "data" / "stereo" / "mustard"
RATE_HZ, RUN_S, FAULT_S = 15.0, 22.0, 15.0  # the fault begins FAULT_S after the server
KILLED_S, JUMP_S = 2.0, -100.0
RIG_CAMERA = """
[[camera]]
name = "{name}"
device = "{address}/{name}{faults}"
size_px = {size}
focal_px = {focal}
center_px = {center}
rig_from_camera = {pose}
"""


@dataclass(frozen=True)
class Fault:
    """A fault of the server, and the notice that must report it."""

    query: str
    notice: str
    is_killed: bool = False


FAULTS = {
    "killed": Fault("", r"no image came for [1-9][^;]*; it was opened anew", is_killed=True),
    "stalled": Fault(f"?stall={FAULT_S},2", r"no image came for [1-9]\.\d s"),
    "dropped": Fault("?drop=7", r"1 image is missing before this one"),
    "small": Fault(f"?small={FAULT_S},2", r"the image is 320x240 pixels, but the lens has 640x480"),
    "jump": Fault(f"?jump={FAULT_S},{JUMP_S}", r"its clock went back by \d+\.\d s"),
}


@dataclass(frozen=True)
class Row:
    """One observation of a track."""

    time_s: float
    is_tracked: bool
    notices: str


def main() -> None:
    """Measure the requested faults, or all."""
    if not BOTTLE.is_dir():
        print("skipped: not in shared/data beside the repository")
        return
    unknown = set(sys.argv[1:]) - set(FAULTS)
    if unknown:
        sys.exit(f"no fault is called {', '.join(sorted(unknown))}; choose of {', '.join(FAULTS)}")
    print(f"fault    {'told':40}  silent s  tracked after s  longest lost s  tracked")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        result = fit_capture(
            open_capture(BOTTLE), targets=[MaskTarget(next((BOTTLE / "masks").glob("*.png")))]
        )
        result.save(folder / "body.json", learn_appearance(result))
        for word in sys.argv[1:] or FAULTS:
            print(f"{word:8} {judged(run(folder, FAULTS[word]), FAULTS[word])}")


def run(folder: Path, fault: Fault) -> list[Row]:
    """Track the streams live while the fault happens, and return the observations."""
    with served(BOTTLE, rate_hz=RATE_HZ) as address:
        began_s = time.monotonic()
        tracking = track(folder, write_rig(folder / "rig.toml", address, fault.query))
        if fault.is_killed:
            time.sleep(max(0.0, began_s + FAULT_S - time.monotonic()))
        else:
            tracking.wait()
    if fault.is_killed:
        time.sleep(KILLED_S)
        with served(BOTTLE, int(address.rpartition(":")[2]), RATE_HZ):
            tracking.wait()
    if tracking.returncode:
        sys.exit(f"servoid track ended with {tracking.returncode}")
    with (folder / "poses.csv").open(newline="") as file:
        return [
            Row(float(row["time_s"]), row["status"] == "tracking", row["notices"])
            for row in csv.DictReader(file)
        ]


def track(folder: Path, rig: Path) -> "subprocess.Popen[bytes]":
    """Start `servoid track` in a process of its own."""
    command = [sys.executable, "-m", "servoid", "track", str(rig), "--body", "body.json"]
    command += ["--duration", str(RUN_S), "--out", "poses.csv"]
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, cwd=folder, stdout=quiet, stderr=quiet)


def write_rig(path: Path, address: str, faults: str) -> Path:
    """Write the recording's cameras as a live rig."""
    tables = [
        RIG_CAMERA.format(
            name=camera.name,
            address=address,
            faults=faults,
            size=list(camera.lens.size_px),
            focal=list(camera.lens.focal_px),
            center=list(camera.lens.center_px),
            pose=camera.rig_from_camera.matrix().tolist(),
        )
        for camera in open_capture(BOTTLE).cameras
    ]
    path.write_text("version = 1\n" + "".join(tables))
    return path


def judged(rows: Sequence[Row], fault: Fault) -> str:
    """Return a line of figures; it states if the fault was not reported."""
    begun = next((at for at, row in enumerate(rows) if row.is_tracked), None)
    if begun is None:
        return "never tracked: this machine is too busy, or too slow"
    share = sum(row.is_tracked for row in rows[begun:]) / len(rows[begun:])
    found = [re.search(fault.notice, row.notices) for row in rows]
    first = next((at for at, match in enumerate(found) if match), None)
    if first is None:
        return f"NOT TOLD; {share:.1%} tracked"
    steps = itertools.pairwise(rows[begun:])
    silent_s = max(after.time_s - before.time_s for before, after in steps)
    # The last observation that reports the fault is the first one after it, or its last one.
    last = max(at for at, match in enumerate(found) if match)
    back_s = next((row.time_s for row in rows[last:] if row.is_tracked), float("inf"))
    text = next(match[0] for match in found if match)
    lost_s, since_s = 0.0, rows[last].time_s
    for row in rows[last:]:
        lost_s = max(lost_s, row.time_s - since_s)
        since_s = row.time_s if row.is_tracked else since_s
    after_s = back_s - rows[last].time_s
    return f"{text[:40]:40} {silent_s:9.2f} {after_s:16.2f} {lost_s:15.2f} {share:8.1%}"


if __name__ == "__main__":
    main()
