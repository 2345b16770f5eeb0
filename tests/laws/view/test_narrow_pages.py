"""Pages on a narrow screen: whole words, and a sign beside what has to be scrolled."""

import re
from importlib.resources import files

import pytest

from servoid.view.page_parts import fill_text, scrolling, wide

TEMPLATES = [
    ("servoid.view", name)
    for name in ("report.html", "track_report.html", "scan_report.html", "servo_report.html")
] + [("servoid_experiments", "page.html")]


def style_of(package: str, name: str) -> str:
    text = files(package).joinpath(name).read_text(encoding="utf-8")
    parts = dict.fromkeys(re.findall(r"\{\{(\w+)\}\}", text), "")
    page = fill_text(text, parts | {"title": ""}).decode()
    found = re.search(r"<style>(.*)</style>", page, re.S)
    assert found is not None
    return found[1]


@pytest.mark.parametrize(("package", "name"), TEMPLATES)
def test_no_page_breaks_a_word_that_fits_into_a_line(package: str, name: str) -> None:
    style = style_of(package, name)
    assert "overflow-wrap: anywhere" not in style and "break-all" not in style
    assert "overflow-wrap: break-word" in style


@pytest.mark.parametrize(("package", "name"), TEMPLATES)
def test_what_is_wider_than_the_screen_says_that_it_scrolls(package: str, name: str) -> None:
    style = style_of(package, name)
    narrow = style[style.index("@media (max-width: 640px)") :]
    assert re.search(r"\.wide::before \{[^}]*content: \"Scroll sideways", narrow)
    shadows = re.search(r"\.scroll \{([^}]*)\}", style)
    assert shadows is not None and "linear-gradient" in shadows[1]


def test_what_scrolls_can_be_reached_by_the_keyboard_and_has_a_name() -> None:
    for kind, element in (("wide", wide("x", 'a "b"')), ("scroll", scrolling("x", 'a "b"'))):
        assert f'class="{kind}"' in element and 'tabindex="0"' in element
        assert 'aria-label="a &quot;b&quot;"' in element


def test_a_table_that_is_wider_than_a_phone_says_that_it_scrolls() -> None:
    row = "<tr><td>{}</td><td>{}</td></tr>"
    narrow = row.format("eye/0001", "<b>0.9613</b>") * 30
    wide_one = row.format("a" * 35, "b") + row.format("a", "b" * 9)
    assert 'class="scroll"' in scrolling(f"<table>{narrow}</table>", "Views")
    assert 'class="scroll long"' in scrolling(f"<table>{wide_one}</table>", "Views")
    assert re.search(r"max-width: 30rem\) \{\s*\.long::before", style_of(*TEMPLATES[0]))
