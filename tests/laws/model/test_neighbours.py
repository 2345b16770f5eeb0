"""Laws of nearest neighbours."""

import numpy as np
import pytest

from servoid.model import neighbours
from servoid.model.neighbours import nearest, some_of


@pytest.mark.parametrize("axes", [2, 3])
@pytest.mark.parametrize(("points", "count"), [(5, 8), (100, 4), (700, 12)])
def test_neighbours_are_those_of_a_sort_of_all_distances_the_first_of_equal_ones_first(
    points: int, count: int, axes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = np.random.default_rng(points + axes)
    places = np.round(random.normal(size=(points, axes)), 1)  # many are equally far
    queries = some_of(points, 60)
    squared = np.square(places[queries, None] - places[None]).sum(axis=2)
    squared[np.arange(len(queries)), queries] = np.inf
    expected = np.argsort(squared, axis=1, kind="stable")[:, :count]
    for at_once in (1, 1 << 21):
        monkeypatch.setattr(neighbours, "_AT_ONCE", at_once)
        found, ways = nearest(places, queries, count)
        assert (found == expected).all()
        wanted = np.sqrt(np.take_along_axis(squared, expected, axis=1))
        assert ways == pytest.approx(wanted, rel=1e-12)
