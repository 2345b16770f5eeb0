"""Scans of recordings, bags and pairs: what is taken of each, and how a second eye tells metres."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from rooms_to_scan import (
    FOCAL_PX,
    SIZE_PX,
    Room,
    around,
    draw,
    few_features,
    off_after_similarity,
    write_film,
    write_photos,
)

from servoid.capture import open_capture
from servoid.errors import CaptureError, ScanError
from servoid.exchange.bags.writing import raw_observations, write_mcap_recording
from servoid.opening import Filmed, GivenCalibration, open_filmed, parse_source
from servoid.pose import Pose
from servoid.scan import Film, Photographs, Recorded, Request, parse_length, scan

BASELINE_M = 0.06
CAPTURE = """version = 1
rate_hz = 25.0
[[camera]]
name = "left"
images = "left/*.jpg"
size_px = [320, 240]
focal_px = [{focal}, {focal}]
[[camera]]
name = "right"
images = "right/*.jpg"
size_px = [320, 240]
focal_px = [{focal}, {focal}]
rig_from_camera = [[1, 0, 0, {apart}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""

Image = NDArray[np.uint8]


def write_pair(folder: Path, left: list[Image], right: list[Image], focal_px: float) -> Path:
    """Write a recording of a pair."""
    folder.mkdir()
    write_photos(folder / "left", left)
    write_photos(folder / "right", right)
    head, tail = CAPTURE.format(focal=focal_px, apart=BASELINE_M).rsplit("[[camera]]", 1)
    rest = "rig_from_camera = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
    (folder / "capture.toml").write_text(f"{head}{rest}[[camera]]{tail}")
    return folder


def blank(count: int) -> list[Image]:
    return [np.full((SIZE_PX[1], SIZE_PX[0], 3), 20 * index, np.uint8) for index in range(count)]


def filmed(text: object, **given: float) -> Filmed:
    return open_filmed(parse_source(str(text)), GivenCalibration(**given))  # type: ignore[arg-type]


def levels(found: Filmed, names: list[str]) -> list[int]:
    return [int(image.mean().round()) for _, image in found.footage.images(names)]


def test_a_recording_and_a_bag_are_films_of_their_first_camera(tmp_path: Path) -> None:
    folder = write_pair(tmp_path / "run", blank(5), blank(5), FOCAL_PX)
    bag = tmp_path / "run.mcap"
    capture = open_capture(folder)
    write_mcap_recording(bag, capture.cameras, raw_observations(capture))
    for source in (folder, bag):
        found = filmed(source)
        assert isinstance(found.footage, Recorded) and found.footage.is_film
        assert list(found.footage.names) == ["0000", "0001", "0002", "0003", "0004"]
        assert levels(found, ["0001", "0003"]) == [20, 60]
        assert found.partner is not None and found.lens is not None
        assert found.partner.metres == pytest.approx(BASELINE_M)
        assert found.lens.focal_px[0] == pytest.approx(FOCAL_PX)


def test_two_films_are_a_pair_if_it_is_told_how_far_they_are_apart(tmp_path: Path) -> None:
    films = [write_film(tmp_path / f"{name}.avi", blank(4)) for name in ("l", "r")]
    text = f"{films[0]}+{films[1]}"
    alone, pair = filmed(text), filmed(text, baseline_m=BASELINE_M)
    assert alone.partner is None and "--baseline or --calibration to get metres" in alone.notes[0]
    assert pair.partner is not None and pair.partner.metres == BASELINE_M
    assert pair.lens is None and not pair.notes
    assert levels(pair, ["0002"]) == pytest.approx([40], abs=2)
    halves = filmed(f"side-by-side:{films[0]}", baseline_m=BASELINE_M)
    assert isinstance(halves.footage, Recorded) and halves.footage.size_px == (160, 240)


def test_a_film_and_photographs_are_scanned_as_they_are(tmp_path: Path) -> None:
    film = write_film(tmp_path / "film.avi", blank(4))
    photos = write_photos(tmp_path / "photos", blank(4))
    assert isinstance(filmed(film).footage, Film)
    assert isinstance(filmed(photos).footage, Photographs)
    assert isinstance(filmed(f"{photos}/*.jpg").footage, Photographs)
    lens = filmed(film, fov_deg=60.0).lens
    assert lens is not None and lens.focal_px[0] == pytest.approx(160 / np.tan(np.radians(30.0)))


def test_what_cannot_be_a_footage_is_refused_with_what_would_do(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="servoid record 0 --out run"):
        filmed("0")
    with pytest.raises(CaptureError, match=r"there is no capture in .*: no images \(\.jpg"):
        filmed(tmp_path)
    folder = write_pair(tmp_path / "run", blank(3), blank(3), FOCAL_PX)
    text = (folder / "capture.toml").read_text()
    fisheye = 'model = "kannala_brandt"\ndistortion = [0.0, 0.0, 0.0, 0.0]\nname = "left"'
    (folder / "capture.toml").write_text(text.replace('name = "left"', fisheye))
    with pytest.raises(CaptureError, match="camera 'left' has a fisheye"):
        filmed(folder)


def test_a_mark_in_an_image_that_is_not_there_is_told_before_the_scan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pycolmap", reason="scans need pycolmap")
    monkeypatch.setattr("servoid.scan.scanning.choose_keys", None)  # nothing is computed
    photos = write_photos(tmp_path / "photos", blank(4))
    marks = tuple(map(parse_length, ("p001:10,20,30,40=0.1", "nosuch:10,20,30,40=0.1")))
    with pytest.raises(
        ScanError, match=r"no image 'nosuch' in .*photos; its images are named p000 to"
    ):
        scan(photos, tmp_path / "out", Request(lengths=marks))
    assert [path.name for path in tmp_path.iterdir()] == ["photos"]


@pytest.mark.extended
@pytest.mark.parametrize("given_px", [FOCAL_PX, 1.08 * FOCAL_PX])
def test_a_second_eye_gives_metres_and_a_wrong_focal_length_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, given_px: float
) -> None:
    few_features(monkeypatch)
    walk = around(10, 60.0)
    aside = np.eye(4)
    aside[0, 3] = BASELINE_M
    left = draw(Room(), walk)
    right = draw(Room(), [pose @ aside for pose in walk])
    found = filmed(write_pair(tmp_path / "run", left, right, given_px))
    request = Request(partner=found.partner, given_lens=found.lens, threads=1)
    made = scan(found.footage, tmp_path / "out", request)
    true = np.array([Pose(pose).translation for pose in walk])
    off_m, scale = off_after_similarity(made.solution.places, true)
    assert off_m < 0.001
    assert made.scale is not None and made.scale.words.startswith("by a stereo pair")
    assert abs(scale - 1.0) < 0.005
    assert made.scale.deviation < 0.01
    wrong = [note for note in made.doubts if "images fit a focal length" in note]
    assert bool(wrong) is (given_px != FOCAL_PX)
    if wrong:
        assert "better than the given 324 px" in wrong[0]
