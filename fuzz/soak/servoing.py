"""Servoes to an object in a simulated world while its cameras fail at random."""

import csv
import io
from pathlib import Path
from typing import Any

import numpy as np

from fuzz.soak.health import Health
from servoid.errors import ServoidError
from servoid.record import write_servo_log
from servoid.servo import ServoLog
from servoid.sim.trial import ServoTrial, TrialSettings, changed, run_servo_trial

SECONDS = 60.0  # of servoing, in each run; the meeting before takes as long as ten of them
MOST_FAULTS_HZ = 1.0 / 3.0  # at most so many, drawn evenly from none
OBJECTS = ("painted_ellipsoid", "bottle", "mug", "drill")
PATHS = ("still", "sine:0.05@4s", "circle:0.05@8s", "random:{seed}:0.05@6s", "line:0.1@5s")
SMALL: dict[str, Any] = {
    "run.max_ellipsoids": 3,
    "world.cameras.size_px": [320, 240],
    "world.cameras.samples": 1,
    "world.cameras.moments": 1,
    "world.threads": 1,
    "servo.look.count": 2,
}
WRONG_M, WRONG_RAD = 0.02, np.radians(15.0)
MOST_IN_A_ROW = 1  # images that may be wrong and said to be tracked
_SLACK = 1e-6


def soak_servoing(
    random: np.random.Generator, folder: Path, health: Health, seconds: float
) -> None:
    """Meet an object, model it and servo to it with faults at random; `health` hears of wrongs."""
    settings = drawn_settings(random, seconds)
    health.runs += 1
    try:
        trial = run_servo_trial(settings, folder)
    except ServoidError as error:
        health.counts["servo runs refused"] += 1
        health.counts[f"refused: {type(error).__name__}"] += 1
        return
    except Exception as error:  # what is no ServoidError is what is sought
        health.wrong(f"a servo run raised {type(error).__name__}: {error}; {_described(settings)}")
        return
    health.servoed_s += float(trial.log.times[-1]) if len(trial.log) else 0.0
    for words in (*_unsafe(trial), *_wrongly_trusted(trial, health), *_lost_rows(trial, folder)):
        health.wrong(f"{words}; {_described(settings)}")


def drawn_settings(random: np.random.Generator, seconds: float) -> TrialSettings:
    """Draw an object, its path, the light of chance, and faults."""
    seed = int(random.integers(1 << 20))
    values = {
        "world.object.name": str(random.choice(OBJECTS)),
        "world.object.path": str(random.choice(PATHS)).format(seed=seed),
        "world.background": str(random.choice(["plain", "cluttered"])),
        "world.ideal": bool(random.random() < 0.5),
        "world.seed": seed,
        "track.seed": seed,
        "world.faults": _faults(random, seconds),
        "run.seconds": seconds,
    }
    return changed(TrialSettings(), SMALL | values, "the soak")


def _faults(random: np.random.Generator, seconds: float) -> list[dict[str, Any]]:
    """Draw faults; no object leaps while images are frozen, as nobody could know.

    Each second leap leads back, so that objects stay where the arm reaches.
    """
    most = int(MOST_FAULTS_HZ * seconds)
    faults = [_fault(random, seconds) for _ in range(int(random.integers(0, most + 1)))]
    frozen = [
        (one["at_s"], one["at_s"] + one["seconds"]) for one in faults if one["type"] == "freeze"
    ]
    seen = [
        one
        for one in faults
        if one["type"] != "teleport"
        or not any(first <= one["at_s"] <= last for first, last in frozen)
    ]
    leaps = sorted((one for one in seen if one["type"] == "teleport"), key=lambda one: one["at_s"])
    for there, back in zip(leaps[::2], leaps[1::2], strict=False):
        back["by"] = [-step for step in there["by"]]
    return seen


def _fault(random: np.random.Generator, seconds: float) -> dict[str, Any]:
    """Draw a fault of the world, in the first four fifths of the seconds."""
    kind = str(random.choice(["drop", "freeze", "occlude", "teleport"]))
    fault: dict[str, Any] = {"type": kind, "at_s": float(random.uniform(0.2, 0.8 * seconds))}
    if kind == "teleport":
        return fault | {"by": random.uniform(-0.08, 0.08, 3).tolist()}
    fault["seconds"] = float(random.uniform(0.05, 2.0))
    if kind != "occlude" and random.random() < 0.5:
        fault["camera"] = int(random.integers(2))
    return fault


def _unsafe(trial: ServoTrial) -> list[str]:
    """Say what an arm must never be asked for, and where it must not be."""
    log, joints = trial.log, trial.world.arm.joints
    if not len(log):
        return ["the log is empty"]
    found = []
    if not (np.isfinite(log.commands).all() and np.isfinite(log.positions).all()):
        found.append("joint speeds or angles are not finite")
    if (np.abs(log.commands) > np.array(joints.speed) + _SLACK).any():
        found.append("a joint was commanded faster than it may be")
    below = log.positions < np.array(joints.lower) - _SLACK
    above = log.positions > np.array(joints.upper) + _SLACK
    if (below | above).any():
        found.append("a joint went over its stop")
    # What follows the log brought the arm to rest; its servos lag behind what is commanded.
    if trial.log.rows[-1].tick.state.time_s > trial.world.arm.state().time_s:
        found.append("the arm's clock ran back")
    return found


def _wrongly_trusted(trial: ServoTrial, health: Health) -> list[str]:
    """Say where the tracker was wrong and said to track, for more than an image in a row."""
    longest = row = 0
    for _, seen in trial.log.seen:
        health.servoed += 1
        if seen.estimate is None or seen.truth is None:
            row = 0
            continue
        health.counts[f"servoing {seen.estimate.status}"] += 1
        off = seen.truth.inverse() @ seen.estimate.world_from_object
        far = float(np.linalg.norm(off.translation)) > WRONG_M
        turned = float(np.linalg.norm(off.log()[3:])) > WRONG_RAD
        wrong = seen.estimate.status == "tracking" and (far or turned)
        health.counts["servoing wrong and trusted"] += wrong
        row = row + 1 if wrong else 0
        longest = max(longest, row)
    if longest > MOST_IN_A_ROW:
        return [f"{longest} images in a row were wrong and said to be tracked"]
    return []


def _lost_rows(trial: ServoTrial, folder: Path) -> list[str]:
    """Write the log, read it back, and say what is not whole."""
    path = folder / "log.csv"
    write_servo_log(trial.log, path)
    rows = list(csv.reader(io.StringIO(path.read_text())))
    log: ServoLog = trial.log
    whole = len(rows) == len(log) + 1 and len({len(row) for row in rows}) == 1
    return [] if whole else [f"{path.name} holds {len(rows) - 1} of {len(log)} control periods"]


def _described(settings: TrialSettings) -> str:
    """Say of which run something is told, so that it can be repeated."""
    world = settings.world
    return (
        f"object {world.object.name}, path {world.object.path}, seed {world.seed}, background "
        f"{world.background}, ideal {world.ideal}, faults {list(world.faults)}"
    )
