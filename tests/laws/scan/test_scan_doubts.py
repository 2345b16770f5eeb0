"""What a scan refuses and doubts by its figures alone, and that models of it know the doubts."""

import os
import struct
from dataclasses import replace
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest

from servoid._native import Lens, Pose
from servoid.capture import Capture, CaptureCamera, doubt_for_model
from servoid.errors import ScanError
from servoid.pose import looking
from servoid.scan import Scan, Solution
from servoid.scan.footage import open_footage
from servoid.scan.groups import check_found
from servoid.scan.staging import stage
from servoid.scan.writing import FIGURES

COUNT = 8
LENS = Lens(model="pinhole", size_px=(480, 360), focal_px=(430.0, 430.0), center_px=(239.5, 179.5))


def around(count: int = COUNT, spread: float = 0.2) -> Solution:
    """Return a scan of hundreds of points, all of which each camera around them sees."""
    points = np.random.default_rng(0).uniform(-spread, spread, (900, 3))
    turns = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    eyes = [np.array([np.cos(turn), np.sin(turn), 0.3]) for turn in turns]
    poses = tuple(looking(eye, np.zeros(3)) for eye in eyes)
    rows = np.arange(len(points))
    names = tuple(f"p{index}" for index in range(count))
    return Solution(
        names=names,
        lens=LENS,
        world_from_camera=poses,
        points=points,
        widest_rad=np.full(len(points), 1.0),
        seen=(rows,) * count,
        marks_px=tuple(LENS.project(pose.inverse().transform(points)) for pose in poses),
        error_px=np.full(count, 0.4),
        focal_std_px=0.5,
        center_is_found=True,
        missing=(),
    )


def scan_of(solution: Solution, tmp_path: Path) -> Scan:
    return Scan(
        source=tmp_path,
        path=tmp_path,
        count=len(solution.names),
        keys=len(solution.names),
        solution=solution,
        scale=None,
        times={},
    )


def written(scan: Scan, folder: Path) -> Capture:
    """Return the capture of a scan whose images say nothing, with the scan's figures beside it."""
    (folder / FIGURES).write_bytes(msgspec.json.encode(scan.numbers()))
    camera = CaptureCamera(
        name="camera",
        lens=LENS,
        rig_from_camera=Pose.identity(),
        pictures=(None,) * scan.count,
        mask_paths=(None,) * scan.count,
        depth_paths=(None,) * scan.count,
    )
    return Capture(folder / "capture.toml", (camera,), scan.solution.world_from_camera, None)


def photo(path: Path, focal_35mm: int | None) -> None:
    """Write a photograph with a focal length in its EXIF data."""
    done, data = cv2.imencode(".jpg", np.full((36, 48, 3), 120, np.uint8))
    assert done
    tag = struct.pack("<HHIHH", 0xA405, 3, 1, focal_35mm or 0, 0)
    top = struct.pack("<HHHII", 1, 0x8769, 4, 1, 26) + struct.pack("<I", 0)
    content = b"Exif\0\0II" + struct.pack("<HI", 42, 8) + top + struct.pack("<H", 1) + tag
    segment = b"\xff\xe1" + struct.pack(">H", len(content) + 2) + content
    path.write_bytes(data.tobytes()[:2] + segment + data.tobytes()[2:])


@pytest.mark.parametrize(
    ("focals_mm", "differing"),
    [((32, 42, 32), True), ((None, 32, 42), True), ((32, 32, 32), False), ((None, 32, 32), False)],
)
def test_photographs_of_several_focal_lengths_are_a_doubt_that_names_two(
    tmp_path: Path, focals_mm: tuple[int | None, ...], differing: bool
) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "staged").mkdir()
    for index, focal in enumerate(focals_mm):
        photo(tmp_path / "photos" / f"p{index}.jpg", focal)
    footage = open_footage(tmp_path / "photos")
    staged = stage(footage, footage.names, tmp_path / "staged")
    if differing:
        [doubt] = staged.doubts
        assert "from 32 mm (p" in doubt and "to 42 mm (p" in doubt and "at one zoom" in doubt
        assert staged.focal_px is None
    else:
        assert staged.doubts == ()
        assert (staged.focal_px is None) == (None in focals_mm)


def test_a_model_of_a_scan_has_the_doubts_of_its_poses(tmp_path: Path) -> None:
    right = scan_of(around(), tmp_path)
    assert right.doubts and right.pose_doubts == ()
    assert doubt_for_model(written(right, tmp_path)) is None
    zoomed = replace(right.solution, zoomed_px=(432.0, 578.0))
    wrong = replace(right, solution=zoomed, image_doubts=("the photographs differ",))
    doubt = doubt_for_model(written(wrong, tmp_path))
    assert doubt is not None and doubt.startswith("the scan that found the poses doubts them: ")
    assert "the photographs differ; the first half of the images fits a focal length" in doubt
    assert set(wrong.pose_doubts) <= set(wrong.doubts)


def seen_by(solution: Solution, seen: list[np.ndarray]) -> Solution:
    """Return a scan whose images each see only some of the points."""
    marks = [places[rows] for places, rows in zip(solution.marks_px, seen, strict=True)]
    return replace(solution, seen=tuple(seen), marks_px=tuple(marks))


def test_images_at_one_pose_that_see_different_surroundings_are_a_doubt(tmp_path: Path) -> None:
    once = around(4, spread=0.45)
    twice = replace(
        once,
        names=tuple(f"p{index}" for index in range(8)),
        world_from_camera=once.world_from_camera * 2,
        seen=once.seen * 2,
        marks_px=once.marks_px * 2,
        error_px=np.full(8, 0.4),
    )
    rng = np.random.default_rng(1)
    rows = np.arange(len(twice.points))
    missed = seen_by(twice, [rows[rng.random(len(rows)) < 0.6] for _ in range(8)])
    assert scan_of(missed, tmp_path).pose_doubts == ()
    box = np.abs(twice.points).max(axis=1) < 0.25
    front, back = (rows[box | (rows % 2 == half)] for half in (0, 1))
    mixed = scan_of(seen_by(twice, [front] * 4 + [back] * 4), tmp_path)
    [doubt] = mixed.pose_doubts
    for index in range(4):
        assert f"p{index} and p{index + 4}" in doubt
    assert "front and back of a box" in doubt


@pytest.mark.parametrize("content", [b"", b"[1]", b'{"notes": ["of an earlier version"]}'])
def test_a_file_that_is_named_like_a_scans_figures_is_no_doubt(
    tmp_path: Path, content: bytes
) -> None:
    capture = written(scan_of(around(), tmp_path), tmp_path)
    (tmp_path / FIGURES).write_bytes(content)
    assert doubt_for_model(capture) is None


def test_a_named_pipe_in_place_of_a_scans_figures_is_not_waited_for(tmp_path: Path) -> None:
    capture = written(scan_of(around(), tmp_path), tmp_path)
    (tmp_path / FIGURES).unlink()
    os.mkfifo(tmp_path / FIGURES)
    assert doubt_for_model(capture) is None


@pytest.mark.parametrize(
    ("focal_std_px", "error_px", "words"),
    [
        (float("nan"), 0.4, "do not determine the focal length"),
        (float("inf"), 0.4, "do not determine the focal length"),
        (0.5, 17.0, "the reprojection error is 17 px"),
    ],
)
def test_a_scan_whose_images_contradict_each_other_is_refused_with_repeated_patterns(
    focal_std_px: float, error_px: float, words: str
) -> None:
    right = around()
    check_found(right, COUNT)
    errors = np.full(COUNT, error_px)
    with pytest.raises(ScanError, match=rf"{words}.* a pattern that repeats, such as tiles"):
        check_found(replace(right, focal_std_px=focal_std_px, error_px=errors), COUNT)


def test_two_images_that_are_connected_are_too_few() -> None:
    check_found(around(3), 3)
    with pytest.raises(ScanError, match=r"only 2 of 3 .* \(p0, p1\), and a scan needs at least 3"):
        check_found(around(2), 3)
