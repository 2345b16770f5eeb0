"""Finds views whose images contradict their poses, and which of them belong together.

Where the object was moved between two series of photographs, or two reconstructions were merged,
the views of each part fit each other, and one body may fit them all. Features of the object show it
in views from similar directions. What surrounds it does not count: before a turntable, it
contradicts right poses.

Of photographs with right poses, no pair contradicts them. If half of the views are turned about the
object by 10 to 45 degrees, or displaced by 20 mm, 8 to 53 % of the pairs do.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from servoid.capture import CaptureView
from servoid.model.running import in_parallel
from servoid.model.view_features import Looked, look, off_px, place
from servoid.pose import exact
from servoid.words import counted, joined

_MOST = 48  # views that are compared, evenly chosen
_NEAREST = 4  # views with which each is compared
_MOST_BETWEEN = 40  # pairs of views of different groups that are compared
_LEAST_DEG, _MOST_DEG = 2.0, 50.0  # between the directions of two views that are compared
_LEAST_VIEWS = 3  # of a group
_LEAST_PAIRS, _LEAST_SHARE = 3, 0.05  # of views that contradict each other
_MOST_APART = 0.6  # share of the views in groups, below which only a pair is named
_LEAST_CLEAR = 5  # of the pairs of two groups that contradict each other
_MOST_UNCLEAR = 0.15  # share of these, of pairs that do not agree with the groups
_MOST_NAMED = 3
# At 1000 px of diagonal, by how much rays to a feature miss each other if two views fit: so many
# times as is usual in the capture.
_FIT_PX, _MOST_PX = 1.0, 8.0
_USUAL = 5.0
_OFF = 2.0  # times that, from which on two views contradict each other

_Offs = dict[tuple[int, int], float]


@dataclass(frozen=True)
class Contradiction:
    """What images have against the poses of their views, in words.

    With `is_apart` the views of each part fit each other, so that no other order of poses is meant.
    """

    words: str
    is_apart: bool


def contradicting_views(views: Sequence[CaptureView]) -> Contradiction | None:
    """Compare the images of views with their poses; return None if they do not contradict them.

    What cannot be read is not compared: it is reported where it is needed.
    """
    shown = [view for view in views if view.has_image and view.has_mask]
    if len(shown) < 2 * _LEAST_VIEWS:
        return None
    places = np.linspace(0, len(shown) - 1, min(_MOST, len(shown))).round().astype(int)
    chosen = [shown[at] for at in places.tolist()]
    seen = [one for one in in_parallel(look, chosen) if one is not None]
    if len(seen) < 2 * _LEAST_VIEWS:
        return None
    groups = _compared(seen)
    return _note([one.view for one in seen], groups) if groups.contradict else None


def _compared(seen: Sequence[Looked]) -> "_Groups":
    """Compare each view with the nearest ones, and then those of different groups."""
    pairs = _by_angle(seen)
    near = _nearest(pairs)
    offs = _compare(seen, near)
    members = _Groups.of(len(seen), offs).members
    group_of = {at: number for number, group in enumerate(members) for at in group}
    between = [pair for pair in pairs if group_of[pair[0]] != group_of[pair[1]]]
    known = set(near)
    further = [pair for pair in between if pair not in known][:_MOST_BETWEEN]
    return _Groups.of(len(seen), offs | _compare(seen, further))


def _compare(seen: Sequence[Looked], pairs: Sequence[tuple[int, int]]) -> _Offs:
    """Return how far features of pairs of views are off, of those with enough in common."""
    offs = in_parallel(lambda pair: off_px(seen[pair[0]], seen[pair[1]]), pairs)
    return {pair: off for pair, off in zip(pairs, offs, strict=True) if off is not None}


def _by_angle(seen: Sequence[Looked]) -> list[tuple[int, int]]:
    """List the pairs of views from similar directions, those from the most similar first."""
    middle = place(seen)
    aims = np.array([one.center - middle for one in seen])
    aims /= np.maximum(exact.lengths(aims), np.finfo(float).tiny)[:, None]
    cosines = exact.product(aims, np.ascontiguousarray(aims.T))
    least, most = (exact.cos(np.radians(degrees)) for degrees in (_MOST_DEG, _LEAST_DEG))
    pairs = combinations(range(len(seen)), 2)
    near = [pair for pair in pairs if least < cosines[pair] < most]
    return sorted(near, key=lambda pair: (-cosines[pair], pair))


def _nearest(pairs: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return the first of the pairs, so that each view is in a few of them."""
    counts: dict[int, int] = {}
    chosen = []
    for pair in pairs:
        if min(counts.get(at, 0) for at in pair) < _NEAREST:
            chosen.append(pair)
            counts.update({at: counts.get(at, 0) + 1 for at in pair})
    return chosen


@dataclass(frozen=True)
class _Groups:
    """Views that fit each other, the largest group first, and how far pairs of views are off."""

    members: list[list[int]]
    fit_px: float
    offs: _Offs = field(repr=False)

    @classmethod
    def of(cls, count: int, offs: _Offs) -> "_Groups":
        """Join views that fit each other, directly or by way of others, the best first.

        Where most pairs of two groups contradict each other, a few that fit by chance do not join
        them.
        """
        of_view = [[off for pair, off in offs.items() if at in pair] for at in range(count)]
        least = [min(some) for some in of_view if some and np.isfinite(min(some))]
        usual_px = float(np.median(least)) if least else 0.0
        fit_px = min(max(_FIT_PX, _USUAL * usual_px), _MOST_PX)
        group_of = np.arange(count)
        for (one, other), off in sorted(offs.items(), key=lambda item: (item[1], item[0])):
            low, high = sorted((group_of[one], group_of[other]))
            if off <= fit_px and low != high:
                pairs = _between(offs, group_of == low, group_of == high)
                if np.sum(pairs <= fit_px) > np.sum(pairs > _OFF * fit_px):
                    group_of[group_of == high] = low
        members = [np.flatnonzero(group_of == group).tolist() for group in np.unique(group_of)]
        return cls(sorted(members, key=lambda group: -len(group)), fit_px, offs)

    @property
    def off(self) -> _Offs:
        """Return the pairs of views that contradict each other."""
        return {pair: off for pair, off in self.offs.items() if off > _OFF * self.fit_px}

    @property
    def contradict(self) -> bool:
        """Return whether so many pairs of views contradict each other that poses are wrong."""
        return len(self.off) >= max(_LEAST_PAIRS, _LEAST_SHARE * len(self.offs))

    def apart(self) -> list[list[int]]:
        """Return the groups that contradict each other, in the order of their views.

        Empty if some of their views fit those of another group, or contradict those of their own.
        """
        count = sum(map(len, self.members))
        some = sorted(group for group in self.members if len(group) >= _LEAST_VIEWS)
        inside = [np.isin(np.arange(count), group) for group in some]
        within = np.concatenate([_between(self.offs, one, one) for one in inside] or [np.empty(0)])
        found: set[int] = set()
        fit, off = 0, 0
        for one, other in combinations(range(len(some)), 2):
            pairs = _between(self.offs, inside[one], inside[other])
            fit += int(np.sum(pairs <= self.fit_px))
            off += int(np.sum(pairs > _OFF * self.fit_px))
            found |= {one, other} if (pairs > _OFF * self.fit_px).any() else set()
        is_clear = (
            off >= _LEAST_CLEAR
            and max(fit, int(np.sum(within > _OFF * self.fit_px))) <= _MOST_UNCLEAR * off
        )
        return [some[at] for at in sorted(found)] if is_clear else []


def _between(offs: _Offs, one: NDArray[np.bool_], other: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return how far pairs of a view of one group and a view of another are off."""
    return np.array(
        [off for (a, b), off in offs.items() if (one[a] and other[b]) or (one[b] and other[a])]
    )


def _note(views: Sequence[CaptureView], groups: _Groups) -> Contradiction:
    """Say which views belong together, if most are in groups, and which do not."""
    off = groups.off
    what = (
        f"the images contradict the poses of the views, or their calibration: in {len(off)} of "
        f"{counted(len(groups.offs), 'pair')} of views from similar directions, features of the "
        "object are not where the poses place them"
    )
    apart = groups.apart()
    if sum(map(len, apart)) < _MOST_APART * len(views) or _share_instants(views, apart):
        one, other = (views[at].name for at in max(off, key=lambda pair: (off[pair], pair)))
        words = (
            f"{what}, such as in {one} and {other}; check how the poses were computed, and whether "
            "the object was moved"
        )
        return Contradiction(words, is_apart=False)
    named = [_named(views, group, apart) for group in apart]
    words = (
        f"{what}: {joined(named)} fit among themselves, but not each other; was the object moved "
        "between them, or are they of two reconstructions? model each part by itself, or compute "
        "the poses of all views together"
    )
    return Contradiction(words, is_apart=True)


def _share_instants(views: Sequence[CaptureView], groups: Sequence[Sequence[int]]) -> bool:
    """Return whether two groups have views of one instant, between which nothing moved."""
    instants = [{views[at].index for at in group} for group in groups]
    return any(one & other for one, other in combinations(instants, 2))


def _named(
    views: Sequence[CaptureView], group: Sequence[int], groups: Sequence[Sequence[int]]
) -> str:
    """Name the views of a group by its first and last, if none of another is between them."""
    first, last = group[0], group[-1]
    if any(first < at < last for other in groups if other is not group for at in other):
        some = joined([views[at].name for at in group[:_MOST_NAMED]])
        return f"{counted(len(group), 'view')} such as {some}"
    return f"the views {views[first].name} to {views[last].name}"
