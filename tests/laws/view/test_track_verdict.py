"""The report of a track says first whether it is good."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from fake_tracker import plain_body
from track_histories import history_of, track_of

from servoid.pose import Pose
from servoid.track import Tracked, TrackResult
from servoid.view import write_track_report
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


def test_a_track_whose_start_is_in_doubt_is_not_good_and_says_why() -> None:
    track, body = track_of([OWN] * 20), plain_body(OWN, count=2)
    sure = TrackResult("cup", track, body, notes=("the back is a guess",))
    doubted = replace(sure, notes=(*sure.notes, "it may be a jug"), doubts=("it may be a jug",))
    assert next(TrackFigures(sure, history_of(20)).verdict()).startswith("Tracking: good; ")
    first, why, *_ = TrackFigures(doubted, history_of(20)).verdict()
    assert first.startswith("Tracking: rough; ")
    assert why == "In doubt since the start: it may be a jug."
    assert (sure.reasons, doubted.reasons) == ([], ["what was found at first is in doubt"])
    lost = replace(doubted, tracked=track_of([OWN] * 20, lambda _: {"status": "lost"}))
    assert next(TrackFigures(lost, history_of(20)).verdict()).startswith("Tracking: poor; ")
    assert lost.reasons == [*doubted.reasons, "not tracked in 20 of 20 observations"]


def test_a_track_by_cameras_that_the_images_contradict_is_not_good() -> None:
    result = TrackResult("cup", track_of([OWN] * 20), plain_body(OWN, count=2))
    doubted = replace(result, calibration_doubt="the images contradict the calibration")
    assert (result.verdict, doubted.verdict) == ("good", "rough")
    assert doubted.reasons == ["the calibration is in doubt"]
    doubted = replace(result, rig_doubt="features at rest move")
    assert (doubted.verdict, doubted.reasons) == ("rough", ["the poses of the rig are in doubt"])
    first = next(TrackFigures(doubted, history_of(20)).verdict())
    assert first.startswith("Tracking: rough; the poses of the rig are in doubt; it was tracked")
    doubted = replace(result, step_doubt="camera right is 33 ms behind camera left")
    assert (doubted.verdict, doubted.reasons) == ("rough", ["the cameras are out of step"])
    assert doubted.capture_doubts == ("camera right is 33 ms behind camera left",)


def test_what_the_verdict_doubts_is_not_repeated_in_the_notes(tmp_path: Path) -> None:
    notes = ("the back is a guess", "it may be a jug")
    result = TrackResult(
        "cup", track_of([OWN] * 3), plain_body(OWN, count=2), notes=notes, doubts=notes[1:]
    )
    write_track_report(result, history_of(3), tmp_path)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert text.count("it may be a jug") == 1 == text.count("the back is a guess")
    assert "<li>At the start: the back is a guess</li>" in text
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert (summary["notes"], summary["doubts"]) == (["the back is a guess"], ["it may be a jug"])


@pytest.mark.parametrize(
    ("count", "tracked", "is_told"), [(20, 1, True), (20, 2, False), (1, 1, False)]
)
def test_a_track_that_no_image_after_the_first_confirms_says_what_to_do(
    count: int, tracked: int, is_told: bool
) -> None:
    track = track_of(
        [OWN] * count, lambda place: {"status": "tracking" if place < tracked else "lost"}
    )
    result = TrackResult("cup", track, plain_body(OWN, count=2))
    assert (result.nowhere is not None) == is_told
    said = " ".join(TrackFigures(result, history_of(count)).verdict())
    assert ("No image after the first confirms a pose" in said) == is_told


@pytest.mark.parametrize(
    ("overlap", "words"), [(None, None), (0.914, "intersection over union of 0.91")]
)
def test_the_page_says_how_well_the_body_fits_the_first_masks(
    overlap: float | None, words: str | None
) -> None:
    result = TrackResult("cup", track_of([OWN] * 3), plain_body(OWN, count=2), overlap=overlap)
    said = " ".join(TrackFigures(result, history_of(3)).words())
    assert (words in said) if words else ("the masks of the first observation" not in said)


@pytest.mark.parametrize("overlap", [None, 0.9])
@pytest.mark.parametrize("changes", [0, 1, 3])
def test_a_good_track_does_not_vouch_for_the_mask_and_for_a_body_that_changed(
    overlap: float | None, changes: int
) -> None:
    track = track_of([OWN] * 5, lambda place: {"evolved": 0 < place <= changes})
    result = TrackResult("cup", track, plain_body(OWN, count=2), overlap=overlap)
    said = " ".join(TrackFigures(result, history_of(5)).verdict())
    assert ("whether the first mask was the object's" in said) == (overlap is not None)
    assert ("whether the body, which changed" in said) == (changes > 0)
    assert ("No figure shows" in said) == (overlap is not None or changes > 0)
    assert changes == 0 or f"changed {'once' if changes == 1 else '3 times'} while" in said


@pytest.mark.parametrize(
    ("drift_rad", "words"), [(0.0, "below 0.05 degrees"), (0.0020, "0.1 degrees")]
)
def test_a_drift_is_never_told_as_zero_degrees(drift_rad: float, words: str) -> None:
    track = track_of([OWN] * 3, lambda _: {"evidence": {"drift_rad": drift_rad}})
    result = TrackResult("cup", track, plain_body(OWN, count=2))
    text = " ".join(TrackFigures(result, history_of(3)).words())
    if words.startswith("below"):
        assert f"drift stayed {words} (one standard deviation)" in text
    else:
        assert f"drift was {words} at most, and {words} at the end" in text


def test_a_state_tells_a_place_that_is_confirmed_from_one_that_is_not() -> None:
    [one] = track_of([OWN], lambda _: {"status": "searching"})
    assert one.state == one.words == "searching"
    known = Tracked(0, SimpleNamespace(status="searching", located=True), 0.0)  # type: ignore[arg-type]
    assert (known.state, known.words) == ("located", "searching, located")
