from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scenes_servo import BACK, back_again, servo_back
from servo_trials import small_trial

from servoid.sim.trial import TrialSettings, changed, run_servo_trial

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
    (note,) = [one for one in trial.exploration.all_notes if "not reached" in one]
    assert note.startswith("3 of 3 viewpoints, including the start, were not reached within 0.2 s")


@pytest.mark.parametrize("law", ["qp", "paper"])
def test_the_hand_is_back_where_it_began_when_servoing_begins(tmp_path: Path, law: str) -> None:
    pytest.importorskip("mujoco")
    assert servo_back.beyond(back_again(0, tmp_path, law)) == []


def test_what_a_tracker_sees_while_it_searches_is_older(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    pytest.importorskip("daqp")
    hidden = {"type": "occlude", "at_s": 0.4, "seconds": 1.2}
    trial = small_trial(tmp_path, {"world.ideal": False, "world.faults": [hidden]})
    ages: dict[bool, list[float]] = {True: [], False: []}
    for before, after in pairwise([row for row in trial.log.rows if row.seen is not None]):
        assert before.seen is not None and after.seen is not None
        assert before.seen.estimate is not None
        tracking = before.seen.estimate.status == "tracking"
        ages[tracking].append(after.time_s - after.seen.instant.time_s)
    lab, latency_s = trial.settings.world.lab, trial.settings.world.cameras.latency_s
    stamp_s = 0.006  # by which time stamps may be off
    assert len(ages[True]) > 15 and len(ages[False]) > 15
    assert min(ages[True]) > latency_s + lab.track_s - stamp_s
    assert np.median(ages[True]) < latency_s + lab.track_s + 0.008 + stamp_s
    assert min(ages[False]) > latency_s + lab.search_s - stamp_s
