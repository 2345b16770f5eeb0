"""Names of topics and frames in recordings that servoid writes."""

import re

TIME_TOPIC = "/servoid/time_s"
"""Exact times of observations: stamps count nanoseconds, and cannot hold every number."""

TF_TOPIC, STATIC_TOPIC = "/tf", "/tf_static"
WORLD, RIG = "world", "rig"

_NO_LETTER = re.compile(r"[^A-Za-z0-9_]")


def topic_of(name: str, what: str) -> str:
    """Return the topic of what belongs to a camera or an object; ROS allows few letters in it."""
    return f"/{word_of(name)}/{what}"


def word_of(name: str) -> str:
    """Return a name as ROS allows it: ASCII letters, digits and underscores, no digit first."""
    word = _NO_LETTER.sub("_", name)
    return f"_{word}" if word[:1].isdigit() else word


def frame_of(name: str) -> str:
    """Name the frame of a camera: x right, y down, z forward, as ROS's optical frames are."""
    return f"{word_of(name)}_optical"
