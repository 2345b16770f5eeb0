"""Measures whether views confirm each other: a body of all others must fit the one left out.

A few views are fitted by a body though their poses are wrong, since it is seen from too few sides
to contradict them: three to five views of inverted or exchanged poses are overlapped by 0.9 and
more. A body that was made without a view is contradicted by that view. In 60 sets of 4 to 8 views,
photographs and drawn objects, it overlaps the view left out by 0.73 to 0.95 on average where the
poses are right, and by 0.0 to 0.74 where they are inverted, shifted, reversed or two are exchanged;
by more only where the exchanged views look alike. Of three views, those of thin objects reach 0.49
to 0.69 though their poses are right: they are too few to tell.
"""

from collections.abc import Sequence

from servoid._native import ModelInput, ModelSettings, View, fit_body, silhouette_ious
from servoid.errors import ModelError
from servoid.model.running import run_core

CONFIRMED = 0.72
"""The mean overlap with the views left out from which on they confirm each other."""
LEAST_LEFT_OUT = 3
"""Views, below which the others do not make a body."""
MOST_LEFT_OUT = 8
"""Views, above which wrong poses fit so badly that the overlap of the body itself shows it."""


def overlap_of_fit(views: Sequence[View], settings: ModelSettings) -> float:
    """Return the mean overlap of views with a body of them; 0 if they make none."""
    return _mean_overlap(views, views, settings)


def overlap_left_out(views: Sequence[View], settings: ModelSettings) -> float:
    """Return the mean overlap of each view with a body of the others; 0 where they make none."""
    overlaps = [
        _mean_overlap([other for other in views if other is not view], [view], settings)
        for view in views
    ]
    return sum(overlaps) / len(overlaps)


def _mean_overlap(
    given: Sequence[View], compared: Sequence[View], settings: ModelSettings
) -> float:
    evidence = ModelInput(views=given)
    try:
        steps = run_core(lambda report: fit_body(evidence, settings, report), None)
    except ModelError:
        return 0.0
    return float(silhouette_ious(steps[-1].body, compared).mean())
