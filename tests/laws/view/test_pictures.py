"""What pages tell of pictures to those who cannot see them, or see them on small screens."""

import re

import pytest

from servoid.view.model import html_page
from servoid.view.page_parts import picture, with_head
from servoid.view.servo import servo_report
from servoid.view.track import track_report


@pytest.mark.parametrize("page", [html_page, servo_report, track_report])
def test_alternative_texts_say_what_is_drawn_and_do_not_repeat_the_heading(page: object) -> None:
    captions, shown = page._CAPTIONS, page._SHOWN  # pyright: ignore[reportAttributeAccessIssue]
    headings = {name: one if isinstance(one, str) else one[0] for name, one in captions.items()}
    assert set(shown) == set(headings)
    assert all(len(shown[name]) > 20 and shown[name] != headings[name] for name in shown)


def test_a_picture_can_be_scrolled_by_keys_on_a_small_screen() -> None:
    element = picture(b"", "A & B", "Lines of <a>")
    assert 'alt="Lines of &lt;a&gt;"' in element
    assert re.search(
        r'<div class="wide" role="region" tabindex="0" aria-label="A &amp; B"><img', element
    )


@pytest.mark.parametrize("name", ["report.html", "track_report.html", "servo_report.html"])
def test_pages_keep_plots_readable_on_small_screens(name: str) -> None:
    text = with_head(name)
    assert re.search(r"max-width: 640px\) \{ \.wide \{ overflow-x: auto; \}", text)
