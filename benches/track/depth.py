"""Track drawn objects that turn before one camera: with its depth images, and without.

The courses are those of the laws of trust, 4.5 degrees per image, 640x480; depth has the noise and
the holes of structured light. Without depth, the true initial distance is given, and a scale is
fitted to the images reported as tracked. Each row is a seed, which selects another object.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from sequences import Recording, Table
from servoid.exchange import open_any

sys.path.extend(
    str(Path(__file__).resolve().parents[2] / "tests" / part) for part in ("fixtures", "scenes")
)

from trust_scenes import COURSES, FULL, write_depth_course
from trust_verdicts import verdicts

COURSE, SEEDS = "turn", 4


def measure(folder: Path, seed: int, table: Table, *, with_depth: bool) -> None:
    """Print a row: the results for a recording."""
    recording = Recording(COURSE, folder, open_any(folder))
    result = recording.track(seed=seed)
    found = verdicts(
        result.tracked, recording.true_poses, recording.vertices, scaled=not with_depth
    )
    located = [one.estimate.located for one in result.tracked[1:]]
    right = found.add[found.right]
    table.row(
        COURSES[COURSE].object_of(seed),
        "yes" if with_depth else "no",
        100.0 * float(np.mean(located)),
        100.0 * float(found.right.mean()),
        int(found.trusted_wrong.sum()),
        1000.0 * float(np.median(right)) if len(right) else float("nan"),
    )


def main() -> None:
    """Draw, track and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"how many (default {SEEDS})")
    table = Table("object           ", "depth", "located %", "right %", "wrong", "ADD mm")
    for seed in range(parser.parse_args().seeds):
        with tempfile.TemporaryDirectory() as name:
            folder = write_depth_course(Path(name) / "course", COURSE, seed, FULL)
            measure(folder, seed, table, with_depth=True)
            text = (folder / "capture.toml").read_text()
            (folder / "capture.toml").write_text(text[: text.index("depths =")])
            measure(folder, seed, table, with_depth=False)


if __name__ == "__main__":
    main()
