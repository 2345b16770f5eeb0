"""What is asked of a track, and cannot mean anything, is refused before anything is read."""

from typing import Any

import pytest

from servoid.errors import TrackError
from servoid.track import Request


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"every": 0}, "every is 0; choose 1 or more"),
        ({"evolve_every": -1}, "evolve_every is -1"),
        ({"observations": range(20)}, r"observations is range\(0, 20\); give a slice"),
    ],
)
def test_a_request_that_means_nothing_is_refused(given: dict[str, Any], words: str) -> None:
    with pytest.raises(TrackError, match=words):
        Request(**given)
