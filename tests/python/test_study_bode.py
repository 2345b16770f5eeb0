"""The study as a whole, told of runs that were made up."""

import csv
from pathlib import Path

import msgspec
import numpy as np
import pytest

from servoid.errors import StudyError
from servoid.observe.strict import convert
from servoid.servo import settings_toml
from servoid_experiments.bode import BODE, BodeSettings
from servoid_experiments.bode.margin import MARGIN, SERVOID, MarginCase, MarginRow
from servoid_experiments.bode.planning import HALF, MAPS, VARIANTS
from servoid_experiments.bode.response import RESPONSE, Answer, ResponseCase, ResponseRow
from servoid_experiments.bode.spread import HALF_POWER, leaving
from servoid_experiments.design import Done, Results
from servoid_experiments.findings import Section, Verdict

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
def told(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Section]]:
    pytest.importorskip("matplotlib")
    folder = tmp_path_factory.mktemp("bode")
    return folder, list(BODE.tell(SMALL, results(), folder))


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
def test_every_figure_has_its_numbers_beside_it(told: tuple[Path, list[Section]]) -> None:
    folder, sections = told
    pictures = [picture.file for section in sections for picture in section.pictures]
    assert [file.name for file in pictures] == [
        "hand.png",
        "gaze.png",
        "recognition.png",
        "margins.png",
    ]
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in pictures)
    rows = list(csv.DictReader((folder / "responses.csv").open()))
    hand = [row for row in rows if row["signal"] == "hand" and row["axis"] == "sideways"]
    assert {row["variant"] for row in hand} == set(VARIANTS)
    assert len(hand) == len(VARIANTS) * len(SMALL.response.sideways_lines)
    margins = list(csv.DictReader((folder / "margins.csv").open()))
    assert len(margins) == len(BODE.plan(SMALL)[1].cases)


@pytest.mark.extended
def test_sentences_say_what_the_rows_say(told: tuple[Path, list[Section]]) -> None:
    sections = {section.heading: section for section in told[1]}
    lag = np.degrees(np.arctan(SMALL.response.lag_hz / CORNER_HZ[False]))
    assert f"by {lag:.1f} deg without" in sections["The hand"].words[1]
    hz = SMALL.response.base_hz * np.array(SMALL.response.sideways_lines)
    gains = 1.0 / np.hypot(1.0, hz / CORNER_HZ[False])
    falls = leaving(hz, gains, (HALF_POWER, np.inf))
    assert f"falls by 3 dB at {falls:.2f} Hz" in sections["The hand"].words[2]
    loop = sections["How much the loop bears"]
    assert "more than 256 at the corners" in loop.words[1]
    assert any("bears 30 ms" in words and "16 degrees" in words for words in loop.words)
    assert loop.tables[0].rows[0][-1] == "20"  # half of ten times 4 a second


@pytest.mark.extended
def test_a_peak_and_a_cure_of_the_lag_are_told_only_where_they_are(
    told: tuple[Path, list[Section]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (hand,) = [section for section in told[1] if section.heading == "The hand"]
    assert not any("peak" in words for words in hand.words)
    assert hand.findings[0].verdict is Verdict.BEYOND
    monkeypatch.setitem(CORNER_HZ, True, 0.4)  # as if feed-forward did harm
    (hand,) = [
        section
        for section in BODE.tell(SMALL, results(), tmp_path)
        if section.heading == "The hand"
    ]
    assert hand.findings[0].verdict is Verdict.AGREES
    assert "does not take it away" in hand.findings[0].why


@pytest.mark.extended
def test_halved_amplitudes_are_compared_with_the_run_of_the_same_seed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setitem(APART, "seeds", 0.2)  # but what is halved answers as the whole does
    sections = BODE.tell(SMALL, results(), tmp_path)
    (doubts,) = [one for one in sections if one.heading == "Is that a frequency response?"]
    assert "differs by 0 % as a median over frequencies and runs, and by 0 %" in doubts.words[-1]


@pytest.mark.extended
def test_trials_that_failed_are_left_out(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    sections = BODE.tell(SMALL, results(failed=1), tmp_path)
    assert sections[0].heading == "The hand"
    rows = list(csv.DictReader((tmp_path / "responses.csv").open()))
    runs = {row["variant"]: int(row["runs"]) for row in rows}
    seeds = SMALL.response.seeds
    assert list(runs.values()) == [seeds - 1, seeds, seeds, seeds]


def test_nothing_but_failures_is_told(tmp_path: Path) -> None:
    failed = {
        work.experiment.name: [Done(case, None, "no") for case in work.cases]
        for work in BODE.plan(SMALL)
    }
    [section] = BODE.tell(SMALL, failed, tmp_path)
    assert "No run succeeded" in section.words[0]
    assert section.pictures == ()
