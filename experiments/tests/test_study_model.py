from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace as changed
from tiers import tiered

from servoid._native import Body, Camera, Mesh
from servoid.batch import Done
from servoid.errors import SimError
from servoid.pose import Pose
from servoid.servo import settings_toml
from servoid.sim.samples import bird
from servoid.sim.samples.drawing.surface_nets import surface_net
from servoid_experiments.modelling.designs import DESIGNS, around, design_of, voxels_of
from servoid_experiments.modelling.study import (
    MODEL,
    CenterSettings,
    ModelStudySettings,
    SweepSettings,
    series_of,
)
from servoid_experiments.modelling.trial import (
    MODELLING,
    run_model_case,
    spoilt_mask,
    spoilt_pose,
)

SMALL = ModelStudySettings(
    objects=("two_ellipsoids", "bottle"),
    seeds=2,
    size_px=(160, 120),
    center=CenterSettings(views=4, ellipsoids=2),
    sweep=SweepSettings(
        views=(2,),
        ellipsoids=(1,),
        edge_px=(),
        flipped=(0.05,),
        holes=(),
        place_mm=(),
        turn_deg=(),
    ),
)
CASE = series_of(SMALL)[0].centers[0]
CAMERA = Camera(size_px=(160, 120), focal_px=(200.0, 200.0), center_px=(79.5, 59.5))


def body_of(centers: Sequence[Sequence[float]], radii: Sequence[Sequence[float]]) -> Body:
    return Body(
        world_from_object=Pose.identity(),
        centers=np.array(centers, float),
        radii=np.array(radii, float),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]] * len(centers)),
    )


def test_a_ball_that_is_netted_is_closed_and_as_large_as_it_is() -> None:
    def distance(points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points - 0.01, axis=1) - 0.08

    low, high = np.full(3, -0.1), np.full(3, 0.12)
    vertices, faces = surface_net(distance, low, high, 0.01)
    mesh = Mesh(vertices=np.ascontiguousarray(vertices), faces=faces)  # refuses what is open
    assert mesh.volume == pytest.approx(4.0 / 3.0 * np.pi * 0.08**3, rel=0.02)
    np.testing.assert_allclose(distance(vertices), 0.0, atol=1e-6)


@pytest.mark.extended
def test_the_bird_is_as_large_as_its_mesh() -> None:
    design = design_of("bird")
    mesh = Mesh(vertices=design.vertices, faces=design.faces)
    assert design.voxels.total == pytest.approx(mesh.volume, rel=0.01)


@pytest.mark.extended
def test_voxels_lie_where_the_signed_distance_is_negative() -> None:
    x, y, z = design_of("bird").voxels.middles.T
    points = np.stack([x, z, -y]) + np.array(bird.BOUND_CENTER)[:, None]
    # But for a few in narrow gaps, which count as full.
    assert np.mean(bird.distance(points.astype(np.float32)) < 0.001) > 0.99


def test_a_hollow_that_is_open_at_the_top_counts_as_full() -> None:
    mug, plain = design_of("mug").voxels, design_of("plain_mug").voxels
    assert mug.total == plain.total
    least = np.pi * 0.0375**2 * 0.1  # a cylinder within the wall
    assert mug.total > least


def test_parts_that_overlap_are_counted_once() -> None:
    corners = np.array([[x, y, z] for x in (0.0, 0.1) for y in (0.0, 0.1) for z in (0.0, 0.1)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    box = np.array([[a, b, c] for a, b, c, _ in sides] + [[a, c, d] for a, _, c, d in sides])
    vertices = np.concatenate([corners, corners + np.array([0.05, 0.0, 0.0])])
    faces = np.concatenate([box, box + 8]).astype(np.int64)
    assert voxels_of(vertices, faces, 60).total == pytest.approx(0.15 * 0.1 * 0.1, rel=0.03)


def test_a_body_equal_to_its_object_shares_all_of_the_volume() -> None:
    radii = [[0.0225, 0.045, 0.0225]]
    design = design_of("ellipsoid")
    assert design.volume_iou(body_of([[0.0, 0.0, 0.0]], radii)) > 0.98
    assert design.volume_iou(body_of([[0.3, 0.0, 0.0]], radii)) == 0.0


def test_a_body_twice_as_large_shares_half_of_its_volume() -> None:
    grown = 2.0 ** (1.0 / 3.0) * np.array([[0.0225, 0.045, 0.0225]])
    design = design_of("ellipsoid")
    assert design.volume_iou(body_of([[0.0, 0.0, 0.0]], grown)) == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("name", tiered(sorted(DESIGNS, key="bird".__eq__)))
def test_voxels_lie_within_every_outline(name: str) -> None:
    design = design_of(name)
    for pose in around(3, 0.4, (20.0, 45.0, 5.0), 0.5):
        mask = design.mask(CAMERA, pose)
        points = pose.inverse().transform(np.ascontiguousarray(design.voxels.middles))
        u, v = np.rint(CAMERA.project(points)).astype(int).T
        assert np.mean(mask[v, u] > 0) > 0.97


def test_cameras_look_at_the_object_from_where_they_were_asked_to() -> None:
    for pose in around(7, 0.1, (20.0, 45.0), 0.5):
        center = pose.inverse().transform(np.zeros((1, 3)))[0]
        np.testing.assert_allclose(center, [0.0, 0.0, 0.5], atol=1e-12)
        assert pose.matrix()[1, 1] > 0.0  # upright: down is down


def test_exact_masks_and_poses_stay_as_they_are() -> None:
    random = np.random.default_rng(0)
    pose = around(1, 0.0, (20.0,), 0.5)[0]
    mask = design_of("bottle").mask(CAMERA, pose)
    assert np.array_equal(spoilt_mask(mask, CASE, random), mask)
    np.testing.assert_array_equal(spoilt_pose(pose, CASE, random).matrix(), pose.matrix())


@pytest.mark.parametrize("share", [0.05, 0.3])
def test_as_many_pixels_are_wrong_as_asked(share: float) -> None:
    mask = np.zeros((120, 160), np.uint8)
    mask[40:80, 50:110] = 255
    spoilt = spoilt_mask(mask, changed(CASE, flipped=share), np.random.default_rng(1))
    assert np.mean(spoilt != mask) == pytest.approx(share, abs=0.01)
    assert set(np.unique(spoilt)) == {0, 255}


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_holes_take_so_much_of_the_object_and_nothing_else(share: float) -> None:
    mask = np.zeros((120, 160), np.uint8)
    mask[20:100, 30:130] = 255
    spoilt = spoilt_mask(mask, changed(CASE, holes=share), np.random.default_rng(1))
    assert not spoilt[mask == 0].any()
    assert 1.0 - np.count_nonzero(spoilt) / np.count_nonzero(mask) == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("off_px", [1.0, 4.0])
def test_an_outline_is_off_by_as_much_as_asked(off_px: float) -> None:
    mask = np.zeros((400, 400), np.uint8)
    mask[:, :200] = 255
    offs = []
    for seed in range(12):
        spoilt = spoilt_mask(mask, changed(CASE, edge_px=off_px), np.random.default_rng(seed))
        offs.append(np.count_nonzero(spoilt, axis=1) - 200.0)
    assert np.std(offs) == pytest.approx(off_px, rel=0.2)


def test_poses_are_off_by_as_much_as_asked() -> None:
    random = np.random.default_rng(2)
    case, pose = changed(CASE, place_mm=5.0, turn_deg=1.0), around(1, 0.3, (20.0,), 0.5)[0]
    off = [pose.inverse() @ spoilt_pose(pose, case, random) for _ in range(400)]
    places = np.array([one.translation for one in off])
    turns = np.array([one.log()[3:] for one in off])
    np.testing.assert_allclose(places.std(axis=0), 0.005, rtol=0.15)
    np.testing.assert_allclose(np.degrees(turns.std(axis=0)), 1.0, rtol=0.15)


def test_the_same_case_gives_the_same_row_but_for_its_seconds() -> None:
    rows = [changed(run_model_case(CASE), seconds=0.0) for _ in range(2)]
    assert rows[0] == rows[1]
    assert 0.5 < rows[0].volume_iou < 1.0
    assert rows[0].worst_outline_iou <= rows[0].outline_iou


def test_another_seed_sees_the_object_from_elsewhere() -> None:
    assert run_model_case(changed(CASE, seed=1)).volume_iou != run_model_case(CASE).volume_iou


def test_an_unknown_object_fails_with_what_there_is() -> None:
    with pytest.raises(SimError, match="bird, bottle"):
        run_model_case(changed(CASE, object="teapot"))


def test_the_settings_read_back_as_they_are_printed() -> None:
    text = settings_toml(ModelStudySettings())
    assert msgspec.toml.decode(text, type=ModelStudySettings) == ModelStudySettings()


@pytest.fixture(scope="module")
def done() -> list[Done]:
    return [Done(case, MODELLING.run(case)) for case in MODEL.plan(SMALL)[0].cases]


def test_no_case_is_planned_twice() -> None:
    cases = MODEL.plan(ModelStudySettings())[0].cases
    assert len(cases) == len(set(cases))


@pytest.mark.extended
def test_what_is_reported_is_what_the_rows_say(done: list[Done]) -> None:
    sections = MODEL.report(SMALL, {MODELLING.name: done})
    pictures = [picture for section in sections for picture in section.pictures]
    assert [picture.name for picture in pictures] == ["volume", "outline", "seconds"]
    assert all(picture.png.startswith(b"\x89PNG") for picture in pictures)
    [volumes, *_] = [picture.numbers for picture in pictures]
    assert volumes is not None
    rows = [one.row for one in done if one.case in series_of(SMALL)[0].centers]
    volume, outline = (
        float(np.median([getattr(row, name) for row in rows]))
        for name in ("volume_iou", "outline_iou")
    )
    [table] = [table for section in sections for table in section.tables]
    assert all(len(cells) == len(table.headings) for cells in table.rows)
    [cells] = [cells for cells in table.rows if cells[:4] == ("views", "", "4", "two_ellipsoids")]
    assert cells[4:6] == (volume, outline)
    assert f"views,,4,two_ellipsoids,,{volume:.6g}," in volumes.csv().decode()


@pytest.mark.extended
def test_failed_trials_are_left_out(done: list[Done]) -> None:
    failing = [replace(one, row=None, failure="no light") for one in done]
    failing[1:2] = done[1:2]
    sections = MODEL.report(SMALL, {MODELLING.name: failing})
    [table] = [table for section in sections for table in section.tables]
    known = [cells for cells in table.rows if cells[4] is not None]
    assert {cells[3] for cells in known} == {"two_ellipsoids"}
    lost = [replace(one, row=None, failure="no light") for one in done]
    [nothing] = MODEL.report(SMALL, {MODELLING.name: lost})
    assert nothing.heading == "No trial succeeded"
