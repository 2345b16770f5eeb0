import math
from typing import Any

import msgspec
import numpy as np
import pytest
from scenes_studies import SHORT, paper_fed_forward

from servoid.batch import Done
from servoid.pose import Pose
from servoid_experiments.design import Section, Verdict
from servoid_experiments.paper import AS_ASSUMED
from servoid_experiments.paper.eye_pair import true_body
from servoid_experiments.paper.sensitivity import (
    LAG,
    SENSITIVITY,
    SPREAD,
    SensitivitySettings,
    changes,
    quick_sensitivity,
    sensitivity_sections,
    sensitivity_work,
)
from servoid_experiments.paper.servoing.followed import Track, followed, response, swing, unswung
from servoid_experiments.paper.servoing.report import servoing_sections
from servoid_experiments.paper.servoing.runs import (
    FAST,
    FORWARD,
    OTHER,
    READINGS,
    SLOW,
    ServoingSettings,
    quick_servoing,
    servoing_work,
)
from servoid_experiments.paper.servoing.settings import Constants, Place, constants, with_constant
from servoid_experiments.paper.servoing.trial import (
    SERVOING,
    ServoingCase,
    ServoingRow,
    run_servoing,
    start_place,
)
from servoid_experiments.paper.servoing.unknown import UNKNOWN, UnknownRow

TIMES = np.arange(0.0, 30.0, 1.0 / 30.0)
OMEGA = 0.628


def late(lag_deg: float, gain: float) -> np.ndarray:
    return 0.2 - gain * 0.15 * np.cos(OMEGA * TIMES - math.radians(lag_deg))


@pytest.mark.parametrize(("lag_deg", "gain"), [(10.0, 0.9), (-4.0, 1.1), (170.0, 0.2)])
def test_a_late_swing_has_its_lag_and_its_gain(lag_deg: float, gain: float) -> None:
    found = response(TIMES, late(lag_deg, gain), late(0.0, 1.0), OMEGA)
    assert abs(found.lag_deg - lag_deg) < 1e-9
    assert abs(found.gain - gain) < 1e-12


def test_nothing_is_left_of_a_swing_without_its_swing() -> None:
    assert np.abs(unswung(TIMES, late(12.0, 0.7), OMEGA)).max() < 1e-12
    assert abs(swing(TIMES, np.full(len(TIMES), 3.0), OMEGA)) < 1e-12


def track(lag_deg: float, z_spread: float, seed: int = 0) -> Track:
    random = np.random.default_rng(seed)
    target = np.stack([late(0.0, 1.0) - 0.05, 0.0 * TIMES, 0.0 * TIMES], axis=1)
    wrong = random.normal(size=target.shape) * (0.001, 0.001, z_spread)
    hand = np.stack([late(lag_deg, 1.0) - 0.05, 0.0 * TIMES, 0.0 * TIMES], axis=1)
    return Track(times=TIMES, target=target, seen=target + wrong, hand=hand)


def test_figures_of_a_run_are_those_of_what_was_put_in() -> None:
    found = followed(track(10.0, 0.004), OMEGA, 5.0, 2)
    assert abs(found.hand_lag_deg - 10.0) < 1e-6
    assert abs(found.seen_lag_deg) < 0.2
    assert abs(found.seen_spread[2] - 0.004) < 0.0003
    assert abs(found.seen_spread[0] - 0.001) < 0.0001
    assert len(found.z_spread_by_period) == 2
    assert abs(found.x_by_z) < 0.15
    times = found.courses.seconds
    assert min(np.diff(times)) > 1.0 / 16.0 - 1e-9
    assert times[0] == 0.0


def test_every_constant_has_a_source() -> None:
    def leaves(settings: msgspec.Struct) -> int:
        values = [getattr(settings, name) for name in settings.__struct_fields__]
        return sum(leaves(one) if isinstance(one, msgspec.Struct) else 1 for one in values)

    listed = constants(Constants())
    assert len(listed) == leaves(Constants())
    sources = {source for *_, source in listed}
    assert {"assumed", "lab's papers", "Eq. (17)", "Eq. (20)", "Sec. 3.2"} <= sources
    assert ("scene.amplitude", "0.15") in [(name, value) for name, value, *_ in listed]


def test_a_constant_that_cannot_be_is_refused() -> None:
    with pytest.raises(msgspec.ValidationError, match="latency_s"):
        with_constant(Constants(), "eyes.latency_s", -1.0)


def test_the_printed_start_is_beside_where_the_text_wants_the_object() -> None:
    printed = with_constant(Constants(), "scene.place", Place.PRINTED)
    np.testing.assert_allclose(start_place(printed), (-0.1, 0.0, 0.545), atol=1e-12)
    assert start_place(Constants()) == (0.0, -0.09, 0.545)


def test_the_body_of_two_ellipsoids_is_as_the_world_has_it() -> None:
    assert len(true_body("two_ellipsoids", Pose.identity())) == 2
    egg = true_body("ellipsoid", Pose.identity(), (0.01, 0.02, 0.03))
    assert egg.radii.tolist() == [[0.01, 0.02, 0.03]]


@pytest.mark.extended
def test_the_same_case_gives_the_same_row_and_another_seed_another_one() -> None:
    one, two = (msgspec.json.encode(run_servoing(SHORT)) for _ in range(2))
    other = msgspec.json.encode(run_servoing(msgspec.structs.replace(SHORT, seed=4)))
    assert one == two
    assert one != other
    row = msgspec.json.decode(one, type=ServoingRow)
    assert msgspec.json.encode(row) == one
    assert b"null" not in one
    assert row.held_share == 0.0


@pytest.mark.extended
def test_with_feed_forward_the_hand_lags_less() -> None:
    assert paper_fed_forward.broken(3) == []


def test_no_two_cases_have_the_same_key() -> None:
    settings = ServoingSettings()
    work = [*servoing_work(settings), *sensitivity_work(SensitivitySettings(), Constants())]
    keys = [one.experiment.key(case) for one in work for case in one.cases]
    assert len(keys) == len(set(keys))


def test_only_what_the_paper_leaves_out_is_changed_and_each_change_changes_something() -> None:
    given = Constants()
    sources = {name: source for name, _, _, source in constants(given)}
    found = changes(SensitivitySettings(), given)
    assert {sources[one.constant] for one in found} == {"assumed", "lab's papers"}
    for one in found:
        assert one.constants != given
    assert len({one.constant for one in found}) > 20


def row_of(case: ServoingCase) -> ServoingRow:
    lag_deg, z_spread = {SLOW: (3.0, 0.002), FORWARD: (0.2, 0.001)}.get(case.name, (10.0, 0.004))
    if case.name.startswith("search.population"):
        z_spread *= 3.0
    return ServoingRow(
        followed=followed(track(lag_deg, z_spread, case.seed), OMEGA, 5.0, 2),
        seen_turn_deg=0.0,
        held_share=0.0,
        scored=60.0,
    )


def reported(settings: ServoingSettings, failing: str = "") -> list[Section]:
    known = UnknownRow(
        ellipsoids=3,
        looks=4,
        followed=followed(track(0.3, 0.001), OMEGA, 5.0, 2),
        hand_turn_deg=0.2,
        seen_turn_deg=0.1,
        held_share=0.0,
    )
    results = {}
    for work in servoing_work(settings):
        rows = [known if work.experiment is UNKNOWN else row_of(case) for case in work.cases]
        results[work.experiment.name] = [
            Done(case, row)
            if work.experiment is UNKNOWN or case.name != failing
            else Done(case, None, "no image came")
            for case, row in zip(work.cases, rows, strict=True)
        ]
    return servoing_sections(settings, results)


def cells(section: Section, name: str, run: str) -> dict[str, Any]:
    """Return the cells of a run in a table, by its headings."""
    [table] = [table for table in section.tables if table.name == name]
    [row] = [row for row in table.rows if row[0] == run]
    return dict(zip(table.headings, row, strict=True))


@pytest.mark.extended
def test_what_is_reported_follows_from_the_rows() -> None:
    paper, changes, future, listed = reported(ServoingSettings())
    # z spreads more, but not more and more.
    verdicts = [Verdict.AGREES, Verdict.AGREES, Verdict.PARTLY]
    assert list(paper.findings.values())[:3] == verdicts
    for run, lag_deg, z_mm in ((SLOW, 3.0, 2.0), (FAST, 10.0, 4.0), (FORWARD, 0.2, 1.0)):
        found = cells(listed, "servoing_figures", run)
        assert found["hand_lag_deg"] == pytest.approx(lag_deg)
        assert found["seen_spread_z_mm"] == pytest.approx(z_mm, rel=0.1)
    assert list(changes.findings.values())[1] is Verdict.BEYOND
    assert len(future.tables) == 1
    names = [row[0] for row in listed.tables[0].rows]
    assert names[2:6] == [OTHER, *(one.name for one in READINGS)]
    for section in (paper, changes, future):
        for picture in section.pictures:
            assert picture.png.startswith(b"\x89PNG")
            assert picture.numbers is not None and len(picture.numbers.rows) > 2


def wider(case: ServoingCase) -> ServoingRow:
    """Return a run whose hand swings too wide once its target's velocity is fed forward."""
    row = row_of(case)
    gain = 1.5 if case.name == FORWARD else row.followed.hand_gain
    followed_so = msgspec.structs.replace(row.followed, hand_gain=gain)
    return msgspec.structs.replace(row, followed=followed_so)


@pytest.mark.extended
def test_a_hand_that_swings_too_wide_does_not_go_beyond_the_paper() -> None:
    settings = ServoingSettings()
    results = {
        SERVOING.name: [Done(case, wider(case)) for case in servoing_work(settings)[0].cases]
    }
    _, changes, future, listed = servoing_sections(settings, results)
    assert list(changes.findings.values())[1] is Verdict.PARTLY
    assert cells(listed, "servoing_figures", FORWARD)["hand_gain"] == pytest.approx(1.5)
    # Both methods lag alike in these rows.
    assert next(iter(future.findings.values())) is Verdict.PARTLY


@pytest.mark.extended
def test_runs_that_failed_are_left_out() -> None:
    listed = reported(ServoingSettings(), failing=OTHER)[-1]
    assert OTHER not in [row[0] for row in listed.tables[0].rows]
    first = reported(ServoingSettings(), failing=FAST)[0]
    assert first.heading.startswith("The future")


def test_the_constants_that_matter_come_first() -> None:
    settings = SensitivitySettings(base_seeds=3)
    (work,) = sensitivity_work(settings, Constants())
    results = {SENSITIVITY.name: [Done(case, row_of(case)) for case in work.cases]}
    (section,) = sensitivity_sections(settings, Constants(), results)
    effects, holds = section.tables
    lag, spread = ([row for row in effects.rows if row[0] == name] for name in (LAG, SPREAD))
    assert (spread[0][1], spread[0][4]) == ("search.population", "yes")
    assert {row[4] for row in lag} == {"no"}
    count = len(changes(settings, Constants()))
    assert holds.rows == [(count, count, count)]
    assert section.pictures[0].png.startswith(b"\x89PNG")
    assert work.cases[0].name == AS_ASSUMED


@pytest.mark.extended
def test_the_quick_sensitivity_runs_and_is_reported() -> None:
    settings, given = quick_sensitivity(), quick_servoing().constants
    (work,) = sensitivity_work(settings, given)
    assert len(work.cases) == 6
    results = {SENSITIVITY.name: [Done(case, run_servoing(case)) for case in work.cases]}
    (section,) = sensitivity_sections(settings, given, results)
    assert section.tables[0].rows[0][1] == "law.position_gain"


@pytest.mark.extended
def test_the_quick_study_runs_and_is_reported() -> None:
    settings = quick_servoing()
    work = servoing_work(settings)[0]
    chosen = [case for case in work.cases if case.name in (SLOW, FAST, FORWARD)]
    results = {SERVOING.name: [Done(case, run_servoing(case)) for case in chosen]}
    assert len(servoing_sections(settings, results)) == 3
