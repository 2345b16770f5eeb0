"""Measure how reliable the tracker's own reports are.

Each recording beside the repository, and each course that the tests draw, is tracked unchanged and
made harder: every 2nd to 4th image, noise, half size, JPEG, darkness, lamps that change, one eye
covered, and faults of the cameras; with a body from the first observation, and with several seeds.
The head of `trust.tsv`, which this writes, explains the counts; the tables and the figure of the
page on trust are generated from it. Missing recordings are skipped.

Run it with: python benches/trust/trust.py [--seeds N] [--variants NAME ...] [SEQUENCE ...] A
SEQUENCE is the beginning of a name, such as `mustard` or `drawn`; without one, all are measured.
Rows that are not measured are kept. `--missing` measures only what the table lacks. `--quick` uses
one seed of each sequence, unchanged, and writes nothing. `--pages` only generates the pages from
the table.
"""

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from servoid.cli.progress import progress_bar
from servoid.exchange import open_any
from servoid.output import write_whole
from servoid.track import Request, track_capture

sys.path.extend(
    str(Path(__file__).resolve().parents[2] / part)
    for part in ("benches/track", "tests/fixtures", "tests/scenes")
)

from trust_scenes import (
    COURSES,
    FULL,
    LEAVING_COURSES,
    MESHES,
    PLAIN_COURSES,
    TOY_COURSES,
    write_course,
)
from trust_variants import VARIANTS, Variant
from trust_verdicts import Verdicts, verdicts

from sequences import HARD, MONO, REAL, SHARED, STEREO, Recording, Table
from trust_pages import write_pages
from trust_table import BINS, TABLE, Key, Row, joined, parse, row_of, written

SEEDS = 8
DRAWN = "drawn"
Open = Callable[[int], Recording]  # by a seed


def arguments() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("sequence", nargs="*", help="the beginning of a sequence's name")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"how many (default {SEEDS})")
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=VARIANTS)
    parser.add_argument("--missing", action="store_true", help="measure what the table lacks")
    parser.add_argument("--quick", action="store_true", help="one seed, as it is; write nothing")
    parser.add_argument("--pages", action="store_true", help="write the pages, measure nothing")
    given = parser.parse_args()
    if given.seeds < 1:
        parser.error(f"{given.seeds} seeds tell nothing; give 1 or more")
    if given.quick:
        given.seeds, given.variants = 1, list(VARIANTS)[:1]
    return given


def sequences(folder: Path) -> Iterator[tuple[str, Open]]:
    """Name the available sequences, with their openers; courses are drawn into a folder."""
    for name in (*STEREO, *MONO, *HARD, *REAL):
        place = SHARED / "data" / name
        if place.is_dir():
            opened = Recording(place.name, place, open_any(place))
            yield place.name, lambda _seed, opened=opened: opened
        else:
            print(f"{place.name} skipped: not in shared/data beside the repository")
    toys = TOY_COURSES if MESHES.is_dir() else {}
    for name in (*COURSES, *PLAIN_COURSES, *LEAVING_COURSES, *toys):
        yield f"{DRAWN} {name}", lambda seed, name=name: drawn(folder, name, seed)


def drawn(folder: Path, name: str, seed: int) -> Recording:
    """Draw a course, unless it was drawn before."""
    place = folder / f"{name} {seed}"
    if not place.is_dir():
        write_course(place, name, seed, FULL)
    return Recording(f"{DRAWN} {name}", place, open_any(place))


def judged(recording: Recording, variant: Variant, seed: int) -> Verdicts:
    """Track the object of a recording from only its first mask, and evaluate the track."""
    request = Request(seed=seed, every=variant.every, distance_m=recording.distance_m)
    with tempfile.TemporaryDirectory() as folder:
        capture = variant.change(recording.capture, seed, Path(folder))
        result = track_capture(capture, None, request)[0]
    scaled = len(capture.cameras) == 1
    return verdicts(result.tracked, recording.true_poses, recording.vertices, scaled=scaled)


def measured(name: str, opened: Open, given: argparse.Namespace, old: set[Key]) -> Iterator[Row]:
    """Measure the variants of a sequence, each over all seeds."""
    for variant in (VARIANTS[one] for one in given.variants):
        if (name, variant.name) in old or len(opened(0).capture.cameras) < variant.eyes:
            continue
        with progress_bar(f"{name}, {variant.name}") as update:
            runs = []
            for seed in range(given.seeds):
                update(seed / given.seeds, f"seed {seed}")
                runs.append(judged(opened(seed), variant, seed))
        yield row_of((name, variant.name), runs)


def new_table() -> Table:
    """Return a table for rows of trust: shares in per cent, and `row`, the longest wrong streak."""
    return Table(
        *("sequence         ", "variant    ", "images", "tracked", "right", "wrong", "worst"),
        *("row", "found  ", "after", "ADD mm"),
    )


def print_row(table: Table, row: Row) -> None:
    """Print a row."""
    shares = (row.tracked_percent, row.right_percent)
    shares = (*shares, float(np.median(row.wrong_percent)), max(row.wrong_percent))
    found = f"{len(row.found)}/{len(row.found_after)}"
    after = f"{np.median(row.found):.0f}" if row.found else "-"
    table.row(
        *(row.sequence, row.variant, sum(row.images), *(f"{one:.1f}".rjust(5) for one in shares)),
        *(max(row.longest), found, after.rjust(5), row.add_mm),
    )


def print_calibration(rows: list[Row]) -> None:
    """Print how often poses are right by their confidence, and the coverage of the covariances."""
    whole = joined(("all", ""), rows)
    print()
    table = Table("confidence", "images", "right %", "tracking", "of these right %")
    for step in range(BINS):
        shares = (
            100.0 * right / one if one else float("nan")
            for one, right in (
                (whole.told[step], whole.told_right[step]),
                (whole.tracking[step], whole.tracking_right[step]),
            )
        )
        followed, tracking = shares
        name = f"{step / BINS:.1f} - {(step + 1) / BINS:.1f}"
        table.row(name, whole.told[step], followed, whole.tracking[step], tracking)
    print()
    table = Table("in the 95 % region   ", "place %", "turn %", "both %")
    for name in dict.fromkeys(row.sequence for row in rows):
        own = joined((name, ""), (row for row in rows if row.sequence == name))
        table.row(name, *own.covered_percent)
    table.row("all", *whole.covered_percent)


def main() -> None:
    """Measure, print, and write the table and the pages."""
    given = arguments()
    kept = parse(TABLE.read_text(encoding="utf-8")) if TABLE.exists() else {}
    new: dict[Key, Row] = {}
    with tempfile.TemporaryDirectory() as folder:
        chosen = [] if given.pages else list(sequences(Path(folder)))
        starts = tuple(given.sequence) or ("",)
        table = new_table() if chosen else None
        for name, opened in chosen:
            if not name.startswith(starts):
                continue
            for row in measured(name, opened, given, set(kept) if given.missing else set()):
                new[row.key] = row
                print_row(table or new_table(), row)
                if not given.quick:
                    write_whole(TABLE, written(kept | new).encode())
    if new:
        print_calibration(list(new.values()))
    if not given.quick:
        write_pages(list((kept | new).values()))


if __name__ == "__main__":
    main()
