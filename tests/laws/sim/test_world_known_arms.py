"""Arms that laboratories have, and files that are none."""

import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from known_arms import PANDA, UR5E, KnownArm
from servo_loop import hand_shares_of
from servo_run import Run

from servoid.errors import SimError
from servoid.pose import exact
from servoid.servo import ORDINARY
from servoid.sim.world import ArmSettings, Teleport, World, WorldSettings

ARMS = pytest.mark.parametrize("known", [UR5E, PANDA], ids=lambda known: known.name)


def written(folder: Path, name: str, text: str) -> str:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def world_of(name: str, **arm: object) -> World:
    settings = ArmSettings(name=name, **arm)  # pyright: ignore[reportArgumentType]
    return World(WorldSettings(ideal=True, arm=settings, background="plain"))


@ARMS
def test_an_arm_stands_where_its_published_dimensions_put_it(
    tmp_path: Path, known: KnownArm
) -> None:
    path = written(tmp_path, "arm.urdf", known.urdf)
    arm = world_of(path, mount="flange", start=known.start).arm
    count = len(known.limits)
    assert arm.joints.hand_count == count
    np.testing.assert_allclose(arm.joints.lower[:count], [limit[0] for limit in known.limits])
    straight = {"ur": (-0.8172, -0.2329, 0.0628), "panda": (0.088, 0.0, 0.926)}[known.name]
    hand = arm.world_from_hand(np.zeros(len(arm.joints.names)))
    np.testing.assert_allclose(hand.translation, straight, atol=1e-9)


@ARMS
def test_the_hand_of_such_an_arm_follows(tmp_path: Path, known: KnownArm) -> None:
    path = written(tmp_path, "arm.urdf", known.urdf)
    run = Run(path="sine:0.05@8s", lost_s=(9.0, 9.0), arm=known.settings(path))
    log = run.run(4.0)
    errors = log.hand_errors[log.times > 2.0]
    assert exact.lengths(errors[:, :3]).max() < 2e-3
    reasons = set().union(*(row.tick.command.limiting for row in log.rows))
    assert not reasons - ORDINARY


@pytest.mark.extended
@pytest.mark.parametrize("arm", ["pa10", UR5E, PANDA], ids=["pa10", "ur", "panda"])
def test_a_hand_in_a_world_keeps_its_limits_after_leaps(
    tmp_path: Path, arm: str | KnownArm
) -> None:
    leaps = (
        Teleport(at_s=1.5, by=(0.12, 0.05, 0.0), turn=(0.0, 0.3, 0.0)),
        Teleport(at_s=4.0, by=(-0.1, 0.0, 0.1), turn=(0.3, -0.2, 0.2)),
    )
    settings = ArmSettings()
    if isinstance(arm, KnownArm):
        settings = arm.settings(written(tmp_path, "arm.urdf", arm.urdf))
    run = Run(path="sine:0.1@5s", lost_s=(3.0, 3.5), arm=settings, faults=leaps)
    log = run.run(6.5)
    commanded = np.array([row.tick.command.twist for row in log.rows])
    states = [row.tick.state for row in log.rows]
    went = np.array([run.world.arm.jacobian(one.positions) @ one.velocities for one in states])
    shares = hand_shares_of(commanded, went, run.world.arm.period_s)
    assert max(shares.values()) <= 1.0, shares
    assert any(row.tick.command.holding for row in log.rows)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("arm.urdf.xacro", "<robot/>", ("is a xacro file", "xacro arm.urdf.xacro > arm.urdf")),
        (
            "arm.urdf",
            '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arm/></robot>',
            ("is a xacro file",),
        ),
        ("arm.sdf", "<sdf/>", ("no arm's file by its name", "MJCF", "URDF")),
        ("arm.xml", "<sdf/>", ("a file of <sdf>", "<mujoco>", "<robot>")),
        ("arm.usd", "", ("no arm's file by its name",)),
        ("arm.xml", "<robot>", ("cannot be read as an arm",)),
    ],
)
def test_a_file_of_another_kind_is_refused_by_its_kind(
    tmp_path: Path, name: str, text: str, words: tuple[str, ...]
) -> None:
    with pytest.raises(SimError) as caught:
        world_of(written(tmp_path, name, text), mount="flange")
    assert [word for word in words if word not in str(caught.value)] == []


def test_names_that_are_no_arm_are_refused_with_those_that_are(tmp_path: Path) -> None:
    with pytest.raises(SimError, match=r"unknown arm 'ur5e'; choose pa10, or give the path"):
        world_of("ur5e")
    with pytest.raises(SimError, match=r"there is no file models/ur5e"):
        world_of("models/ur5e")
    with pytest.raises(SimError, match=r"is a folder; give an arm's MJCF or URDF file in it"):
        world_of(str(tmp_path))


def test_a_urdf_is_read_whatever_it_is_called(tmp_path: Path) -> None:
    path = written(tmp_path, "arm.xml", UR5E.urdf)
    assert world_of(path, mount="flange", start=UR5E.start).arm.joints.speed[0] == 2.0


def test_joints_without_an_effort_are_told(tmp_path: Path) -> None:
    text = UR5E.urdf.replace('effort="28.0"', 'effort="0"', 1).replace(' effort="28.0"', "", 1)
    world = world_of(written(tmp_path, "arm.urdf", text), mount="flange", start=UR5E.start)
    (note,) = world.notes
    assert "arm.urdf gives j4, j5 no effort, or 0: their torque is not limited" in note
    assert world_of("pa10").notes == ()


def test_joints_without_a_velocity_are_told(tmp_path: Path) -> None:
    text = UR5E.urdf.replace('velocity="3.14"', 'velocity="0"', 1).replace(
        ' velocity="3.14"', "", 1
    )
    path = written(tmp_path, "arm.urdf", text)
    world = world_of(path, mount="flange", start=UR5E.start, speed=1.5)
    (note,) = world.notes
    assert "arm.urdf gives j1, j2 no velocity, or 0: they turn by at most 1.5 rad/s" in note
    assert world.arm.joints.speed[:2] == pytest.approx(1.5)


def test_limits_in_degrees_are_refused_with_what_they_are_in_radians(tmp_path: Path) -> None:
    text = UR5E.urdf.replace('lower="-6.28" upper="6.28"', 'lower="-90" upper="170"', 1)
    path = written(tmp_path, "arm.urdf", text)
    with pytest.raises(SimError) as caught:
        world_of(path, mount="flange", start=UR5E.start)
    words = ("joint 'j1' has a limit of 170", "in radians", "170 degrees are 2.967 rad")
    assert [word for word in words if word not in str(caught.value)] == []
    endless = text.replace('type="revolute"', 'type="continuous"', 1)
    arm = world_of(written(tmp_path, "endless.urdf", endless), mount="flange", start=UR5E.start).arm
    assert arm.joints.upper[0] == pytest.approx(2.0 * np.pi)


def test_only_a_driven_joint_may_not_follow_another(tmp_path: Path) -> None:
    mimic = '<mimic joint="j1" multiplier="-1"/>'
    text = UR5E.urdf.replace("</joint>", f"{mimic}</joint>", 2).replace(mimic, "", 1)
    with pytest.raises(SimError, match=r"joint 'j2' between .* follows 'j1' \(<mimic>\).*remove"):
        world_of(written(tmp_path, "arm.urdf", text), mount="flange", start=UR5E.start)
    fingers = "".join(
        f'<link name="f{side}"><collision><geometry><box size="0.01 0.01 0.04"/></geometry>'
        f'</collision></link><joint name="f{side}" type="revolute"><parent link="flange"/>'
        f'<child link="f{side}"/><axis xyz="1 0 0"/>{follows}'
        '<limit lower="0" upper="60" velocity="0" effort="0"/></joint>'
        for side, follows in (("left", ""), ("right", '<mimic joint="fleft"/>'))
    )
    text = UR5E.urdf.replace("</robot>", f"{fingers}</robot>")
    world = world_of(written(tmp_path, "grip.urdf", text), mount="flange", start=UR5E.start)
    assert (world.arm.joints.hand_count, world.notes) == (6, ())


@ARMS
def test_an_arm_without_room_where_its_first_joint_is_0_starts_another_way(
    tmp_path: Path, known: KnownArm
) -> None:
    path = written(tmp_path, "arm.urdf", known.urdf)
    wanted = (0.5, -0.5, -0.5, 0.5, -0.4, 0.0, 0.5)
    arm = world_of(path, mount="flange", world_from_hand=wanted).arm
    place = arm.world_from_hand(arm.state().positions).translation
    assert place == pytest.approx(wanted[4:], abs=1e-5)


@ARMS
def test_an_arm_in_millimetres_is_refused(tmp_path: Path, known: KnownArm) -> None:
    text = re.sub(
        r'xyz="([^"]*)"/>(?=<axis)',
        lambda found: f'xyz="{" ".join(str(1000.0 * float(x)) for x in found[1].split())}"/>',
        known.urdf,
    )
    assert text != known.urdf
    path = written(tmp_path, "arm.urdf", text)
    with pytest.raises(SimError, match=r"arm.urdf: the length of the arm .* is \d+.* write \d\.\d"):
        world_of(path, mount="flange", start=known.start)


def test_an_arm_whose_base_stands_far_from_the_origin_of_its_file_is_no_long_arm(
    tmp_path: Path,
) -> None:
    first = re.search(r'xyz="([^"]*)"/>(?=<axis)', UR5E.urdf)
    assert first is not None
    x, *others = first[1].split()
    moved = f'xyz="{" ".join([str(float(x) + 60.0), *others])}"/>'
    text = UR5E.urdf[: first.start()] + moved + UR5E.urdf[first.end() :]
    arm = world_of(written(tmp_path, "arm.urdf", text), mount="flange", start=UR5E.start).arm
    usual = world_of(written(tmp_path, "usual.urdf", UR5E.urdf), mount="flange", start=UR5E.start)
    hands = [one.world_from_hand(one.state().positions).translation for one in (arm, usual.arm)]
    assert np.subtract(*hands) == pytest.approx([60.0, 0.0, 0.0], abs=1e-6)


NEEDED = re.compile(
    r"joint '(\w+)' needs ([\d.]+) N m to hold the ([\d.]+) kg that it carries, "
    r"but has ([\d.]+) N m"
)


def with_efforts(folder: Path, effort: float) -> World:
    text = re.sub(r'effort="[\d.]+"', f'effort="{effort}"', UR5E.urdf)
    return world_of(written(folder, "arm.urdf", text), mount="flange", start=UR5E.start)


def sinks(world: World) -> float:
    """Command the arm to rest, and return the greatest motion of a joint in half a second."""
    before = np.array(world.arm.state().positions)
    for _ in range(60):
        world.arm.command(np.zeros(len(world.arm.joints.names)))
    return float(np.abs(world.arm.state().positions - before).max())


def test_efforts_of_a_file_limit_the_torques(tmp_path: Path) -> None:
    speeds = []
    for effort in (150.0, 22.0):
        world = with_efforts(tmp_path, effort)
        for _ in range(4):
            world.arm.command(np.where(np.arange(len(world.arm.joints.names)) == 1, -1.0, 0.0))
        speeds.append(-world.arm.state().velocities[1])
    assert 0.0 < speeds[1] < 0.5 * speeds[0]


def test_motors_that_cannot_hold_the_arm_are_refused_and_stronger_ones_hold_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(SimError, match=r"arm.urdf: .* own weight where it starts: ") as caught:
        with_efforts(tmp_path, 1.0)
    found = NEEDED.search(str(caught.value))
    assert found is not None and (found[1], found[4]) == ("j2", "1")
    needed = float(found[2])
    assert sinks(with_efforts(tmp_path, 1.01 * needed)) < 1e-3
    with pytest.raises(SimError, match="own weight"):
        with_efforts(tmp_path, 0.99 * needed)
    monkeypatch.setattr("servoid.sim.world.world.check_strength", lambda *_: None)
    fallen = with_efforts(tmp_path, 0.5 * needed)
    assert sinks(fallen) > 0.1
    assert fallen.arm.state().stopped


def test_masses_in_grams_are_refused_unless_no_motor_has_a_limit(tmp_path: Path) -> None:
    inertial = (
        '<inertial><mass value="2300"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        '<origin xyz="0 0.1 0.1"/></inertial>'
    )
    text = UR5E.urdf.replace('<link name="ur3">', f'<link name="ur3">{inertial}')
    assert text != UR5E.urdf
    with pytest.raises(SimError, match=r"masses are in kg, and efforts .* in N m") as caught:
        world_of(written(tmp_path, "arm.urdf", text), mount="flange", start=UR5E.start)
    found = NEEDED.search(str(caught.value))
    assert found is not None and float(found[2]) > 150.0 and float(found[3]) > 2300.0
    free = written(tmp_path, "free.urdf", re.sub(r'effort="[\d.]+"', 'effort="0"', text))
    assert sinks(world_of(free, mount="flange", start=UR5E.start)) < 1e-3


@pytest.mark.parametrize("limits", ['lower="0" upper="0" ', ""])
def test_a_joint_that_is_locked_by_its_limits_is_refused(tmp_path: Path, limits: str) -> None:
    text = UR5E.urdf.replace('lower="-6.28" upper="6.28" ', limits, 1)
    assert text != UR5E.urdf
    with pytest.raises(SimError, match=r"joint 'j1' is revolute with limits of 0 and 0, or none"):
        world_of(written(tmp_path, "arm.urdf", text), mount="flange", start=UR5E.start)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name="j2"', 'name="j1"', "2 joints have the name 'j1'; give each its own"),
        ('upper="6.28"', 'upper="nan"', "joint 'j1' has upper=\"nan\"; write finite numbers"),
        (
            '<link name="ur0">',
            '<link name="ur0"><inertial><mass value="-2"/></inertial>',
            "link 'ur0' has a mass of -2 kg; a mass is positive",
        ),
    ],
)
def test_faults_in_a_urdf_are_told_with_their_place(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    text = UR5E.urdf.replace(old, new, 1)
    assert text != UR5E.urdf
    path = written(tmp_path, "arm.urdf", text)
    with pytest.raises(SimError) as caught:
        world_of(path, mount="flange", start=UR5E.start)
    assert str(caught.value).startswith(f"{path}: ") and words in str(caught.value)
