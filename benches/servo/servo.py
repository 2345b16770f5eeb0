"""Servo an arm to objects of simulated worlds, and measure how well hand and eyes follow.

Four tables. In `parts` the hand follows a textured bottle: static, from 0.2 m and 20 degrees off;
then in the paper's motion of 150 - 150 cos(wt) mm, T = 10 s, with the defaults and with one feature
removed at a time. In `textured` and `plain` it follows all objects in the same motion; there a
pixel has one ray and no blur, which renders four times as fast. These worlds are ideal. In
`laboratory` the same worlds have the errors of a decent laboratory, and some of their objects turn
as well.

One row per run: a seed changes the clutter, the noise, the laboratory and the tracker's searches.
Errors are after settling, in mm of the hand and degrees; a rotation about an axis of symmetry does
not count. `repeat` is relative to the pose at which the body was modelled, `true` to the true
object; `object` is the distance of the true object's middle from its goal in the hand. Times are
wall times, on a machine that also renders the world and runs other programs. The last lines
summarise all runs of a table. Needs MuJoCo.

Run it with: python benches/servo/servo.py [--seeds N] [--only TABLE] [--names NAME ...]
"""

import argparse
import sys
import tempfile
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from servoid.errors import ServoidError
from servoid.servo import ServoMetrics
from servoid.sim.trial import ServoTrial, TrialSettings, changed, run_servo_trial

sys.path.append(str(Path(__file__).resolve().parents[1] / "track"))

from sequences import Table

SINE = {"world.object.path": "sine:0.15@10s", "run.seconds": 13.0}
OFF = {  # 0.2 m and 20 degrees
    "run.start_offset": (0.1, -0.1, -0.1414),
    "run.start_turn_deg": (10.0, -10.0, 14.14),
    "run.seconds": 8.0,
    "run.settle_s": 5.0,
}
PARTS: dict[str, dict[str, Any]] = {
    "still, from afar": OFF,
    "sine": SINE,
    "no feed-forward": SINE | {"servo.hand.feed_forward": False},
    "paper's joint law": SINE | {"servo.joints.law": "paper"},
    "one look": SINE | {"servo.look.count": 1},
    "fixed eyes": SINE | {"servo.gaze.mode": "parallel"},
}
OBJECTS = {
    "textured": ("bottle", "mug", "drill", "painted_ellipsoid"),
    "plain": ("ellipsoid", "two_ellipsoids", "plain_bottle", "plain_mug"),
}
TURNING = {"world.object.path": "random:3", "run.seconds": 10.0}
COARSE = {"world.cameras.samples": 1, "world.cameras.moments": 1}


@dataclass
class Totals:
    """Totals over all runs."""

    runs: int = 0
    failed: int = 0
    losing: int = 0
    held: int = 0
    control_s: list[float] = field(default_factory=list)
    track_s: list[float] = field(default_factory=list)

    def add(self, trial: ServoTrial, lost: int, metrics: ServoMetrics) -> None:
        """Add a run."""
        ticks = [row.tick for row in trial.log.rows]
        self.runs += 1
        self.losing += lost > 0
        self.held += len(later_holds(metrics)) > 0
        self.control_s += [tick.control_s for tick in ticks]
        self.track_s += [tick.track_s for tick in ticks if tick.estimate is not None]

    def report(self) -> None:
        """Print them."""
        print(
            f"{self.runs} runs, {self.failed} more that could not begin; in {self.losing} of them "
            f"the tracker lost the object in some image, in {self.held} the hand was held on the "
            "way"
        )
        print("times on the wall, beside drawing and all else:")
        for name, spent in (("control", self.control_s), ("tracker", self.track_s)):
            if spent:
                p50, p99 = 1e3 * np.percentile(spent, (50, 99))
                print(f"{name}: {p50:.2f} ms, p99 {p99:.2f} ms of {len(spent)}")


def main() -> None:
    """Print the tables."""
    tables = {"parts": PARTS} | {kind: rows_of(names) for kind, names in OBJECTS.items()}
    tables = {kind: ideally(rows) for kind, rows in tables.items()}
    tables["laboratory"] = laboratory(OBJECTS["textured"])
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--seeds", type=int, default=3, help="runs of each row (default 3)")
    arguments.add_argument("--first", type=int, default=0, help="the first seed (default 0)")
    arguments.add_argument("--only", choices=tables, help="one of the tables")
    arguments.add_argument("--names", nargs="+", help="of rows or objects, in place of all")
    options = arguments.parse_args()
    if find_spec("mujoco") is None:
        print("skipped: worlds need MuJoCo; pip install 'servoid[sim]'")
        return
    for title, rows in tables.items():
        chosen = {name: row for name, row in rows.items() if name in (options.names or rows)}
        if options.only in (None, title) and chosen:
            measure(title, chosen, range(options.first, options.first + options.seeds))


def rows_of(names: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """Return the settings of runs with some objects."""
    return {name: SINE | COARSE | {"world.object.name": name} for name in names}


def ideally(rows: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the same runs in ideal worlds."""
    return {name: row | {"world.ideal": True} for name, row in rows.items()}


def laboratory(names: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """Return the settings of runs in laboratories, with objects that only shift and that turn."""
    shifting = rows_of(names)
    turning = {f"{name}, turning": row | TURNING for name, row in shifting.items()}
    return shifting | turning


def measure(title: str, rows: dict[str, dict[str, Any]], seeds: range) -> None:
    """Print a row for each run, seed by seed."""
    table = Table(
        *(f"{title:26}", "seed", "repeat mm", "95 %", "deg", "true mm", "95 %", "deg"),
        *("object mm", "gaze px", "not tracked"),
        *("held", "control ms p50", "  p99", "tracker ms p50", "  p99"),
    )
    totals = Totals()
    for seed in seeds:
        for name, values in rows.items():
            settings = changed(
                TrialSettings(), values | {"world.seed": seed, "track.seed": seed}, name
            )
            try:
                run(name, settings, table, totals)
            except ServoidError as error:
                totals.failed += 1
                print(f"{name:17}  {seed:4}  {error}", flush=True)
    totals.report()


def run(name: str, settings: TrialSettings, table: Table, totals: Totals) -> None:
    """Servo once, and print the result."""
    with tempfile.TemporaryDirectory() as folder:
        trial = run_servo_trial(settings, Path(folder))
    metrics = ServoMetrics.of(trial.log, settings.run.settle_s)
    estimates = [seen.estimate for _, seen in trial.log.seen]
    lost = sum(one is None or one.status != "tracking" for one in estimates)
    totals.add(trial, lost, metrics)
    true = metrics.accuracy
    table.row(
        *(name, settings.world.seed, 1e3 * metrics.position_rms, 1e3 * metrics.position_95),
        *(float(np.degrees(metrics.turn_rms)), 1e3 * true.position_rms, 1e3 * true.position_95),
        *(float(np.degrees(true.turn_rms)), 1e3 * true.object_rms, metrics.fixation_rms_px),
        *(lost, len(later_holds(metrics))),
        *(1e3 * metrics.control_s.p50, 1e3 * metrics.control_s.p99),
        *(1e3 * metrics.track_s.p50, 1e3 * metrics.track_s.p99),
    )


def later_holds(metrics: ServoMetrics) -> list[Any]:
    """List the holds except the first, in which each run awaits trusted images at its start."""
    return [hold for hold in metrics.holds if hold.start_s > 0.0]


if __name__ == "__main__":
    main()
