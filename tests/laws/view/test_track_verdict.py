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
    [(0, "good; it was tracked in 20 of 20"), (1, "good"), (2, "rough"), (7, "poor")],
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
    assert first.startswith(f"Tracking: {sentence}")
    assert first.startswith(f"Tracking: {result.verdict};")
    often = "once" if lost == 1 else f"{lost} times"
    range_of = "0" if lost <= 1 else f"0 to {lost - 1}"
    why = f"The most frequent notice while it was not, {often}: dark by {range_of}."
    assert more[:-1] == [why][:lost]
    assert more[-1].startswith("The cameras saw ")


@pytest.mark.parametrize(
    ("drift_rad", "words"), [(0.0, "below 0.05 degrees"), (0.0020, "0.1 degrees")]
)
def test_a_drift_is_never_told_as_zero_degrees(drift_rad: float, words: str) -> None:
    track = track_of([OWN] * 3, lambda _: {"evidence": {"drift_rad": drift_rad}})
    result = TrackResult("cup", track, plain_body(OWN, count=2))
    text = " ".join(TrackFigures(result, history_of(3)).words())
    assert f"drift was {words} at most, and {words} at the end" in text
