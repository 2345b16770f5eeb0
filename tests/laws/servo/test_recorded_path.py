"""An object follows a recorded path where it was tracked, and nowhere else."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from servo_trials import small_settings

from servoid.cli.servo.recorded_path import GivenPath, read_path
from servoid.errors import SimError, TrajectoryError
from servoid.pose import Pose
from servoid.record import Waypoint, write_trajectory


def given_path(folder: Path, statuses: list[str]) -> GivenPath:
    """Read a path of 10 mm a second whose poses are far away where they are not tracked."""
    points = []
    for second, status in enumerate(statuses):
        x = 0.01 * second if status == "tracking" else 3.0
        pose = Pose.from_parts((x, 0.0, 0.6), (1.0, 0.0, 0.0, 0.0))
        points.append(Waypoint(float(second), pose, status=status))
    write_trajectory(folder / "poses.csv", points)
    path = f"recorded:{folder / 'poses.csv'}"
    return read_path(small_settings({"world.object.path": path}))


def test_a_recorded_path_leads_over_poses_that_are_not_tracked(tmp_path: Path) -> None:
    given = given_path(tmp_path, ["tracking", "lost", "searching", "tracking", "tracking"])
    assert given.path is not None
    for time_s in np.linspace(0.0, 4.0, 9):
        expected = (0.01 * time_s, 0.0, 0.0)
        found = given.path.start_from_object(time_s).translation
        np.testing.assert_allclose(found, expected, atol=1e-12)
    (note,) = given.notes
    assert "poses.csv: 2 of 5 poses are searching or lost, and left out" in note


def test_a_path_that_is_tracked_throughout_has_no_note(tmp_path: Path) -> None:
    assert given_path(tmp_path, ["tracking"] * 3).notes == ()
    assert read_path(small_settings()) == GivenPath()


def test_a_path_with_fewer_than_two_tracked_poses_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TrajectoryError, match=r"poses\.csv: of 3 poses, 1 is tracking, and a path"):
        given_path(tmp_path, ["lost", "tracking", "searching"])
    with pytest.raises(SimError, match=r"poses\.csv: a recorded path needs two poses or more"):
        given_path(tmp_path, ["tracking"])
