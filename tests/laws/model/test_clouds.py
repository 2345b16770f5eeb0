"""A cloud bounds its body, and what contradicts a cloud is reported."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from servoid.errors import MeshError
from servoid.model import (
    ModelResult,
    RangeSamples,
    Request,
    fit_range_samples,
    range_samples_of_cloud,
)
from servoid.model.cloud_outline import outline_view, outlook, viewpoint_of
from servoid.pose import Pose
from servoid.shape import body_sides

LONG, WIDE, DEEP = 0.16, 0.08, 0.05
EYE = np.array([0.02, -0.03, 0.8])
FEW = Request(max_ellipsoids=4, delta=0.0)


def bar(count: int = 3000, noise: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sample the surface of a bar along x, of elliptic section: points and outward normals."""
    random = np.random.default_rng(0)
    angle = random.uniform(0.0, 2.0 * np.pi, count)
    ring = np.stack([np.zeros(count), 0.5 * WIDE * np.cos(angle), 0.5 * DEEP * np.sin(angle)], 1)
    normals = ring / [1.0, WIDE**2, DEEP**2]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = ring + random.uniform(-0.5, 0.5, (count, 1)) * [LONG, 0.0, 0.0]
    ends = np.flatnonzero(random.random(count) < 0.18)
    way = np.where(ends % 2, 1.0, -1.0)[:, None]
    points[ends] = ring[ends] * np.sqrt(random.random((len(ends), 1))) + 0.5 * way * [LONG, 0, 0]
    normals[ends] = way * [1.0, 0.0, 0.0]
    return points + noise * random.normal(size=(count, 3)), normals


def stone(noise: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sample the surface of an ellipsoid of the bar's size: points and outward normals."""
    random = np.random.default_rng(0)
    units = random.normal(size=(3000, 3))
    units /= np.linalg.norm(units, axis=1, keepdims=True)
    radii = 0.5 * np.array([LONG, WIDE, DEEP])
    normals = units / radii / np.linalg.norm(units / radii, axis=1, keepdims=True)
    return units * radii + noise * random.normal(size=(3000, 3)), normals


def spans(result: ModelResult) -> NDArray[np.float64]:
    """Return the extents of a body along the axes of the cloud, (3,)."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    body, turn = result.body, result.body.world_from_object.matrix()[:3, :3]
    for center, radii, rotation in zip(body.centers, body.radii, body.rotations, strict=True):
        axes = turn @ Pose.from_parts((0.0, 0.0, 0.0), rotation).matrix()[:3, :3] * radii
        reach = np.linalg.norm(axes, axis=1)
        low, high = np.minimum(low, turn @ center - reach), np.maximum(high, turn @ center + reach)
    return high - low


def one_side(noise: float = 0.0) -> NDArray[np.float64]:
    """Return the points of the bar that are visible from the viewpoint."""
    points, normals = bar(noise=noise)
    return points[((EYE - points) * normals).sum(axis=1) > 0.0]


def fit(
    points: NDArray[np.float64], *, normals: NDArray[np.float64] | None = None, eye: object = None
) -> ModelResult:
    viewpoint = None if eye is None else np.asarray(eye, np.float64)
    return fit_range_samples(range_samples_of_cloud(points, normals, viewpoint), FEW)


@pytest.fixture(scope="module")
def whole() -> ModelResult:
    points, normals = stone()
    return fit(points, normals=normals)


@pytest.fixture(scope="module")
def half() -> ModelResult:
    return fit(one_side(), eye=EYE)


def test_a_right_cloud_makes_a_good_body_without_a_word_against_it(
    whole: ModelResult, half: ModelResult
) -> None:
    noisy, normals = stone(noise=0.002)
    for result in (whole, half, fit(noisy, normals=normals), fit(one_side(0.002), eye=EYE)):
        assert result.verdict.word == "good", result.verdict.words
        assert result.all_doubts == () and result.notes == ()


@pytest.mark.parametrize("has_normals", [True, False])
def test_points_without_a_place_are_left_out_of_a_cloud(has_normals: bool) -> None:
    points, normals = stone()
    holed, facing = points.copy(), normals.copy()
    holed[::7], facing[1::7] = np.nan, np.nan
    kept = np.isfinite(holed).all(axis=1)
    if has_normals:
        kept &= np.isfinite(facing).all(axis=1)
    eye = None if has_normals else np.asarray(EYE)
    whole = range_samples_of_cloud(points[kept], normals[kept] if has_normals else None, eye)
    some = range_samples_of_cloud(holed, facing if has_normals else None, eye)
    assert np.array_equal(some.points, whole.points)
    assert np.array_equal(some.directions, whole.directions)
    with pytest.raises(MeshError, match="none of the 5 points is finite"):
        range_samples_of_cloud(np.full((5, 3), np.nan), np.ones((5, 3)), eye)


@pytest.mark.parametrize(
    ("normals", "eye", "words"),
    [
        (np.full((5, 3), np.nan), None, "no point has a normal"),
        (np.zeros((5, 3)), None, "no point has a normal"),
        (None, (0.0, np.nan, 1.0), "the view point is not finite"),
    ],
)
def test_clouds_without_a_side_are_refused(
    normals: NDArray[np.float64] | None, eye: object, words: str
) -> None:
    with pytest.raises(MeshError, match=words):
        fit(np.ones((5, 3)), normals=normals, eye=eye)


def test_a_cloud_that_was_seen_from_one_side_ends_at_its_outline(half: ModelResult) -> None:
    samples = range_samples_of_cloud(one_side(), None, EYE)
    free = fit_range_samples(samples, Request(max_ellipsoids=4, delta=0.0, silhouette_weight=0.0))
    assert spans(half)[:2] == pytest.approx([LONG, WIDE], rel=0.1)
    assert (spans(free)[:2] > [1.15 * LONG, 1.15 * WIDE]).any()


def test_an_outline_is_that_of_the_object_whatever_the_density_and_the_order() -> None:
    everything, _ = bar(30000)
    for points in (one_side(), one_side()[::10], np.random.default_rng(1).permutation(one_side())):
        samples = range_samples_of_cloud(points, None, EYE)
        eye = viewpoint_of(samples)
        seen = None if eye is None else outlook(samples, eye)
        assert seen is not None
        view = outline_view(seen)
        pixels = view.camera.project(view.world_from_camera.inverse().transform(everything))
        rows, columns = np.nonzero(view.mask)
        spacing_px = seen.spacing * view.camera.focal_px[0]
        for cells, axis in ((columns, 0), (rows, 1)):
            ends = pixels[:, axis].min(), pixels[:, axis].max()
            assert (cells.min(), cells.max()) == pytest.approx(ends, abs=spacing_px + 1.0)


def test_holes_in_a_cloud_are_no_holes_in_its_outline() -> None:
    points = one_side()
    torn = points[np.hypot(points[:, 0] - 0.02, points[:, 1]) > 0.02]
    assert len(torn) < len(points)
    seen = outlook(range_samples_of_cloud(torn, None, EYE), EYE)
    assert seen is not None
    labels, _ = cv2.connectedComponents((outline_view(seen).mask == 0).astype(np.uint8))
    assert labels == 2, "there is one background, and no hole in the object"
    result = fit(torn, eye=EYE)
    assert result.verdict.word == "good"
    assert spans(result)[:2] == pytest.approx([LONG, WIDE], rel=0.1)


def test_a_far_viewpoint_has_an_outline_as_well() -> None:
    points, normals = bar()
    eye = 1000.0 * EYE
    visible = points[((eye - points) * normals).sum(axis=1) > 0.0]
    result = fit(visible, eye=eye)
    assert result.outline is not None
    assert spans(result)[:2] == pytest.approx([LONG, WIDE], rel=0.12)


def test_samples_of_several_viewpoints_or_of_normals_have_no_outline(whole: ModelResult) -> None:
    assert whole.outline is None
    points = one_side()
    directions = points - EYE
    directions[::2] = points[::2] - [0.0, 0.0, 1.0]
    assert viewpoint_of(RangeSamples(points, directions)) is None


def test_normals_that_point_into_a_closed_cloud_are_reversed_with_a_note(
    whole: ModelResult,
) -> None:
    points, normals = stone()
    result = fit(points, normals=-normals)
    assert result.body == whole.body
    (note,) = result.notes
    assert note.startswith("the normals of the 3000 points point into the object, and were rev")
    assert result.doubts == ()


def test_normals_that_point_into_a_cloud_from_one_side_are_a_doubt() -> None:
    points, normals = bar()
    visible = ((EYE - points) * normals).sum(axis=1) > 0.0
    result = fit(points[visible], normals=-normals[visible])
    assert "the normals seem to point into the object" in result.doubts[0]
    assert result.verdict.word != "good"
    assert not any(
        "seem" in doubt for doubt in fit(points[visible], normals=normals[visible]).doubts
    )


def test_normals_of_mixed_signs_are_a_doubt() -> None:
    points, normals = bar()
    mixed = (
        normals * np.where(np.random.default_rng(2).random(len(points)) < 0.4, -1.0, 1.0)[:, None]
    )
    result = fit(points, normals=mixed)
    assert "the normals contradict each other: 4" in result.doubts[0]
    assert "--viewpoint X,Y,Z" in result.doubts[0]
    assert result.verdict.word != "good"


def test_a_viewpoint_on_the_other_side_is_a_doubt() -> None:
    result = fit(one_side(), eye=-EYE)
    assert "hollow towards the viewpoint (-0.02, 0.03, -0.8)" in result.doubts[0]
    assert result.verdict.word != "good"


def test_a_viewpoint_inside_the_cloud_is_refused() -> None:
    with pytest.raises(MeshError, match=r"the viewpoint \(0, 0, 0\) is inside the cloud"):
        fit(bar()[0], eye=(0.0, 0.0, 0.0))


def test_a_cloud_of_all_sides_with_one_viewpoint_is_a_doubt() -> None:
    result = fit(bar()[0], eye=EYE)
    assert any("lie behind others" in doubt and "normals" in doubt for doubt in result.doubts)


def test_a_body_that_extends_far_beyond_its_cloud_is_a_doubt() -> None:
    points, normals = bar()
    patch = normals[:, 2] > 0.5
    samples = range_samples_of_cloud(points[patch] * [0.3, 1.0, 1.0], normals[patch], None)
    result = fit_range_samples(samples, Request(max_ellipsoids=1))
    sides, cloud = body_sides(result.body).max(), 0.08
    told = any("extends far beyond the cloud" in doubt for doubt in result.doubts)
    assert told == (sides > 1.5 * cloud)
    assert told and result.verdict.word != "good"


def test_points_far_from_all_others_are_left_out_with_a_note(half: ModelResult) -> None:
    stray = np.random.default_rng(3).uniform(-3.0, 3.0, (60, 3))
    result = fit(np.concatenate([one_side(), stray]), eye=EYE)
    (note,) = result.notes
    count = int(note.split()[0])
    assert 57 <= count <= 60
    assert "lie apart from the others, up to" in note and note.endswith("and were left out")
    assert body_sides(result.body) == pytest.approx(body_sides(half.body), rel=0.1)


@pytest.mark.parametrize("noise", [0.0, 0.001])
def test_a_table_below_the_object_is_a_doubt(noise: float) -> None:
    random = np.random.default_rng(4)
    flat = random.uniform(-0.3, 0.3, (3000, 3)) * [1.0, 1.0, 0.0] - [0.0, 0.0, 0.5 * DEEP]
    table = flat + noise * random.normal(size=flat.shape)
    result = fit(np.concatenate([one_side(noise), table]), eye=EYE)
    assert any("if that is a table, a floor or a wall" in doubt for doubt in result.doubts)
    assert result.verdict.word != "good"
