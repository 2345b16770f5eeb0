"""The fitness map of the paper's Fig. 8: its pairs, its ridges, and what is reported of it."""

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes_studies import (
    BEFORE_HAND,
    SMALL,
    eye_pair,
    highest_off,
    matches,
    poses_around,
    tracker_of,
)

from servoid._native import PaperSettings, Tracker, paper_scores
from servoid.batch import Done
from servoid.errors import PoseError, TrackError
from servoid.servo.settings_text import settings_toml
from servoid.sim.world import ArmSettings, CameraSettings, ObjectSettings, World, WorldSettings
from servoid_experiments.design import Verdict
from servoid_experiments.paper.eye_pair import EyePair, Moment, paper_hand, see, true_body
from servoid_experiments.paper.maps.case import Fitness, MapRow
from servoid_experiments.paper.maps.fitness_map import FITNESS_MAP
from servoid_experiments.paper.maps.places import peak_of, width_at_share
from servoid_experiments.paper.maps.report import (
    QUICK_MAP,
    MapSettings,
    map_section,
    map_variants,
    map_work,
)
from servoid_experiments.stage import EyeMode

PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def pair() -> EyePair:
    """Return a stereo pair of the patterned egg."""
    return eye_pair(3)


@pytest.fixture(scope="module")
def done() -> list[Done]:
    """Return all trials of the quick maps."""
    work = map_work(QUICK_MAP)
    return [Done(case, work.experiment.run(case)) for case in work.cases]


@pytest.mark.parametrize("mode", EyeMode)
def test_a_pair_is_what_the_eyes_of_the_worlds_arm_see(mode: EyeMode) -> None:
    hand = (*paper_hand().quaternion, *paper_hand().translation)
    world = World(
        WorldSettings(
            ideal=True,
            arm=ArmSettings(world_from_hand=hand, eyes_on_object=mode is EyeMode.VERGED),
            object=ObjectSettings(
                name="ellipsoid", hand_from_object=(1.0, 0.0, 0.0, 0.0, 0.0, -0.1, 0.53)
            ),
            cameras=CameraSettings(size_px=(320, 240), samples=1, moments=1, noise=0.0),
            background="plain",
        )
    )
    rest = np.zeros(len(world.arm.joints.names))
    while (instant := world.source.newest()) is None:
        world.arm.command(rest)
    quiet = msgspec.structs.replace(SMALL, noise=0.0)
    seen = see(quiet, Moment("ellipsoid", BEFORE_HAND, paper_hand(), mode, 0))
    for eye, other in zip(seen.world_from_cameras, instant.world_from_camera, strict=True):
        assert np.abs(eye.matrix() - other.matrix()).max() < 1e-6
    for image, other in zip(seen.images, instant.images, strict=True):
        assert other is not None
        assert np.abs(image.astype(float) - other).mean() < 0.05


@pytest.mark.parametrize("name", ["ellipsoid", "painted_ellipsoid", "two_ellipsoids"])
def test_the_true_body_has_the_silhouettes_that_are_seen(name: str) -> None:
    seen = see(SMALL, Moment(name, BEFORE_HAND, paper_hand(), EyeMode.PARALLEL, 0))
    body = true_body(name, seen.world_from_object)
    for camera, pose, mask in zip(seen.cameras, seen.world_from_cameras, seen.masks, strict=True):
        drawn = body.silhouette(camera, pose) != 0
        assert (drawn != (mask != 0)).sum() < 0.01 * drawn.sum()


@given(half=st.floats(0.002, 0.04), height=st.floats(0.01, 100.0), share=st.floats(0.2, 0.95))
def test_a_tent_is_as_wide_as_the_share_that_is_left(
    half: float, height: float, share: float
) -> None:
    places = np.linspace(-0.05, 0.05, 20_001)
    tent = height * np.maximum(0.0, 1.0 - np.abs(places) / half)
    width = width_at_share(places, tent, share=share)
    assert width == pytest.approx(2.0 * half * (1.0 - share), abs=2e-5)
    # A floor lower by the height makes the same share twice as wide.
    lower = width_at_share(places, tent, floor=-height, share=0.5 + 0.5 * share)
    assert lower == pytest.approx(2.0 * half * (1.0 - share), abs=2e-5)


def test_a_ridge_that_leaves_the_range_or_is_nowhere_above_its_floor_has_no_width() -> None:
    places = np.linspace(0.0, 1.0, 11)
    assert width_at_share(places, places) is None
    assert width_at_share(places, -np.ones(11)) is None


def test_the_peak_of_a_plateau_is_its_middle() -> None:
    places = np.linspace(-1.0, 1.0, 201)
    values = np.minimum(1.0, 1.5 - np.abs(places - 0.2))
    assert peak_of(places, values) == pytest.approx(0.2, abs=0.011)


def test_poses_score_the_same_one_by_one_and_on_any_number_of_threads(pair: EyePair) -> None:
    poses, views = poses_around(pair), matches(pair)
    body = true_body("painted_ellipsoid", pair.world_from_object)
    many = paper_scores(views, body, poses, PaperSettings(points=100, threads=1))
    three = paper_scores(views, body, poses, PaperSettings(points=100, threads=3))
    alone = paper_scores(views, body, poses[7:8], PaperSettings(points=100))
    assert (many == three).all()
    assert alone[0] == many[7]
    tracker = tracker_of(pair)
    eyes, images = pair.world_from_cameras, pair.images
    score_terms = tracker.score_terms(1.0, eyes, images, poses, threads=1)
    assert score_terms.shape == (1000, 2)
    assert (score_terms == tracker.score_terms(1.0, eyes, images, poses, threads=3)).all()
    assert (score_terms[7:8] == tracker.score_terms(1.0, eyes, images, poses[7:8])).all()


def test_every_fitness_is_highest_where_the_object_is(pair: EyePair) -> None:
    assert highest_off(pair, poses_around(pair)) < 0.01


def test_a_tracker_that_knows_nothing_and_poses_that_are_none_are_refused(pair: EyePair) -> None:
    body = true_body("painted_ellipsoid", pair.world_from_object)
    fresh = Tracker(pair.cameras, body)
    eyes, images = pair.world_from_cameras, pair.images
    with pytest.raises(TrackError, match="nothing is known"):
        fresh.score_terms(1.0, eyes, images, poses_around(pair))
    with pytest.raises(TrackError, match="resolution must be 0"):
        tracker_of(pair).score_terms(1.0, eyes, images, poses_around(pair), resolution=3)
    with pytest.raises(PoseError):
        paper_scores(matches(pair), body, np.zeros((1, 7)), PaperSettings())


def test_the_same_case_gives_the_same_row(done: list[Done]) -> None:
    again = FITNESS_MAP.run(done[0].case)

    def plain(row: MapRow) -> MapRow:
        return msgspec.structs.replace(row, points_seconds=None, region_seconds=None)

    first = done[0].row
    assert isinstance(first, MapRow)
    assert plain(again) == plain(first)
    assert msgspec.json.decode(msgspec.json.encode(again), type=MapRow) == again


def test_the_maps_hold_the_whole_box_and_peak_at_the_true_place(done: list[Done]) -> None:
    case, row, ridges = done[0].case, done[0].row, done[1].row
    assert isinstance(row, MapRow)
    assert isinstance(ridges, MapRow)
    count = case.trial.count
    for one in row.fitnesses:
        if one.fitness is Fitness.COARSE:
            continue
        assert np.array(one.xy).shape == np.array(one.xz).shape == (count, count)
        assert np.array(one.xy).max() == np.array(one.yz).max() == np.array(one.xz).max()
        if one.fitness is Fitness.SURFACE:
            continue  # an object of one hue has no pattern to tell where it is
        spacing = 2.0 * case.trial.half / (count - 1)
        # On one hue the surface alone knows hardly a point, and no place of a wide grid is near it.
        if one.fitness is not Fitness.SURFACE:
            assert np.abs(one.map_peak).max() <= spacing
    assert not done[1].case.whole
    assert ridges.fitnesses[0].xy == []


@pytest.mark.extended
def test_the_section_lists_its_figures_and_draws_its_pictures(
    done: list[Done],
) -> None:
    section = map_section(QUICK_MAP, done)
    assert len(section.findings) == 3
    assert list(section.findings.values())[2] in (Verdict.BEYOND, Verdict.PARTLY)
    for picture in section.pictures:
        assert picture.png.startswith(PNG)
        assert picture.numbers is not None and len(picture.numbers.rows) > 100
    widths, answers = section.tables
    for table in (widths, answers):
        assert table.rows
        assert all(len(row) == len(table.headings) for row in table.rows)
    ridges = [one.row.fitnesses[0].ridge.crest for one in done if one.row is not None]
    assert widths.rows[0][:6] == (
        "as assumed", "ellipsoid", "verged", 2, "points", pytest.approx(1e3 * np.mean(ridges))
    )  # fmt: skip
    half = map_section(QUICK_MAP, [done[0], Done(done[1].case, None, "it broke")])
    assert half.tables[0].rows[0][3] == 1
    none = map_section(QUICK_MAP, [Done(one.case, None, "it broke") for one in done])
    assert (none.findings, none.pictures, none.tables[0].rows) == ({}, [], [])


def test_without_a_map_there_is_no_verdict_on_its_peak(done: list[Done]) -> None:
    ridges = [Done(done[0].case, None, "it broke"), done[1]]
    claims = list(map_section(QUICK_MAP, ridges).findings)
    assert len(claims) == 2
    assert not any("true position" in claim for claim in claims)


def test_a_change_that_changes_nothing_is_no_trial() -> None:
    pair = msgspec.structs.replace(QUICK_MAP.trial.pair, background="plain", noise=0.0)
    trial = msgspec.structs.replace(QUICK_MAP.trial, pair=pair)
    assert trial not in [changed for _, changed in map_variants(trial)]
    assert len(map_variants(trial)) == len(map_variants(QUICK_MAP.trial)) - 2


def test_the_settings_are_printed_with_what_they_mean() -> None:
    text = settings_toml(MapSettings())
    assert 'objects = ["ellipsoid", "painted_ellipsoid"]' in text
    assert "assumed" in text
    assert "Sec. 5.1" in text


@pytest.mark.extended
def test_changed_numbers_are_tried_beside_the_rest_and_listed(
    done: list[Done],
) -> None:
    varied = msgspec.structs.replace(QUICK_MAP, vary=True)
    work = map_work(varied)
    changed = work.cases[len(done) : len(done) + 2]
    both = [*done, *(Done(case, work.experiment.run(case)) for case in changed)]
    section = map_section(varied, both)
    found = list(dict.fromkeys(row[0] for row in section.tables[0].rows))
    assert found == ["as assumed", "α a third", "α three times"]
    plain = map_section(QUICK_MAP, done).tables[0].rows
    assert section.tables[0].rows[: len(plain)] == plain
