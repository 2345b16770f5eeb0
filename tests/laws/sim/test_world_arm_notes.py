"""Laws of what is told of an arm's file that leaves something out, or is in another unit."""

import re
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from known_arms import UR5E
from test_world_other_arms import MJCF, URDF

from servoid.errors import SimError
from servoid.sim.world import ArmSettings, CameraSettings, ObjectSettings, World, WorldSettings

AHEAD = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1)


def notes_of(folder: Path, name: str, text: str, **arm: object) -> tuple[str, ...]:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    settings = ArmSettings(name=str(path), mount_from_hand=AHEAD, **arm)  # type: ignore[arg-type]
    return World(
        WorldSettings(
            arm=settings,
            object=ObjectSettings(name="ellipsoid"),
            background="plain",
            cameras=CameraSettings(size_px=(64, 48), samples=1, moments=1),
            ideal=True,
        )
    ).notes


def test_joints_of_an_mjcf_without_a_range_are_told_once(tmp_path: Path) -> None:
    told = notes_of(tmp_path, "six.xml", MJCF, mount="flange")
    assert [note.split(" no range")[0] for note in told] == ["six.xml gives j4, j6"]
    assert "360 degrees" in told[0]
    whole = MJCF.replace('axis="0 0 1"/>', 'axis="0 0 1" range="-170 170"/>')
    assert notes_of(tmp_path, "six.xml", whole, mount="flange") == ()


def test_ranges_of_an_mjcf_in_radians_that_are_read_as_degrees_are_told(tmp_path: Path) -> None:
    def in_radians(found: re.Match[str]) -> str:
        return f'range="{-float(found[1]) / 57.3:.3f} {float(found[1]) / 57.3:.3f}"'

    text = re.sub(r'range="-(\d+) \d+"', in_radians, MJCF)
    text = re.sub(r"<keyframe>.*</keyframe>", "", text, flags=re.DOTALL)
    (tiny,) = (
        note
        for note in notes_of(tmp_path, "six.xml", text, mount="flange", start=(0.0,) * 6)
        if "radian" in note
    )
    assert "the joints of six.xml turn by at most 2.967 degrees" in tiny
    assert '<compiler angle="radian"/>' in tiny


def test_a_velocity_in_degrees_is_told_and_the_arm_turns_no_faster_than_arm_speed(
    tmp_path: Path,
) -> None:
    text = UR5E.urdf.replace('velocity="3.14"', 'velocity="180"', 1)
    told = notes_of(tmp_path, "arm.urdf", text, mount="flange", start=UR5E.start)
    (note,) = (one for one in told if "velocity" in one)
    assert "the velocity of j1 in arm.urdf is 180 rad/s" in note and "3.14" in note
    assert note.endswith("at most it turns by 2 rad/s, as of arm.speed")


@pytest.mark.parametrize("kind", ["velocity", "effort"])
def test_a_negative_limit_of_a_urdf_is_refused(tmp_path: Path, kind: str) -> None:
    text = re.sub(rf'{kind}="', f'{kind}="-', URDF, count=1)
    with pytest.raises(SimError, match=rf"joint 'lift' has a limit of {kind} of -\d+; it holds"):
        notes_of(tmp_path, "two.urdf", text, mount="wrist")
