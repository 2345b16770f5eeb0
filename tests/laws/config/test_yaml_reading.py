"""YAML of other programs: numbers as they are meant, and no file that is more than it seems."""

import math
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from servoid.config import CALIBRATION_FILE, read_yaml
from servoid.errors import CaptureError

WORDS = st.text(st.characters(categories=["L"]), min_size=1, max_size=6)
SCALARS = st.one_of(st.integers(-(2**50), 2**50), st.floats(allow_nan=False), WORDS)
INNER = st.recursive(
    SCALARS, lambda one: st.lists(one, max_size=3) | st.dictionaries(WORDS, one, max_size=3),
    max_leaves=8,
)  # fmt: skip
CONTENTS = st.dictionaries(WORDS, INNER, max_size=3)
PARSERS = [name for name in ("CBaseLoader", "BaseLoader") if hasattr(yaml, name)]


def read(folder: Path, text: str) -> object:
    path = folder / "a.yaml"
    path.write_text(text, encoding="utf-8")
    return read_yaml(path, CaptureError, CALIBRATION_FILE)


@pytest.fixture(params=PARSERS)
def parser(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Read with the parser in C, and with the one in Python, which is everywhere."""
    monkeypatch.setattr(yaml, "CBaseLoader", getattr(yaml, request.param), raising=False)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=CONTENTS)
def test_what_pyyaml_writes_is_read_as_it_was(tmp_path: Path, content: dict[str, object]) -> None:
    assert read(tmp_path, yaml.safe_dump(content)) == yaml.safe_load(yaml.safe_dump(content))


@pytest.mark.usefixtures("parser")
def test_numbers_are_those_of_every_writer_and_other_words_are_text(tmp_path: Path) -> None:
    text = "[1, -2, 1., .5, 1e-5, 2.5E+3, 010, 1_0, 1:30, 0x1F, yes, null, ~, nan, '7', 2024-01-01]"
    assert read(tmp_path, text) == [
        1, -2, 1.0, 0.5, 1e-5, 2500.0, 10, "1_0", "1:30", "0x1F", "yes", "null", "~", "nan", "7",
        "2024-01-01",
    ]  # fmt: skip
    least, most, none = read(tmp_path, "[-.inf, .Inf, .NaN]")  # type: ignore
    assert (least, most) == (-math.inf, math.inf) and math.isnan(none)


@pytest.mark.usefixtures("parser")
def test_the_header_and_the_tags_of_opencv_are_no_fault(tmp_path: Path) -> None:
    text = "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 1\n   data: [ 1., 2. ]\n"
    assert read(tmp_path, text) == {"M1": {"rows": 1, "data": [1.0, 2.0]}}
    assert read(tmp_path, '{"M1":{"type_id":"opencv-matrix",\n "data":[1.0]}}') == {
        "M1": {"type_id": "opencv-matrix", "data": [1.0]}
    }


LAUGHS = "a: &a [x, x]\n" + "".join(
    f"{name}: &{name} [{','.join(9 * ['*' + before])}]\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.usefixtures("parser")
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (LAUGHS, r"a\.yaml, line 2: \*a stands for another part of the file; write that out"),
        ("a: &a [*a]", r"line 1: \*a stands for another part"),
        ("a: 1\nb: 2\na: 3", "line 3: the key 'a' is given twice in one table; leave one of them"),
        ("? [a]\n: 1", "line 1: a key is a table or a list; give text"),
        ("a: 1\n---\nb: 1", "holds several documents; leave one"),
        (33 * "[" + 33 * "]", "is nested too deeply: more than 32 nested tables or lists"),
        (5000 * "[", "nested too deeply|is not valid YAML: .*nesting"),
        (500 * "{a: ", "nested too deeply|is not valid YAML: .*nesting"),
        ("a: b: c", "is not valid YAML: mapping values are not allowed .*, line 1; give the calib"),
        (
            "a: [1,\n 2\n",
            "is not valid YAML: .*, line 3; give the calibration as its program writes",
        ),
        ("a: \x07", "is not valid YAML: it has characters that cannot be"),
    ],
)
def test_what_is_no_plain_yaml_is_refused_with_its_line(
    text: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(CaptureError, match=message):
        read(tmp_path, text)
