"""Model the research captures beside the repository, and score them over all their views.

Prints one line per capture, count and seed: the mean silhouette overlap over all views by a scorer
that reads the files independently, the wall seconds of the whole command, and whether one thread
and two give the same file. Missing captures are skipped.
"""

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
SERVOID = Path(sys.executable).with_name("servoid")
RUNS = [
    ("skull", "::2", 6),
    ("temple", "::2", 6),
    ("temple", "::2", 12),
    ("blowtorch", "::6", 6),
    ("blowtorch", "::6", 12),
]
SEEDS = (0, 1, 2)


def model(capture: Path, views: str, count: int, seed: int, out: Path, threads: int) -> float:
    """Run the command; return its wall seconds."""
    command = [SERVOID, "model", capture, "--out", out, "--views", views, "--delta", "0"]
    command += ["--max-ellipsoids", count, "--seed", seed, "--threads", threads]
    start = time.perf_counter()
    subprocess.run([str(part) for part in command], check=True, capture_output=True)
    return time.perf_counter() - start


def score(body: Path, capture: Path) -> float:
    """Run the independent scorer; return the mean overlap over all views."""
    command = [sys.executable, SHARED / "tools" / "score_body.py", body, capture]
    done = subprocess.run([str(part) for part in command], check=True, capture_output=True)
    found = re.search(rb"mean ([0-9.]+)", done.stdout)
    return float(found.group(1)) if found else float("nan")


def main() -> None:
    """Run all captures that are present."""
    print("capture      views  count  seed  mean IoU, all views  seconds  1 thread = 2 threads")
    with tempfile.TemporaryDirectory() as folder:
        one, two = Path(folder) / "one.json", Path(folder) / "two.json"
        for name, views, count in RUNS:
            capture = SHARED / "data" / "photos" / name
            if not capture.is_dir():
                print(f"{name:12} skipped: not in shared/data/photos beside the repository")
                continue
            for seed in SEEDS:
                seconds = model(capture, views, count, seed, two, threads=2)
                model(capture, views, count, seed, one, threads=1)
                same = "yes" if one.read_bytes() == two.read_bytes() else "NO"
                iou = score(two, capture)
                print(f"{name:12} {views:5} {count:6} {seed:5} {iou:20.4f} {seconds:8.2f}  {same}")


if __name__ == "__main__":
    main()
