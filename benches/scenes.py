"""Measure the random variation of the tests' scenes again, and the bounds that follow from it.

Each scene of `tests/scenes/scenes_*.py` runs with seeds 0, 1, 2 and so on. The medians and the
worst figures replace those of `tests/scenes/scenes.tsv`, all or none; the margins there are kept.
Prints each figure with its worst seeds, and its previous bound. If a scene fails for a seed, the
error is printed, and nothing is written.

Run it with: python benches/scenes.py [--seeds N] [SCENE ...]
A SCENE is the beginning of a name, such as `servo`; without one, all are measured.
"""

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from servoid.output import write_whole

sys.path.extend(
    str(Path(__file__).resolve().parents[1] / part)
    for part in (
        *("tests", "tests/fixtures", "tests/fixtures/servo", "tests/fixtures/shape"),
        "tests/scenes",
    )
)

from scene_table import (
    SEEDS,
    TABLE,
    Figures,
    Row,
    Scene,
    Sense,
    all_scenes,
    bound_of,
    parse,
    written,
)

SCENES = all_scenes()
Rows = dict[tuple[str, str], Row]
WORST_SEEDS = 3  # number of seeds to print


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("scene", nargs="*", help="the beginning of a scene's name")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"how many (default {SEEDS})")
    given = parser.parse_args()
    if given.seeds < SEEDS:
        parser.error(f"{given.seeds} seeds are too few to tell the worst; give {SEEDS} or more")
    for start in given.scene:
        if not any(name.startswith(start) for name in SCENES):
            parser.error(f"no scene begins with '{start}'; there are: {', '.join(SCENES)}")
    return given


def chosen(starts: list[str]) -> list[Scene]:
    """Return the scenes whose names begin with one of the words."""
    return [
        one
        for name, one in SCENES.items()
        if not starts or any(name.startswith(start) for start in starts)
    ]


def measured(scene: Scene, runs: list[Figures], old: Rows) -> Iterable[Row]:
    """Combine the results of the seeds with the margins that were chosen before."""
    failing = tuple(seed for seed, run in enumerate(runs) if scene.fails(run))
    if failing:
        print(f"{scene.name} fails with seeds {', '.join(map(str, failing))}")
    for measure, kind in scene.measures.items():
        values = [float(run[measure]) for run in runs]
        row = Row.of((scene.name, measure), kind, values, failing)
        before = old.get((row.scene, row.measure))
        if before is not None:
            bound = bound_of(row.worst, before.margin, row.sense)
            row = replace(row, margin=before.margin, bound=bound)
        print_row(row, values, before)
        yield row


def print_row(row: Row, values: list[float], before: Row | None) -> None:
    """Print a row, with the seeds of the worst results."""
    order = sorted(range(len(values)), key=values.__getitem__, reverse=row.sense is Sense.AT_MOST)
    seeds = ", ".join(f"{seed}: {values[seed]:.3g}" for seed in order[:WORST_SEEDS])
    had = "new" if before is None else f"before {before.bound:g}"
    print(
        f"{row.scene}: {row.measure} {row.sense.value} {row.bound:g} {row.unit} ({had}); "
        f"median {row.median:g}, worst by seed {seeds}",
        flush=True,
    )


def main() -> None:
    """Measure, and write the table."""
    given = arguments()
    scenes = chosen(given.scene)
    old = parse(TABLE.read_text(encoding="utf-8")) if TABLE.exists() else {}
    wanted = {(name, measure) for name, one in SCENES.items() for measure in one.measures}
    new: Rows = {key: row for key, row in old.items() if key in wanted}
    failed = 0
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    console = Console(stderr=True)
    with Progress(
        *columns, TimeRemainingColumn(), console=console, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("", total=given.seeds * len(scenes))
        for scene in scenes:
            runs = []
            for seed in range(given.seeds):
                bar.update(task, description=f"{scene.name}, seed {seed}")
                try:
                    runs.append(scene.figures(seed))
                except Exception as error:
                    failed += 1
                    print(f"{scene.name}: seed {seed} fails: {error!r}", flush=True)
                bar.advance(task)
            if len(runs) == given.seeds:
                new |= {(row.scene, row.measure): row for row in measured(scene, runs, old)}
    if failed:
        sys.exit(f"{failed} runs failed; {TABLE.name} stays as it was")
    write_whole(TABLE, written(new).encode())


if __name__ == "__main__":
    main()
