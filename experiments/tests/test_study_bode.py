"""The study as a whole, which reports runs that were made up."""

import csv
import io
from typing import Any

import msgspec
import numpy as np
import pytest

from servoid.batch import Done, Results
from servoid.config.strict import convert
from servoid.errors import StudyError
from servoid.servo import settings_toml
from servoid_experiments.bode.curves import HALF_POWER, leaving
from servoid_experiments.bode.margin import MARGIN, SERVOID, MarginCase, MarginRow
from servoid_experiments.bode.plan import HALF, MAPS, VARIANTS, BodeSettings
from servoid_experiments.bode.report import BODE
from servoid_experiments.bode.response import RESPONSE, Answer, ResponseCase, ResponseRow
from servoid_experiments.design import Section, Table, Verdict

SMALL = BODE.quick
CORNER_HZ = {True: 4.0, False: 0.5}
APART = {"seeds": 0.001}  # by which share of the gain


def answer(case: ResponseCase, signal: str, axis: str) -> Answer:
    """Make a hand that answers with a first-order lag, and all else without any error."""
    lines = case.sideways_lines if axis == "sideways" else case.depth_lines
    hz = case.base_hz * np.array(lines)
    corner = CORNER_HZ[case.feed_forward] if signal == "hand" else np.inf
    ratio = (1.0 + APART["seeds"] * case.seed) / (1.0 + 1j * hz / corner)
    return Answer(
        signal=signal,
        axis=axis,
        hz=hz.tolist(),
        real=ratio.real.tolist(),
        imag=ratio.imag.tolist(),
        floor=1e-4,
    )


def made_up(case: ResponseCase) -> ResponseRow:
    signals = ("seen", "known", "predicted", "gaze", "hand")
    pairs = [
        (signal, axis)
        for signal in signals
        for axis in ("sideways", "depth")
        if case.eyes_follow or (signal, axis) != ("gaze", "depth")
    ]
    return ResponseRow(
        answers=[answer(case, *pair) for pair in pairs],
        images=600,
        joint_speed_share=0.2,
        joint_acceleration_share=0.5,
        limited_share=0.01,
    )


def edge(case: MarginCase) -> MarginRow:
    if case.seeks == "gain" and case.loop == SERVOID:
        return MarginRow(edge=None, swings_hz=None)
    return MarginRow(edge=0.03 if case.seeks == "delay" else 10.0, swings_hz=1.5)


def results(failed: int = 0) -> Results:
    responses, margins = BODE.plan(SMALL)
    rows = [Done(case, made_up(case)) for case in responses.cases]
    rows[:failed] = [Done(case, None, "the hand was held") for case in responses.cases[:failed]]
    return {
        RESPONSE.name: rows,
        MARGIN.name: [Done(case, edge(case)) for case in margins.cases],
    }


@pytest.fixture(scope="module")
def reported() -> list[Section]:
    pytest.importorskip("matplotlib")
    return list(BODE.report(SMALL, results()))


def test_every_variant_is_run_with_every_seed_and_one_at_half_the_amplitude() -> None:
    responses, margins = BODE.plan(BodeSettings())
    seeds = BodeSettings().response.seeds
    whole = [case for case in responses.cases if case.scale == 1.0]
    ran = {(case.seed, case.feed_forward, case.eyes_follow) for case in whole}
    assert len(whole) == len(ran) == seeds * len(VARIANTS)
    halved = [case for case in responses.cases if case.scale == HALF]
    assert halved and all(case.feed_forward and case.eyes_follow for case in halved)
    asked = BodeSettings().margin
    cells = len(asked.latencies_s) * len(asked.rates_hz)
    assert len(margins.cases) == len(MAPS) * cells + 4


def test_no_two_cases_have_the_same_key() -> None:
    for work in BODE.plan(BodeSettings()):
        keys = {work.experiment.key(case) for case in work.cases}
        assert len(keys) == len(work.cases)


def test_cases_and_rows_come_back_from_json() -> None:
    for work, make in zip(BODE.plan(SMALL), (made_up, edge), strict=True):
        case = work.cases[0]
        for value in (case, make(case)):
            text = msgspec.json.encode(value)
            assert msgspec.json.decode(text, type=type(value)) == value


def test_settings_read_back_from_their_toml() -> None:
    text = settings_toml(BodeSettings())
    data = msgspec.toml.decode(text.encode())
    assert convert(data, BodeSettings, "the text", StudyError) == BodeSettings()
    assert "seeds = 6  # runs of each variant" in text


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"sideways_lines": [1, 2, 3]}, r"none twice"),
        ({"depth_lines": []}, r"one line or more"),
        ({"lag_hz": 0.12}, r"lag_hz is 0.12; choose one of 0.05, 0.1,"),
        ({"seeds": 1}, r"seeds"),
        ({"object": "bottel"}, r"unknown object 'bottel'; choose one of .*bottle"),
        ({"background": "clutter"}, r"unknown background 'clutter'; choose one of"),
    ],
)
def test_settings_that_cannot_be_are_refused(values: dict[str, object], message: str) -> None:
    with pytest.raises(StudyError, match=message):
        convert({"response": values}, BodeSettings, "the text", StudyError)


@pytest.mark.extended
def test_every_figure_has_its_numbers_beside_it(reported: list[Section]) -> None:
    pictures = [picture for section in reported for picture in section.pictures]
    assert [picture.name for picture in pictures] == ["hand", "gaze", "recognition", "margins"]
    assert all(picture.png.startswith(b"\x89PNG") for picture in pictures)
    rows = responses(reported)
    hand = [row for row in rows if row["signal"] == "hand" and row["axis"] == "sideways"]
    assert {row["variant"] for row in hand} == set(VARIANTS)
    assert len(hand) == len(VARIANTS) * len(SMALL.response.sideways_lines)
    assert len(tables_of(reported)["margins"].rows) == len(BODE.plan(SMALL)[1].cases)


def tables_of(sections: list[Section]) -> dict[str, Table]:
    return {table.name: table for section in sections for table in section.tables}


def responses(sections: list[Section]) -> list[dict[str, str]]:
    """Return the rows of `responses.csv`."""
    content = tables_of(sections)["responses"].csv().decode()
    return list(csv.DictReader(io.StringIO(content)))


def figures(sections: list[Section], variant: str, signal: str) -> dict[str, Any]:
    """Return the figures of a variant's answer sideways."""
    table = tables_of(sections)["response_figures"]
    [row] = [row for row in table.rows if row[:3] == (variant, signal, "sideways")]
    return dict(zip(table.headings, row, strict=True))


@pytest.mark.extended
def test_tables_hold_what_the_rows_say(reported: list[Section]) -> None:
    sections = reported
    hand = figures(sections, "no feed-forward, eyes follow", "hand")
    lag = np.degrees(np.arctan(SMALL.response.lag_hz / CORNER_HZ[False]))
    assert hand["lag_deg"] == pytest.approx(lag)
    hz = SMALL.response.base_hz * np.array(SMALL.response.sideways_lines)
    gains = 1.0 / np.hypot(1.0, hz / CORNER_HZ[False])
    falls = leaving(hz, gains, (HALF_POWER, np.inf))
    assert hand["falls_by_3db_hz"] == pytest.approx(falls, rel=0.01)
    seen = figures(sections, "feed-forward, eyes follow", "seen")
    assert seen["falls_by_3db_hz"] == np.inf
    assert seen["gain_off_at_most"] < 0.01
    tables = tables_of(sections)
    corners = [row for row in tables["margins"].rows if row[3] == "gain" and row[0] in MAPS]
    assert {row[4] for row in corners if row[0] != "the paper's law, no time stamps"} == {""}
    assert tables["greatest_gains"].rows[0][-1] == pytest.approx(
        20.0
    )  # half of ten times 4 a second
    assert {name for section in sections for name in tables_of([section])} == set(tables)


@pytest.mark.extended
def test_feed_forward_goes_beyond_the_paper_only_if_the_hand_lags_less_for_it(
    reported: list[Section], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert list(reported[0].findings.values()) == [Verdict.BEYOND]
    monkeypatch.setitem(CORNER_HZ, True, 0.4)  # as if feed-forward did harm
    [verdict] = BODE.report(SMALL, results())[0].findings.values()
    assert verdict is Verdict.AGREES


@pytest.mark.extended
def test_halved_amplitudes_are_compared_with_the_run_of_the_same_seed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setitem(APART, "seeds", 0.2)  # but what is halved answers as the whole does
    table = tables_of(list(BODE.report(SMALL, results())))["response_halved"]
    ratios = [row[-1] for row in table.rows]
    assert ratios and ratios == pytest.approx([1.0] * len(ratios))


@pytest.mark.extended
def test_trials_that_failed_are_left_out() -> None:
    pytest.importorskip("matplotlib")
    rows = responses(list(BODE.report(SMALL, results(failed=1))))
    runs = {row["variant"]: int(row["runs"]) for row in rows}
    seeds = SMALL.response.seeds
    assert list(runs.values()) == [seeds - 1, seeds, seeds, seeds]


def test_nothing_but_failures_leaves_nothing_to_report() -> None:
    failed = {
        work.experiment.name: [Done(case, None, "no") for case in work.cases]
        for work in BODE.plan(SMALL)
    }
    [section] = BODE.report(SMALL, failed)
    assert section.heading == "No trial succeeded"
    assert section.pictures == section.tables == ()
