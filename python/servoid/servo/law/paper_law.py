"""The paper's law, as one piece: what servoid adds to it is left out."""

from typing import Any

import msgspec

from servoid.servo.settings import JointLaw, ServoSettings

PAPER_LAW: dict[str, Any] = {
    "joints.law": JointLaw.PAPER,
    "hand.feed_forward": False,
    "gaze.feed_forward": False,
    # So rough a motion, and no rest, that the filter takes each estimate as it is.
    "target.compensate": False,
    "target.use_covariance": False,
    "target.linear_rest": 1e2,
    "target.linear_jerk": 1e4,
    "target.gliding_jerk": 1e4,
    "target.linear_jump": 0.5,
    # Its tracker tells a share of colours, and no probability.
    "safety.least_confidence": 0.0,
}
"""The settings of the paper's law by their dotted names.

Turns are still followed only as far as images tell them: the paper is given the true ones.
"""


_TURN_TOLD = {
    "target.angular_rest": 1e2,
    "target.angular_jerk": 1e4,
    "target.rolling_jerk": 1e4,
}


def as_the_paper(settings: ServoSettings, *, turn_told: bool = True) -> ServoSettings:
    """Return settings with the paper's law: its joints, no filter, prediction, feed-forward.

    Gains and limits stay as they are. With `turn_told`, as in the paper, estimates hold the
    object's true orientation, and it counts as it is, too.
    """
    for name, value in (PAPER_LAW | (_TURN_TOLD if turn_told else {})).items():
        table, key = name.split(".")
        part = msgspec.structs.replace(getattr(settings, table), **{key: value})
        settings = msgspec.structs.replace(settings, **{table: part})
    return settings
