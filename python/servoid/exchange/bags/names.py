"""Names of topics and frames in recordings that servoid writes."""

import re

TIME_TOPIC = "/servoid/time_s"
"""Exact times of observations: stamps are whole nanoseconds, and cannot represent every number."""

TF_TOPIC, STATIC_TOPIC = "/tf", "/tf_static"
WORLD, RIG = "world", "rig"

_NO_LETTER = re.compile(r"[^A-Za-z0-9_]")


def topic_of(name: str, what: str) -> str:
    """Return the topic for a camera or an object; ROS allows few characters in it."""
    return f"/{word_of(name)}/{what}"


def word_of(name: str) -> str:
    """Convert a name to ROS's rules: ASCII letters, digits and underscores, no digit first."""
    word = _NO_LETTER.sub("_", name)
    return f"_{word}" if word[:1].isdigit() else word


def frame_of(name: str) -> str:
    """Return a camera's frame name: x right, y down, z forward, as in ROS's optical frames."""
    return f"{word_of(name)}_optical"
