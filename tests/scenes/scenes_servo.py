"""Small servo runs in simulated worlds, and what becomes of them."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from scene_table import Figures, scene
from servo_trials import position_errors, rms, small_trial, turn_errors

from servoid.servo import ServoLog, ServoMetrics
from servoid.sim.trial import ServoTrial, TrialSettings, changed, run_servo_trial

SETTLED_S = 1.5
LOST = {"not tracking": "images"}


def seeded(seed: int, values: dict[str, Any] | None = None) -> dict[str, Any]:
    """Let a seed decide the noise of the images, the model's search and the tracker's."""
    return {"world.seed": seed, "track.seed": seed} | (values or {})


def lost_images(log: ServoLog) -> int:
    """Count the images in which the object is not tracked."""
    return sum(not (seen.estimate and seen.estimate.status == "tracking") for _, seen in log.seen)


def missed(one: np.ndarray, other: np.ndarray) -> float:
    """Return the share of two masks together that they do not have in common."""
    one, other = one > 0, other > 0
    return 1.0 - float((one & other).sum() / (one | other).sum())


def follow(folder: Path, seed: int, values: dict[str, Any] | None = None) -> ServoTrial:
    """Follow an object that swings to and fro, drawn on one thread."""
    return small_trial(folder, seeded(seed, {"world.threads": 1} | (values or {})))


def trial_figures(trial: ServoTrial) -> Figures:
    """Say how far the model of the object is off."""
    exploration, camera = trial.exploration, trial.world.cameras[0]
    mask = exploration.masks[0]
    assert mask is not None and exploration.masks[1] is None
    drawn = exploration.body.silhouette(camera, exploration.looks[0].world_from_camera[0])
    place = np.linalg.norm(trial.truth.object_from_body.translation)
    return {"body off": 1e3 * float(place), "mask missed": missed(mask, drawn)}


def followed_figures(trial: ServoTrial) -> Figures:
    """Say how well hand and eyes follow."""
    found = ServoMetrics.of(trial.log, SETTLED_S)
    return {
        "position rms": 1e3 * found.position_rms,
        "turn rms": float(np.degrees(found.turn_rms)),
        "fixation rms": found.fixation_rms_px,
        "held": sum(hold.seconds for hold in found.holds if hold.start_s > 0.2),
    }


@scene(
    "servo followed",
    {
        **LOST,
        "body off": "mm",
        "mask missed": "1",
        "position rms": "mm",
        "turn rms": "deg",
        "fixation rms": "px",
        "held": "s",
    },
)
def servo_followed(seed: int, folder: Path) -> Figures:
    trial = follow(folder, seed)
    return {
        **trial_figures(trial),
        **followed_figures(trial),
        "not tracking": lost_images(trial.log),
    }


def lag_figures(lagging: ServoTrial, followed: ServoTrial) -> Figures:
    """Compare a run without feed-forward with one that has it."""
    lags = [rms(position_errors(trial.log, SETTLED_S)) for trial in (lagging, followed)]
    return {"times as far": lags[0] / lags[1]}


LAGGING = {"servo.hand.feed_forward": False}


@scene("servo without feed-forward", {}, {"times as far": "1"})
def servo_lagging(seed: int, folder: Path) -> Figures:
    runs = [follow(folder / str(len(values)), seed, values) for values in (LAGGING, {})]
    return lag_figures(*runs)


@scene("servo after one look", {**LOST, "position rms": "mm"})
def servo_one_look(seed: int, folder: Path) -> Figures:
    trial = follow(folder, seed, {"servo.look.count": 1})
    assert len(trial.exploration.looks) == 1
    position = rms(position_errors(trial.log, SETTLED_S))
    return {"position rms": 1e3 * position, "not tracking": lost_images(trial.log)}


AFAR = {
    "run.start_offset": [0.2, 0.0, 0.0],
    "run.start_turn_deg": [0.0, 20.0, 0.0],
    "world.object.path": "still",
}


@scene(
    "servo from afar",
    {"start off": "mm", "start turn off": "deg", "position rms": "mm", "turn rms": "deg"},
)
def servo_from_afar(seed: int, folder: Path) -> Figures:
    log = follow(folder, seed, AFAR).log
    return {
        "start off": 1e3 * abs(float(position_errors(log)[0]) - 0.2),
        "start turn off": abs(float(np.degrees(turn_errors(log)[0])) - 20.0),
        "position rms": 1e3 * rms(position_errors(log, 2.0)),
        "turn rms": float(np.degrees(rms(turn_errors(log, 2.0)))),
    }


BACK = {
    "world.ideal": True,
    "world.background": "plain",
    "world.cameras.size_px": (320, 240),
    "world.cameras.samples": 1,
    "world.cameras.moments": 1,
    "servo.look.count": 3,
    "run.max_ellipsoids": 2,
    "run.seconds": 0.1,
}


def back_again(seed: int, folder: Path, law: str = "qp") -> Figures:
    """Look at the object from three places, and say how far from the first the hand ends."""
    values = BACK | seeded(seed, {"servo.joints.law": law})
    trial = run_servo_trial(changed(TrialSettings(), values, "test"), folder)
    home, first = trial.exploration.world_from_hand, trial.log.rows[0]
    assert len(trial.exploration.looks) == 3
    off = np.subtract(first.world_from_hand.translation, home.translation)
    return {"hand off": 1e3 * float(np.abs(off).max())}


@scene("servo back", {"hand off": "mm"})
def servo_back(seed: int, folder: Path) -> Figures:
    return back_again(seed, folder)


def shipped_iiwa() -> str | None:
    """Return the URDF of KUKA's LBR iiwa 14, which the wheel of rtb-data holds, if it is there."""
    found = find_spec("rtbdata")
    if found is None or found.origin is None:
        return None
    folder = Path(found.origin).with_name("xacro") / "kuka_description" / "kuka_lbr_iiwa"
    return str(folder / "urdf" / "lbr_iiwa_14_r820.urdf")


IIWA = {
    "mount": "tool0",
    "mount_from_hand": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1),
    "world_from_hand": (0.5, -0.5, -0.5, 0.5, -0.7, 0.0, 0.5),
}


@scene("servo an iiwa", {**LOST, "position rms": "mm"})
def servo_iiwa(seed: int, folder: Path) -> Figures:
    arm = {f"world.arm.{key}": value for key, value in IIWA.items()}
    arm["world.arm.name"] = shipped_iiwa()
    trial = small_trial(folder, seeded(seed, arm))
    position = rms(position_errors(trial.log, SETTLED_S))
    return {"position rms": 1e3 * position, "not tracking": lost_images(trial.log)}
