"""Keeps several tracked objects apart: two of them are never at one place."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from servoid._native import Body
from servoid.errors import TrackError
from servoid.track.follower import Avoider, Follower
from servoid.track.request import Subject
from servoid.track.result import Tracked
from servoid.track.starting import Followed


def avoid(tracker: Follower, others: Sequence[Body]) -> None:
    """Let a tracker not find its object where others are, if it can."""
    if isinstance(tracker, Avoider):
        tracker.avoid(others)


def others_of(place: int, objects: Sequence[Followed], tracked: Sequence[Tracked]) -> list[Body]:
    """Return the bodies of all objects but one that are located, by their last estimates."""
    pairs = enumerate(zip(objects, tracked, strict=True))
    return [
        one.body_at(last.estimate.world_from_object)
        for other, (one, last) in pairs
        if other != place and last.estimate.located
    ]


def told_apart(objects: Sequence[Followed], tracked: Sequence[Tracked]) -> tuple[Tracked, ...]:
    """Return the estimates of an observation; those of located objects at one place are in doubt.

    At least one of them is wrong, and nothing tells which.
    """
    located = [place for place, one in enumerate(tracked) if one.estimate.located]
    bodies = {
        place: objects[place].body_at(tracked[place].estimate.world_from_object)
        for place in (located if len(located) > 1 else ())
    }
    told = list(tracked)
    for pair in combinations(bodies, 2):
        if not bodies[pair[0]].shares_place(bodies[pair[1]]):
            continue
        for place, other in (pair, pair[::-1]):
            notice = f"'{objects[other].name}' is at the same place, so that one of them is wrong"
            one = told[place]
            estimate = one.estimate.in_doubt(located=False)
            told[place] = replace(one, estimate=estimate, notices=(*one.notices, notice))
    return tuple(told)


def check_targets_differ(subjects: Sequence[Subject]) -> None:
    """Check that no two objects are marked by the same targets.

    Raises:
        TrackError: two are.

    """
    for one, other in combinations(subjects, 2):
        if one.targets and one.targets == other.targets:
            raise TrackError(
                f"'{one.name}' and '{other.name}' are marked by the same target, "
                f"'{one.targets[0]}'; mark each object by its own"
            )
