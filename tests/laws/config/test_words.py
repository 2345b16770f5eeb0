"""Numbers in text files and options are those that every program reads alike."""

import math
from pathlib import Path

import numpy as np
import pytest
from fake_tracker import plain_body
from hypothesis import given
from hypothesis import strategies as st

from servoid.batch import BatchProgress
from servoid.cli.batch_progress import words_of
from servoid.errors import BodyError
from servoid.exchange.shapes.mesh_closing import close_mesh
from servoid.model.result import Coverage
from servoid.shape import save_body
from servoid.words import (
    alternatives,
    by_kind,
    counted,
    digits,
    finite,
    four_digits,
    hundredths,
    in_one_line,
    measured,
    number_of,
    suggestion,
    whole_number_of,
)


@given(st.floats())
def test_every_number_is_read_back_as_python_writes_it(number: float) -> None:
    read = number_of(repr(number))
    assert read == number or (math.isnan(read) and math.isnan(number))


@pytest.mark.parametrize(
    ("text", "number"), [("1", 1.0), (" -.5 ", -0.5), ("3.", 3.0), ("+1E-3", 0.001)]
)
def test_numbers_are_read_in_every_usual_form(text: str, number: float) -> None:
    assert number_of(text) == number


@pytest.mark.parametrize("text", ["1_000", "１２", "٣", "1e", ".", "", "0x10", "1 0", "1,5", "--1"])
def test_what_other_programs_do_not_take_for_a_number_is_none(text: str) -> None:
    with pytest.raises(ValueError, match="is no number"):
        number_of(text)


@given(st.integers(-(10**30), 10**30))
def test_whole_numbers_are_read_back(number: int) -> None:
    assert whole_number_of(str(number)) == number


@pytest.mark.parametrize("text", ["1.0", "1_0", "２", ""])
def test_what_is_no_whole_number_is_none(text: str) -> None:
    with pytest.raises(ValueError, match="is no whole number"):
        whole_number_of(text)


def test_one_thing_has_no_plural() -> None:
    assert [counted(count, "image") for count in (0, 1, 2)] == ["0 images", "1 image", "2 images"]
    assert counted(1, "value was", "values were") == "1 value was"
    assert counted(3, "value was", "values were") == "3 values were"


@given(st.floats(allow_nan=False))
def test_a_number_for_people_has_six_digits_at_most(number: float) -> None:
    mantissa = digits(number).partition("e")[0].strip("-")
    assert sum(sign.isdigit() for sign in mantissa.lstrip("0.")) <= 6


@given(st.floats(-0.0049, 0.0049))
def test_what_rounds_to_zero_has_no_sign(number: float) -> None:
    assert hundredths(number) == "0.00"
    assert f"({hundredths(number)}, 0.00, -1.00) in the object" in _note_towards(number)


@given(st.floats(-1e6, 1e6))
def test_two_decimals_are_off_by_half_of_the_last_one_at_most(number: float) -> None:
    assert abs(float(hundredths(number)) - number) <= 0.00501


def _note_towards(x: float) -> str:
    return str(Coverage(np.array([0.1]), 0.5, (x, -0.001, -1.0)).note())


def test_what_another_library_says_becomes_one_line() -> None:
    assert in_one_line(ValueError("XML Error:\n  no file\n\tx.xml")) == "XML Error: no file x.xml"


def test_one_trial_one_ellipsoid_and_one_face_are_singular(tmp_path: Path) -> None:
    assert words_of(BatchProgress(1, 0, 1, 0, None)) == "1 of 1 trial"
    with pytest.raises(BodyError, match="a body of 1 ellipsoid needs colors of shape"):
        save_body(tmp_path / "b.json", plain_body(), np.zeros((2, 3), np.uint8))
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    faces[0] = faces[0, ::-1]
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    *_, notes = close_mesh(corners, faces)
    assert "1 of 4 faces had the wrong orientation and was flipped" in notes


@given(st.floats(1e-12, 1e12))
def test_four_digits_round_a_number_and_show_no_exponent(number: float) -> None:
    text = four_digits(number)
    assert "e" not in text
    assert float(text) == pytest.approx(number, rel=0.5001e-3)


@given(st.floats())
def test_only_a_finite_number_goes_into_json(number: float) -> None:
    assert finite(number) == (number if math.isfinite(number) else None)


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["21 % is hidden", "39 % is hidden", "22.5 % is hidden"], "21 to 39 % is hidden"),
        (["9 of 10 points", "11 of 10 points"], "9 to 11 of 10 points"),
        (
            ["left/000003.jpg is damaged", "left/000004.jpg is damaged"],
            "left/000003.jpg is damaged",
        ),
        (["dark by 3"], "dark by 3"),
        (["late"] * 2, "late"),
    ],
)
def test_texts_that_differ_only_in_numbers_become_one_with_their_ranges(
    texts: list[str], words: str
) -> None:
    said = [(text, place) for place, text in enumerate(texts)]
    assert by_kind(said) == [(words, list(range(len(texts))))]
    twice = list(range(len(texts))) * 2
    others = [("something else", -1), *said, *said]
    assert by_kind(others) == [(words, twice), ("something else", [-1])]


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("bottel", "bottle"),
        ("plan_mug", "plain_mug"),
        ("MUG", "mug"),
        ("mug", "mug"),
        ("teapot", None),
        ("", None),
        ("x" * 10_000, None),
    ],
)
def test_a_name_is_suggested_only_if_it_is_almost_the_one_that_was_given(
    given: str, meant: str | None
) -> None:
    known = ("bottle", "drill", "mug", "plain_mug")
    listed = "; choose one of bottle, drill, mug, plain_mug"
    assert alternatives(given, known).removeprefix(listed) == suggestion(given, known)
    assert suggestion(given, known) == ("" if meant is None else f"; did you mean '{meant}'?")


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (115.1134, "115.1"),
        (0.0012345, "0.001234"),
        (123456.0, "123500"),
        (0.0, "0"),
        (1e30, "1e+30"),
    ],
)
def test_what_was_measured_has_four_digits_at_most(number: float, text: str) -> None:
    assert measured(number) == text
