"""Chooses the topics of a bag: those that the user names, or the most likely ones."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from servoid.errors import CaptureError
from servoid.exchange.bags.geometry.calibration import CAMERA_INFO
from servoid.exchange.bags.names import TIME_TOPIC, without_transport
from servoid.exchange.bags.stored.header import read_header
from servoid.exchange.bags.stored.pixels import (
    COMPRESSED,
    IMAGE,
    is_compressed_depth,
    is_depth,
    size_of,
)
from servoid.exchange.bags.stored.reader import Bag

# Of the topics of one camera, the first available one is used.
_RANKS = ("image_raw", "image_color", "image", "image_rect_color", "image_rect_raw", "image_rect")
_PAIRS = (("left", "right"), ("infra1", "infra2"), ("cam0", "cam1"), ("camera_0", "camera_1"))
_COLORED = re.compile(r"color|colour|rgb", re.IGNORECASE)
_MOST_NAMED = 8


@dataclass(frozen=True)
class ImageTopic:
    """A topic of images; `base` is its name without the suffix for compression."""

    topic: str
    base: str
    is_depth: bool
    size_px: tuple[int, int]
    frame: str
    info_topic: str | None

    @property
    def camera(self) -> str:
        """Return the camera's name: the namespace that its topics share."""
        return self.base.rpartition("/")[0]

    @property
    def is_rectified(self) -> bool:
        """Return whether the images are rectified, by the naming of image_proc and drivers."""
        return "rect" in self.base.rpartition("/")[2]

    def rank(self) -> tuple[int, int, str]:
        """Return the sort key of the topics of one camera, the best first."""
        last = self.base.rpartition("/")[2]
        named = _RANKS.index(last) if last in _RANKS else len(_RANKS)
        return named, int(self.topic != self.base), self.topic


@dataclass(frozen=True)
class Chosen:
    """Colour topics, a depth topic or None for each, and `notes` on what was guessed."""

    images: tuple[ImageTopic, ...]
    depths: tuple[ImageTopic | None, ...]
    notes: tuple[str, ...] = ()


def choose(bag: Bag, topics: Sequence[str]) -> Chosen:
    """Choose by name, or guess if no topic is named.

    Raises:
        CaptureError: a name is not a topic of images, there is none, or depth fits no camera.

    """
    names = [name for name, kind in bag.kinds.items() if kind in (IMAGE, COMPRESSED)]
    if not names:
        raise CaptureError(
            f"{bag.path} holds no images: no topic of {IMAGE} or {COMPRESSED}; its topics are "
            f"{_some(sorted(bag.kinds))}"
        )
    if topics:
        return _by_name(bag, [_named(bag, topic, names) for topic in topics])
    return _guessed(bag, [one for one in (_describe(bag, name) for name in names) if one])


def _named(bag: Bag, topic: str, names: Sequence[str]) -> ImageTopic:
    found = next((name for name in (topic, f"{topic}/compressed") if name in names), None)
    if found is None:
        raise CaptureError(
            f"{bag.path} holds no images on '{topic}'; its topics of images are {_some(names)}"
        )
    described = _describe(bag, found)
    if described is None:
        raise CaptureError(f"{bag.path}: nothing was recorded on '{found}'; choose another topic")
    return described


def _describe(bag: Bag, topic: str) -> ImageTopic | None:
    """Examine the first image of a topic; None if there is none, or it has no size."""
    first = bag.first(topic)
    if first is None:
        return None
    size, is_of_depth = bag.decode(
        first, lambda image: (size_of(image, topic), is_depth(image, topic))
    )
    if size is None or min(size) < 1:
        return None
    is_compressed = bag.kinds[topic] == COMPRESSED
    return ImageTopic(
        topic=topic,
        base=without_transport(topic) if is_compressed else topic,
        is_depth=is_of_depth,
        size_px=size,
        frame=read_header(bag, first).frame,
        info_topic=_info_topic(bag, without_transport(topic) if is_compressed else topic),
    )


def _info_topic(bag: Bag, base: str) -> str | None:
    """Return the topic of the calibration, by image_transport's rule."""
    topic = f"{base.rpartition('/')[0]}/camera_info"
    return topic if bag.kinds.get(topic) == CAMERA_INFO else None


def _by_name(bag: Bag, named: Sequence[ImageTopic]) -> Chosen:
    images = [one for one in named if not one.is_depth]
    if not images:
        raise CaptureError(
            f"{bag.path}: only topics of depth were named; name the camera's images too, such as "
            "those to which the depth is registered"
        )
    depths: list[ImageTopic | None] = [None] * len(images)
    for depth in (one for one in named if one.is_depth):
        fits = [index for index, image in enumerate(images) if _is_registered(depth, image)]
        if not fits:
            raise CaptureError(
                f"{bag.path}: {_not_registered(depth, images)}; record it aligned to them"
            )
        depths[fits[0]] = depth
    return Chosen(tuple(images), tuple(depths))


def _guessed(bag: Bag, found: Sequence[ImageTopic]) -> Chosen:
    is_own = TIME_TOPIC in bag.kinds  # then all its cameras form one rig, in their order
    order = list(bag.kinds)
    seen = [one for one in found if not one.is_depth]
    seen.sort(key=lambda one: (order.index(one.info_topic or one.topic),) if is_own else one.rank())
    calibrated = [one for one in seen if one.info_topic is not None]
    if not seen:
        raise CaptureError(
            f"{bag.path}: its topics of images have only depth, or no image; record those of a "
            "camera too"
        )
    cameras: dict[str, ImageTopic] = {}
    for one in calibrated or seen:
        cameras.setdefault(one.camera, one)
    depths = [one for one in found if one.is_depth]
    images = tuple(cameras.values()) if is_own else _likely(cameras, depths)
    chosen = tuple(_depth_of(image, depths) for image in images)
    if len(found) == 1 or is_own:
        return Chosen(images, chosen)
    used = [one.topic for one in (*images, *chosen) if one is not None]
    others = [one.topic for one in found if one.topic not in used]
    rest = f"; left out: {_some(others)}" if others else ""
    return Chosen(
        images,
        chosen,
        (
            f"of the topics of images {', '.join(used)} were chosen{rest}; --topic chooses others",
            *_unregistered(images, depths),
        ),
    )


def _unregistered(images: Sequence[ImageTopic], depths: Sequence[ImageTopic]) -> Iterator[str]:
    """Yield notes on depth that is not used, as it belongs to other pixels than the images."""
    for depth in depths:
        if not any(_is_registered(depth, image) for image in images):
            yield f"{_not_registered(depth, images)}, so it is not used; record it aligned to them"


def _not_registered(depth: ImageTopic, images: Sequence[ImageTopic]) -> str:
    return (
        f"the depth on '{depth.topic}' (frame '{depth.frame}', {depth.size_px[0]}x"
        f"{depth.size_px[1]} pixels) is not registered to the images of "
        f"{' or '.join(one.topic for one in images)}"
    )


def _likely(cameras: dict[str, ImageTopic], depths: Sequence[ImageTopic]) -> tuple[ImageTopic, ...]:
    """Return the only camera, one with depth, a stereo pair, or the first one with colour."""
    names = sorted(cameras)
    with_depth = [name for name in names if _depth_of(cameras[name], depths) is not None]
    if len(names) > 1 and with_depth:
        return (cameras[with_depth[0]],)
    for left, right in _PAIRS:
        for name in names:
            other = name.replace(left, right)
            if other in cameras and other != name:
                pair = cameras[name], cameras[other]
                if pair[0].size_px == pair[1].size_px:
                    return pair
    return (cameras[min(names, key=lambda name: (not _COLORED.search(name), name))],)


def _depth_of(image: ImageTopic, depths: Sequence[ImageTopic]) -> ImageTopic | None:
    fits = [one for one in depths if _is_registered(one, image)]
    return min(fits, key=lambda one: (is_compressed_depth(one.topic), one.topic), default=None)


def _is_registered(depth: ImageTopic, image: ImageTopic) -> bool:
    """Return whether depth is registered to the pixels of a camera."""
    return (depth.frame, depth.size_px) == (image.frame, image.size_px)


def _some(names: Sequence[str]) -> str:
    listed = list(names)
    if len(listed) > _MOST_NAMED:
        listed = [*listed[: _MOST_NAMED - 1], "..."]
    return ", ".join(listed) or "none"
