import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from scenes_servo import IIWA, servo_iiwa, shipped_iiwa

from servoid.errors import SimError
from servoid.servo import Arm
from servoid.sim.arm_file import read_arm
from servoid.sim.world import ArmSettings, CameraSettings, ObjectSettings, World, WorldSettings
from servoid.sim.world.arms.file_arm import build_file_arm
from servoid.sim.world.scene.visuals import Visual

MJCF = """
<mujoco model="six">
  <compiler angle="degree"/>
  <default><joint damping="2" armature="0.01"/></default>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="base">
      <geom type="cylinder" size="0.08 0.05" pos="0 0 0.05" rgba="0.8 0.4 0.1 1"/>
      <body name="one" pos="0 0 0.1">
        <joint name="j1" axis="0 0 1" range="-170 170"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.2" size="0.06" rgba="0.8 0.4 0.1 1"/>
        <body name="two" pos="0 0 0.2">
          <joint name="j2" axis="0 1 0" range="-120 120"/>
          <geom type="capsule" fromto="0 0 0 0 0 0.4" size="0.05" rgba="0.8 0.4 0.1 1"/>
          <body name="three" pos="0 0 0.4">
            <joint name="j3" axis="0 1 0" range="-150 150"/>
            <geom type="capsule" fromto="0 0 0 0 0 0.35" size="0.04" rgba="0.8 0.4 0.1 1"/>
            <body name="four" pos="0 0 0.35">
              <joint name="j4" axis="0 0 1"/>
              <geom type="sphere" size="0.045"/>
              <body name="five">
                <joint name="j5" axis="0 1 0" range="-120 120"/>
                <geom type="box" size="0.03 0.03 0.04" pos="0 0 0.04"/>
                <body name="six" pos="0 0 0.08">
                  <joint name="j6" axis="0 0 1"/>
                  <geom type="ellipsoid" size="0.03 0.03 0.02"/>
                  <site name="flange" pos="0 0 0.02" euler="0 0 90"/>
                  <body name="finger" pos="0 0.03 0.02">
                    <joint name="grip" type="slide" axis="0 1 0" range="0 0.02"/>
                    <geom type="box" size="0.005 0.005 0.02" mass="0.05"/>
                  </body>
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator><position joint="j1" kp="5000"/><position joint="grip"/></actuator>
  <keyframe><key name="home" qpos="0 0.3 1.2 0 -0.1 0 0"/></keyframe>
</mujoco>
"""

URDF = """
<robot name="two">
  <link name="foot"/>
  <link name="arm">
    <inertial><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/>
      <origin xyz="0 0 0.2"/></inertial>
    <collision><origin xyz="0 0 0.2"/><geometry><box size="0.06 0.06 0.4"/></geometry></collision>
  </link>
  <link name="wrist">
    <inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="lift" type="revolute"><parent link="foot"/><child link="arm"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="90" velocity="2"/>
  </joint>
  <joint name="turn" type="revolute"><parent link="arm"/><child link="wrist"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="9" velocity="2"/>
  </joint>
</robot>
"""

CAMERAS = CameraSettings(size_px=(160, 120), samples=1, moments=1)


def written(folder: Path, name: str, text: str) -> str:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return str(path)


def make_world(**arm: object) -> World:
    return World(
        WorldSettings(
            arm=ArmSettings(**arm),  # pyright: ignore[reportArgumentType]
            object=ObjectSettings(name="ellipsoid"),
            background="plain",
            cameras=CAMERAS,
            ideal=True,
        )
    )


def rest(world: World, periods: int) -> None:
    for _ in range(periods):
        world.arm.command(np.zeros(len(world.arm.joints.names)))


@pytest.mark.parametrize("turning", [True, False])
def test_an_arm_of_an_mjcf_file_carries_the_eyes(tmp_path: Path, turning: bool) -> None:
    path = written(tmp_path, "six.xml", MJCF)
    world = make_world(name=path, mount="flange", turning_eyes=turning)
    joints = world.arm.joints
    eyes = ("tilt", "pan_left", "pan_right") if turning else ()
    assert isinstance(world.arm, Arm)
    assert joints.names == ("j1", "j2", "j3", "j4", "j5", "j6", *eyes)
    assert joints.hand_count == 6
    assert (world.arm.eyes is not None) == turning
    assert joints.upper[1] == pytest.approx(np.radians(120))
    start = world.arm.state().positions
    assert start[:6] == pytest.approx((0, 0.3, 1.2, 0, -0.1, 0))
    rest(world, 30)
    assert np.abs(world.arm.state().positions - start).max() < 1e-6
    assert world.source.newest() is not None
    for mask in world.masks():
        assert (mask > 0).sum() > 100


def test_the_joints_of_a_files_arm_follow_their_commands(tmp_path: Path) -> None:
    path = written(tmp_path, "six.xml", MJCF)
    world = make_world(name=path, mount="flange", lag_s=0.03)
    wanted = np.array([0.1, -0.1, 0.1, 0.1, 0.1, -0.1, 0.0, 0.0, 0.0])
    for _ in range(10):
        world.arm.command(wanted)
    share = 1.0 - np.exp(-0.08 / 0.03)
    assert np.abs(world.arm.state().velocities - share * wanted).max() < 2e-3


def test_the_hand_sits_on_the_mount_as_it_was_told(tmp_path: Path) -> None:
    path = written(tmp_path, "six.xml", MJCF)
    plain = make_world(name=path, mount="six")
    placed = make_world(name=path, mount="flange", mount_from_hand=(0, 1, 0, 0, 0.1, 0.2, 0.3))
    angles = np.linspace(-0.5, 0.5, 9)
    relation = plain.arm.world_from_hand(angles).inverse() @ placed.arm.world_from_hand(angles)
    # The site is turned by 90 degrees about z and 20 mm ahead.
    assert relation.translation == pytest.approx((-0.2, 0.1, 0.32), abs=1e-9)


def test_an_arm_of_six_joints_starts_with_its_hand_where_it_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, "six.xml", MJCF)
    wanted = (0.5, -0.5, -0.5, 0.5, -0.4, 0.05, 0.45)
    world = make_world(name=path, mount="flange", world_from_hand=wanted)
    hand = world.arm.world_from_hand(world.arm.state().positions)
    assert hand.translation == pytest.approx(wanted[4:], abs=1e-5)
    assert np.abs(hand.quaternion) == pytest.approx(np.abs(wanted[:4]), abs=1e-5)
    with pytest.raises(SimError, match="cannot start with its hand at"):
        make_world(name=path, mount="flange", world_from_hand=(1, 0, 0, 0, 3, 0, 0))


def test_why_an_arm_cannot_start_is_told(tmp_path: Path) -> None:
    wanted = (0.5, -0.5, -0.5, 0.5, -0.4, 0.05, 0.45)
    two = written(tmp_path, "two.urdf", URDF)
    with pytest.raises(SimError, match="it has 2 joints, and to take any pose an arm needs 6"):
        make_world(name=two, mount="wrist", world_from_hand=wanted)
    in_radians = re.sub(
        r'range="-(\d+) (\d+)"',
        lambda found: 'range="-{0} {0}"'.format(np.radians(float(found[1]))),
        MJCF.replace('name="j4"', 'name="j4" range="-3 3"').replace(
            'name="j6"', 'name="j6" range="-3 3"'
        ),
    )
    small = written(tmp_path, "small.xml", in_radians)
    with pytest.raises(SimError, match=r"turn by at most 2\.967 degrees.*<compiler angle"):
        make_world(name=small, mount="flange", world_from_hand=wanted)


def test_an_arm_of_an_urdf_file_can_be_driven(tmp_path: Path) -> None:
    world = make_world(name=written(tmp_path, "two.urdf", URDF), mount="wrist", start=(0.3, -0.2))
    assert world.arm.joints.names[:2] == ("lift", "turn")
    assert world.arm.joints.lower[:2] == pytest.approx((-1.0, -2.0))
    rest(world, 50)
    assert world.arm.state().positions[:2] == pytest.approx((0.3, -0.2), abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, ("arm.mount is not given", "flange", "six")),
        ({"mount": "hand"}, ("'hand'", "flange", "six")),
        ({"mount": "finger"}, ("'grip'", "turning joints only")),
        ({"mount": "base"}, ("there are 0",)),
        ({"mount": "flange", "start": (1.0,)}, ("1 angle;", "6 for the hand")),
    ],
)
def test_an_arm_that_cannot_be_used_is_refused(
    tmp_path: Path, changes: dict[str, object], words: tuple[str, ...]
) -> None:
    with pytest.raises(SimError) as caught:
        make_world(name=written(tmp_path, "six.xml", MJCF), **changes)
    assert [word for word in words if word not in str(caught.value)] == []


def test_a_file_that_is_none_or_no_arm_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SimError, match="there is no file"):
        make_world(name=str(tmp_path / "nothing.xml"), mount="a")
    with pytest.raises(SimError, match="cannot be read as an arm"):
        make_world(name=written(tmp_path, "bad.xml", "<mujoco><worldbody>"), mount="a")


def test_a_urdf_says_how_fast_its_joints_may_turn(tmp_path: Path) -> None:
    path = written(tmp_path, "two.urdf", URDF.replace('velocity="2"', 'velocity="0.7"', 1))
    assert make_world(name=path, mount="wrist").arm.joints.speed[:2] == pytest.approx((0.7, 2.0))
    slow = make_world(name=path, mount="wrist", speed=0.5)
    assert slow.arm.joints.speed[:2] == pytest.approx((0.5, 0.5))


@pytest.mark.parametrize(("lower", "upper"), [("1", "-1"), ("0.5", "0.5"), ("nan", "1")])
def test_a_joint_whose_lower_limit_is_not_below_its_upper_limit_is_refused(
    tmp_path: Path, lower: str, upper: str
) -> None:
    urdf = URDF.replace('lower="-1" upper="1"', f'lower="{lower}" upper="{upper}"')
    mjcf = MJCF.replace('range="-170 170"', f'range="{lower} {upper}"')
    assert mjcf != MJCF
    for path, mount, joint in (
        (written(tmp_path, "two.urdf", urdf), "wrist", "lift"),
        (written(tmp_path, "six.xml", mjcf), "flange", "j1"),
    ):
        said = f"joint '{joint}' has (the lower limit .* must be below|lower=\"nan\")"
        with pytest.raises(SimError, match=said):
            make_world(name=path, mount=mount)


def test_limits_that_an_mjcf_file_switches_off_are_not_read(tmp_path: Path) -> None:
    text = MJCF.replace('range="-170 170"', 'limited="false" range="1 -1"')
    arm = make_world(name=written(tmp_path, "six.xml", text), mount="flange").arm
    assert arm.joints.upper[0] == pytest.approx(2.0 * np.pi)


OBJ = """v 0 0 0
v 0.1 0 0
v 0 0.1 0
v 0 0 0.1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""


def in_a_package(folder: Path, mesh: str) -> str:
    """Write a URDF with a mesh as ROS packages hold them: urdf and meshes side by side."""
    for name in ("urdf", "meshes"):
        (folder / "two_support" / name).mkdir(parents=True)
    (folder / "two_support" / "meshes" / "arm.obj").write_text(OBJ)
    shape = f'<mesh filename="{mesh}"/>'
    drawn = '<visual><geometry><mesh filename="package://two_support/arm.dae"/></geometry></visual>'
    text = URDF.replace('<box size="0.06 0.06 0.4"/>', shape)
    text = text.replace("<collision>", f"{drawn}<collision>")
    return written(folder / "two_support" / "urdf", "two.urdf", text)


@pytest.mark.parametrize(
    "mesh",
    [
        "package://two_support/meshes/arm.obj",
        "package://another_name/meshes/arm.obj",
        "../meshes/arm.obj",
        "file://../meshes/arm.obj",
    ],
)
def test_the_meshes_of_a_urdf_are_found_as_ros_would(tmp_path: Path, mesh: str) -> None:
    world = make_world(name=in_a_package(tmp_path, mesh), mount="wrist")
    assert world.arm.joints.names[:2] == ("lift", "turn")


def test_the_meshes_of_a_urdf_are_found_where_it_tells_mujoco_that_they_are(tmp_path: Path) -> None:
    path = Path(in_a_package(tmp_path, "arm.obj"))
    extension = '<mujoco><compiler meshdir="../meshes"/></mujoco></robot>'
    path.write_text(path.read_text().replace("</robot>", extension))
    assert make_world(name=str(path), mount="wrist").arm.joints.names[:2] == ("lift", "turn")


def test_a_urdf_without_masses_and_solid_shapes_is_seen_and_driven(tmp_path: Path) -> None:
    text = re.sub(r"<inertial>.*?</inertial>", "", URDF, flags=re.DOTALL)
    path = written(tmp_path, "two.urdf", text.replace("collision>", "visual>"))
    world = make_world(name=path, mount="wrist", lag_s=0.03)
    for _ in range(20):
        world.arm.command(np.array([0.1, -0.1, 0.0, 0.0, 0.0]))
    assert world.arm.state().velocities[:2] == pytest.approx((0.1, -0.1), abs=3e-3)
    bare = text[: text.index("<collision>")] + text[text.index("</collision>") + 12 :]
    assert len(shapes(path)) == 1 + len(shapes(written(tmp_path, "bare.urdf", bare)))


def shapes(path: str) -> list[Visual]:
    """List what can be seen of a file's arm."""
    file = read_arm()
    settings = ArmSettings(name=path, mount="wrist")
    robot = build_file_arm(settings, file.eyes, file.joints.lag_s)
    return list(robot.visuals)


def test_a_mesh_that_is_missing_is_named(tmp_path: Path) -> None:
    path = in_a_package(tmp_path, "package://two_support/meshes/none.stl")
    with pytest.raises(
        SimError, match=r"two.urdf: the mesh package://two_.*none.stl was not found"
    ):
        make_world(name=path, mount="wrist")


def needs_iiwa() -> str:
    """Return where an iiwa is, or skip the test that asks for it."""
    path = shipped_iiwa()
    if path is None:
        pytest.skip("rtb-data, which ships a KUKA iiwa, is not installed")
    return path


def test_an_arm_that_a_package_ships_can_be_driven() -> None:
    world = make_world(name=needs_iiwa(), **IIWA)
    rest(world, 30)
    joints, hand = world.arm.joints, world.arm.world_from_hand(world.arm.state().positions)
    assert joints.names[:7] == tuple(f"joint_a{number}" for number in range(1, 8))
    assert joints.speed[3] == pytest.approx(1.3089)
    assert hand.translation == pytest.approx(IIWA["world_from_hand"][4:], abs=1e-5)
    assert world.source.newest() is not None
    assert all((mask > 0).sum() > 100 for mask in world.masks())


@pytest.mark.extended
def test_an_arm_that_a_package_ships_servos_to_an_object_that_it_met() -> None:
    needs_iiwa()
    # So coarse images tell a turn to half a degree, which is 5 mm at the hand.
    assert servo_iiwa.broken(0) == []
