"""The paper's own method, end to end on images that the tests draw, and the hue that it reads."""

import colorsys
import threading

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes_hue import GREY, QUICK, Pair, fit_pair, hue_around, hue_pair, hue_red
from tiers import tiered

from servoid.errors import ImageError, MaskError, ModelError
from servoid.model import PaperSettings, Progress, fit_paper_views
from servoid.model.paper import hue_window, match_image


@pytest.mark.parametrize("seed", tiered([3, 0, 1, 2]))
def test_the_centre_is_within_five_millimetres_in_x_and_y(seed: int) -> None:
    # The thickness along the line of sight is open; the two radii across it are not all wrong.
    assert hue_pair.broken(seed) == []


@pytest.mark.extended
def test_views_from_all_around_find_the_depth_as_well() -> None:
    assert hue_around.broken(0) == []


def test_a_red_target_is_found_although_its_window_goes_through_zero() -> None:
    low, high = hue_window(np.full((4, 4, 3), (200, 30, 32), np.uint8), np.ones((4, 4), np.uint8))
    assert low > high
    assert hue_red.broken(0) == []


def test_the_match_images_are_the_silhouettes_of_a_plain_target() -> None:
    pair = Pair()
    for image, seen in zip(pair.images(), pair.silhouettes(), strict=True):
        window = hue_window(image, seen.astype(np.uint8))
        np.testing.assert_array_equal(match_image(image, *window) != 0, seen)


def test_a_further_ellipsoid_gains_almost_as_much_as_the_first_although_nothing_is_left() -> None:
    three = PaperSettings(max_ellipsoids=3, delta=0.0, generations=100, points=200)
    first, second, third = (step.fitness for step in fit_pair(Pair(), three))
    assert second - first > 0.5 * first
    assert third - second > 0.5 * first


def test_delta_ends_the_growth() -> None:
    greedy = PaperSettings(max_ellipsoids=3, delta=0.99, generations=5, points=50)
    assert [step.count for step in fit_pair(Pair(), greedy)] == [1]


def test_the_same_seed_gives_the_same_body_on_any_number_of_threads() -> None:
    def radii(seed: int, threads: int) -> bytes:
        chosen = PaperSettings(
            max_ellipsoids=2, delta=0.0, generations=5, points=50, seed=seed, threads=threads
        )
        return fit_pair(Pair(), chosen)[-1].body.radii.tobytes()

    assert radii(0, 1) == radii(0, 2)
    assert radii(0, 1) != radii(1, 1)


def test_progress_comes_on_the_callers_thread_and_can_stop_the_work() -> None:
    pair, reports = Pair(), list[Progress]()

    def listen(progress: Progress) -> None:
        assert threading.current_thread() is threading.main_thread()
        reports.append(progress)

    images = pair.images()
    fit_paper_views(images, pair.cameras, pair.poses, (120, 150), settings=QUICK, progress=listen)
    shares = [progress.share for progress in reports]
    assert shares == sorted(shares)
    assert (reports[-1].count, reports[-1].share) == (1, 1.0)

    def refuse(_: Progress) -> None:
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        fit_paper_views(
            images, pair.cameras, pair.poses, (120, 150), settings=QUICK, progress=refuse
        )


def test_settings_keep_what_was_given_and_leave_the_rest_to_the_core() -> None:
    default, given_some = PaperSettings(), PaperSettings(seed=7, alpha_m=0.004, population=31)
    assert (given_some.seed, given_some.alpha_m, given_some.population) == (7, 0.004, 31)
    assert given_some.alpha is None
    assert default.alpha is not None
    assert given_some.generations == default.generations
    assert PaperSettings(alpha=0.1).alpha == 0.1


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"max_ellipsoids": 0}, "max_ellipsoids must be 1 to 64, but it is 0"),
        ({"delta": float("nan")}, "delta must be at least 0"),
        ({"generations": 0}, "generations must be 1 to 10000"),
        ({"population": 1}, "population must be 2 to 100000"),
        ({"points": 0}, "m is 0"),
        ({"points": 10**12}, "1 to 65536 points"),
        ({"alpha": 0.0}, "alpha must be a positive number"),
        ({"alpha_m": float("inf")}, "alpha must be a positive number"),
    ],
)
def test_settings_out_of_their_ranges_are_refused(wrong: dict[str, float], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        fit_pair(Pair(), PaperSettings(**wrong))  # type: ignore[arg-type]


def test_one_margin_cannot_be_given_twice() -> None:
    with pytest.raises(ModelError, match="give one"):
        PaperSettings(alpha=0.2, alpha_m=0.01)


def test_lists_that_do_not_belong_together_and_images_without_the_hue_are_refused() -> None:
    pair = Pair()
    images, cameras, poses = pair.images(), pair.cameras, pair.poses
    with pytest.raises(ModelError, match="2 images, 1 cameras and 2 poses"):
        fit_paper_views(images, cameras[:1], poses, (120, 150))
    with pytest.raises(ModelError, match="at least two views"):
        fit_paper_views(images[:1], cameras[:1], poses[:1], (120, 150))
    with pytest.raises(MaskError, match="image 0: no pixel falls into the hue window of 250 to"):
        fit_paper_views(images, cameras, poses, (250, 270))
    with pytest.raises(ImageError, match="image 1"):
        fit_paper_views([images[0], images[1][:300]], cameras, poses, (120, 150))


@settings(max_examples=60, deadline=None)
@given(
    low=st.floats(-720, 720),
    width=st.floats(0, 359),
    seed=st.integers(0, 99),
    least=st.floats(0, 1),
)
def test_a_match_is_a_hue_on_the_way_from_low_up_to_high(
    low: float, width: float, seed: int, least: float
) -> None:
    image = np.random.default_rng(seed).integers(0, 256, (6, 7, 3), dtype=np.uint8)
    match = match_image(image, low, low + width, least, least)
    for pixel, rgb in zip(match.reshape(-1), image.reshape(-1, 3) / 255.0, strict=True):
        hue, saturation, value = colorsys.rgb_to_hsv(*rgb)
        turned = (360.0 * hue - low) % 360.0
        near_edge = min(abs(turned - width), turned, 360.0 - turned) < 1e-2
        if near_edge or min(abs(saturation - least), abs(value - least)) < 1e-4:
            continue
        expected = turned <= width and min(saturation, value) >= least
        assert pixel == (255 if expected else 0)


@settings(max_examples=60, deadline=None)
@given(hue=st.floats(0, 359), noise=st.floats(0, 8), seed=st.integers(0, 99))
def test_a_window_holds_the_targets_hue_wherever_on_the_circle_it_is(
    hue: float, noise: float, seed: int
) -> None:
    random = np.random.default_rng(seed)
    hsv = np.full((20, 20, 3), 200, np.uint8)
    hsv[..., 0] = np.mod(hue + random.normal(0, noise, (20, 20)), 360) / 2
    image = cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB).astype(np.uint8)
    mask = np.zeros((20, 20), np.uint8)
    mask[4:16, 4:16] = 1
    low, high = hue_window(image, mask)
    assert 0 <= low < 360
    assert 0 <= high < 360
    assert 16 - 1e-6 <= (high - low) % 360 <= 120
    assert (match_image(image, low, high)[mask != 0] != 0).mean() > 0.95


def test_a_window_of_a_whole_turn_holds_every_hue() -> None:
    wheel = np.full((1, 180, 3), 255, np.uint8)
    wheel[0, :, 0] = np.arange(180)
    image = cv2.cvtColor(wheel, cv2.COLOR_HSV2RGB).astype(np.uint8)
    assert match_image(image, 0, 360).all()
    assert match_image(image, 30, 30 + 360).all()


def test_what_has_no_hue_or_is_no_image_is_refused() -> None:
    grey, mask = np.full((8, 9, 3), GREY, np.uint8), np.ones((8, 9), np.uint8)
    with pytest.raises(MaskError, match="only 0% of the target's pixels have a hue"):
        hue_window(grey, mask)
    with pytest.raises(MaskError, match="the mask is empty"):
        hue_window(grey, np.zeros_like(mask))
    with pytest.raises(MaskError, match="shape"):
        hue_window(grey, mask[1:])
    for wrong in (grey[..., 0], grey.astype(float), grey[:0], np.zeros((8, 9, 4), np.uint8)):
        with pytest.raises(ImageError, match="RGB"):
            match_image(wrong, 0, 10)  # type: ignore[arg-type]
    for bounds in ((float("nan"), 10.0), (0.0, float("inf"))):
        with pytest.raises(ImageError, match="finite"):
            match_image(grey, *bounds)
    with pytest.raises(ImageError, match="least_value must be 0 to 1"):
        match_image(grey, 0, 10, 0.2, 1.5)
