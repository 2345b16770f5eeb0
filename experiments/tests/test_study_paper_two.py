"""The paper's object of two ellipsoids, modelled with three: errors and report."""

import msgspec
import numpy as np
import pytest
from scenes_studies import TWO, paper_two, two_figures

from servoid._native import Body, Pose
from servoid.batch import Done
from servoid_experiments.metrics import centroid, nearest_parts, volume_iou
from servoid_experiments.paper.eye_pair import paper_hand, true_body
from servoid_experiments.paper.two.modelling import OBJECT_NAME, Procedure, TwoRow
from servoid_experiments.paper.two.report import (
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
def test_the_section_lists_its_figures_and_draws_its_pictures(
    done: list[Done],
) -> None:
    section = two_section(SETTINGS, done)
    assert len(section.findings) == 3
    assert all(picture.png.startswith(PNG) for picture in section.pictures)
    [numbers] = [one.numbers for one in section.pictures if one.numbers is not None]
    assert (numbers.name, len(numbers.rows)) == ("two_ellipsoids_errors", len(done))
    [table] = section.tables
    assert all(len(row) == len(table.headings) for row in table.rows)
    first = dict(zip(table.headings, table.rows[0], strict=True))
    error = abs(row_of(done, Procedure.PAPER).error[2])
    assert (first["procedure"], first["error_z_mm"]) == ("paper", pytest.approx(1e3 * error))
    broken = [*done[:-1], Done(done[-1].case, None, "it broke")]
    assert len(two_section(SETTINGS, broken).tables[0].rows) == len(table.rows) - 1


def test_the_whole_has_thirty_seeds_of_every_procedure() -> None:
    cases = two_work(msgspec.structs.replace(TwoSettings(), vary_seeds=0)).cases
    assert len(cases) == 30 * len(Procedure)
    assert len(set(map(two_work(TwoSettings()).experiment.key, cases))) == len(cases)


@pytest.mark.extended
def test_changed_numbers_are_tried_beside_the_rest_and_listed(
    done: list[Done],
) -> None:
    varied = msgspec.structs.replace(SETTINGS, vary_seeds=1)
    work = two_work(varied)
    changed = [Done(case, work.experiment.run(case)) for case in work.cases[len(done) :]]
    section = two_section(varied, [*done, *changed])
    rows = section.tables[0].rows
    assert [row[1] for row in rows[len(done) :]] == [
        "α a third",
        "α three times",
        "a third of the generations",
    ]
    assert rows[: len(done)] == two_section(SETTINGS, done).tables[0].rows
