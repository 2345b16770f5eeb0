"""Measure the effect of the tracker's tuning constants: each smaller and larger, all else equal.

A constant is well chosen if changing it by a quarter more or a fifth less improves nothing, and
suitable as a constant in the code if that makes nothing much worse. For each requested one, this
changes a copy of the Rust sources, builds it, tracks the courses of trust that the tests draw, and
writes to `tuning.tsv` how many more images were tracked rightly than with the usual value, and how
many more were wrong and trusted. The table of the page on tuning is generated from it.

Run it with: python benches/trust/tuning.py [--seeds N] [CONSTANT ...]
A CONSTANT is a file and a name, such as `trust/mod.rs:LOCATED`, or the beginning of that; without
one, nothing is measured, and only the page's table is written.
"""

import argparse
import csv
import io
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

from servoid.exchange import open_any
from servoid.output import write_whole
from servoid.track import Request, track_capture

sys.path.extend(
    str(Path(__file__).resolve().parents[2] / part)
    for part in ("benches/track", "tests/fixtures", "tests/scenes", "tests/house")
)

from rust_constants import (
    FACTORS,
    ROOT,
    TABLE,
    TRACK,
    Constant,
    Tuned,
    changed,
    constants,
    tuned,
    written,
)
from trust_scenes import COURSES, FULL, write_course
from trust_verdicts import verdicts

from sequences import Recording

PAGE = ROOT / "docs" / "tables" / "tuning.tsv"
SEEDS = 2  # of each course
Score = tuple[int, int]  # images that are tracked rightly, and that are wrong and trusted


def arguments() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("constant", nargs="*", help="file:NAME, or the beginning of it")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"how many (default {SEEDS})")
    parser.add_argument("--score", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.seeds < 1:
        parser.error(f"{given.seeds} seeds tell nothing; give 1 or more")
    return given


def score(folder: Path, seeds: int) -> Score:
    """Track the courses in a folder, which are drawn if they are missing."""
    right = wrong = 0
    for name in COURSES:
        for seed in range(seeds):
            place = folder / f"{name} {seed}"
            if not place.is_dir():
                write_course(place, name, seed, FULL)
            recording = Recording(name, place, open_any(place))
            result = track_capture(recording.capture, None, Request(seed=seed))[0]
            found = verdicts(result.tracked, recording.true_poses, recording.vertices, scaled=False)
            right += int(found.right.sum())
            wrong += int(found.trusted_wrong.sum())
    return right, wrong


def built(folder: Path, change: tuple[Constant, Constant] | None) -> Path:
    """Build the package, with a constant changed to another; return where it can be imported."""
    package = folder / "python" / "servoid"
    sources = folder / "sources"
    if not sources.is_dir():
        shutil.copytree(ROOT / "crates", sources / "crates")
        for name in ("Cargo.toml", "Cargo.lock"):
            shutil.copy(ROOT / name, sources)
        shutil.copytree(ROOT / "python" / "servoid", package)
    for path in TRACK.rglob("*.rs"):
        text = path.read_text(encoding="utf-8")
        if change and path == TRACK / change[0].file:
            text = changed(text, *change)
        target = sources / path.relative_to(ROOT)
        if target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")
    # Quick to build, and the same bits.
    profile = {"LTO": "off", "CODEGEN_UNITS": "16", "INCREMENTAL": "true"}
    options = {f"CARGO_PROFILE_RELEASE_{name}": value for name, value in profile.items()}
    options |= {"CARGO_TARGET_DIR": str(folder / "target"), "PYO3_PYTHON": sys.executable}
    build = "cargo build --release --quiet -p servoid-py --features pyo3/extension-module"
    subprocess.run(build.split(), cwd=sources, env=os.environ | options, check=True)
    library = "lib_native" + (".dylib" if sys.platform == "darwin" else ".so")
    (native,) = package.glob("_native*" + Path(sysconfig.get_config_var("EXT_SUFFIX")).suffix)
    native.unlink()
    shutil.copy(folder / "target" / "release" / library, native)
    return package.parent


def scored(package: Path, folder: Path, seeds: int) -> Score:
    """Score the courses with a built package."""
    command = [sys.executable, __file__, "--score", str(folder), "--seeds", str(seeds)]
    environment = os.environ | {"PYTHONPATH": str(package)}
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    right, wrong = done.stdout.split()
    return int(right), int(wrong)


def swept(given: argparse.Namespace, rows: dict[tuple[str, str], Tuned]) -> None:
    """Measure the requested constants, and write each to the table when it is known."""
    chosen = [
        one for one in constants() if f"{one.file}:{one.name}".startswith(tuple(given.constant))
    ]
    with tempfile.TemporaryDirectory() as place:
        folder, courses = Path(place), Path(place) / "courses"
        usual = scored(built(folder, None), courses, given.seeds)
        print(f"as it is: {usual[0]} images right, {usual[1]} wrong and trusted")
        for one in chosen:
            cells = []
            for factor in FACTORS:
                other = one.scaled(factor)
                if other is None:
                    cells.append("the same")
                    continue
                try:
                    found = scored(built(folder, (one, other)), courses, given.seeds)
                except subprocess.CalledProcessError:
                    cells.append("fails")
                    continue
                cells.append(f"{found[0] - usual[0]:+d} / {found[1] - usual[1]:+d}")
            print(f"{one.file} {one.name} = {one.value}:", ", ".join(cells), flush=True)
            rows[one.key] = Tuned(rows[one.key].unit, tuple(cells))
            write_whole(TABLE, written(rows).encode())


def page(rows: dict[tuple[str, str], Tuned]) -> str:
    """Write the table for the page."""
    lines: list[tuple[str, ...]] = [
        ("file", "constant", "value", "unit", *(f"x {one:g}" for one in FACTORS), "meaning")
    ]
    for one in constants():
        row = rows[one.key]
        cells = (one.file, one.name, one.value, row.unit, *row.swept, one.meaning)
        lines.append(cells)
    out = io.StringIO()
    csv.writer(out, delimiter="\t", lineterminator="\n").writerows(lines)
    return out.getvalue()


def main() -> None:
    """Measure what is requested, and write the results."""
    given = arguments()
    if given.score:
        given.score.mkdir(exist_ok=True)
        print(*score(given.score, given.seeds))
        return
    rows = tuned()
    if given.constant:
        swept(given, rows)
    write_whole(PAGE, page(rows).encode())


if __name__ == "__main__":
    main()
