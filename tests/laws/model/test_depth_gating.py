"""What is told from the object by its depth."""

from pathlib import Path

import numpy as np
from drawn_pairs import BASELINE, Pair

from servoid.capture import CaptureView, open_capture
from servoid.model.depth_gating import gate_by_depth
from servoid.model.range_samples import (
    NO_RANGE_SAMPLES,
    RangeSamples,
    depth_of_pair,
    range_samples_of_depth,
)


def views_of(folder: Path) -> tuple[CaptureView, CaptureView]:
    left, right = open_capture(folder).all_views()
    return left, right


def asked(
    pair: Pair, folder: Path, samples: RangeSamples | None, *, twin: bool = True
) -> np.ndarray:
    left, right = views_of(pair.write(folder))
    region = np.full(right.image().shape[:2], 255, np.uint8)
    region[:, :60] = 0
    known = samples
    if known is None:
        depth = depth_of_pair(left, right)
        known = range_samples_of_depth(depth, left.mask(), left.camera, left.world_from_camera)
    found = gate_by_depth(right, right.image(), left if twin else None, known, region)
    assert not found[region == 0].any()
    return found


def test_the_wall_is_elsewhere_and_the_object_is_not(tmp_path: Path) -> None:
    pair = Pair()
    found = asked(pair, tmp_path / "pair", None)
    mask = pair.draw(0, BASELINE)[2]
    assert not found[mask].any()
    wall = ~mask
    wall[:, :60] = False
    assert found[wall].mean() > 0.7


def test_without_texture_the_mask_of_the_other_view_still_bounds_the_object(tmp_path: Path) -> None:
    pair = Pair(patterned=False)
    center, spread = np.array(pair.centers[0]), np.array([0.05, 0.04, 0.0])
    in_left = center + spread * np.random.default_rng(0).uniform(-1.0, 1.0, (200, 3))
    pose = pair.world_from_left
    points = in_left @ pose[:3, :3].T + pose[:3, 3]
    found = asked(pair, tmp_path / "pair", RangeSamples(points, points - pose[:3, 3]))
    mask = pair.draw(0, BASELINE)[2]
    assert not found[mask].any()
    rows = np.flatnonzero(mask.any(axis=1))
    assert found[: rows[0] - 16, 60:150].all()
    assert found[rows[-1] + 17 :, 60:150].all()


def test_where_nothing_is_known_of_the_depth_nothing_is_elsewhere(tmp_path: Path) -> None:
    assert not asked(Pair(), tmp_path / "one", NO_RANGE_SAMPLES).any()
    points = Pair().seen_points()
    samples = RangeSamples(points, points - Pair().world_from_left[:3, 3])
    assert not asked(Pair(), tmp_path / "two", samples, twin=False).any()
