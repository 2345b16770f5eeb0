"""From which sides an object was seen, and how far it turned: laws of what the report shows."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from track_histories import AHEAD, history_of, track_of, turned

from servoid.pose import Pose
from servoid.view.track.sides import SEEN_WITHIN, Sides, all_directions, sides_of
from servoid.view.track.turning import Cause, turning_of
from servoid.view.track.turning_plot import drift_before

ESTIMATE = Path(__file__).parents[3] / "crates" / "servoid" / "src" / "track" / "estimate.rs"
UPRIGHT = np.array([0.0, -1.0, 0.0])  # up in the camera's frame
STEP = float(np.radians(2.5))
AXES = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1)


def unit(axis: tuple[float, ...] | NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(axis) / np.linalg.norm(axis)


def spin(angles: NDArray[np.floating], axis: NDArray[np.float64] = UPRIGHT) -> list[Pose]:
    return [turned(angle * axis) for angle in angles]


def sides(poses: list[Pose], **options: object) -> Sides:
    return sides_of(track_of(poses), history_of(len(poses), **options))  # type: ignore


WHOLE = np.arange(0.0, 2.0 * np.pi + STEP, STEP)


def test_a_still_object_shows_a_cap_of_its_sides() -> None:
    share = sides([turned((0.3, -0.4, 1.0))] * 5).share
    assert share == pytest.approx((1.0 - np.cos(SEEN_WITHIN)) / 2.0, abs=0.003)


@pytest.mark.parametrize("lean", [0.0, 0.4, 2.5])
def test_a_whole_turn_shows_the_band_of_its_sides_about_the_axis(lean: float) -> None:
    across = np.array([np.sin(lean), np.cos(lean), 0.0])
    share = sides(spin(WHOLE, across)).share
    assert share == pytest.approx(np.sin(SEEN_WITHIN), abs=0.01)


def test_a_whole_turn_shows_more_than_half_a_turn_and_that_more_than_none() -> None:
    shares = [sides(spin(most * WHOLE)).share for most in (0.0, 0.5, 1.0)]
    assert shares[0] < shares[1] - 0.1 < shares[2] - 0.2


def test_cameras_around_an_object_at_rest_show_what_one_shows_of_one_that_turns() -> None:
    center = Pose.from_parts((0.0, 0.0, AHEAD), (1.0, 0.0, 0.0, 0.0))
    around = [
        (center @ Pose.exp([0.0, 0.0, 0.0, *(-angle * UPRIGHT)]) @ center.inverse(),)
        for angle in WHOLE
    ]
    seen = sides([turned((0.0, 0.0, 0.0))] * len(WHOLE), world_from_camera=around)
    np.testing.assert_allclose(seen.directions, sides(spin(WHOLE)).directions, atol=1e-9)


def test_what_is_not_tracked_and_what_delivers_no_image_shows_no_side() -> None:
    poses = spin(WHOLE)
    lost = track_of(poses, lambda place: {"status": "lost" if place else "tracking"})
    assert len(sides_of(lost, history_of(len(poses))).times) == 1
    nothing = track_of(poses, lambda _: {"status": "searching"})
    assert sides_of(nothing, history_of(len(poses))).share == 0.0
    half = np.ones((len(poses), 1), np.bool_)
    half[::2] = False
    assert sides(poses, delivered=half).times.tolist() == [
        one.estimate.time_s for one in track_of(poses)[1::2]
    ]


@pytest.mark.parametrize(
    ("axis", "expected"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        ((0.0, -1.0, 0.0), (-1.0, 0.0, 0.0)),  # what was to the left comes to the front
        ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ],
)
def test_sides_are_named_as_the_first_camera_saw_them_first(
    axis: tuple[float, ...], expected: tuple[float, ...]
) -> None:
    first = turned((0.4, 1.0, -0.2))
    quarter = Pose.exp([0.0, 0.0, 0.0, *(np.pi / 2.0 * np.array(axis))])
    center = Pose.from_parts(first.translation, (1.0, 0.0, 0.0, 0.0))
    then = center @ quarter @ center.inverse() @ first
    np.testing.assert_allclose(sides([first, then]).directions[1], expected, atol=1e-9)


def test_all_directions_stand_for_equal_areas() -> None:
    faces = all_directions(4000)
    np.testing.assert_allclose(np.linalg.norm(faces, axis=1), 1.0, atol=1e-12)
    for axis in np.random.default_rng(0).normal(size=(20, 3)):
        for height in (-0.5, 0.0, 0.8):
            share = (faces @ unit(axis) > height).mean()
            assert share == pytest.approx((1.0 - height) / 2.0, abs=0.005)


@given(AXES, st.floats(0.02, 0.1), st.integers(2, 200))
def test_the_angle_turned_of_a_known_motion_is_that_motion(
    axis: tuple[float, ...], step: float, count: int
) -> None:
    poses = spin(step * np.arange(count), unit(axis))
    turning = turning_of(track_of(poses), history_of(count).world_from_camera)
    np.testing.assert_allclose(turning.turned, step * np.arange(count), atol=1e-6)


def test_a_turn_and_back_adds_up_and_the_angle_from_the_first_view_returns() -> None:
    there = STEP * np.arange(68)
    angles = np.concatenate([there, there[::-1]])
    poses = spin(angles)
    turning = turning_of(track_of(poses), history_of(len(poses)).world_from_camera)
    assert turning.turned[-1] == pytest.approx(2.0 * there[-1], abs=np.radians(6.0))
    assert (np.diff(turning.turned) >= 0.0).all()
    np.testing.assert_allclose(turning.away, angles, atol=1e-6)


def test_the_noise_of_poses_at_rest_does_not_add_up() -> None:
    random = np.random.default_rng(1)
    poses = [turned(np.radians(random.normal(0.0, 0.3, 3))) for _ in range(400)]
    turning = turning_of(track_of(poses), history_of(400).world_from_camera)
    assert np.degrees(turning.turned[-1]) < 3.0


def test_a_camera_that_turns_with_the_object_sees_no_turn() -> None:
    poses = spin(WHOLE)
    behind = turned((0.0, 0.0, 0.0)).inverse()
    with_it = [(pose @ behind,) for pose in poses]
    turning = turning_of(track_of(poses), with_it)
    assert turning.turned[-1] < 1e-6


def test_where_it_is_not_located_the_angle_stays_and_is_made_up_for_after() -> None:
    poses = spin(STEP * np.arange(40))
    track = track_of(poses, lambda place: {"status": "lost" if 10 <= place < 30 else "tracking"})
    turning = turning_of(track, history_of(40).world_from_camera)
    assert np.ptp(turning.turned[9:30]) == 0.0
    assert turning.turned[-1] == pytest.approx(39 * STEP, abs=1e-6)


def test_the_plot_of_drift_has_one_entry_an_observation() -> None:
    def values(place: int) -> dict[str, object]:
        known = {"evidence": {"drift_rad": 0.01 * place}} if place != 3 else {}
        return {**known, "covariance": np.diag([1.0] * 3 + [1e-4, 4e-4, 9e-4])}

    turning = turning_of(track_of(spin(WHOLE), values), history_of(len(WHOLE)).world_from_camera)
    for values in (turning.turned, turning.away, turning.drift, turning.deviation):
        assert values.shape == (len(WHOLE),)
    assert np.flatnonzero(np.isnan(turning.drift)).tolist() == [3]
    assert turning.drift[10] == pytest.approx(0.1)
    np.testing.assert_allclose(turning.deviation, 0.03)


def test_a_correction_is_marked_at_the_drift_that_was_told_last() -> None:
    drifts = [0.0, 0.1, 0.5, np.nan, 0.2]

    def values(place: int) -> dict[str, object]:
        lost = {"status": "lost"} if place == 2 else {}
        return {**lost, "evidence": {"drift_rad": drifts[place]}}

    turning = turning_of(track_of(spin(WHOLE[:5]), values), history_of(5).world_from_camera)
    np.testing.assert_allclose(np.radians(drift_before(turning)), [0.0, 0.0, 0.1, 0.1, 0.1])


def test_a_covariance_that_is_open_has_no_deviation() -> None:
    track = track_of(spin(WHOLE[:2]), lambda _: {"covariance": np.full((6, 6), np.inf)})
    assert np.isnan(turning_of(track, history_of(2).world_from_camera).deviation).all()


def test_corrections_are_read_from_the_notices() -> None:
    notices = {
        2: [f"{Cause.KNOWN_SIDE.value}: the rotation is corrected by 12.5 degrees"],
        4: [
            "camera left: too dark",
            f"{Cause.ADJUSTED.value}: the rotation is corrected by 0 degrees",
        ],
        5: [
            "a known side is hidden: the rotation is corrected by 3 degrees",
            "corrected by 4 degrees",
        ],
    }
    track = track_of(spin(WHOLE[:6]), lambda place: {"notices": notices.get(place, [])})
    found = turning_of(track, history_of(6).world_from_camera).corrections
    assert [(one.place, one.cause) for one in found] == [(2, Cause.KNOWN_SIDE), (4, Cause.ADJUSTED)]
    assert [np.degrees(one.angle) for one in found] == pytest.approx([12.5, 0.0])
    assert found[0].time_s == pytest.approx(0.2)


def test_the_words_of_corrections_are_those_of_the_tracker() -> None:
    source = ESTIMATE.read_text(encoding="utf-8")
    for cause in Cause:
        assert f'"{cause.value}: the rotation is corrected by {{degrees:.1}} degrees"' in source
