import pytest
from msgspec.structs import replace

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")
pytest.importorskip("daqp", reason="servoing within all limits needs daqp")

from scene_table import Scene
from scenes_bode import BODE_ALONE, MANY, bode_fed_forward, bode_fixed_eyes, bode_many, many

from servoid_experiments.bode.response import run_response

pytestmark = pytest.mark.extended

SEED = 1


@pytest.mark.parametrize("one", BODE_ALONE.values(), ids=BODE_ALONE)
def test_a_frequency_alone_is_answered_as_it_is_among_others(one: Scene) -> None:
    assert one.broken(SEED) == []


def test_the_same_case_gives_the_same_row() -> None:
    case = replace(MANY, seed=SEED)
    assert run_response(case) == many(SEED)


def test_recognition_is_right_when_it_is_taken_and_late_when_it_is_used() -> None:
    assert bode_many.broken(SEED, "seen error", "known late") == []


def test_feed_forward_takes_the_lag_away() -> None:
    assert bode_many.broken(SEED, "hand lag") == []
    assert bode_fed_forward.broken(SEED) == []


def test_fixed_cameras_look_where_the_hand_leads_them() -> None:
    assert bode_fixed_eyes.broken(SEED) == []


def test_limits_in_use_are_told() -> None:
    assert many(SEED).images == 60
    assert many(SEED).joint_speed_share > 0.0
    assert bode_many.broken(SEED, "joint speed", "limited") == []
