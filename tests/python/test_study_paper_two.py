"""The paper's object of two ellipsoids, modelled with three: its errors, and what is told of it."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from scenes_studies import TWO, paper_two, two_figures

from servoid._native import Body, Pose
from servoid.batch import Done
from servoid_experiments.paper.body_errors import centroid, nearest_parts, volume_iou
from servoid_experiments.paper.eye_pair import paper_hand, true_body
from servoid_experiments.paper.intervals import interval, mean_interval
from servoid_experiments.paper.two_case import OBJECT_NAME, Procedure, TwoRow
from servoid_experiments.paper.two_section import (
    TwoSettings,
    two_section,
    two_work,
)

PNG = b"\x89PNG"
SETTINGS = TWO


@pytest.fixture(scope="module")
def done() -> list[Done]:
    """Return one quick trial of each procedure."""
    work = two_work(SETTINGS)
    return [Done(case, work.experiment.run(case)) for case in work.cases]


def row_of(done: list[Done], procedure: Procedure) -> TwoRow:
    """Return the row of a procedure."""
    rows = [one.row for one in done if one.case.procedure is procedure]
    assert isinstance(rows[0], TwoRow)
    return rows[0]


def ball(x: float, radius: float = 0.04) -> Body:
    """Return a ball on the x axis."""
    return Body(
        world_from_object=Pose.from_parts([x, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]),
        centers=np.zeros((1, 3)),
        radii=np.full((1, 3), radius),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )


def test_volumes_in_common_are_those_of_balls() -> None:
    assert volume_iou(ball(0.0), ball(0.0)) == 1.0
    assert volume_iou(ball(0.0), ball(0.1)) == 0.0
    assert volume_iou(ball(0.0), ball(0.0, 0.032)) == pytest.approx(0.8**3, abs=0.02)
    # Two balls whose centres are a radius apart share 5/16 of each.
    assert volume_iou(ball(0.0), ball(0.04)) == pytest.approx(5.0 / 27.0, abs=0.02)


def test_parts_are_told_apart_and_the_centroid_moves_with_the_body() -> None:
    true = true_body(OBJECT_NAME, paper_hand())
    shift = np.array([0.01, -0.02, 0.03])
    moved = true_body(
        OBJECT_NAME,
        Pose.from_parts(
            (np.array(paper_hand().translation) + shift).tolist(), paper_hand().quaternion
        ),
    )
    assert nearest_parts(true, true) == [0, 1]
    assert centroid(moved) - centroid(true) == pytest.approx(shift, abs=1e-12)


def test_an_interval_holds_its_mean_and_narrows_with_more_values() -> None:
    values = np.random.default_rng(0).normal(3.0, 1.0, 400).tolist()
    few, many = interval(values[:20]), interval(values)
    assert few.low < few.mean < few.high
    assert many.high - many.low < 0.5 * (few.high - few.low)
    assert interval([0.002]).mm() == "2.0"
    assert mean_interval([]) is None
    assert interval(values) == many


@pytest.mark.extended
def test_looks_from_around_or_depth_give_the_volume_that_a_pair_leaves_open(
    done: list[Done],
) -> None:
    rows = {procedure: row_of(done, procedure) for procedure in Procedure}
    assert paper_two.beyond(two_figures(rows)) == []


@pytest.mark.extended
def test_the_errors_are_in_the_frame_of_the_hand_and_the_model_can_be_drawn_again(
    done: list[Done],
) -> None:
    row = row_of(done, Procedure.LOOKS)
    center = np.array(row.centers)
    assert np.abs(center.mean(axis=0) - SETTINGS.trial.place).max() < 0.08
    assert len(row.centers) == len(row.radii) == len(row.rotations) == 3


@pytest.mark.extended
def test_the_same_case_gives_the_same_row(done: list[Done]) -> None:
    work = two_work(SETTINGS)
    for procedure in (Procedure.PAPER, Procedure.LOOKS):
        again = work.experiment.run(work.cases[list(Procedure).index(procedure)])
        both = (again, row_of(done, procedure))
        plain = [msgspec.structs.replace(row, seconds=0.0) for row in both]
        assert plain[0] == plain[1]


@pytest.mark.extended
def test_the_section_tells_findings_and_draws_its_pictures(
    done: list[Done], tmp_path: Path
) -> None:
    section = two_section(SETTINGS, done, tmp_path)
    assert len(section.findings) == 3
    assert all(picture.file.read_bytes().startswith(PNG) for picture in section.pictures)
    assert (tmp_path / "two_ellipsoids_errors.csv").read_text().count("\n") == 1 + len(done)
    error = abs(row_of(done, Procedure.PAPER).error[2])
    assert f"{1000.0 * error:.1f}" in section.findings[1].ours
    for table in section.tables:
        assert all(len(row) == len(table.headings) for row in table.rows)
    broken = [*done[:-1], Done(done[-1].case, None, "it broke")]
    assert any("1 trials" in words for words in two_section(SETTINGS, broken, tmp_path).words)


def test_the_whole_has_thirty_seeds_of_every_procedure() -> None:
    cases = two_work(msgspec.structs.replace(TwoSettings(), vary_seeds=0)).cases
    assert len(cases) == 30 * len(Procedure)
    assert len(set(map(two_work(TwoSettings()).experiment.key, cases))) == len(cases)


@pytest.mark.extended
def test_changed_numbers_are_tried_beside_the_rest_and_listed(
    done: list[Done], tmp_path: Path
) -> None:
    varied = msgspec.structs.replace(SETTINGS, vary_seeds=1)
    work = two_work(varied)
    changed = [Done(case, work.experiment.run(case)) for case in work.cases[len(done) :]]
    section = two_section(varied, [*done, *changed], tmp_path)
    assert [row[:2] for row in section.tables[-1].rows] == [
        ("as above", "1"),
        ("α a third", "1"),
        ("α three times", "1"),
        ("a third of the generations", "1"),
    ]
    assert section.tables[0].rows == two_section(SETTINGS, done, tmp_path).tables[0].rows
