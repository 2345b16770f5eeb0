import csv
import io
import math
import re
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import pytest

from servoid.errors import OutputError
from servoid_experiments.page import write_study_page
from servoid_experiments.report import Finding, Picture, Section, Table, Verdict


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


def a_section(picture: Path) -> Section:
    return Section(
        heading="Fig. 8: <the map> & more",
        findings=(Finding("wide <along> z", Verdict.PARTLY),),
        pictures=(Picture(picture, "Maps & profiles"),),
        tables=(
            Table(
                "widths", "Widths", ("fitness", "width"), [("points", 12.34567), ("region", None)]
            ),
        ),
    )


def a_picture(folder: Path) -> Path:
    path = folder / "map.png"
    cv2.imwrite(str(path), np.zeros((4, 4, 3), np.uint8))
    return path


def test_a_page_needs_nothing_beside_it_and_says_all(tmp_path: Path) -> None:
    section = a_section(a_picture(tmp_path))
    page = write_study_page(
        tmp_path,
        "A <study>",
        [section],
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


def test_a_picture_that_is_missing_is_named_and_no_page_is_left(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"map\.png"):
        write_study_page(tmp_path, "A study", [a_section(tmp_path / "map.png")])
    assert list(tmp_path.iterdir()) == []


def test_a_table_is_read_back_from_its_csv_with_six_digits() -> None:
    rows = [("a, b", 1.23456789, 3), ("", None, 4), ("c", math.inf, 5)]
    table = Table("a", "A", ("name", "value", "count"), rows)
    read = list(csv.DictReader(io.StringIO(table.csv().decode())))
    assert [one["name"] for one in read] == ["a, b", "", "c"]
    assert [one["value"] for one in read] == ["1.23457", "", "inf"]
    assert [one["count"] for one in read] == ["3", "4", "5"]
