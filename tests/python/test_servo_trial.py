from pathlib import Path

import pytest
from scenes_servo import BACK, back_again, servo_back

from servoid.study import TrialSettings, changed, run_servo_trial

pytestmark = pytest.mark.extended


def test_the_tracker_is_given_as_many_images_as_must_agree(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    values = BACK | {"servo.look.count": 1, "servo.safety.resume_after": 90}
    trial = run_servo_trial(changed(TrialSettings(), values, "test"), tmp_path)
    assert trial.log.rows[0].time_s > 3.0  # 91 images


def test_places_that_the_hand_did_not_reach_in_time_are_told(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    values = BACK | {"servo.look.patience_s": 0.2, "run.max_ellipsoids": 1}
    trial = run_servo_trial(changed(TrialSettings(), values, "test"), tmp_path)
    (note,) = [one for one in trial.meeting.all_notes if "not reached" in one]
    assert note.startswith("3 of 3 places, the start among them, were not reached within 0.2 s")


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_the_hand_is_back_where_it_began_when_servoing_begins(tmp_path: Path, law: str) -> None:
    pytest.importorskip("mujoco")
    assert servo_back.beyond(back_again(0, tmp_path, law)) == []
