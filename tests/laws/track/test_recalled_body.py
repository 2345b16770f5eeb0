"""A saved body holds what its tracker knew of the object's look, and files of earlier versions
are read."""

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest
from recordings import Alone

from servoid import _native
from servoid.errors import TrackError
from servoid.shape import load_body
from servoid.track import cameras_of

MOST = 8  # images until it is found, at the latest
RIGHT_M = 0.01
REFERENCE = 7 * 8  # bytes of the reference values
NEWEST_VERSION = 2
PATCHES = 3 * 65  # bytes of the templates of a point from one side


@dataclass
class Written:
    """The parts of an appearance, read as `docs/formats.md` describes them."""

    reference: bytes = b""
    colors: list[tuple[int, float]] = field(default_factory=list)
    points: list[bytes] = field(default_factory=list)  # as in the first version
    hit_rates: list[float] = field(default_factory=list)
    templates: list[int] = field(default_factory=list)
    views: int = 0
    thumbnails: int = 0
    grey: int = 0

    @property
    def of_the_first_version(self) -> bytes:
        """Return the same as servoid wrote it until version 0.7."""
        counts = struct.pack("<BII", self.grey, len(self.points), len(self.colors))
        colors = b"".join(struct.pack("<If", *one) for one in self.colors)
        return b"servoap1" + counts + self.reference + colors + b"".join(self.points)


def parsed(data: bytes) -> Written:
    """Read an appearance independently of the tracker."""
    at = 0

    def take(form: str) -> tuple[float, ...]:
        nonlocal at
        values = struct.unpack_from("<" + form, data, at)
        at += struct.calcsize("<" + form)
        return values

    def skip(count: int) -> bytes:
        nonlocal at
        at += count
        return data[at - count : at]

    assert skip(8) == b"servoap2"
    grey, points, colors, views = (int(x) for x in take("BIII"))
    out = Written(reference=skip(REFERENCE), grey=grey, views=views)
    out.colors = [(int(one), share) for one, share in (take("If") for _ in range(colors))]
    for _ in range(points):
        out.points.append(skip(16 * 8 + 3 + PATCHES))
        skip(3 + 2 * 8)
        seen, agreed = take("ff")
        out.hit_rates.append(agreed / seen)
        skip(3 * 4)
        (further,) = (int(x) for x in take("B"))
        skip(further * (12 * 8 + PATCHES))
        out.templates.append(1 + further)
    for _ in range(views):
        skip(4 * 8 + 1 + 3 * 8)
        (has_thumbnail,) = take("B")
        if has_thumbnail:
            skip(2 + 4 * 8)
            skip(6 * int(take("I")[0]))
            out.thumbnails += 1
    assert at == len(data)
    return out


def look_of(alone: Alone) -> bytes:
    look = load_body(alone.folder / "body.json").look()
    assert look is not None
    return look


def recalling(alone: Alone, look: bytes) -> _native.Tracker:
    body = load_body(alone.folder / "body.json").body()
    tracker = _native.Tracker(cameras_of(alone.recording.capture), body)
    tracker.recall(look)
    return tracker


def test_a_recalled_body_knows_each_template_and_hit_rate_that_the_tracker_knew(
    alone: Alone,
) -> None:
    look = look_of(alone)
    written = parsed(look)
    assert max(written.templates) > 1
    assert min(written.hit_rates) < 1.0 and max(written.hit_rates) <= 1.0
    assert recalling(alone, look).appearance() == look


def test_a_recalled_body_knows_the_sides_that_the_tracker_saw_and_how_they_looked(
    alone: Alone,
) -> None:
    look = look_of(alone)
    written = parsed(look)
    assert written.views > 1 and written.thumbnails > 0
    again = recalling(alone, look)
    again.recall(again.appearance())
    assert again.appearance() == look


def test_a_body_of_the_first_version_is_recalled_and_found(alone: Alone) -> None:
    old = parsed(look_of(alone)).of_the_first_version
    tracker, recording = recalling(alone, old), alone.recording
    new = parsed(tracker.appearance())
    assert new.of_the_first_version == old
    assert set(new.templates) == {1} and set(new.hit_rates) == {1.0} and not new.views
    estimate, count = None, 0
    for count, moment in enumerate(recording.moments()[:MOST]):
        call: Callable[..., _native.Estimate] = tracker.step if count else tracker.find
        estimate = call(moment.time_s, moment.world_from_camera, moment.images)
    assert estimate is not None and estimate.status == "tracking"
    found = np.asarray(estimate.world_from_object.matrix())
    true = recording.truth(count) @ alone.toy_from_body
    assert np.linalg.norm(found[:3, 3] - true[:3, 3]) < RIGHT_M


@pytest.mark.parametrize("version", [NEWEST_VERSION + 1, 9])
def test_an_appearance_of_a_later_version_is_refused_with_what_to_do(
    version: int, alone: Alone
) -> None:
    later = b"servoap" + str(version).encode() + look_of(alone)[8:]
    with pytest.raises(
        TrackError, match=f"of version {version}, and this servoid reads versions 1 and 2: use"
    ):
        recalling(alone, later)
