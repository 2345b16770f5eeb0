import math
from enum import Enum
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np
import pytest

from servoid.batch import Done
from servoid_experiments import panels as drawing
from servoid_experiments.modelling.study import ModelStudySettings
from servoid_experiments.panels import Scale, draw_panels, far_apart, panels_table
from servoid_experiments.stats import over, spread_of
from servoid_experiments.sweep import Factor, Series, Sweep, varied
from servoid_experiments.tracking.plan import TrackStudySettings

NOTHING = "\n".join(
    f"{name} = []"
    for name in ("views", "ellipsoids", "edge_px", "flipped", "holes", "place_mm", "turn_deg")
)


class Kind(Enum):
    ROUND = "round"
    FLAT = "flat"


class Inner(msgspec.Struct, frozen=True):
    size: float
    kind: Kind = Kind.ROUND


class Case(msgspec.Struct, frozen=True):
    inner: Inner
    seed: int
    count: int = 3


class Row(msgspec.Struct, frozen=True):
    worth: float


SIZE = Factor("inner.size", "size", "mm", (1.0, 4.0))
COUNT = Factor("count", "count", "", (3, 9))
KIND = Factor("inner.kind", "kind", "", (Kind.FLAT,))
CENTERS = tuple(Case(Inner(2.0), seed) for seed in range(3))
SERIES = Series("ours", "#0072B2", CENTERS, (SIZE, COUNT, KIND))


def trials() -> list[Done]:
    """Return trials that are worth their size, more with a higher seed; the largest fails once."""
    cases = SERIES.cases()
    return [
        Done(case, None, "too large")
        if case.inner.size == 4.0 and case.seed == 0
        else Done(case, Row(case.inner.size + 0.1 * case.seed))
        for case in cases
    ]


def test_a_case_is_varied_in_one_field_alone_however_deep_it_lies() -> None:
    case = CENTERS[1]
    assert varied(case, "inner.size", 7.0) == Case(Inner(7.0), 1)
    assert varied(case, "count", 8) == Case(Inner(2.0), 1, 8)
    assert SIZE.at(varied(case, "inner.size", 7.0)) == 7.0


def test_no_case_is_tried_twice_and_the_centre_is_tried() -> None:
    cases = SERIES.cases()
    assert len(cases) == len(set(cases)) == 3 * (1 + 2 + 1 + 1)
    assert set(CENTERS) <= set(cases)


def test_numbers_stand_in_their_order_with_the_centre_among_them() -> None:
    assert SIZE.values_with(2.0) == (1.0, 2.0, 4.0)
    assert KIND.values_with(Kind.ROUND) == (Kind.ROUND, Kind.FLAT)


def test_a_curve_is_the_median_between_the_extremes_of_the_seeds() -> None:
    curve = Sweep(trials()).curve(SERIES, SIZE, lambda row: row.worth)
    middle = curve.spreads[1]
    assert middle is not None
    assert (middle.low, middle.middle, middle.high) == (2.0, 2.1, 2.2)


def test_a_failed_trial_is_left_out_of_its_point() -> None:
    sweep = Sweep(trials())
    last = sweep.curve(SERIES, SIZE, lambda row: row.worth).spreads[2]
    assert last is not None
    assert (last.low, last.high) == (4.1, 4.2)


def test_what_is_not_known_has_no_spread() -> None:
    assert spread_of([None, None]) is None
    spread = spread_of([None, 3.0])
    assert spread is not None and (spread.mean, spread.half, spread.count) == (3.0, None, 1)


def test_the_band_of_six_runs_holds_the_median_in_97_percent_of_samples() -> None:
    draws = np.random.default_rng(0).exponential(size=(20000, 6))
    spreads = [over(draw.tolist()) for draw in draws]
    holds = [one.low < np.log(2.0) < one.high for one in spreads]
    # It lies outside only if all values fall on one side of it, whatever their distribution.
    assert np.mean(holds) == pytest.approx(1.0 - 0.5**5, abs=0.005)


def test_an_interval_holds_the_true_mean_in_95_percent_of_samples() -> None:
    samples = np.random.default_rng(0).normal(3.0, 1.0, (4000, 4))
    found = [over(sample.tolist()) for sample in samples]
    holds = [one.half is not None and abs(one.mean - 3.0) <= one.half for one in found]
    assert np.mean(holds) == pytest.approx(0.95, abs=0.01)


def test_a_further_value_is_within_reach_of_the_mean_in_95_percent_of_samples() -> None:
    samples = np.random.default_rng(1).normal(3.0, 1.0, (4000, 6))
    found = [(over(sample[:5].tolist()), sample[5]) for sample in samples]
    holds = [abs(further - one.mean) <= one.reach for one, further in found]
    assert np.mean(holds) == pytest.approx(0.95, abs=0.01)


def test_values_beyond_all_that_was_tried_are_above_all_others() -> None:
    spread = spread_of([1.0, 1.5, math.inf])
    assert spread is not None
    assert (spread.low, spread.middle, spread.high) == (1.0, 1.5, math.inf)
    assert (spread.mean, spread.half) == (math.inf, None)


def test_each_point_of_a_picture_has_its_line_of_numbers() -> None:
    sweep = Sweep(trials())
    panels = [sweep.panel([SERIES], one, lambda row: row.worth) for one in (SIZE, COUNT, KIND)]
    assert draw_panels(panels, Scale("worth")).startswith(b"\x89PNG")
    lines = panels_table(panels, "worths", "worth").csv().decode().splitlines()
    assert lines[0] == "factor,unit,value,series,variant,worth,seeds_low,seeds_high"
    assert "size,mm,2,ours,,2.1,2,2.2" in lines
    assert len(lines) == 1 + 3 + 2 + 2


def test_the_title_beside_a_row_of_panels_does_not_reach_into_the_next_row(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(drawing, "png", lambda figure: figure)
    panels = [Sweep(trials()).panel([SERIES], SIZE, lambda row: row.worth)] * 7
    figure: Any = draw_panels(panels, Scale("95 % of errors of position below [mm]"))
    figure.draw_without_rendering()
    titles = [axes.yaxis.label for axes in figure.axes if axes.get_ylabel()]
    boxes = sorted((title.get_window_extent() for title in titles), key=lambda box: box.y0)
    assert len(boxes) == 3
    for below, above in pairwise(boxes):
        assert above.y0 - below.y1 > 0.1 * below.height


@pytest.mark.parametrize(
    ("kind", "text", "message"),
    [
        (
            TrackStudySettings,
            '[center]\nobject = "teapot"',
            r"'teapot'; choose.*bottle.*center",
        ),
        (TrackStudySettings, '[sweep]\nobject = ["teapot"]', r"'teapot'; choose.*sweep"),
        (ModelStudySettings, 'objects = ["teapot"]', r"'teapot'; choose one of bird"),
        (ModelStudySettings, "[sweep]\n" + NOTHING, r"nothing is varied; .* views, .*sweep"),
        (ModelStudySettings, "[sweep]\nviews = [1]", r">= 2 .*sweep.views"),
        (TrackStudySettings, "[sweep]\nway_mm = [0.0]", r"> 0.0 .*sweep.way_mm"),
    ],
)
def test_settings_that_cannot_be_are_told_with_their_place(
    kind: type[msgspec.Struct], text: str, message: str
) -> None:
    with pytest.raises(msgspec.ValidationError, match=message):
        msgspec.toml.decode(text, type=kind)


@pytest.mark.parametrize("log", [False, True])
def test_the_first_and_the_last_value_are_named_on_the_axis(log: bool) -> None:
    numbers = [0.1, 0.2, 0.21, 0.22, 0.5, 1.0, 1.9, 2.0]
    kept = far_apart(numbers, log)
    assert (kept[0], kept[-1]) == (0.1, 2.0)
    assert 1.9 not in kept
