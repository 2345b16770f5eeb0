"""Names of topics and frames in recordings that servoid writes."""

import re
from collections.abc import Sequence

TIME_TOPIC = "/servoid/time_s"
"""Exact times of observations: stamps are whole nanoseconds, and cannot represent every number."""

TF_TOPIC, STATIC_TOPIC = "/tf", "/tf_static"
WORLD, RIG = "world", "rig"

_TRANSPORT = re.compile(r"/(compressed|compressedDepth)$")
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


def without_transport(topic: str) -> str:
    """Return the topic of the images whose compressed ones a topic carries."""
    return _TRANSPORT.sub("", topic)


def namespace_of(topic: str) -> str:
    """Return the namespace that the topics of a camera share, which is the camera's name."""
    return without_transport(topic).rpartition("/")[0]


def short_names(spaces: Sequence[str]) -> list[str]:
    """Name cameras by the last part of their namespaces, or by the whole if that is ambiguous."""
    spaces = [space.strip("/") or "camera" for space in spaces]
    short = [space.rpartition("/")[2] for space in spaces]
    return short if len(set(short)) == len(short) else [one.replace("/", "_") for one in spaces]
