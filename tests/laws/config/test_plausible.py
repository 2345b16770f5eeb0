"""Lengths in millimetres where metres belong: they are refused, or reported where any unit can be.

What a length is taken for by each stage is tested beside it; here are the settings, the options and
the files.
"""

from pathlib import Path

import numpy as np
import pytest
from commands import Command

from servoid.config.plausible import FAR_M, NEAR_M, OBJECT_MOST_M, REACH_M, SQUARE_M, implausible
from servoid.errors import ScanError, ServoError, SimError
from servoid.pose import Pose
from servoid.scan.metres.board import parse_board
from servoid.scan.metres.scale import parse_baseline, parse_length
from servoid.shape import Body, save_body
from servoid.shape.bodies import body_size_note
from servoid.sim.trial import TrialSettings, changed
from servoid.sim.world import ArmSettings, Recorded, parse_path

SETTINGS = {
    "run.goal": ([0.0, -90.0, 545.0], "goal is -90 m, and more than 10 m .* write -0.09"),
    "run.start_offset": ([50.0, 0.0, 0.0], "start_offset is 50 m"),
    "world.arm.mount_from_hand": ([1.0, 0, 0, 0, 0, 0, 120], "mount_from_hand is 120 m, .* 0.12"),
    "world.arm.half_baseline": (60.0, "half_baseline is 60 m"),
    "world.arm.world_from_hand": ([1.0, 0, 0, 0, 500, 0, 300], "world_from_hand is 500 m"),
    "world.object.radii": ([50.0, 50.0, 100.0], "radii is 50 m"),
    "world.object.hand_from_object": ([1.0, 0, 0, 0, 0, -90, 545], "hand_from_object is -90 m"),
    "servo.safety.workspace_upper": ([1500.0, 1500.0, 2000.0], "workspace_upper is 1500 m"),
    "servo.safety.least_clearance": (15.0, "least_clearance is 15 m"),
    "servo.hand.linear_speed": (500.0, "linear_speed is 500 m/s, and more than 20 m/s .* 0.5"),
    "servo.safety.braking": (800.0, "braking is 800 m/s²"),
    "servo.look.nearest": (450.0, "nearest is 450 m"),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_a_setting_in_millimetres_is_refused(name: str) -> None:
    value, message = SETTINGS[name]
    with pytest.raises(ServoError, match=message):
        changed(TrialSettings(), {name: value}, "run.toml")


def test_settings_made_in_python_are_checked_as_well() -> None:
    with pytest.raises(SimError, match=r"half_baseline is 60 m, .* is not plausible; lengths are"):
        ArmSettings(half_baseline=60.0)
    ArmSettings(half_baseline=0.06)


def test_lengths_up_to_the_limits_are_taken() -> None:
    for limit in (FAR_M, NEAR_M, OBJECT_MOST_M, REACH_M, SQUARE_M):
        assert implausible("it", limit, limit) is implausible("it", -limit, limit) is None
        assert implausible("it", -1.001 * limit, limit) is not None


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("hand.linear_speed", 500.0, "speeds are in metres per second: if .* second, write 0.5"),
        ("target.linear_speed", 1000.0, "100 m/s .* speeds are in .* per second, write 1$"),
        ("safety.braking", 800.0, "accelerations are in .* millimetres per second squared, write"),
    ],
)
def test_a_speed_in_millimetres_gets_the_advice_of_a_speed(
    name: str, value: float, words: str
) -> None:
    with pytest.raises(ServoError, match=words) as refused:
        changed(TrialSettings(), {f"servo.{name}": value}, "run.toml")
    assert "length" not in str(refused.value)


def test_a_path_in_millimetres_is_refused() -> None:
    with pytest.raises(SimError, match=r"'line:200@5s' is 200 m, .* write 0.2"):
        parse_path("line:200@5s")
    poses = [Pose.from_parts([x, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]) for x in (400.0, 480.0)]
    with pytest.raises(SimError, match="the farthest point of a recorded path is 80 m"):
        Recorded([0.0, 1.0], poses)


def test_a_scale_in_millimetres_is_refused() -> None:
    with pytest.raises(ScanError, match=r"a board's square is 30 m, .* write 0.03"):
        parse_board("7x5,30")
    with pytest.raises(ScanError, match=r"the length of '1:1,2,3,4=120' is 120 m, .* write 0.12"):
        parse_length("1:1,2,3,4=120")
    with pytest.raises(ScanError, match="the baseline of '1,2=300' is 300 m"):
        parse_baseline("1,2=300")


@pytest.mark.parametrize("command", ["model", "track"])
def test_a_distance_in_millimetres_is_a_wrong_option(
    command: str, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    out = tmp_path / ("b.json" if command == "model" else "p.csv")
    ended = servoid_command(command, drawn_capture, "--distance", "414", "--out", out)
    assert ended.code == 2
    assert "distance is 414 m, and more than 100 m is not plausible" in ended.err


def test_a_baseline_in_millimetres_is_a_wrong_option(
    tmp_path: Path, servoid_command: Command
) -> None:
    options = ("--fov", 60, "--baseline", 60, "--out", tmp_path / "p.csv")
    ended = servoid_command("track", "l.mp4+r.mp4", *options)
    assert ended.code == 2 and "--baseline is 60 m, and more than 10 m" in ended.err


def test_a_body_in_millimetres_is_used_and_doubted(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    for radius, is_noted in ((0.05, False), (50.0, True)):
        body = Body(
            world_from_object=Pose.identity(),
            centers=np.zeros((1, 3)),
            radii=np.array([[radius, radius, 2.0 * radius]]),
            rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
        )
        save_body(tmp_path / "body.json", body)
        ended = servoid_command("export", tmp_path / "body.json", "--out", tmp_path / "body.obj")
        note = "note  the body is 200 m large; if its unit is the millimetre, scale it by 0.001"
        assert ended.code == 0 and (note in ended.out) == is_noted
    options = ("--body", tmp_path / "body.json", "--out", tmp_path / "p.csv")
    ended = servoid_command("track", drawn_capture, *options)
    assert "the body is 200 m large" in " ".join(ended.out.split())


def test_a_body_is_as_large_as_its_longest_side() -> None:
    turn = Pose.exp([0.0, 0.0, 0.0, 0.3, -0.5, 0.9])
    radii = np.array([1.0, 3.0, 8.0])
    body = Body(
        world_from_object=Pose.identity(),
        centers=np.zeros((1, 3)),
        radii=radii[None],
        rotations=np.array([turn.quaternion]),
    )
    ways = np.random.default_rng(0).normal(size=(200_000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    points = (radii * ways) @ turn.matrix()[:3, :3].T
    said = body_size_note(body)
    assert said is not None
    assert float(said.split()[3]) == pytest.approx(np.ptp(points, axis=0).max(), rel=1e-3)
