"""Scans of drawn rooms: poses, focal length and scale come back, and what cannot be is refused."""

import html
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawn import Drawn
from rooms_to_scan import (
    BOARD,
    FOCAL_PX,
    LENS,
    Room,
    around,
    draw,
    few_features,
    off_after_similarity,
    standing,
    turning,
    write_film,
    write_photos,
)

from servoid.camera import Lens
from servoid.capture import open_capture
from servoid.errors import OutputError, ScanError
from servoid.output import check_replaceable
from servoid.pose import Pose
from servoid.scan import Request, Scan, parse_baseline, parse_board, parse_length, scan
from servoid.scan.writing import FOLDER
from servoid.view.scan import scan_page

WALK = around(10, 60.0)
TRUE_PLACES = np.array([pose[:3, 3] for pose in WALK])
CORNERS = ((-0.05, -0.035, 0.12), (0.05, -0.035, 0.12))  # of the box, on its upper front edge
EDGE_M = 0.1


def marked(index: int) -> str:
    """Return the true pixels of the box's upper front edge in a photograph, as --length has it."""
    pixels = LENS.project(Pose(WALK[index]).inverse().transform(np.array(CORNERS)))
    numbers = ",".join(f"{number:.2f}" for number in pixels.ravel())
    return f"p{index:03}:{numbers}={EDGE_M}"


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory, drawn: Drawn) -> Path:
    """Draw photographs of a room."""
    folder = tmp_path_factory.mktemp("photos") / "room"
    return drawn(folder, "room", "walk", lambda new: write_photos(new, draw(Room(), WALK)))


@pytest.fixture(scope="module")
def scanned(photos: Path, tmp_path_factory: pytest.TempPathFactory) -> Scan:
    """Scan them, with a known length."""
    out = tmp_path_factory.mktemp("scans") / "room"
    lengths = tuple(parse_length(marked(index)) for index in (1, 5, 9))
    return scan(photos, out, Request(lengths=lengths, threads=1))


def test_a_scan_finds_every_place_and_the_focal_length(scanned: Scan) -> None:
    solution = scanned.solution
    assert len(solution.names) == len(WALK)
    off_m, _ = off_after_similarity(solution.places, TRUE_PLACES)
    assert off_m < 0.001
    assert abs(solution.focal_px / FOCAL_PX - 1.0) < 0.015
    assert 0.0 < solution.focal_std_px < 0.01 * FOCAL_PX
    assert solution.rms_px < 0.6


def test_a_known_length_gives_metres(scanned: Scan) -> None:
    assert scanned.scale is not None
    _, scale = off_after_similarity(scanned.solution.places, TRUE_PLACES)
    assert abs(scale - 1.0) < 0.02
    assert scanned.scale.deviation < 0.02


def test_a_scan_is_a_capture_whose_views_see_what_they_saw(scanned: Scan, photos: Path) -> None:
    capture = open_capture(scanned.path)
    assert capture.metric
    views = capture.all_views()
    assert [view.name for view in views] == [f"camera/p{index:03}" for index in range(len(WALK))]
    assert np.allclose(views[0].world_from_lens.matrix(), np.eye(4))
    assert views[3].picture.path.read_bytes() == (photos / "p003.jpg").read_bytes()
    true = [Pose(WALK[0]).inverse() @ Pose(pose) for pose in WALK]
    for view, pose in zip(views, true, strict=True):
        apart = (view.world_from_lens.inverse() @ pose).log()
        assert np.linalg.norm(apart[:3]) < 0.012 and np.linalg.norm(apart[3:]) < 0.01


def test_the_figures_of_a_scan_are_those_of_its_solution(scanned: Scan) -> None:
    figures = json.loads((scanned.path / "scan.json").read_text())
    assert figures["images"] == {"all": 10, "used": 10, "found": 10}
    assert figures["focal_px"] == pytest.approx(scanned.solution.focal_px)
    assert [one["name"] for one in figures["by_image"]] == list(scanned.solution.names)
    assert any("one side" in note for note in figures["notes"])


def test_a_bar_of_a_plan_is_as_long_as_it_says(scanned: Scan) -> None:
    page = scan_page(scanned, scanned.path / "images").decode()
    ends = r'class="scale"><line x1="([\d.]+)".*?x2="([\d.]+)".*?>([\d.]+) m<'
    above, side = (
        np.array(re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', plan), dtype=np.float64)
        * (float(length) / (float(right) - float(left)))
        for plan in page.split("<svg")[1:]
        for left, right, length in re.findall(ends, plan)
    )
    moved_right = above[-1, 0] - above[0, 0]
    moved = np.array([moved_right, *(side[-1] - side[0])])  # and ahead and down
    places = scanned.solution.places
    assert np.linalg.norm(moved) == pytest.approx(np.linalg.norm(places[-1] - places[0]), rel=0.02)


def test_the_page_of_a_scan_names_each_doubt_once_and_a_missing_scale_once(scanned: Scan) -> None:
    unscaled = replace(scanned, scale=None)
    page = html.unescape(scan_page(unscaled, scanned.path / "images").decode())
    verdict = re.findall(r'class="verdict">(.*?)</p>', page)
    assert verdict[0].endswith("images were registered.")
    assert any(one.startswith("In doubt: the scene was seen from one side") for one in verdict)
    assert verdict[-1].startswith("The scale is unknown, so lengths are not in metres")
    assert page.count("seen from one side") == page.count("cale is unknown") == 1


@pytest.mark.extended
def test_the_same_photographs_give_the_same_bits_on_any_number_of_threads(tmp_path: Path) -> None:
    folder = write_photos(tmp_path / "photos", draw(Room(), WALK[:6]))
    lengths = tuple(parse_length(marked(index)) for index in (1, 3, 5))
    one, four = (
        scan(folder, tmp_path / f"{threads}", Request(lengths=lengths, threads=threads)).path
        for threads in (1, 4)
    )
    for name in ("capture.toml", "poses.csv"):
        assert (one / name).read_bytes() == (four / name).read_bytes()


@pytest.mark.extended
def test_a_printed_board_gives_metres(tmp_path: Path) -> None:
    folder = write_photos(tmp_path / "photos", draw(Room(board=True), WALK))
    columns, rows, square, marker = BOARD
    board = parse_board(f"{columns}x{rows},{square},{marker}")
    made = scan(folder, tmp_path / "out", Request(board=board))
    assert made.scale is not None and made.scale.words.startswith("by ")
    _, scale = off_after_similarity(made.solution.places, TRUE_PLACES)
    assert abs(scale - 1.0) < 0.005


@pytest.mark.extended
def test_a_film_is_scanned_by_its_key_images(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    few_features(monkeypatch)  # 0.09 mm off, and 0.07 mm with the usual number
    way = around(30, 25.0)
    film = write_film(tmp_path / "film.avi", draw(Room(), way))
    first, last = way[0][:3, 3], way[-1][:3, 3]
    baseline = parse_baseline(f"0000,0029={np.linalg.norm(last - first):.5f}")
    made = scan(film, tmp_path / "out", Request(baselines=(baseline,)))
    names = made.solution.names
    assert made.keys < made.count and {"0000", "0029"} <= set(names)
    true = np.array([way[int(name)][:3, 3] for name in names])
    off_m, scale = off_after_similarity(made.solution.places, true)
    assert off_m < 0.001
    assert abs(scale - 1.0) < 0.005


@pytest.mark.extended
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("turning", "the camera only rotates"),
        ("standing", "the camera does not move"),
        ("turntable", "the camera does not move, and an object moves"),
        ("blank", "the images have too few features"),
        ("two scenes", "2 scenes that have nothing in common"),
        ("two images", "has 2 images, too few"),
    ],
)
def test_what_cannot_be_scanned_is_refused_by_name(tmp_path: Path, name: str, words: str) -> None:
    folder = tmp_path / "photos"
    if name == "turning":
        write_photos(folder, draw(Room(), turning(10, 50.0)))
    elif name == "standing":
        write_photos(folder, draw(Room(), standing(6)))
    elif name == "turntable":
        near = around(1, 0.0, away=0.38) * 8
        write_photos(folder, draw(Room(), near, np.radians(np.linspace(0.0, 56.0, 8))))
    elif name == "blank":
        write_photos(folder, draw(Room(printed=False), around(6, 60.0)))
    elif name == "two scenes":
        write_photos(folder, draw(Room(), WALK[:5]))
        write_photos(folder, draw(Room(seed=5), WALK[:5]), first=50)
    else:
        write_photos(folder, draw(Room(), WALK[:2]))
    with pytest.raises(ScanError, match=words):
        scan(folder, tmp_path / "out", Request())
    assert not (tmp_path / "out").exists()


def test_a_length_that_marks_other_points_is_refused(scanned: Scan) -> None:
    from servoid.scan.metres.scale import scale_of_lengths

    swapped = marked(9)
    name, _, rest = swapped.partition(":")
    u0, v0, u1, v1 = rest.partition("=")[0].split(",")
    lengths = [parse_length(marked(1)), parse_length(f"{name}:{u1},{v1},{u0},{v0}={EDGE_M}")]
    with pytest.raises(ScanError, match="not the same two points"):
        scale_of_lengths(scanned.solution, lengths)
    with pytest.raises(ScanError, match="only in p001"):
        scale_of_lengths(scanned.solution, lengths[:1])
    with pytest.raises(ScanError, match="no image 'x'"):
        scale_of_lengths(scanned.solution, [lengths[0], parse_length(f"x:1,2,3,4={EDGE_M}")])


@pytest.mark.parametrize("text", ["a:1,2,3=0.1", "1,2,3,4=0.1", "a:1,2,3,4=-1", "a:1,2,1,2=1", ""])
def test_what_is_no_length_is_refused(text: str) -> None:
    with pytest.raises(ScanError, match="is not a length"):
        parse_length(text)


@pytest.mark.parametrize("text", ["7x5", "7by5,0.1", "1x5,0.1", "7x5,0.02,0.03", "7x5,0.1,0.05,NO"])
def test_what_is_no_board_is_refused(text: str) -> None:
    with pytest.raises(ScanError, match=r"board|dictionary"):
        parse_board(text)


@pytest.mark.parametrize("text", ["a=1", "a,a=1", "a,b=0", "a,b", "a,b=x"])
def test_what_is_no_baseline_is_refused(text: str) -> None:
    with pytest.raises(ScanError, match="is not a baseline"):
        parse_baseline(text)


def test_nothing_but_a_scan_is_replaced(tmp_path: Path, photos: Path) -> None:
    (tmp_path / "mine.txt").write_text("keep")
    with pytest.raises(OutputError, match="holds other files"):
        scan(photos, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_scan_to_which_files_were_added_is_not_replaced(
    scanned: Scan, photos: Path, tmp_path: Path
) -> None:
    copied = tmp_path / "room"
    shutil.copytree(scanned.path, copied)
    check_replaceable(copied, FOLDER)
    for name in ("images/zz_mine.jpg", "images/p001.png", "masks/p001.png", "images/own/a.txt"):
        added = copied / name
        added.parent.mkdir(exist_ok=True)
        added.write_bytes(b"mine")
        with pytest.raises(OutputError, match=r"such as (images|masks)/"):
            scan(photos, copied)
        assert added.read_bytes() == b"mine"
        added.unlink()
        if added.parent.name == "own":
            added.parent.rmdir()
    check_replaceable(copied, FOLDER)


def test_a_right_scan_has_no_doubt_of_its_images_and_lens(scanned: Scan) -> None:
    assert all(word not in note for note in scanned.doubts for word in ("error", "principal"))


def test_images_that_fit_worse_than_the_page_calls_good_are_told_and_named(scanned: Scan) -> None:
    size_px = scanned.solution.lens.size_px
    good_px = 0.001 * float(np.hypot(*size_px))
    errors = np.full(len(WALK), 0.9 * good_px)
    errors[3] = 3.0 * good_px
    wrong = replace(scanned, solution=replace(scanned.solution, error_px=errors))
    doubts = " ".join(wrong.doubts)
    assert wrong.solution.rms_px > good_px and "images that were stretched" in doubts
    assert f"of p003 ({errors[3]:.2g} px) the reprojection error is more than twice" in doubts
    fit = replace(scanned.solution, error_px=np.full(len(WALK), 0.9 * good_px))
    assert not any("error" in one for one in replace(scanned, solution=fit).doubts)


def test_a_principal_point_far_from_the_middle_is_told(scanned: Scan) -> None:
    lens = scanned.solution.lens
    (u, v), (_, height) = lens.center_px, lens.size_px
    aside = Lens(
        model=lens.model,
        size_px=lens.size_px,
        focal_px=lens.focal_px,
        center_px=(u, v - 0.18 * height),
        distortion=lens.distortion,
    )
    found = replace(scanned.solution, lens=aside, center_is_found=True)
    [doubt] = [one for one in replace(scanned, solution=found).doubts if "principal point" in one]
    assert "far from the middle" in doubt and "pixels are not square" in doubt
