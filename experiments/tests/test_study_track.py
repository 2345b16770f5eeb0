from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace as changed
from tiers import tiered

from servoid.batch import Done
from servoid.errors import SimError
from servoid.servo import settings_toml
from servoid.track import Method
from servoid_experiments.modelling.designs import design_of
from servoid_experiments.stage import EyeMode
from servoid_experiments.sweep import Sweep
from servoid_experiments.tracking.plan import (
    QUICK,
    CenterSettings,
    SweepSettings,
    TrackStudySettings,
    series_of,
)
from servoid_experiments.tracking.scene import (
    Scene,
    SetUp,
    eyes_of,
    is_hidden,
    last_quarter,
    rest_from_objects,
    shoot,
)
from servoid_experiments.tracking.study import (
    TRACK,
    of_tracked,
    success,
    success_at_end,
    success_behind_board,
    success_panels,
    wrongly_sure,
)
from servoid_experiments.tracking.trial import TRACKING, TrackCase, TrackRow, run_track_case

SMALL = TrackStudySettings(
    seeds=1,
    images=12,
    size_px=(160, 120),
    center=CenterSettings(ellipsoids=1),
    sweep=SweepSettings(
        way_mm=(40.0,),
        population=(8,),
        generations=(2,),
        ellipsoids=(),
        noise=(20.0,),
        light=(),
        hidden=(1.0,),
        baseline_mm=(60.0,),
        object=("two_ellipsoids",),
    ),
)
NOTHING = dict.fromkeys(SweepSettings.__struct_fields__, ())
SCENE = series_of(SMALL)[0].centers[0].scene


def own_pixels(scene: Scene, index: int) -> np.ndarray:
    """Return where the left eye would see the object if nothing stood before it."""
    set_up = SetUp(scene)
    eye_from_object = set_up.eyes[0].inverse() @ set_up.world_from_objects[index]
    return design_of(scene.object).mask(set_up.camera, eye_from_object.inverse()) > 0


@pytest.mark.parametrize("seed", range(3))
def test_the_object_goes_equally_far_in_each_image_once_it_has_got_going(seed: int) -> None:
    poses = rest_from_objects(seed, 0.002, 40)
    places = np.array([pose.translation for pose in poses])
    ways = np.linalg.norm(np.diff(places, axis=0), axis=1)
    # Where the curve is bent, the straight way between two images is shorter.
    assert ways.max() < 0.00201
    assert np.median(ways[6:]) == pytest.approx(0.002, rel=0.01)
    assert ways[0] < 0.001
    assert np.abs(places).max() < 0.05


def test_verged_eyes_meet_in_the_middle_of_the_path_and_parallel_ones_do_not() -> None:
    middle = np.array([-0.89 - 0.545, 0.0, 0.5])
    for kind in EyeMode:
        eyes = eyes_of(changed(SCENE, eyes=kind, baseline_mm=200.0))
        apart = np.subtract(eyes[0].translation, eyes[1].translation)
        assert np.linalg.norm(apart) == pytest.approx(0.2)
        for eye in eyes:
            aside = eye.inverse().transform(middle[None])[0][:2]
            expected = 0.0 if kind is EyeMode.VERGED else 0.1
            assert np.linalg.norm(aside) == pytest.approx(expected, abs=1e-9)


def test_the_masks_are_where_the_object_truly_is() -> None:
    mask = SetUp(SCENE).masks(0)[0] > 0
    own = own_pixels(SCENE, 0)
    assert np.count_nonzero(mask != own) <= 0.02 * np.count_nonzero(own)


@pytest.mark.parametrize("share", tiered([0.6, 0.3, 1.0]))
def test_the_board_hides_the_share_that_was_asked_for(share: float) -> None:
    scene = changed(SCENE, hidden=share, size_px=(320, 240))
    index = scene.images // 2
    seen, whole = (SetUp(one).masks(index) for one in (scene, changed(scene, hidden=0.0)))
    hidden = [
        1.0 - np.count_nonzero(one) / np.count_nonzero(every)
        for one, every in zip(seen, whole, strict=True)
    ]
    # One eye sees a little more of it, the other a little less than one between them.
    assert np.mean(hidden) == pytest.approx(share, abs=0.05)
    assert np.ptp(hidden) < 0.3


def test_the_board_stands_there_in_the_third_quarter_alone() -> None:
    scene = changed(SCENE, hidden=0.5, images=40)
    assert [is_hidden(scene, index) for index in (19, 20, 29, 30)] == [False, True, True, False]
    assert last_quarter(40) == 30
    assert not is_hidden(SCENE, 6)


def test_the_light_changes_halfway() -> None:
    _, images = shoot(changed(SCENE, light=0.4))
    level = [float(pair[0].mean()) for pair in images]
    assert max(level[6:]) < 0.8 * min(level[:6])


def test_the_same_case_gives_the_same_row() -> None:
    case = series_of(SMALL)[0].centers[0]
    first = run_track_case(case)
    shoot.cache_clear()
    assert run_track_case(case) == first
    assert len(first.status) == len(first.add_share) == SMALL.images - 1


def test_the_papers_tracker_is_told_the_orientation() -> None:
    row = run_track_case(series_of(SMALL)[1].centers[0])
    assert max(row.turn_deg) < 1e-4
    assert max(row.position_mm) > 0.1


def test_an_unknown_object_fails_with_what_there_is() -> None:
    case = series_of(SMALL)[0].centers[0]
    with pytest.raises(SimError, match="bottle"):
        run_track_case(changed(case, scene=changed(case.scene, object="teapot")))


def row_of(status: Sequence[str], add: Sequence[float]) -> TrackRow:
    return TrackRow(
        position_mm=[100.0 * share for share in add],
        turn_deg=[0.0] * len(add),
        add_share=list(add),
        status=list(status),
        evaluations=1.0,
    )


def test_only_what_is_said_to_be_tracked_and_near_is_a_success() -> None:
    row = row_of(["tracking", "tracking", "lost", "searching"], [0.05, 0.3, 0.01, 0.5])
    assert success(row, 0.1) == 0.25
    assert wrongly_sure(row, 0.1) == 0.25
    assert of_tracked(lambda one: one.position_mm, 50.0)(row) == pytest.approx(17.5)


def test_what_was_never_tracked_has_no_error() -> None:
    row = row_of(["lost", "lost"], [0.0, 0.0])
    assert of_tracked(lambda one: one.position_mm, 50.0)(row) is None


def test_quarters_are_told_apart_image_by_image() -> None:
    scene = changed(SCENE, images=16, hidden=1.0)
    seen = [not is_hidden(scene, index) for index in range(1, 16)]
    row = row_of(["tracking" if one else "lost" for one in seen], [0.0] * 15)
    assert success_behind_board(row, 0.1) == 0.0
    assert success_at_end(row, 0.1) == 1.0


def test_no_case_is_planned_twice_and_shared_scenes_follow_each_other() -> None:
    cases = TRACK.plan(TrackStudySettings())[0].cases
    assert len(cases) == len(set(cases))
    scenes = [case.scene for case in cases]
    changes = sum(one != other for one, other in pairwise(scenes))
    assert changes == len(set(scenes)) - 1


def test_generations_are_not_varied_for_the_papers_tracker() -> None:
    cases: Sequence[TrackCase] = TRACK.plan(QUICK)[0].cases
    assert {case.generations for case in cases if case.method is Method.PAPER} == {1}


def test_a_factor_without_values_is_not_varied() -> None:
    titles = [factor.title for factor in series_of(SMALL)[0].factors]
    assert "ellipsoids" not in titles
    assert "object" in titles


def test_the_settings_read_back_as_they_are_printed() -> None:
    text = settings_toml(TrackStudySettings())
    assert msgspec.toml.decode(text, type=TrackStudySettings) == TrackStudySettings()


@pytest.fixture(scope="module")
def done() -> list[Done]:
    cases = TRACK.plan(SMALL)[0].cases
    return [Done(case, TRACKING.run(case)) for case in cases]


@pytest.mark.extended
def test_what_is_reported_is_what_the_rows_say(done: list[Done]) -> None:
    sections = TRACK.report(SMALL, {TRACKING.name: done})
    pictures = [picture for section in sections for picture in section.pictures]
    assert [picture.name for picture in pictures] == ["success", "error", "large_errors"]
    assert all(picture.png.startswith(b"\x89PNG") for picture in pictures)
    [successes, *_] = [picture.numbers for picture in pictures]
    assert successes is not None
    center = series_of(SMALL)[0].centers[0]
    row = next(one.row for one in done if one.case == center)
    share = success(row, SMALL.near)
    line = f"population,,24,servoid,,{share:.6g},{share:.6g},{share:.6g}"
    assert line in successes.csv().decode().splitlines()
    [table] = [table for section in sections for table in section.tables]
    assert all(len(cells) == len(table.headings) for cells in table.rows)
    assert {cells[0] for cells in table.rows} >= {"way between images", "object"}
    [cells] = [cells for cells in table.rows if cells[:4] == ("population", "", "24", "servoid")]
    assert dict(zip(table.headings, cells, strict=True))["tracked"] == share


@pytest.mark.extended
def test_failed_trials_are_left_out(done: list[Done]) -> None:
    lost = [replace(one, row=None, failure="the camera broke") for one in done]
    assert TRACK.report(SMALL, {TRACKING.name: lost})[0].heading == "No trial succeeded"
    sections = TRACK.report(SMALL, {TRACKING.name: [done[0], *lost[1:]]})
    [table] = [table for section in sections for table in section.tables]
    known = [cells for cells in table.rows if cells[-1] is not None]
    assert 0 < len(known) < len(table.rows)


def test_a_panel_of_success_shows_both_trackers_at_each_value() -> None:
    settings = changed(SMALL, sweep=SweepSettings(**{**NOTHING, "way_mm": (5.0, 40.0, 90.0)}))
    series = series_of(settings)
    worth = {5.0: True, 12.0: True, 40.0: False, 90.0: True}
    done = []
    for case in TRACK.plan(settings)[0].cases:
        holds = worth[case.scene.way_mm] and case.method is Method.REGION
        status = ["tracking" if holds else "lost"] * 11
        done.append(Done(case, row_of(status, [0.0] * 11)))
    [panel] = success_panels(series, Sweep(done), settings.near)
    ours, paper = (
        {
            value: spread and spread.middle
            for value, spread in zip(one.values, one.spreads, strict=True)
        }
        for one in panel.curves[:2]
    )
    assert ours == {value: float(holds) for value, holds in worth.items()}
    assert set(paper.values()) == {0.0}
