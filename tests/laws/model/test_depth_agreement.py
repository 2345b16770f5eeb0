"""Depth images that contradict a stereo pair are refused, and those that agree are used."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from commands import Command
from drawn_pairs import DEPTH_SCALE_M, Pair
from refusals import check_refused, edit

from servoid.capture import PosedImage, capture_of, open_capture
from servoid.errors import CaptureError
from servoid.model import Request, fit_capture
from servoid.segment import parse_target

QUICK = Request(max_ellipsoids=1, delta=0.0)


def test_a_depth_image_that_agrees_with_the_pair_is_used(tmp_path: Path) -> None:
    capture = open_capture(Pair().write(tmp_path / "pair", depths=True))
    result = fit_capture(capture, QUICK)
    assert len(result.range_samples) > 1000
    assert not any("stereo" in note for note in result.notes)


@pytest.mark.parametrize("factor", [0.1, 0.75, 1.3, 2.0, 10.0])
def test_a_depth_image_in_another_unit_than_the_pair_is_refused_with_the_unit(
    factor: float, tmp_path: Path, servoid_command: Command
) -> None:
    folder = Pair().write(tmp_path / "pair", depths=True)
    scale = f"depth_scale_m = {factor * DEPTH_SCALE_M:g}"
    edit("capture.toml", f"depth_scale_m = {DEPTH_SCALE_M}", scale)(folder)
    check_refused(
        servoid_command, tmp_path,
        r"left/0000: the object is .* m away in its depth image, and 0\.\d+ m by stereo with "
        r"right/0000: .* times as far; if the pair is right, set depth_scale_m = "
        r"(0\.0001|9\.9\de-05|0\.00010\d) instead of",
        "model", folder, "--out", tmp_path / "body.json",
    )  # fmt: skip
    with pytest.raises(CaptureError, match="times as far"):
        fit_capture(open_capture(folder), QUICK)


def test_depths_in_memory_that_contradict_the_pair_are_refused_with_a_factor(
    tmp_path: Path,
) -> None:
    views = open_capture(Pair().write(tmp_path / "pair", depths=True)).all_views()
    images = [
        PosedImage(
            camera=view.camera,
            world_from_camera=view.world_from_camera,
            image=view.image(),
            mask=view.mask() if view.has_mask else None,
            depth_m=None if depth is None else np.asarray(1.5 * depth, np.float32),
        )
        for view in views
        for depth in (view.depth(),)
    ]
    with pytest.raises(CaptureError, match=r"if the pair is right, multiply the depths by 0\.66"):
        fit_capture(capture_of([images]), QUICK)


def test_depth_that_is_noise_beside_a_pair_is_refused(tmp_path: Path) -> None:
    folder = Pair().write(tmp_path / "pair", depths=True)
    values = np.random.default_rng(0).integers(6000, 60000, (210, 280)).astype(np.uint16)
    for path in (folder / "depths").iterdir():
        assert cv2.imwrite(str(path), values)
    with pytest.raises(CaptureError, match="if the pair is right, leave the depth images out"):
        fit_capture(open_capture(folder), QUICK)


def test_depth_beside_a_pair_without_texture_is_used(tmp_path: Path) -> None:
    folder = Pair(patterned=False).write(tmp_path / "pair", depths=True)
    assert len(fit_capture(open_capture(folder), QUICK).range_samples) > 1000


def test_depth_beside_a_camera_that_looks_away_is_used(tmp_path: Path) -> None:
    folder = Pair().write(tmp_path / "pair", depths=True)
    edit("capture.toml", "[[1, 0, 0, 0.07], [0, 1, 0, 0], [0, 0, 1, 0]",
         "[[-1, 0, 0, 0.07], [0, 1, 0, 0], [0, 0, -1, 0]")(folder)  # fmt: skip
    scale = f"depth_scale_m = {1.5 * DEPTH_SCALE_M:g}"
    edit("capture.toml", f"depth_scale_m = {DEPTH_SCALE_M}", scale)(folder)
    assert len(fit_capture(open_capture(folder), QUICK).range_samples) > 1000


@pytest.mark.parametrize(("shift_px", "is_doubted"), [(0, False), (24, True), (-24, True)])
def test_a_depth_image_that_is_not_registered_to_the_masks_is_doubted(
    shift_px: int, is_doubted: bool, tmp_path: Path
) -> None:
    folder = Pair().write(tmp_path / "one", depths=True, cameras=1)
    for path in (folder / "depths").iterdir():
        depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert depth is not None
        assert cv2.imwrite(str(path), np.roll(depth, shift_px, axis=1))
    made = fit_capture(open_capture(folder), Request(max_ellipsoids=2, delta=0.0, seed=0))
    told = [doubt for doubt in made.all_doubts if "its mask covers two surfaces" in doubt]
    assert bool(told) == is_doubted
    if is_doubted:
        assert "register the depth image to the colour image (align)" in told[0]
        assert made.verdict.word != "good"


def test_a_part_towards_the_camera_is_no_second_surface(tmp_path: Path) -> None:
    folder = Pair().write(tmp_path / "one", depths=True, cameras=1)
    [path] = (folder / "depths").iterdir()
    depth = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    mask = cv2.imread(str(next((folder / "masks").iterdir())), cv2.IMREAD_GRAYSCALE)
    assert depth is not None and mask is not None
    rows, columns = np.nonzero(mask)
    knob = np.zeros_like(mask)
    cv2.circle(knob, (int(columns.mean()), int(rows.mean())), 14, 255, -1)
    depth[knob != 0] -= np.uint16(0.1 / DEPTH_SCALE_M)
    assert cv2.imwrite(str(path), depth)
    made = fit_capture(open_capture(folder), Request(max_ellipsoids=2, delta=0.0, seed=0))
    assert not any("two surfaces" in doubt for doubt in made.all_doubts)


@pytest.mark.parametrize("is_noise", [False, True])
def test_a_body_that_fits_its_mask_but_not_its_depth_is_doubted(
    is_noise: bool, tmp_path: Path
) -> None:
    folder = Pair().write(tmp_path / "one", depths=True, cameras=1)
    if is_noise:
        values = np.random.default_rng(0).integers(6000, 60000, (210, 280)).astype(np.uint16)
        for path in (folder / "depths").iterdir():
            assert cv2.imwrite(str(path), values)
    made = fit_capture(open_capture(folder), Request(max_ellipsoids=2, delta=0.0, seed=0))
    told = [doubt for doubt in made.all_doubts if "the measured depth contradicts" in doubt]
    assert bool(told) == is_noise
    assert (made.verdict.word == "good") != is_noise


# The right camera does not see what is close behind the left side of the object.
@pytest.mark.parametrize("is_target", [False, True])
@pytest.mark.parametrize(
    ("shift_px", "is_doubted"), [(0, False), (24, True), (48, True), (-60, True)]
)
def test_a_mask_beside_the_object_of_a_pair_is_doubted(
    shift_px: int, is_doubted: bool, is_target: bool, tmp_path: Path
) -> None:
    folder = Pair().write(tmp_path / "pair")
    paths = sorted((folder / "masks").rglob("*.png"))
    for path in paths:
        mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        assert mask is not None
        assert cv2.imwrite(str(path), np.roll(mask, shift_px, axis=1))
    targets = [parse_target(f"mask:{paths[0]}")] if is_target else []
    request = Request(max_ellipsoids=2, delta=0.0, seed=0)
    made = fit_capture(open_capture(folder), request, targets=targets)
    told = [doubt for doubt in made.all_doubts if "its mask covers two surfaces" in doubt]
    assert bool(told) == is_doubted
    if is_doubted:
        assert "mark the object alone" in told[0]
        assert made.verdict.word != "good"
