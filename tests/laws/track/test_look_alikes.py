"""Of several objects that look alike, each is tracked as itself."""

from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest
from fake_tracker import FakeEstimate, FakeTracker, plain_body
from hypothesis import given
from hypothesis import strategies as st
from tiers import tiered
from twin_scenes import RETURNING, TWIN_COURSES, tracked_beside_twin

from servoid.camera import Camera
from servoid.capture import Capture, open_capture
from servoid.errors import TrackError
from servoid.pose import Pose
from servoid.segment import ClickTarget, HueTarget
from servoid.shape import Body
from servoid.track import Request, Subject, Tracked, Tracker, track_capture
from servoid.track.apart import (
    marked_in_one_place,
    others_of,
    still_together,
    told_apart,
)

SAID = "something that looks like the object was already there"
RUNS = [(name, seed) for seed in range(2) for name in TWIN_COURSES]
FIRST = [("hidden", 1)]


def at(x: float, body: Body | None = None) -> Body:
    """Return a body moved along x."""
    body = plain_body() if body is None else body
    return Body(
        world_from_object=Pose.exp([x, 0.0, 0.0, 0.0, 0.0, 0.0]) @ body.world_from_object,
        centers=body.centers,
        radii=body.radii,
        rotations=body.rotations,
    )


@pytest.mark.parametrize(
    ("name", "seed"), tiered([*FIRST, *(run for run in RUNS if run not in FIRST)], quick=len(FIRST))
)
def test_an_object_that_is_gone_is_not_found_in_its_twin(
    name: str, seed: int, tmp_path: Path
) -> None:
    result, found = tracked_beside_twin(tmp_path, name, seed)
    assert not found.trusted_wrong.any()
    told = [one.estimate.located for one in result.tracked[1:]]
    assert not any(located and off > 0.05 for located, off in zip(told, found.add, strict=True))
    if name in RETURNING:
        assert found.right[-1], "it is found again where it is"
    if (name, seed) in FIRST:
        assert any(SAID in notice for one in result.tracked for notice in one.notices)


@pytest.mark.extended
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", ["hidden", "away"])
def test_a_known_body_is_not_found_in_its_twin_either(name: str, seed: int, tmp_path: Path) -> None:
    _, found = tracked_beside_twin(tmp_path, name, seed, known=True)
    assert not found.trusted_wrong.any()


@given(way=st.floats(0.0, 0.5))
def test_bodies_are_at_one_place_only_as_long_as_they_share_much_of_their_volume(
    way: float,
) -> None:
    body = plain_body()
    size = float(body.radii.max())
    assert body.shares_place(at(way)) == at(way).shares_place(body)
    if way < 0.05 * size:
        assert body.shares_place(at(way))
    if way > 2.0 * size + float(abs(body.centers).max()):
        assert not body.shares_place(at(way))


def test_a_small_body_in_a_large_one_is_beside_it() -> None:
    large = plain_body()
    small = Body(
        world_from_object=large.world_from_object,
        centers=0.3 * large.centers,
        radii=0.3 * large.radii,
        rotations=large.rotations,
    )
    assert not small.shares_place(large) and not large.shares_place(small)


class _Object:
    """What keeping objects apart needs of one that is followed."""

    first: Tracked

    def __init__(self, name: str) -> None:
        self.name = name

    def body_at(self, pose: Pose) -> Body:
        body = plain_body()
        return Body(
            world_from_object=pose,
            centers=body.centers,
            radii=body.radii,
            rotations=body.rotations,
        )


def tracked(x: float, status: str = "tracking") -> Tracked:
    """Return an estimate at a place along x."""
    estimate = FakeEstimate(0.0, Pose.exp([x, 0.0, 0.0, 0.0, 0.0, 0.0]), status)
    return Tracked(index=0, estimate=estimate, seconds=0.0)


def test_two_located_objects_at_one_place_are_both_in_doubt_and_no_other() -> None:
    objects = [_Object(name) for name in "abcd"]
    given = [tracked(0.0), tracked(0.001), tracked(1.0), tracked(0.0, "searching")]
    told = told_apart(objects, given)
    assert [one.estimate.status for one in told] == ["searching"] * 2 + ["tracking", "searching"]
    assert told[0].notices == ("'b' is at the same place, so that one of them is wrong",)
    assert told[1].notices == ("'a' is at the same place, so that one of them is wrong",)
    assert told[2:] == tuple(given[2:])
    assert len(others_of(0, objects, given)) == 2


def test_objects_that_were_marked_in_one_place_may_be_nested_until_they_are_seen_apart() -> None:
    marked = tuple(
        Subject(name=name, targets=(ClickTarget(u, 1.0),)) for u, name in enumerate("ab")
    )
    for subjects, count in [(marked, 1), ((marked[0], Subject(name="b")), 0)]:
        objects = [_Object(name) for name in "ab"]
        for one in objects:
            one.first = tracked(0.0)
        nested = marked_in_one_place(subjects, objects)
        assert len(nested) == count
    together, apart = [tracked(0.0), tracked(0.001)], [tracked(0.0), tracked(1.0)]
    both = frozenset({frozenset({0, 1})})
    told = told_apart(objects, together, both)
    assert [one.is_tracked for one in told] == [True, True]
    assert others_of(0, objects, together, both) == []
    assert still_together(objects, together, both) == both
    unseen = [apart[0], tracked(1.0, "searching")]
    assert still_together(objects, unseen, both) == both
    assert still_together(objects, apart, both) == frozenset()


SIZE, FOCAL_PX, AWAY_M = (640, 480), 600.0, 0.5
EYES = [Pose.from_parts([x, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]) for x in (0.0, 0.06)]
HALF_M = (0.10, 0.008)


@cache
def wall() -> np.ndarray:
    noise = np.random.default_rng(2).uniform(60, 170, (*SIZE[::-1], 3))
    return cv2.GaussianBlur(noise, None, 6)


def slender(turned_deg: float | None, seed: int) -> list[np.ndarray]:
    """Draw what two eyes see of a slender plain ellipse before a wall; None: it is hidden."""
    random = np.random.default_rng(seed)
    images = []
    for eye in EYES:
        image = wall() + random.normal(0.0, 2.0, wall().shape)
        if turned_deg is not None:
            middle = (319.5 - FOCAL_PX * eye.translation[0] / AWAY_M, 239.5)
            axes = [2.0 * FOCAL_PX * half / AWAY_M for half in HALF_M]
            cv2.ellipse(image, (middle, axes, turned_deg), (210, 40, 40), cv2.FILLED)
        images.append(np.clip(image, 0, 255).astype(np.uint8))
    return images


def tracker_of_slender() -> tuple[Tracker, Pose]:
    """Return a tracker of that ellipse, and where it is at first."""
    place = Pose.from_parts([0.0, 0.0, AWAY_M], [1.0, 0.0, 0.0, 0.0])
    body = Body(
        world_from_object=place,
        centers=np.zeros((1, 3)),
        radii=[[*HALF_M, 0.5 * HALF_M[1]]],
        rotations=[[1.0, 0.0, 0.0, 0.0]],
    )
    camera = Camera(size_px=SIZE, focal_px=(FOCAL_PX, FOCAL_PX), center_px=(319.5, 239.5))
    return Tracker([camera, camera], body), place


@pytest.mark.parametrize("turned_deg", tiered([0.0, 25.0, 40.0]))
@pytest.mark.parametrize("hidden", tiered([6, 0]))
def test_a_slender_object_that_turned_in_place_is_no_other_one(
    turned_deg: float, hidden: int
) -> None:
    tracker, place = tracker_of_slender()
    tracker.start(0.0, EYES, slender(0.0, 0), place)
    seen: list[float | None] = [*[0.0] * 3, *[None] * hidden, *[turned_deg] * 20]
    estimates = [
        tracker.step(number / 30.0, EYES, slender(turned, number))
        for number, turned in enumerate(seen, start=1)
    ]
    assert not any(SAID in notice for one in estimates for notice in one.notices)
    assert estimates[-1].located


def test_two_objects_are_not_marked_by_one_target(drawn_capture: Path) -> None:
    both = [Subject(name=name, targets=(HueTarget(10.0, 40.0),)) for name in "ab"]
    with pytest.raises(TrackError, match=r"'a' and 'b' are marked by the same target"):
        track_capture(open_capture(drawn_capture), both)


def test_a_tracker_is_told_of_the_others_before_each_image(
    drawn_capture: Path, fake_core: type[FakeTracker], monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[str, int]] = []
    monkeypatch.setattr(
        fake_core,
        "avoid",
        lambda self, others: told.append((self.made.index(self), len(others))),
        raising=False,
    )
    capture: Capture = open_capture(drawn_capture)
    body = plain_body()
    subjects = [
        Subject(name=name, body=body, start=at(x).world_from_object)
        for name, x in (("a", 0.0), ("b", 0.5))
    ]
    track_capture(capture, subjects, Request(observations=slice(2)))
    assert told == [(0, 0), (1, 1), (0, 1), (1, 1)]
