"""Servo to objects that shift and turn, and through faults, over many seeds: docs/servoing.md.

`turning`: printed objects on paths of their own, at two sizes of images, in ideal worlds and in
laboratories. `plain`: turning objects without print. `faults`: a leap with and without a turn, a
board before the object, a camera that hangs, no images. One run takes 15 to 60 s. Each is written
to a file, one line of JSON per run, and runs in that file are not repeated.

The tables show the median and, in brackets, the worst over all seeds: RMS after settling in mm;
`after`, the hand's error in the fourth second after a fault has ended; `end`, that in the last
second; `held`, the duration of holds. `unsaid` counts seconds in which the hand was more than 30 mm
off and neither held nor slowed for a reason that reports it; `unknown` counts those of them in
which it was estimated to be nearer than that. A line below each table counts the runs that end
well. Needs MuJoCo.

Run it with: python benches/servo/servo_table.py RUNS.jsonl [--seeds 11-18] [--only TABLE]
[--names WORD ...] [--logs FOLDER] [--samples RAYS] [--tables]
"""

import argparse
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from servo import COARSE
from servoid.errors import ServoidError
from servoid.record.servo_log import write_servo_log
from servoid.servo import Reason, ServoMetrics
from servoid.sim.trial import ServoTrial, TrialSettings, changed, run_servo_trial

USUAL = COARSE | {"world.threads": 1, "run.seconds": 9.0}
SIZES = {"320x240": (320, 240), "640x480": (640, 480)}
TURNING = (
    ("bottle", "random:3"),
    ("mug", "random:5"),
    ("drill", "random:8"),
    ("bottle", "sine:0.15@10s"),
    ("mug", "sine:0.15@5s"),
    ("drill", "sine:0.1@3s"),
)
PLAIN = ("plain_mug", "plain_bottle", "two_ellipsoids")
FAULT_S = 3.0
FAULTS: dict[str, dict[str, Any]] = {
    "leap of 0.15 m": {"type": "teleport"},
    "leap and turn by 33 degrees": {"type": "teleport", "turn": (0.0, 0.58, 0.0)},
    "board before it for 1.5 s": {"type": "occlude", "seconds": 1.5},
    "camera hangs for 2 s": {"type": "freeze", "seconds": 2.0, "camera": 0},
    "no images for 2 s": {"type": "drop", "seconds": 2.0},
}
FAULTED = ("mug", "drill", "two_ellipsoids")
TABLES = ("turning", "plain", "faults")
SOON_S, NEAR_MM = 3.0, 10.0
_FAR_M = 0.03
_REPORTED = {Reason.ROUGH, Reason.PARTED, Reason.UNSEEN, Reason.AWAY, Reason.UNREACHABLE}
Row = dict[str, Any]


def main() -> None:
    """Run the missing runs, and print the tables."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("runs", type=Path, help="the file of runs, made if it is missing")
    arguments.add_argument("--seeds", default="11-18", help="first and last (default 11-18)")
    arguments.add_argument("--only", choices=TABLES)
    arguments.add_argument("--names", nargs="+", help="words, one of which a run's name holds")
    arguments.add_argument(
        "--logs", type=Path, help="a folder for the log of each run that is made"
    )
    arguments.add_argument(
        "--samples", type=int, default=1, help="rays along each side of a pixel (default 1)"
    )
    arguments.add_argument("--tables", action="store_true", help="only print what was run")
    options = arguments.parse_args()
    first, last = map(int, options.seeds.split("-"))
    lines = options.runs.read_text().splitlines() if options.runs.exists() else []
    rows: list[Row] = [json.loads(line) for line in lines]
    samples = options.samples
    done = {(row["table"], row["name"], row["seed"], row.get("samples", 1)) for row in rows}
    if not options.tables:
        for seed in range(first, last + 1):
            for table, name, values in cases():
                wanted = options.names is None or any(word in name for word in options.names)
                wanted = wanted and options.only in (None, table)
                if not wanted or (table, name, seed, samples) in done:
                    continue
                log = options.logs and options.logs / f"{table}, {name}, {seed}.csv".replace(
                    ":", ""
                )
                values = values | {"world.cameras.samples": samples}
                case = {"table": table, "name": name, "seed": seed, "samples": samples}
                row = case | run(name, values, seed, log)
                with options.runs.open("a") as file:
                    file.write(json.dumps(row) + "\n")
                rows.append(row)
    for table in TABLES:
        mine = [row for row in rows if row["table"] == table and row.get("samples", 1) == samples]
        print(f"\n{table}\n{markdown(mine)}\n\n{judged(mine)}")


def cases() -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield table, name and settings of each run of a seed."""
    for thing in FAULTED:
        for name, fault in FAULTS.items():
            yield (
                "faults",
                f"{thing}, {name}",
                _case(thing, "sine:0.15@10s", "320x240", is_ideal=True)
                | {"world.faults": [{"at_s": FAULT_S, **fault}]},
            )
    for thing in PLAIN:
        yield "plain", thing, _case(thing, "random:3", "320x240", is_ideal=True)
    for size in SIZES:
        for thing, path in TURNING:
            for is_ideal in (True, False):
                name = f"{thing}, {path}, {size}, {'ideal' if is_ideal else 'laboratory'}"
                yield "turning", name, _case(thing, path, size, is_ideal=is_ideal)


def _case(thing: str, path: str, size: str, *, is_ideal: bool) -> dict[str, Any]:
    return USUAL | {
        "world.object.name": thing,
        "world.object.path": path,
        "world.cameras.size_px": SIZES[size],
        "world.ideal": is_ideal,
    }


def run(name: str, values: dict[str, Any], seed: int, log_csv: Path | None = None) -> Row:
    """Servo once, and return the results; a run that ends early gives the reason."""
    settings = changed(TrialSettings(), values | {"world.seed": seed, "track.seed": seed}, name)
    try:
        with tempfile.TemporaryDirectory() as folder:
            trial = run_servo_trial(settings, Path(folder))
    except ServoidError as error:
        return {"failed": str(error)}
    if log_csv is not None:
        log_csv.parent.mkdir(parents=True, exist_ok=True)
        write_servo_log(trial.log, log_csv)
    return measured(trial)


def measured(trial: ServoTrial) -> Row:
    """Return the figures of a run, and its course at ten samples a second."""
    log, metrics = trial.log, ServoMetrics.of(trial.log, trial.settings.run.settle_s)
    off = np.linalg.norm(log.hand_errors[:, :3], axis=1)
    commands = [row.tick.command for row in log.rows]
    held = np.array([bool(one.holding) for one in commands])
    reported = held | np.array([bool(_REPORTED & one.limiting) for one in commands])
    goals = [one.hand_from_goal for one in commands]
    far = [goal is not None and np.linalg.norm(goal.translation) > _FAR_M for goal in goals]
    times = np.asarray(log.times)
    period_s = float(np.median(np.diff(times)))
    unreported = ~reported & (off > _FAR_M)
    ends_s = max(
        [one.at_s + getattr(one, "seconds", 0.0) for one in trial.settings.world.faults] or [0.0]
    )
    after = (times >= ends_s + SOON_S) & (times < ends_s + SOON_S + 1.0)
    often = slice(None, None, max(1, round(0.1 / period_s)))
    return {
        "repeatability": 1e3 * metrics.position_rms,
        "accuracy": 1e3 * metrics.accuracy.position_rms,
        "object": 1e3 * metrics.accuracy.object_rms,
        "turn": float(np.degrees(metrics.turn_rms)),
        "after": 1e3 * float(off[after].mean()),
        "end": 1e3 * float(off[times > times[-1] - 1.0].mean()),
        "held": sum(hold.end_s - hold.start_s for hold in metrics.holds if hold.start_s > 0.0),
        "held_after": bool(held[after].all()),
        "held_at_end": bool(commands[-1].holding),
        "unsaid": float(unreported.sum()) * period_s,
        "unknown": float((unreported & ~np.array(far)).sum()) * period_s,
        "off_mm": [round(1e3 * float(one), 1) for one in off[often]],
        "told": "".join(np.where(held, "h", np.where(reported, "s", "."))[often]),
    }


def markdown(rows: list[Row]) -> str:
    """Return a table in Markdown, one line per name."""
    keys = ("repeatability", "accuracy", "object", "turn", "after", "end", "held")
    keys += ("unsaid", "unknown")
    lines = [f"| run | seeds | {' | '.join(keys)} | held at the end |", "|---" * 12 + "|"]
    for name in dict.fromkeys(row["name"] for row in rows):
        mine = [row for row in rows if row["name"] == name and "failed" not in row]
        failed = sum(row["name"] == name for row in rows) - len(mine)
        if not mine:
            lines.append(f"| {name} | 0, and {failed} that could not begin |")
            continue
        cells = []
        for key in keys:
            values = [row[key] for row in mine]
            cells.append(f"{np.median(values):.1f} ({max(values):.1f})")
        count = f"{len(mine)}" + (f", and {failed} that could not begin" if failed else "")
        held = sum(row["held_at_end"] for row in mine)
        lines.append(f"| {name} | {count} | {' | '.join(cells)} | {held} |")
    return "\n".join(lines)


def judged(rows: list[Row]) -> str:
    """Report how many runs end well, and which do not."""
    mine = [row for row in rows if "failed" not in row]
    ways = {
        f"within {NEAR_MM:g} mm or held {SOON_S:g} s after the fault": lambda row: (
            row["after"] <= NEAR_MM or row["held_after"]
        ),
        f"within {NEAR_MM:g} mm or held at the end": lambda row: (
            row["end"] <= NEAR_MM or row["held_at_end"]
        ),
        f"never {1e3 * _FAR_M:g} mm off unsaid": lambda row: row["unsaid"] == 0.0,
        f"never {1e3 * _FAR_M:g} mm off unsaid and unknown": lambda row: row["unknown"] == 0.0,
    }
    lines = []
    for way, is_so in ways.items():
        not_so = [f"{row['name']}, {row['seed']}" for row in mine if not is_so(row)]
        lines.append(f"{way}: {len(mine) - len(not_so)} of {len(mine)}")
        lines += [f"    not {one}" for one in not_so]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
