"""Finds out which images and poses do not belong together where a body fits its views badly.

Poses that are shifted by a line or in reversed order leave a body that fits no view well, as a
difficult object does. So other orders are tried, and one is reported only if it fits far better. In
25 captures of 6 to 67 views, photographs and drawn objects with exact and with rough poses and
masks, another order than the right one leaves 1.35 times the misfit or more (0.91 on a level ring,
where a shift only turns the object); of a wrong one, the right order leaves 0.11 to 0.74 times.

Poses of another convention, inverted, with the axes of OpenGL or with w last, leave a body that
fits hardly any view. They are tried where the overlap is that small, so that a difficult object
costs no time.

Two exchanged views fit a body of the other views badly as they are, and well if they change places.
In the same captures 70 of 75 exchanged pairs are found, and no pair that was not exchanged.

Few views are fitted well by a body of wrong poses too, so each is compared with a body of the
others instead (`left_out`); and if that fits badly, and in no other order well, it is reported that
nothing confirms their poses.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, ModelSettings, Pose, View, silhouette_ious
from servoid.capture import CaptureView
from servoid.model.left_out import (
    CONFIRMED,
    LEAST_DIRECTIONS,
    MOST_DIRECTIONS,
    directions,
    overlap_left_out,
    overlap_of_fit,
)
from servoid.model.running import Progress, ProgressCallback
from servoid.pose import CV_FROM_GL
from servoid.words import counted

_GOOD = 0.9  # a mean overlap from which on the order is not doubted
_HARDLY = 0.7  # a mean overlap from which on the convention of the poses is not doubted
_BEHIND = 0.05  # below the median overlap, a view may be exchanged
_MOST = 10  # such views
_EXCHANGED = 0.7  # what two exchanged views may leave of their misfit, as a share of it
_REORDERED = 0.8  # likewise for another order, which fits all views better
_LEAST_VIEWS = 4
_MOST_TRIED = 24  # views
_TRIED_ELLIPSOIDS = 4
_MOST_EXCHANGED = 6  # few views, up to which all pairs of them are tried
_FEW = (
    "nothing confirms the poses of these {count} views, and a body fits so few whether they are "
    "right or wrong: {why}; check poses and masks, or add views from other sides: five to eight "
    "usually suffice"
)

_Report = Callable[[str], None]  # reports the stage of long work

_ORDERS: tuple[tuple[str, Callable[[int, int], int]], ...] = (
    ("if each image takes the pose of the next line", lambda index, _: index + 1),
    ("if each image takes the pose of the line before", lambda index, _: index - 1),
    ("if the poses are taken in reversed order", lambda index, last: last - index),
)
"""Orders of poses to try: the words, and the index of a pose for an image's index and the last."""

_CONVENTIONS: tuple[tuple[str, Callable[[Pose], Pose]], ...] = (
    ("camera_from_world: invert them", Pose.inverse),
    (
        "those of cameras with y up and z backwards, as in OpenGL and Blender: change the signs of "
        "the second and the third column of each rotation",
        lambda pose: pose @ CV_FROM_GL,
    ),
    (
        "those with quaternions in the order x, y, z, w, as in ROS and SciPy: write w first",
        lambda pose: Pose.from_xyzw(pose.translation, pose.quaternion),
    ),
)
"""Conventions of poses to try: what they are and what to do, and world_from_camera of a pose."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A body, and how it fits its views.

    `native` are the `views` in the core's form, `ious` (V,) float64 their overlap with the body.
    `fitness` is that of the body. `is_checked` says that other views, or measured depth, contradict
    poses that are wrong.
    """

    body: Body
    fitness: float
    settings: ModelSettings
    views: Sequence[CaptureView]
    native: Sequence[View]
    ious: NDArray[np.float64]
    is_checked: bool = False


def misplaced_notes(
    fitted: Fitted,
    everywhere: Sequence[CaptureView],
    progress: ProgressCallback | None = None,
) -> list[str]:
    """Report poses in another order than their images, or pairs of views that are exchanged.

    `everywhere` are all views whose pose is known. Where the views are few, poses that nothing
    confirms are reported as well.
    """
    sides = len(directions(fitted.native))
    report = partial(_reported, progress, fitted)
    if sides <= MOST_DIRECTIONS and not fitted.is_checked:
        return _few_notes(fitted, sides, everywhere, report)
    if len(fitted.views) < _LEAST_VIEWS:
        return []
    order = None
    if float(fitted.ious.mean()) < _GOOD:
        order = _order_note(fitted, everywhere, report)
    return _exchanged_notes(fitted) if order is None else [order]


def _reported(progress: ProgressCallback | None, fitted: Fitted, stage: str) -> None:
    if progress is not None:
        progress(Progress(len(fitted.body), fitted.fitness, 1.0, stage))


def _few_notes(
    fitted: Fitted,
    sides: int,
    everywhere: Sequence[CaptureView],
    report: _Report,
) -> list[str]:
    """Report what is wrong with the poses of views from few `sides`, or that nothing confirms them.

    Of the cameras of a rig at one instant, the images themselves are compared instead.
    """
    count = len(fitted.views)
    if sides < LEAST_DIRECTIONS:
        is_instant = len({view.index for view in fitted.views}) == 1
        why = f"they look from {counted(sides, 'direction')}"
        return [] if is_instant else [_FEW.format(count=count, why=why)]
    report("comparing the views with each other")
    tries = _Tries.of(fitted.views, fitted.native, fitted.settings, report, are_few=True)
    before = tries.as_they_are()
    if before >= CONFIRMED:
        return []
    found = _in_orders(everywhere, tries, before) + _in_conventions(tries, before)
    if count <= _MOST_EXCHANGED and max(found)[0] < CONFIRMED:
        found += [tries.exchanged(pair, before) for pair in combinations(range(count), 2)]
    after, note = max(found)
    if after >= CONFIRMED and 1.0 - after < _REORDERED * (1.0 - before):
        return [note]
    exchanged = _exchanged_notes(fitted) if count > _MOST_EXCHANGED else []
    if exchanged:
        return exchanged
    why = (
        f"a body of the others overlaps the mask of each by {before:.2f} on average (intersection "
        f"over union), and by {CONFIRMED:g} and more where poses are right"
    )
    return [_FEW.format(count=count, why=why)]


def _exchanged_notes(fitted: Fitted) -> list[str]:
    """Report pairs of views whose masks fit the body if they change places."""
    body, views, ious = fitted.body, fitted.native, fitted.ious
    behind = np.flatnonzero(ious < np.median(ious) - _BEHIND)
    behind = behind[np.argsort(ious[behind], kind="stable")][:_MOST]
    found = []
    for pair in combinations(behind.tolist(), 2):
        exchanged = _exchanged(views[pair[0]], views[pair[1]])
        if exchanged is None:
            continue
        before, after = ious[list(pair)], silhouette_ious(body, exchanged)
        share = float((1.0 - after).sum() / (1.0 - before).sum())
        if share < _EXCHANGED and bool((after > before).all()):
            found.append((share, pair, before, after))
    notes: list[str] = []
    taken: set[int] = set()
    for _, pair, before, after in sorted(found, key=lambda one: one[:2]):
        if taken.isdisjoint(pair):
            taken.update(pair)
            one, other = (fitted.views[index].name for index in pair)
            notes.append(
                f"{one} and {other} look exchanged: each with the other's pose, the body overlaps "
                f"their masks by {after[0]:.2f} and {after[1]:.2f} (intersection over union) "
                f"instead of {before[0]:.2f} and {before[1]:.2f}; exchange their masks and images, "
                "or their poses"
            )
    return notes


@dataclass(frozen=True, eq=False)
class _Tries:
    """Some views, and how well a quick body of them fits if they take other poses."""

    used: Sequence[CaptureView]
    native: Sequence[View]
    settings: ModelSettings
    report: _Report
    are_few: bool

    @classmethod
    def of(
        cls,
        used: Sequence[CaptureView],
        native: Sequence[View],
        settings: ModelSettings,
        report: _Report,
        *,
        are_few: bool = False,
    ) -> "_Tries":
        """Choose views, at most so many that trying is quick; few are compared each by itself."""
        some = np.unique(np.linspace(0, len(used) - 1, min(len(used), _MOST_TRIED)).round())
        tried = [int(one) for one in some]
        quick = ModelSettings(
            max_ellipsoids=_TRIED_ELLIPSOIDS,
            delta=0.0,
            seed=settings.seed,
            threads=settings.threads,
            quick=True,
        )
        views, seen = [used[one] for one in tried], [native[one] for one in tried]
        return cls(views, seen, quick, report, are_few)

    def as_they_are(self) -> float:
        """Return the mean overlap with the given poses."""
        return self._overlap(self.native)

    def at(self, world_from_lens: Callable[[CaptureView], Pose | None]) -> float:
        """Return the mean overlap at other poses of the lenses, of which some may be unknown.

        Of few views, what confirms none of them is 0.
        """
        posed = [
            _posed(view, of, world_from_lens(of))
            for view, of in zip(self.native, self.used, strict=True)
        ]
        views = [view for view in posed if view is not None]
        least = LEAST_DIRECTIONS if self.are_few else _LEAST_VIEWS
        self.report("comparing other orders of the poses")
        return self._overlap(views, CONFIRMED) if len(views) >= least else 0.0

    def exchanged(self, pair: tuple[int, int], before: float) -> tuple[float, str]:
        """Return the mean overlap if two views change places, and what to report of it."""
        changed = _exchanged(*(self.native[index] for index in pair))
        if changed is None:
            return 0.0, ""
        views = list(self.native)
        views[pair[0]], views[pair[1]] = changed
        self.report("comparing exchanged views")
        after = self._overlap(views, CONFIRMED)
        one, other = (self.used[index].name for index in pair)
        return after, (
            f"{one} and {other} look exchanged: each with the other's pose, "
            f"{self.words(after, before)}; exchange their masks and images, or their poses"
        )

    def words(self, after: float, before: float) -> str:
        """Return what the mean overlap would be, and what it is."""
        what = f"a body of {_TRIED_ELLIPSOIDS} ellipsoids overlaps the masks"
        if self.are_few:
            what = "a body of all others overlaps the mask of each view"
        return f"{what} by {after:.2f} on average (intersection over union) instead of {before:.2f}"

    def _overlap(self, views: Sequence[View], least: float = 0.0) -> float:
        if self.are_few:
            return overlap_left_out(views, self.settings, least)
        return overlap_of_fit(views, self.settings)


def _order_note(fitted: Fitted, everywhere: Sequence[CaptureView], report: _Report) -> str | None:
    """Report poses in another order or convention, where that fits the masks far better."""
    tries = _Tries.of(fitted.views, fitted.native, fitted.settings, report)
    before = tries.as_they_are()
    found = _in_orders(everywhere, tries, before)
    if float(fitted.ious.mean()) < _HARDLY:
        found += _in_conventions(tries, before)
    after, note = max(found)
    return note if 1.0 - after < _REORDERED * (1.0 - before) else None


def _in_orders(
    everywhere: Sequence[CaptureView], tries: _Tries, before: float
) -> list[tuple[float, str]]:
    """Return the overlap in each other order of the poses, and what to report of it."""
    lenses = {(view.camera_name, view.index): view.world_from_lens for view in everywhere}
    last = max(view.index for view in everywhere)
    found: list[tuple[float, str]] = []
    for words, order in _ORDERS:
        after = tries.at(
            lambda of, order=order: lenses.get((of.camera_name, order(of.index, last)))
        )
        found.append(
            (
                after,
                f"images and poses do not belong together: {words}, {tries.words(after, before)}; "
                "compare the lines of the poses with the names of the images, and do not use the "
                "body until then",
            )
        )
    return found


def convention_note(
    used: Sequence[CaptureView], native: Sequence[View], settings: ModelSettings
) -> str | None:
    """Report that views of which no body can be made have poses of another convention."""
    if len(used) < LEAST_DIRECTIONS:
        return None
    are_few = len(directions(native)) <= MOST_DIRECTIONS
    tries = _Tries.of(used, native, settings, lambda _: None, are_few=are_few)
    after, note = max(_in_conventions(tries, 0.0))
    return note if after > (CONFIRMED if are_few else _HARDLY) else None


def _in_conventions(tries: _Tries, before: float) -> list[tuple[float, str]]:
    """Return the overlap in each other convention of poses, and what to report of it."""
    found: list[tuple[float, str]] = []
    for words, turned in _CONVENTIONS:
        after = tries.at(lambda of, turned=turned: turned(of.world_from_lens))
        found.append((after, f"the poses look like {words}; then {tries.words(after, before)}"))
    return found


def _exchanged(one: View, other: View) -> list[View] | None:
    """Return two views with each other's masks; None if these do not fit their cameras."""
    if one.camera.size_px != other.camera.size_px:
        return None
    return [
        View(camera=to.camera, world_from_camera=to.world_from_camera, mask=by.mask)
        for to, by in ((one, other), (other, one))
    ]


def _posed(view: View, of: CaptureView, world_from_lens: Pose | None) -> View | None:
    """Return a view at another pose of its lens; None if that is not known."""
    if world_from_lens is None:
        return None
    pose = world_from_lens @ of.ideal.lens_from_camera
    return View(camera=view.camera, world_from_camera=pose, mask=view.mask)
