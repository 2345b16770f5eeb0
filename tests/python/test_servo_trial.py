from pathlib import Path

import numpy as np
import pytest

from servoid.study import ServoTrial, TrialSettings, changed, run_servo_trial

SMALL = {
    "world.background": "plain",
    "world.cameras.size_px": (320, 240),
    "world.cameras.samples": 1,
    "world.cameras.moments": 1,
    "servo.look.count": 3,
    "run.max_ellipsoids": 2,
    "run.seconds": 0.1,
}


def test_the_tracker_is_given_as_many_images_as_must_agree(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    values = SMALL | {"servo.look.count": 1, "servo.safety.resume_after": 90}
    trial = run_servo_trial(changed(TrialSettings(), values, "test"), tmp_path)
    assert trial.log.rows[0].time_s > 3.0  # 91 images


def test_places_that_the_hand_did_not_reach_in_time_are_told(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    values = SMALL | {"servo.look.patience_s": 0.2, "run.max_ellipsoids": 1}
    trial = run_servo_trial(changed(TrialSettings(), values, "test"), tmp_path)
    (note,) = [one for one in trial.meeting.all_notes if "not reached" in one]
    assert note.startswith("3 of 3 places, the start among them, were not reached within 0.2 s")


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_the_hand_is_back_where_it_began_when_servoing_begins(tmp_path: Path, law: str) -> None:
    pytest.importorskip("mujoco")
    trial: ServoTrial = run_servo_trial(
        changed(TrialSettings(), SMALL | {"servo.joints.law": law}, "test"), tmp_path
    )
    home, first = trial.meeting.world_from_hand, trial.log.rows[0]
    assert len(trial.meeting.looks) == 3
    np.testing.assert_allclose(
        first.world_from_hand.translation, home.translation, rtol=0.0, atol=0.015
    )
    # The way there was no detour that wound up the joints.
    assert np.abs(first.tick.state.positions).max() < np.radians(120.0)
