"""Reads through a bag once: timestamps of images, calibrations and transforms."""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from servoid.errors import CaptureError
from servoid.exchange.bags.geometry.calibration import Info
from servoid.exchange.bags.geometry.transforms import TF_KINDS, Transforms
from servoid.exchange.bags.names import STATIC_TOPIC, TIME_TOPIC
from servoid.exchange.bags.stored.choosing import Chosen, ImageTopic
from servoid.exchange.bags.stored.header import read_header
from servoid.exchange.bags.stored.reader import Bag, Message, Stored
from servoid.words import counted

_SAME_FROM = 12  # bytes of a message before its content, with the timestamp


@dataclass(frozen=True)
class Shot:
    """One image of a topic: when it was taken, and its position in the bag."""

    stamp_ns: int
    at: Stored


@dataclass
class Content:
    """The content of the chosen topics; images are sorted by their timestamps."""

    transforms: Transforms
    shots: dict[str, list[Shot]] = field(default_factory=dict)
    infos: dict[str, Info] = field(default_factory=dict)
    times_s: dict[int, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def scan(bag: Bag, chosen: Chosen) -> Content:
    """Read through the whole bag, for the chosen topics.

    Raises:
        CaptureError: the bag is damaged, a frame or a calibration changes, or TF is malformed.

    """
    images = {one.topic: one for one in (*chosen.images, *chosen.depths) if one is not None}
    infos = {one.info_topic for one in chosen.images if one.info_topic is not None}
    transforms = {topic for topic, kind in bag.kinds.items() if kind in TF_KINDS}
    reading = _Reading(bag, images, infos)
    topics = [*images, *infos, *transforms]
    if TIME_TOPIC in bag.kinds:
        topics.append(TIME_TOPIC)
    for message in bag.messages(topics):
        if message.at.topic in images:
            reading.image(message)
        elif message.at.topic in infos:
            reading.info(message)
        elif message.at.topic == TIME_TOPIC:
            reading.content.times_s[message.at.log_ns] = bag.decode(message, _seconds)
        else:
            is_static = message.at.topic.endswith(STATIC_TOPIC)
            reading.transforms(message, is_static=is_static)
    return reading.close()


def _seconds(decoded: Any) -> float:
    return float(decoded.data)


class _Reading:
    """Collects the content of messages, one after another."""

    def __init__(self, bag: Bag, images: dict[str, ImageTopic], infos: set[str]) -> None:
        self._bag, self._images = bag, images
        self.content = Content(Transforms(str(bag.path)), {topic: [] for topic in images})
        self._first_infos: dict[str, bytes] = dict.fromkeys(infos, b"")

    def image(self, message: Message) -> None:
        topic, header = message.at.topic, read_header(self._bag, message)
        frame = self._images[topic].frame
        if header.frame != frame:
            raise CaptureError(
                f"{self._bag.path}: the frame of {topic} changes from '{frame}' to "
                f"'{header.frame}'; record one camera on one topic"
            )
        self.content.shots[topic].append(Shot(header.stamp_ns, message.at))

    def info(self, message: Message) -> None:
        topic = message.at.topic
        payload = message.data[_SAME_FROM:]
        if payload == self._first_infos[topic]:
            return
        frame = read_header(self._bag, message).frame
        info = self._bag.decode(message, lambda decoded: Info.of(decoded, frame))
        if not info.is_calibrated:
            return
        known = self.content.infos.setdefault(topic, info)
        if not known.is_like(info):
            raise CaptureError(
                f"{self._bag.path}: the calibration on {topic} changes while it is recorded; lock "
                "zoom and focus, or cut the bag where it changes"
            )
        self._first_infos[topic] = payload

    def transforms(self, message: Message, *, is_static: bool) -> None:
        add = self.content.transforms.add
        self._bag.decode(message, lambda decoded: add(decoded, is_static=is_static))

    def close(self) -> Content:
        """Sort everything and return it."""
        content = self.content
        content.transforms.close()
        for topic, shots in content.shots.items():
            back = sum(b.stamp_ns < a.stamp_ns for a, b in pairwise(shots))
            by_stamp = {shot.stamp_ns: shot for shot in reversed(shots)}
            if back:
                content.notes.append(
                    f"timestamps on {topic} go back {counted(back, 'time')}; its images were "
                    "brought in order"
                )
            if len(by_stamp) < len(shots):
                content.notes.append(
                    f"{counted(len(shots) - len(by_stamp), 'image')} on {topic} "
                    "have the same timestamp as another and were left out"
                )
            content.shots[topic] = [by_stamp[stamp] for stamp in sorted(by_stamp)]
        return content
