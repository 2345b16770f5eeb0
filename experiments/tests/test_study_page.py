import csv
import io
import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import cv2
import msgspec
import numpy as np
import pytest

from servoid.errors import OutputError
from servoid_experiments.design import Picture, Section, Study, Table, Verdict
from servoid_experiments.page import write_study_page
from servoid_experiments.running import quick_note, run_study


class Reader(HTMLParser):
    """Gathers the text of a page, its tags, and what it refers to."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []
        self.links: list[str] = []
        self.ids: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "img"):
            self.open.append(tag)
        for name, value in attrs:
            if name in ("src", "href"):
                self.links.append(value or "")
            if name == "id":
                self.ids.add(value or "")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def a_section() -> Section:
    _, png = cv2.imencode(".png", np.zeros((4, 4, 3), np.uint8))
    rows = [("points", 12.34567), ("region", None)]
    return Section(
        heading="Fig. 8: <the map> & more",
        findings={"wide <along> z": Verdict.PARTLY},
        pictures=(
            Picture("map", "Maps & profiles", png.tobytes(), Table("map", ("depth",), [(1,)])),
        ),
        tables=(
            Table("widths", ("fitness", "width"), rows, "Widths"),
            Table("beside", ("hidden",), [("not shown",)]),
        ),
    )


class Few(msgspec.Struct, frozen=True):
    """The settings of a study whose trials are counted only."""

    trials: int = 700


class Nothing(msgspec.Struct, frozen=True):
    """The settings of a study without trials."""


A_STUDY = Study(
    name="a",
    title="A",
    question="Why?",
    settings=Nothing,
    quick=Nothing(),
    plan=lambda _: [],
    report=lambda *_: [a_section()],
)


def test_a_page_needs_nothing_beside_it_and_says_all(tmp_path: Path) -> None:
    page = write_study_page(
        tmp_path,
        "A <study>",
        [a_section()],
        question="How far?",
        settings="a = '<b>'",
        notes=["1 failed"],
    )
    reader = Reader()
    reader.feed(page.read_text(encoding="utf-8"))
    assert reader.open == []
    assert all(link.startswith(("data:image/png;base64,", "#")) for link in reader.links)
    assert {link[1:] for link in reader.links if link.startswith("#")} <= reader.ids
    text = re.sub(r"\s+", " ", " ".join(reader.words))
    for words in (
        "A <study>", "How far?", "Fig. 8: <the map> & more",
        "wide <along> z", "agrees in part", "Maps & profiles", "Widths", "region", "12.35",
        "a = '<b>'", "1 failed",
    ):  # fmt: skip
        assert words in text
    assert "not shown" not in text


def test_a_quick_study_says_so_before_all_else_and_a_whole_one_does_not(tmp_path: Path) -> None:
    study = replace(
        A_STUDY,
        settings=Few,
        quick=Few(trials=32),
        plan=lambda settings: [SimpleNamespace(cases=range(settings.trials))],
    )
    note = quick_note(study, study.quick)
    assert note is not None and "quick study, of 32 trials where the whole one has 700" in note
    assert quick_note(study, Few()) is None
    assert quick_note(study, Few(trials=33)) is None
    empty = replace(study, plan=lambda _: [])
    for settings, is_quick in ((study.quick, True), (Few(), False)):
        report = run_study(empty, settings, tmp_path)
        text = report.page.read_text(encoding="utf-8")
        assert (report.quick is not None) == is_quick == ("This is a quick study" in text)
        assert not is_quick or text.index("This is a quick study") < text.index("<nav>")


def test_pictures_tables_and_verdicts_are_written_beside_the_page(tmp_path: Path) -> None:
    run_study(A_STUDY, Nothing(), tmp_path)
    assert {file.name for file in tmp_path.iterdir() if file.is_file()} == {
        "index.html", "study.toml", "map.png", "map.csv", "widths.csv", "beside.csv",
        "verdicts.csv",
    }  # fmt: skip
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    verdicts = (tmp_path / "verdicts.csv").read_text().splitlines()
    assert verdicts[1] == "Fig. 8: <the map> & more,wide <along> z,agrees in part"


def test_if_one_file_cannot_be_written_none_is(tmp_path: Path) -> None:
    (tmp_path / "widths.csv").mkdir()
    with pytest.raises(OutputError, match=r"widths\.csv"):
        run_study(A_STUDY, Nothing(), tmp_path)
    assert not {"index.html", "map.png", "map.csv"} & {file.name for file in tmp_path.iterdir()}


def test_a_table_is_read_back_from_its_csv_with_six_digits() -> None:
    rows = [("a, b", 1.23456789, 3), ("", None, 4), ("c", math.inf, 5)]
    table = Table("a", ("name", "value", "count"), rows)
    read = list(csv.DictReader(io.StringIO(table.csv().decode())))
    assert [one["name"] for one in read] == ["a, b", "", "c"]
    assert [one["value"] for one in read] == ["1.23457", "", "inf"]
    assert [one["count"] for one in read] == ["3", "4", "5"]
