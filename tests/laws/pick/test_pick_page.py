"""The page of `servoid pick` in a real browser, at the sizes of a desk and of a phone."""

import re
import shutil
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from servoid.pick import PickServer, Question
from servoid.segment import BoxTarget, ClickTarget, find_with_doubts

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
pytestmark = [
    pytest.mark.extended,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium"),
]

DESK, PHONE = (1280, 800), (390, 740)
SIZES = pytest.mark.parametrize("size", [DESK, PHONE])


def picture() -> NDArray[np.uint8]:
    image = np.full((240, 320, 3), 90, dtype=np.uint8)
    image[80:160, 100:220] = (200, 40, 30)
    return image


@pytest.fixture
def server() -> Iterator[PickServer]:
    with PickServer(
        Question("eye/0003", picture(), lambda mark: find_with_doubts(mark, picture()))
    ) as one:
        yield one


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


class Page:
    """The page of a server, and what a hand does on it; pixels are those of the image."""

    def __init__(self, browser: Any, server: PickServer, size: tuple[int, int]) -> None:
        self.page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        self.faults: list[str] = []
        self.page.on("console", lambda message: self.faults.append(message.text))
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.goto(server.address)

    def at(self, u: float, v: float) -> tuple[float, float]:
        box = self.page.locator("#stage").bounding_box()
        return (
            box["x"] + (u + 0.5) / 320.0 * box["width"],
            box["y"] + (v + 0.5) / 240.0 * box["height"],
        )

    def click(self, u: float, v: float) -> None:
        self.page.mouse.click(*self.at(u, v))

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        self.page.mouse.move(*self.at(*start))
        self.page.mouse.down()
        self.page.mouse.move(*self.at(*end), steps=4)
        self.page.mouse.up()

    def expect_message(self, pattern: str) -> None:
        words = self.page.locator("#words")
        playwright.expect(words).to_have_text(re.compile(pattern), timeout=60_000)

    def target(self) -> str:
        return self.page.locator("#target").input_value()


@SIZES
def test_a_box_that_is_drawn_is_the_one_that_is_given_back(
    browser: Any, server: PickServer, size: tuple[int, int]
) -> None:
    page = Page(browser, server, size)
    assert page.page.locator("#use").is_disabled()
    page.drag((228, 168), (92, 72))
    page.expect_message("^The bright area is taken as the object: 12 % of the image")
    page.page.click("#use")
    page.expect_message("^Done: the terminal has --target box:.*@eye/0003")
    choice = server.wait(10.0)
    assert choice is not None and isinstance(choice.target, BoxTarget)
    given = np.array([choice.target.u0, choice.target.v0, choice.target.u1, choice.target.v1])
    assert np.abs(given - [92, 72, 228, 168]).max() <= 1.0
    assert (choice.found.mask > 0).sum() == 80 * 120
    assert page.faults == []
    page.page.close()


@SIZES
def test_a_click_is_the_pixel_that_was_meant(
    browser: Any, server: PickServer, size: tuple[int, int]
) -> None:
    page = Page(browser, server, size)
    page.click(160, 120)
    page.expect_message("^The bright area")
    page.page.click("#use")
    page.expect_message("^Done")
    choice = server.wait(10.0)
    assert choice is not None and isinstance(choice.target, ClickTarget)
    assert np.abs(np.array([choice.target.u, choice.target.v]) - [160, 120]).max() <= 1.0
    assert page.faults == []
    page.page.close()


def test_nothing_is_given_back_that_was_not_shown(browser: Any, server: PickServer) -> None:
    page = Page(browser, server, DESK)
    page.click(160, 120)
    page.expect_message("^The bright area")
    page.page.fill("#target", "click:5,5")
    assert page.page.locator("#use").is_disabled()
    page.page.click("#again")
    assert page.page.locator("#use").is_disabled()
    assert page.target() == ""
    assert server.wait(0.0) is None
    page.page.close()


def test_a_mark_can_be_typed_and_what_is_wrong_with_it_is_said(
    browser: Any, server: PickServer
) -> None:
    page = Page(browser, server, DESK)
    page.page.fill("#target", "box:1,2,3")
    page.page.keyboard.press("Enter")
    page.expect_message("write box:LEFT,TOP,RIGHT,BOTTOM")
    assert page.page.locator("#use").is_disabled()
    page.page.fill("#target", "box:92,72,228,168")
    page.page.keyboard.press("Enter")
    page.expect_message("^The bright area")
    page.page.close()


def test_all_of_the_page_can_be_reached_on_a_phone(browser: Any, server: PickServer) -> None:
    page = Page(browser, server, PHONE)
    widths = page.page.locator("body").bounding_box(), page.page.locator("#stage").bounding_box()
    assert all(box["x"] >= 0.0 and box["x"] + box["width"] <= PHONE[0] for box in widths)
    for name in ("#use", "#again", "#show", "#target"):
        box = page.page.locator(name).bounding_box()
        assert box["y"] + box["height"] <= PHONE[1]
        assert box["height"] >= 30.0
    page.page.close()


def test_a_page_that_stays_open_says_that_servoid_has_ended(browser: Any) -> None:
    with PickServer(
        Question("eye/0", picture(), lambda mark: find_with_doubts(mark, picture()))
    ) as one:
        page = Page(browser, one, DESK)
    page.click(160, 120)
    page.expect_message("servoid has ended")
    page.page.close()
