"""A body that has the object's shape on all sides says so in its file, and to the tracker."""

from pathlib import Path

import pytest
from fake_tracker import FakeTracker, plain_body
from tracks_through import tracks_through

from servoid.capture import open_capture
from servoid.cli.track.subjects import read_subjects
from servoid.errors import TrackError
from servoid.model import fit
from servoid.shape import MadeBy, SeenEntry, save_body
from servoid.track import Method, Request, Subject, TrackSettings


def made_by(*views: str) -> MadeBy:
    return MadeBy(servoid="0.7.0", seed=0, max_ellipsoids=6, delta=0.003, views=views)


@pytest.mark.parametrize(
    ("maker", "share", "known"),
    [
        (made_by(), None, True),  # of a mesh
        (made_by(), 0.5, False),  # of a point cloud
        (made_by("left/0", "right/0"), 0.89, False),
        (made_by("left/0", "right/0"), 0.9, True),
        (made_by("left/0", "right/0"), None, False),
        (None, None, False),
        (None, 0.95, True),
    ],
)
def test_a_file_tells_whether_its_body_has_the_shape_of_the_object_on_all_sides(
    maker: MadeBy | None, share: float | None, known: bool, tmp_path: Path
) -> None:
    seen = None if share is None else SeenEntry(share=share, by_ellipsoid=(share,))
    save_body(tmp_path / "body.json", plain_body(), made_by=maker, seen=seen)
    [subject] = read_subjects((str(tmp_path / "body.json"),), (), ())
    assert subject.known_shape is known


def test_the_core_learns_of_a_known_shape_unless_the_body_may_still_grow() -> None:
    assert not TrackSettings().known_shape
    assert TrackSettings(known_shape=True).known_shape
    known = Subject(body=plain_body(), known_shape=True)
    assert TrackSettings(**Request().options(known)).known_shape
    for request in (Request(evolve=True), Request(method=Method.PAPER)):
        assert "known_shape" not in request.options(known)
    for other in (Subject(body=plain_body()), Subject(), None):
        assert "known_shape" not in Request().options(other)


def test_a_shape_without_a_body_is_not_known() -> None:
    with pytest.raises(TrackError, match=r"'cup' is said to be known, .* give the body too"):
        Subject(name="cup", known_shape=True)


def test_a_mask_that_fits_several_orientations_is_told_and_its_outline_not_trusted(
    drawn_capture: Path, fake_core: type[FakeTracker]
) -> None:
    capture = open_capture(drawn_capture)
    body = fit(capture.views(), max_ellipsoids=1).body
    for start in (None, body.world_from_object):
        subject = Subject(body=body, start=start, known_shape=True)
        [result] = tracks_through(capture, [subject])
        told = [note for note in result.notes if "in other orientations about as well" in note]
        assert len(told) == (start is None)
    by_mask, given = (made.settings.options for made in fake_core.made)
    assert "known_shape" not in by_mask and given["known_shape"] is True
