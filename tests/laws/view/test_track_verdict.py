"""The report of a track says first whether it is good."""

import pytest
from fake_tracker import plain_body
from track_histories import history_of, track_of

from servoid.pose import Pose
from servoid.track import TrackResult
from servoid.view.track.track_figures import TrackFigures

OWN = Pose.from_parts((0.02, 0.0, 0.45), (1.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("lost", "sentence"),
    [(0, "Good: it was tracked in 20 of 20"), (1, "Good"), (2, "Rough"), (7, "Poor")],
)
def test_the_page_says_first_whether_the_track_is_good_and_then_what_is_not(
    lost: int, sentence: str
) -> None:
    def state(place: int) -> dict[str, object]:
        if place >= lost:
            return {"notices": ["new points"]}
        return {"status": "lost", "notices": [f"dark by {place}"]}

    track = track_of([OWN] * 20, state)
    result = TrackResult("cup", track, plain_body(OWN, count=2))
    first, *more = TrackFigures(result, history_of(20)).verdict()
    assert first.startswith(sentence)
    often = "once" if lost == 1 else f"{lost} times"
    why = f"The most frequent notice while it was not, {often}: dark by 0."
    assert more == [why][:lost]
