"""The settings of the paper's law, without servoid's additions."""

from typing import Any

import msgspec

from servoid.servo.settings import JointLaw, ServoSettings

PAPER_LAW: dict[str, Any] = {
    "joints.law": JointLaw.PAPER,
    "hand.feed_forward": False,
    "gaze.feed_forward": False,
    # Such large process noise that the filter reproduces each estimate.
    "target.compensate": False,
    "target.use_covariance": False,
    "target.linear_rest": 1e2,
    "target.linear_jerk": 1e4,
    "target.gliding_jerk": 1e4,
    "target.linear_jump": 0.5,
    # The confidence of the paper's tracker is a share of colours, not a probability.
    "safety.least_confidence": 0.0,
}
"""The settings of the paper's law by their dotted names.

Rotations are still followed only as far as they are observable: the paper uses the true ones.
"""


_TURN_TOLD = {
    "target.angular_rest": 1e2,
    "target.angular_jerk": 1e4,
    "target.rolling_jerk": 1e4,
}


def as_the_paper(settings: ServoSettings, *, turn_told: bool = True) -> ServoSettings:
    """Return settings with the paper's law: its joint law, no filter, prediction, feed-forward.

    Gains and limits stay unchanged. With `turn_told`, as in the paper, estimates contain the
    object's true orientation, which is used unfiltered as well.
    """
    for name, value in (PAPER_LAW | (_TURN_TOLD if turn_told else {})).items():
        table, key = name.split(".")
        part = msgspec.structs.replace(getattr(settings, table), **{key: value})
        settings = msgspec.structs.replace(settings, **{table: part})
    return settings
