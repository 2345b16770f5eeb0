"""Laws of the notes of a run on its arm: joints that are late, and speeds that always limit it."""

from types import SimpleNamespace
from typing import Any

from servoid.servo import Reason, ServoSettings
from servoid.sim.trial import trial_notes


def notes_of(limiting: list[set[Reason]], late_s: float = 0.0) -> tuple[str, ...]:
    rows = [
        SimpleNamespace(
            time_s=0.1 * at,
            tick=SimpleNamespace(command=SimpleNamespace(limiting=one, late_s=late_s)),
        )
        for at, one in enumerate(limiting)
    ]
    trial: Any = SimpleNamespace(
        notes=("of the path",),
        world=SimpleNamespace(notes=()),
        exploration=SimpleNamespace(all_notes=()),
        settings=SimpleNamespace(servo=ServoSettings()),
        log=SimpleNamespace(rows=rows, start_s=0.0),
    )
    metrics: Any = SimpleNamespace(settle_s=1.0, late_note=lambda: None)
    return trial_notes(trial, metrics)


def test_a_lag_that_was_measured_is_noted_with_the_key_to_set() -> None:
    assert notes_of([set()] * 20) == ("of the path",)
    (_, note) = notes_of([set()] * 20, 0.118)
    assert "0.12 s late" in note and note.endswith("servo.joints.reaction_s = 0.12")


def test_a_speed_limit_that_acts_most_of_the_time_is_named_and_one_of_quick_motions_is_not() -> (
    None
):
    joint, hand = {Reason.JOINT_SPEED}, {Reason.HAND_SPEED, Reason.HAND_ACCELERATION}
    assert notes_of([hand] * 10 + [set()] * 20 + [joint] * 19) == ("of the path",)
    (_, note) = notes_of([set()] * 10 + [joint] * 6 + [set()] * 4)
    assert note.startswith("a joint is at its speed limit for 60 % of the time")
    (_, note) = notes_of([set()] * 10 + [hand] * 10)
    assert "servo.hand.linear_speed" in note
