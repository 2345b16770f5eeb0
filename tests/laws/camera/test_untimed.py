"""Laws of captures that know neither times nor a rate, by the command line."""

from pathlib import Path

import numpy as np
import pytest
from drawn_pairs import RADII, TURN, Pair
from recordings import run_servoid
from scipy.spatial.transform import Rotation

from servoid.pose import Pose
from servoid.record import read_trajectory
from servoid.shape import Body, save_body
from servoid.source import ASSUMED_HZ

FAST = Pair(centers=tuple((-0.03 + 0.012 * i, -0.008, 0.42) for i in range(6)))


def tracked(folder: Path, rate: str) -> tuple[str, str]:
    """Track a pair of which only `rate` says how fast it was recorded; return poses and summary."""
    folder.mkdir()
    capture = FAST.write(folder / "video")
    toml = capture / "capture.toml"
    text = toml.read_text().replace('[rig]\nposes = "poses.csv"\n', "")
    toml.write_text(text.replace("version = 1\n", f"version = 1\n{rate}\n"))
    (capture / "poses.csv").unlink()
    ball = Body(
        world_from_object=Pose.from_parts(FAST.centers[0], (1.0, 0.0, 0.0, 0.0)),
        centers=np.zeros((1, 3)),
        radii=RADII[None],
        rotations=Rotation.from_matrix(TURN).as_quat(scalar_first=True)[None],
    )
    save_body(folder / "ball.json", ball)
    output = run_servoid(folder, "track", "video", "--body", "ball.json", "--start", "body")
    return (folder / "poses.csv").read_text(), " ".join(output.split())


def test_a_capture_without_a_rate_is_tracked_as_at_the_rate_that_is_said(tmp_path: Path) -> None:
    known, words = tracked(tmp_path / "with", f"rate_hz = {ASSUMED_HZ}")
    unknown, output = tracked(tmp_path / "without", "")
    assert unknown == known
    assert f"{ASSUMED_HZ:g} observations per second are assumed" in output and "rate_hz" in output
    assert "assumed" not in words
    assert "time jumps" not in output
    points = read_trajectory(tmp_path / "without" / "poses.csv")
    assert [point.time_s for point in points] == pytest.approx([i / ASSUMED_HZ for i in range(6)])
    assert {point.status for point in points} == {"tracking"}
