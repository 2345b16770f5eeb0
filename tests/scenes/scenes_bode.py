"""Runs whose object swings with many frequencies, and how far their answers are off."""

from functools import cache
from pathlib import Path

import numpy as np
from msgspec.structs import replace
from scene_table import Figures, Scene, scene

from servoid_experiments.bode.response import ResponseCase, ResponseRow, run_response

MANY = ResponseCase(
    seed=1,
    feed_forward=False,
    eyes_follow=True,
    object="painted_ellipsoid",
    background="plain",
    base_hz=0.5,
    sideways_lines=(1, 3),
    depth_lines=(2,),
    speed=0.04,  # half as fast, the noise of the images makes two to ten times the error
    amplitude=0.04,
    run_in_s=3.0,
)
LATE_S = 0.04 + 0.5 / 30.0 + 0.004  # latency, half the time of an image and of a control period
OTHERS = {"sideways": "depth_lines", "depth": "sideways_lines"}


@cache
def answered(case: ResponseCase) -> ResponseRow:
    return run_response(case)


def many(seed: int) -> ResponseRow:
    """Let the object swing with two frequencies sideways and one in depth."""
    return answered(replace(MANY, seed=seed))


def ratio(row: ResponseRow, signal: str, axis: str) -> np.ndarray:
    answer = row.answer(signal, axis)
    assert answer is not None
    return answer.ratio


def lag_deg(row: ResponseRow) -> float:
    """Return how far the hand is behind at the lowest frequency, in degrees."""
    return -float(np.degrees(np.angle(ratio(row, "hand", "sideways")[0])))


@scene(
    "bode many",
    {"seen error": "1", "known late": "ms", "joint speed": "1", "limited": "1"},
    {"hand lag": "deg"},
)
def bode_many(seed: int, _folder: Path) -> Figures:
    row = many(seed)
    seen, late = [], []
    for axis, hz in (("sideways", np.array([0.5, 1.5])), ("depth", np.array([1.0]))):
        seen.append(np.abs(ratio(row, "seen", axis) - 1.0).max())
        late_s = -np.angle(ratio(row, "known", axis)) / (2.0 * np.pi * hz)
        late.append(np.abs(late_s - LATE_S).max())
    return {
        "seen error": float(max(seen)),
        "known late": 1e3 * float(max(late)),
        "hand lag": lag_deg(row),
        "joint speed": row.joint_speed_share,
        "limited": row.limited_share,
    }


@scene("bode fed forward", {"hand lag": "deg"})
def bode_fed_forward(seed: int, _folder: Path) -> Figures:
    return {"hand lag": abs(lag_deg(answered(replace(MANY, seed=seed, feed_forward=True))))}


@scene("bode fixed eyes", {"gaze off hand": "1"})
def bode_fixed_eyes(seed: int, _folder: Path) -> Figures:
    fixed = answered(replace(MANY, seed=seed, eyes_follow=False))
    assert fixed.answer("gaze", "depth") is None
    gaze, hand = (ratio(fixed, signal, "sideways")[0] for signal in ("gaze", "hand"))
    return {"gaze off hand": float(abs(gaze - hand))}


def _alone(axis: str, lines: tuple[int, ...], place: int) -> Scene:
    signals = ("seen", "known", "predicted", "gaze", "hand")

    @scene(f"bode {axis} alone", dict.fromkeys(signals, "1"))
    def alone(seed: int, _folder: Path) -> Figures:
        lonely = replace(MANY, seed=seed, **{f"{axis}_lines": lines, OTHERS[axis]: (4,)})
        found = {}
        for signal in signals:
            one = ratio(answered(lonely), signal, axis)[0]
            among = ratio(many(seed), signal, axis)[place]
            found[signal] = float(abs(one - among) / max(1.0, abs(one)))
        return found

    return alone


BODE_ALONE = {"sideways": _alone("sideways", (3,), 1), "depth": _alone("depth", (2,), 0)}
