import colorsys
import re
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scenes_found import before_background, box_around, drawn, iou, target_drawn

from conftest import write_png
from servoid.capture import open_capture
from servoid.errors import ImageError, MaskError, TargetError
from servoid.segment import (
    BackgroundTarget,
    BoxTarget,
    ClickTarget,
    HueTarget,
    MaskTarget,
    Target,
    find_object,
    grow_mask,
    parse_target,
)

Mask = NDArray[np.uint8]
NUMBERS = st.floats(-1e6, 1e6, allow_nan=False)
VIEWS = st.none() | st.from_regex(r"[a-z]{1,6}/[0-9]{1,6}", fullmatch=True)
PATHS = st.from_regex(r"[a-z@]{1,8}/[a-z@2]{1,8}\.(png|jpg)", fullmatch=True).map(Path)
TARGETS = st.one_of(
    st.builds(MaskTarget, PATHS, VIEWS),
    st.builds(BackgroundTarget, PATHS, VIEWS),
    st.builds(ClickTarget, NUMBERS, NUMBERS, VIEWS),
    st.tuples(NUMBERS, NUMBERS, st.floats(0.5, 1e3), st.floats(0.5, 1e3), VIEWS).map(
        lambda box: BoxTarget(box[0], box[1], box[0] + box[2], box[1] + box[3], box[4])
    ),
    st.tuples(st.floats(0, 180), st.floats(181, 360), VIEWS).map(
        lambda hue: HueTarget(hue[0], hue[1], view=hue[2])
    ),
)


@given(TARGETS)
def test_a_target_that_is_written_is_read_back(target: Target) -> None:
    assert parse_target(str(target)) == target


def test_a_target_may_name_its_view() -> None:
    assert parse_target("box:120,80,420,400@eye/0003") == BoxTarget(120, 80, 420, 400, "eye/0003")
    assert parse_target("hue:340..20@left/000000").view == "left/000000"
    assert parse_target("mask:a@2x.png") == MaskTarget(Path("a@2x.png"))
    assert parse_target("mask:a@2x.png@eye/1") == MaskTarget(Path("a@2x.png"), "eye/1")


@pytest.mark.parametrize(
    "text",
    ["", "cup", "box", "box:", "mask:", "mask:@eye/1", "click:1,2@", "circle:1,2,3"],
)  # fmt: skip
def test_what_is_no_target_is_refused_with_the_forms_and_an_example(text: str) -> None:
    with pytest.raises(TargetError) as refused:
        parse_target(text)
    assert f"'{text}'" in str(refused.value)
    assert "box:U0,V0,U1,V1" in str(refused.value)
    assert "box:120,80,420,400@eye/0003" in str(refused.value)


@pytest.mark.parametrize(
    "text", ["box:1,2,3", "box:1,2,3,x", "click:1,2,3", "hue:10", "hue:a..b", "hue:200-260"]
)
def test_numbers_of_a_target_that_are_not_as_many_are_answered_with_an_example_that_is_valid(
    text: str,
) -> None:
    with pytest.raises(
        TargetError, match=rf"^the target '{text}' needs \d numbers with"
    ) as refused:
        parse_target(text)
    kind = text.split(":")[0]
    examples = re.findall(rf"{kind}:[\d.,]+\d", str(refused.value).partition("write ")[2])
    assert examples
    assert [str(parse_target(one)) for one in examples] == examples


@pytest.mark.parametrize(
    "text",
    ["box:5,5,1,9", "box:1,nan,2,3", "box:1,1,1,9", "click:inf,2", "hue:nan..4", "hue:10..10",
     "hue:0..900"],
)  # fmt: skip
def test_numbers_that_make_no_sense_are_refused(text: str) -> None:
    with pytest.raises(TargetError, match="such as"):
        parse_target(text)


@pytest.mark.parametrize("seed", range(3))
def test_a_box_or_a_click_finds_the_drawn_object(seed: int) -> None:
    image, mask, _ = drawn(seed)
    assert iou(find_object(box_around(mask), image), mask) > 0.97
    assert target_drawn.broken(seed) == []


def test_a_box_holds_the_mask_that_is_found_in_it_but_for_the_three_pixels_of_a_hand() -> None:
    image, mask, _ = drawn()
    found = find_object(BoxTarget(90, 60, 200, 200), image)
    rows, columns = np.nonzero(found)
    assert columns.min() >= 87
    assert rows.min() >= 57
    assert columns.max() <= 203
    assert rows.max() <= 203
    assert ((found > 0) & (mask > 0)).sum() > 0.9 * (found > 0).sum()


def test_a_mask_grows_from_certain_into_possible_pixels_and_never_beyond() -> None:
    image, mask, _ = drawn()
    disc = np.ones((31, 31), np.uint8)
    certain, possible = np.asarray(cv2.erode(mask, disc)), np.asarray(cv2.dilate(mask, disc))
    grown = grow_mask(image, certain, possible)
    assert iou(grown, mask) > 0.98
    assert (grown[certain > 0] == 255).all()
    assert (grown[possible == 0] == 0).all()
    assert set(np.unique(grown)) <= {0, 255}


def test_a_grown_border_is_as_sharp_as_the_image_though_the_cut_is_made_on_a_small_copy() -> None:
    image, mask, _ = drawn()
    image, mask = (
        np.asarray(cv2.resize(one, None, fx=4, fy=4, interpolation=cv2.INTER_NEAREST))
        for one in (image, mask)
    )
    disc = np.ones((61, 61), np.uint8)
    grown = grow_mask(image, np.asarray(cv2.erode(mask, disc)), np.asarray(cv2.dilate(mask, disc)))
    wrong = (grown != mask).sum()
    length = sum(len(line) for line in cv2.findContours(mask, 0, cv2.CHAIN_APPROX_NONE)[0])
    assert wrong < 1.5 * length  # pixels of the border; one pixel of the copy is six of the image


def test_growing_gives_the_same_bits_in_every_run_and_on_any_thread_count() -> None:
    image, mask, _ = drawn()
    threads = cv2.getNumThreads()
    found = []
    try:
        for count in (1, 4):
            cv2.setNumThreads(count)
            cv2.setRNGSeed(count)
            found.append(find_object(box_around(mask), image).tobytes())
            found.append(find_object(ClickTarget(160, 120), image).tobytes())
    finally:
        cv2.setNumThreads(threads)
    assert found[:2] == found[2:]


@pytest.mark.parametrize("full", [True, False])
def test_growing_needs_some_pixels_that_are_possible_and_some_that_are_not(full: bool) -> None:
    image, mask, _ = drawn()
    with pytest.raises(TargetError, match="background" if full else "mark some"):
        grow_mask(image, mask * 0, np.full_like(mask, 255 * full))


def test_a_hue_window_through_red_takes_the_largest_part_and_closes_its_holes() -> None:
    image = np.full((60, 80, 3), 120, np.uint8)
    image[10:50, 10:50] = (220, 30, 40)  # hue 357
    image[20:40, 20:40] = (30, 60, 220)
    image[5:15, 60:70] = (220, 50, 30)  # hue 6
    mask = np.zeros((60, 80), np.uint8)
    mask[10:50, 10:50] = 255
    assert (find_object(HueTarget(340, 20), image) == mask).all()
    assert (find_object(HueTarget(-20, 20), image) == mask).all()
    assert find_object(HueTarget(200, 260), image).sum() == 255 * 400


@given(st.tuples(*[st.integers(0, 255)] * 3), st.floats(0, 360), st.floats(2, 350))
def test_a_hue_window_takes_the_colors_whose_hue_lies_in_it(
    color: tuple[int, int, int], low: float, width: float
) -> None:
    hue, saturation, value = colorsys.rgb_to_hsv(*(part / 255.0 for part in color))
    past = (360.0 * hue - low) % 360.0
    assume(min(abs(past - width), past, 360.0 - past) > 0.01)
    assume(abs(saturation - 0.25) > 0.001 and abs(value - 0.15) > 0.001)
    image = np.full((12, 12, 3), 128, np.uint8)
    image[4:8, 4:8] = color
    expected = past < width and saturation > 0.25 and value > 0.15
    try:
        found = int((find_object(HueTarget(low, (low + width) % 360.0), image) > 0).sum())
    except TargetError:
        found = 0
    assert found == 16 * expected


def test_a_hue_window_without_pixels_says_which_hues_there_are() -> None:
    image, _, _ = drawn()
    image[60:180, 100:220] = (40, 60, 200)
    with pytest.raises(TargetError, match=r"hue:100..140.*mostly 220..240"):
        find_object(HueTarget(100, 140), image)
    with pytest.raises(TargetError, match="too grey"):
        find_object(HueTarget(100, 140), np.full((40, 40, 3), 99, np.uint8))


@pytest.mark.parametrize("seed", range(3))
def test_what_is_new_before_a_background_is_found_without_its_soft_shadow(seed: int) -> None:
    assert before_background.broken(seed) == []


def test_a_background_without_a_change_finds_nothing(tmp_path: Path) -> None:
    _, _, floor = drawn()
    noise = np.random.default_rng(1).normal(scale=4.0, size=floor.shape)
    write_png(tmp_path / "empty.png", floor)
    with pytest.raises(TargetError, match="no object was found"):
        find_object(
            BackgroundTarget(tmp_path / "empty.png"),
            np.clip(np.rint(floor + noise), 0, 255).astype(np.uint8),
        )


@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_a_background_is_read_with_the_bits_of_its_image(tmp_path: Path, bits: int) -> None:
    image, mask, floor = drawn()
    write_png(tmp_path / "empty.png", floor)
    expected = find_object(BackgroundTarget(tmp_path / "empty.png"), image)
    assert cv2.imwrite(str(tmp_path / "deep.png"), floor[..., ::-1].astype(np.uint16) << (bits - 8))
    found = find_object(BackgroundTarget(tmp_path / "deep.png"), image, bits=bits)
    np.testing.assert_array_equal(found, expected)
    assert float((found & mask).sum()) > 0.9 * float((found | mask).sum())


def test_a_mask_is_taken_as_it_is(tmp_path: Path) -> None:
    image, mask, _ = drawn()
    write_png(tmp_path / "mask.png", mask // 255)
    assert (find_object(MaskTarget(tmp_path / "mask.png"), image) == mask).all()


@pytest.mark.parametrize(("value", "word"), [(0, "no object"), (9, "whole image")])
def test_a_mask_of_nothing_or_everything_is_refused(tmp_path: Path, value: int, word: str) -> None:
    image, mask, _ = drawn()
    write_png(tmp_path / "mask.png", np.full_like(mask, value))
    with pytest.raises(TargetError, match=word):
        find_object(MaskTarget(tmp_path / "mask.png"), image)


def test_files_that_are_missing_or_of_another_size_are_refused(tmp_path: Path) -> None:
    image, mask, floor = drawn()
    write_png(tmp_path / "mask.png", mask[:50])
    write_png(tmp_path / "empty.png", floor[:50])
    for name in ("mask.png", "missing.png"):
        with pytest.raises(MaskError, match=name):
            find_object(MaskTarget(tmp_path / name), image)
    with pytest.raises(ImageError, match="320x50"):
        find_object(BackgroundTarget(tmp_path / "empty.png"), image)


@pytest.mark.parametrize(
    ("target", "word"),
    [
        (BoxTarget(400, 10, 500, 90), "outside the image"),
        (BoxTarget(-9, -9, 900, 900), "covers the whole image"),
        (ClickTarget(-3, 4), "outside the image"),
        (ClickTarget(4, 240), "outside the image"),
    ],
)
def test_a_box_or_click_that_does_not_fit_its_image_is_refused(target: Target, word: str) -> None:
    with pytest.raises(TargetError, match=word):
        find_object(target, drawn()[0])


@pytest.mark.parametrize("level", [0, 128, 255])
def test_an_image_of_one_colour_has_no_object_to_grow(level: int) -> None:
    image = np.full((90, 120, 3), level, np.uint8)
    for target in (BoxTarget(30, 30, 80, 60), ClickTarget(60, 40)):
        try:
            mask = find_object(target, image)
        except TargetError:
            continue
        assert mask.any()
        assert not mask.all()


@pytest.mark.parametrize(("name", "least"), [("skull", 0.95), ("temple", 0.9), ("blowtorch", 0.65)])
def test_a_box_finds_what_real_photographs_show(
    name: str, least: float, photos: Callable[[str], Path]
) -> None:
    view = open_capture(photos(name)).views()[0]
    mask = view.mask()
    assert iou(find_object(box_around(mask), view.image()), mask) > least
