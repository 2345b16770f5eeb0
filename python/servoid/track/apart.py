"""Keeps several tracked objects apart: two of them are never at one place."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from servoid._native import Body
from servoid.errors import TrackError
from servoid.track.request import Subject
from servoid.track.result import Tracked
from servoid.track.starting import Followed

Pairs = frozenset[frozenset[int]]  # of objects, by their places in the order of the subjects


def body_of(one: Followed, tracked: Tracked) -> Body:
    """Return the body of an object where an estimate has it."""
    return one.body_at(tracked.estimate.world_from_object)


def marked_in_one_place(subjects: Sequence[Subject], objects: Sequence[Followed]) -> Pairs:
    """Return which objects were at one place at first though each has a target of its own.

    Such are stacked cups and nested boxes, whose bodies are not hollow.
    """
    bodies = [body_of(one, one.first) for one in objects]
    return frozenset(
        frozenset((one, other))
        for one, other in combinations(range(len(objects)), 2)
        if subjects[one].targets
        and subjects[other].targets
        and bodies[one].shares_place(bodies[other])
    )


def still_together(objects: Sequence[Followed], tracked: Sequence[Tracked], nested: Pairs) -> Pairs:
    """Return which of the nested pairs were not seen apart in an observation."""
    return frozenset(pair for pair in nested if not _are_apart(objects, tracked, *sorted(pair)))


def _are_apart(
    objects: Sequence[Followed], tracked: Sequence[Tracked], one: int, other: int
) -> bool:
    if not (tracked[one].estimate.located and tracked[other].estimate.located):
        return False
    body = body_of(objects[one], tracked[one])
    return not body.shares_place(body_of(objects[other], tracked[other]))


def others_of(
    place: int, objects: Sequence[Followed], tracked: Sequence[Tracked], nested: Pairs = frozenset()
) -> list[Body]:
    """Return the bodies of all objects but one that are located, by their last estimates.

    What may be nested with it is left out.
    """
    pairs = enumerate(zip(objects, tracked, strict=True))
    return [
        body_of(one, last)
        for other, (one, last) in pairs
        if other != place and last.estimate.located and frozenset((place, other)) not in nested
    ]


def told_apart(
    objects: Sequence[Followed], tracked: Sequence[Tracked], nested: Pairs = frozenset()
) -> tuple[Tracked, ...]:
    """Return the estimates of an observation; those of located objects at one place are in doubt.

    At least one of them is wrong, and nothing tells which; but pairs that may be nested are not.
    """
    located = [place for place, one in enumerate(tracked) if one.estimate.located]
    bodies = {
        place: body_of(objects[place], tracked[place])
        for place in (located if len(located) > 1 else ())
    }
    told = list(tracked)
    for pair in combinations(bodies, 2):
        if frozenset(pair) in nested or not bodies[pair[0]].shares_place(bodies[pair[1]]):
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
