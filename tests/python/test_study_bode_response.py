import numpy as np
import pytest
from msgspec.structs import replace

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

from servoid.study.bode.response import ResponseCase, ResponseRow, run_response

MANY = ResponseCase(
    seed=1,
    feed_forward=False,
    eyes_follow=True,
    object="painted_ellipsoid",
    background="plain",
    base_hz=0.5,
    sideways_lines=(1, 3),
    depth_lines=(2,),
    speed=0.02,
    amplitude=0.02,
    run_in_s=3.0,
)


@pytest.fixture(scope="module")
def many() -> ResponseRow:
    return run_response(MANY)


def ratio(row: ResponseRow, signal: str, axis: str) -> np.ndarray:
    answer = row.answer(signal, axis)
    assert answer is not None
    return answer.ratio


@pytest.mark.parametrize(("axis", "lines", "place"), [("sideways", (3,), 1), ("depth", (2,), 0)])
def test_a_frequency_alone_is_answered_as_it_is_among_others(
    many: ResponseRow, axis: str, lines: tuple[int, ...], place: int
) -> None:
    other = {"sideways": "depth_lines", "depth": "sideways_lines"}[axis]
    quiet = replace(MANY, **{f"{axis}_lines": lines, other: (4,)})
    alone = run_response(quiet)
    for signal, least in (("seen", 0.04), ("known", 0.04), ("predicted", 0.06), ("gaze", 0.08)):
        one, among = ratio(alone, signal, axis)[0], ratio(many, signal, axis)[place]
        assert abs(one - among) < least * max(1.0, abs(one))
    # The hand swings with the noise of the object's turn, too.
    assert abs(ratio(alone, "hand", axis)[0] - ratio(many, "hand", axis)[place]) < 0.3


def test_the_same_case_gives_the_same_row(many: ResponseRow) -> None:
    assert run_response(MANY) == many


def test_recognition_is_right_when_it_is_taken_and_late_when_it_is_used(many: ResponseRow) -> None:
    for axis, hz in (("sideways", np.array([0.5, 1.5])), ("depth", np.array([1.0]))):
        assert np.abs(ratio(many, "seen", axis) - 1.0).max() < 0.04
        late_s = -np.angle(ratio(many, "known", axis)) / (2.0 * np.pi * hz)
        # The latency, and half the time between images and half a control period.
        # An error of 0.04 of the amplitude is one of 13 ms at half a hertz.
        np.testing.assert_allclose(late_s, 0.04 + 0.5 / 30.0 + 0.004, atol=0.013)


def test_feed_forward_takes_the_lag_away(many: ResponseRow) -> None:
    fed = run_response(replace(MANY, feed_forward=True))
    slow = [np.degrees(np.angle(ratio(row, "hand", "sideways")[0])) for row in (many, fed)]
    assert slow[0] < -25.0
    assert abs(slow[1]) < 10.0


def test_fixed_cameras_look_where_the_hand_leads_them() -> None:
    fixed = run_response(replace(MANY, eyes_follow=False))
    assert fixed.answer("gaze", "depth") is None
    both = [ratio(fixed, signal, "sideways")[0] for signal in ("gaze", "hand")]
    assert abs(both[0] - both[1]) < 0.2


def test_limits_in_use_are_told(many: ResponseRow) -> None:
    assert many.images == 60
    assert 0.0 < many.joint_speed_share < 0.5
    assert 0.0 <= many.limited_share < 0.1
