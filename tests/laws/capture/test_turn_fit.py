"""A camera that is turned along its epipolar lines is noticed, and by how much."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from rooms_to_scan import FOCAL_PX, SIZE_PX, write_pair
from true_captures import with_focal_share

from servoid._native import Camera
from servoid.camera import pinhole_lens
from servoid.capture import doubt_calibration, doubt_for_model, is_refuted
from servoid.capture.matched_features import MatchedFeatures
from servoid.capture.turn_fit import TurnFit
from servoid.pose import Pose

CENTER_PX = (0.5 * (SIZE_PX[0] - 1), 0.5 * (SIZE_PX[1] - 1))
LENS = pinhole_lens(Camera(size_px=SIZE_PX, focal_px=(FOCAL_PX, FOCAL_PX), center_px=CENTER_PX))
BESIDE = Pose.from_parts((-0.1, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


def about_y(degrees: float) -> Pose:
    return Pose.exp([0.0, 0.0, 0.0, 0.0, np.radians(degrees), 0.0])


def matched(second_from_first: Pose, told: Pose, noise_px: float, seed: int) -> MatchedFeatures:
    """Return what two cameras see of a room, with a pose that is told of the second one."""
    rng = np.random.default_rng(seed)
    points = rng.uniform((-0.4, -0.3, 0.6), (0.4, 0.3, 1.5), (400, 3))
    pixels = [LENS.project(points), LENS.project(second_from_first.transform(points))]
    noisy = [one + rng.normal(0.0, noise_px, one.shape) for one in pixels]
    seen = np.all([np.all((one >= 0) & (one < SIZE_PX), axis=1) for one in noisy], axis=0)
    return MatchedFeatures((LENS, LENS), told, noisy[0][seen], noisy[1][seen])


@given(st.floats(-2.0, 2.0), st.integers(0, 100))
def test_the_turn_of_a_camera_is_found_to_a_tenth_of_a_degree(degrees: float, seed: int) -> None:
    fit = TurnFit.of([matched(about_y(degrees) @ BESIDE, BESIDE, 0.1, seed)])
    assert fit is not None
    assert np.degrees(fit.angle) == pytest.approx(-degrees, abs=0.15)  # about the axis upwards
    assert abs(fit.angle + np.radians(degrees)) < 5.0 * fit.sigma
    assert fit.best_px <= fit.given_px + 0.02


@given(st.integers(0, 100), st.floats(0.0, 0.5))
def test_noise_alone_is_no_turn(seed: int, noise_px: float) -> None:
    fit = TurnFit.of([matched(BESIDE, BESIDE, noise_px, seed)])
    assert fit is not None and not fit.is_turned


@given(st.integers(0, 20), st.sampled_from([0.0, 0.7, 1.5]))
def test_cameras_one_above_the_other_are_compared_as_those_side_by_side(
    seed: int, degrees: float
) -> None:
    above = Pose.from_parts((0.0, -0.1, 0.0), (1.0, 0.0, 0.0, 0.0))
    turn = Pose.exp([0.0, 0.0, 0.0, np.radians(degrees), 0.0, 0.0])
    fit = TurnFit.of([matched(turn @ above, above, 0.05, seed)])
    assert fit is not None and fit.is_turned == (degrees > 0.0)
    assert abs(np.degrees(fit.angle)) == pytest.approx(degrees, abs=0.15)


def bent(pair: MatchedFeatures, distortion: float) -> MatchedFeatures:
    """Return the same as two lenses with a distortion show it."""

    def shown(pixels: NDArray[np.float64]) -> NDArray[np.float64]:
        places = (pixels - CENTER_PX) / FOCAL_PX
        square = np.square(places).sum(axis=1)[:, None]
        return FOCAL_PX * places * (1.0 + distortion * square) + CENTER_PX

    return replace(pair, first_px=shown(pair.first_px), second_px=shown(pair.second_px))


@given(st.floats(-0.2, 0.2), st.integers(0, 100))
def test_a_distortion_that_is_not_in_the_calibration_is_no_turn(
    distortion: float, seed: int
) -> None:
    fit = TurnFit.of([bent(matched(BESIDE, BESIDE, 0.1, seed), distortion)])
    assert fit is None or not (fit.is_turned or fit.is_surely_turned)
    # Features of 0.1 px show it to 0.07 degrees, beside a distortion: the worst seed has 0.302.
    assert fit is None or abs(np.degrees(fit.bent_angle)) < 0.35


def test_a_turn_or_a_distortion_are_both_named_where_either_may_be_meant() -> None:
    fit = TurnFit.of([bent(matched(BESIDE, BESIDE, 0.02, 0), -0.12)])
    assert fit is not None and fit.is_turned_or_bent
    assert "or the lenses have a distortion" in fit.note(("left", "right"))
    right = TurnFit.of([matched(about_y(1.0) @ BESIDE, BESIDE, 0.02, 0)])
    assert right is not None and "distortion" not in right.note(("left", "right"))


def turned(degrees: float) -> NDArray[np.float64]:
    pose = about_y(degrees).matrix().copy()
    pose[0, 3] = 0.1
    return pose


@pytest.mark.parametrize("is_measured", [True, False])
@pytest.mark.parametrize("degrees", [0.0, 0.4, 0.8, -1.2, 3.0, -6.0])
def test_a_pair_whose_calibration_is_stale_is_refuted_and_the_angle_told(
    degrees: float, is_measured: bool, tmp_path: Path
) -> None:
    capture = write_pair(tmp_path, turned(degrees), turned(0.0))
    capture = replace(capture, measured=is_measured)
    assert is_refuted(capture) == (abs(degrees) > 0.5)
    for doubt in (doubt_calibration(capture), doubt_for_model(capture)):
        assert (doubt is None) == (degrees == 0.0)
        assert doubt is None or f"turned by {abs(degrees)} degrees" in doubt


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.0, 0.0, -0.1)])
def test_cameras_at_one_place_or_one_behind_the_other_show_no_turn(
    shift: tuple[float, float, float],
) -> None:
    told = Pose.from_parts(shift, (1.0, 0.0, 0.0, 0.0))
    assert TurnFit.of([matched(told, told, 0.1, 0)]) is None


def test_of_cameras_that_look_towards_each_other_a_wrong_focal_length_is_no_turn(
    tmp_path: Path,
) -> None:
    capture = write_pair(tmp_path, turned(-5.0))
    wrong = replace(
        capture,
        cameras=tuple(
            replace(one, lens=with_focal_share(one.lens, 0.9)) for one in capture.cameras
        ),
    )
    assert "fit a focal length" in str(doubt_calibration(wrong))
    assert not is_refuted(wrong)
