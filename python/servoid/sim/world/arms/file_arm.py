"""Builds an arm from an MJCF or URDF file, with a head of two cameras."""

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from servoid.config import ARM_FILE, REACH_M, TURN, implausible, read_bytes
from servoid.errors import SimError
from servoid.pose import exact
from servoid.sim.arm_file import EyeLimits
from servoid.sim.world.arms.file_looks import file_visuals
from servoid.sim.world.arms.file_notes import ENDLESS, mjcf_notes, urdf_notes
from servoid.sim.world.arms.head import add_head, head_visuals
from servoid.sim.world.arms.robot import HAND, JointServo, Robot
from servoid.sim.world.arms.urdf import Urdf, read_urdf
from servoid.sim.world.events.motions import compose, unit_row
from servoid.sim.world.scene.engine import load_mujoco
from servoid.sim.world.scene.solids import add_solids
from servoid.sim.world.settings import ArmSettings
from servoid.words import digits, in_one_line, measured

_MJCF, _URDF = "mujoco", "robot"  # root elements of such files
_SUFFIXES = (".xml", ".mjcf", ".urdf")
_XACRO = "{http://www.ros.org/wiki/xacro}"
_REACH = 0.1  # size of the post that carries the head, in m


def is_file_name(name: str) -> bool:
    """Return whether an arm's name refers to a file."""
    path = Path(name)
    return bool(path.suffix) or len(path.parts) > 1 or path.exists()


def build_file_arm(settings: ArmSettings, eyes: EyeLimits, lag_s: float) -> Robot:
    """Build the arm of a file: its revolute joints from the base to the mount are driven.

    Other joints, such as those of fingers, are fixed, and the file's own actuators are left out.

    Raises:
        SimError: the file is missing, malformed or of another kind, or does not contain the mount
            of the settings.

    """
    spec, urdf = _read(Path(settings.name))
    speeds = {} if urdf is None else urdf.speeds
    model = _compiled(spec, settings.name)
    for index, body in enumerate(spec.bodies):
        body.name = body.name or f"servoid body {index}"
    mount, place = _mount(spec, model, settings)
    joints = _chain(spec, mount, settings.name)
    _check_reach(model, mount, settings.name)
    home = _home(model, [joint.name for joint in joints])
    for joint in joints:
        is_off = urdf is None and joint.limited == load_mujoco().mjtLimited.mjLIMITED_FALSE
        if not is_off:
            _check_range(settings.name, model.joint(joint.name))
    if urdf is not None:
        _check_urdf(settings.name, urdf, model, joints)
    names = [joint.name for joint in joints]
    notes = (
        mjcf_notes(settings, model, names) if urdf is None else urdf_notes(settings, urdf, names)
    )
    servos = tuple(_servo(model, joint.name, settings, speeds, lag_s) for joint in joints)
    _strip(spec, {joint.name for joint in joints})
    looks = file_visuals(_compiled(spec, settings.name))
    row = compose(place, unit_row(settings.mount_from_hand))
    hand = mount.add_body(name=HAND, pos=row[4:].tolist(), quat=row[:4].tolist())
    hand.explicitinertial = True
    hand.mass, hand.inertia = 0.5, [1e-3] * 3
    turning = add_head(hand, eyes, settings.turning_eyes)
    head = head_visuals(eyes.half_baseline, _REACH)
    add_solids(spec, head)
    return Robot(
        spec=spec,
        visuals=(*looks, *head),
        servos=servos + turning,
        hand_count=len(servos),
        half_baseline=eyes.half_baseline,
        angles=home,
        notes=tuple(notes),
    )


def _read(path: Path) -> tuple[Any, Urdf | None]:
    """Return the `mujoco.MjSpec` of a file, and its further content if it is a URDF."""
    mujoco = load_mujoco()
    urdf = read_urdf(path) if _kind(path) == _URDF else None
    try:
        spec = (
            mujoco.MjSpec.from_file(str(path))
            if urdf is None
            else mujoco.MjSpec.from_string(urdf.text)
        )
    except ValueError as error:
        raise SimError(f"{path} cannot be read as an arm: {in_one_line(error)}") from error
    spec.compiler.fusestatic = False  # the mount may be a body without a joint
    return spec, urdf


def _kind(path: Path) -> str:
    """Return the root element of a file, one of those that can be read.

    Raises:
        SimError: it is another kind of file, or none.

    """
    if path.is_dir():
        raise SimError(f"{path} is a folder; give an arm's MJCF or URDF file in it")
    if not path.is_file():
        raise SimError(f"there is no file {path}; give an arm's MJCF or URDF file")
    if path.suffix.lower() == ".xacro":
        raise SimError(_of_xacro(path))
    if path.suffix.lower() not in _SUFFIXES:
        raise SimError(
            f"{path} is no arm's file by its name; give an MJCF file (.xml, .mjcf) or a URDF"
        )
    try:
        root = ElementTree.fromstring(read_bytes(path, SimError, ARM_FILE))
    except ElementTree.ParseError as error:
        raise SimError(f"{path} cannot be read as an arm: {in_one_line(error)}") from error
    if any(one.tag.startswith(_XACRO) for one in root.iter() if isinstance(one.tag, str)):
        raise SimError(_of_xacro(path))
    if root.tag not in (_MJCF, _URDF):
        raise SimError(
            f"{path} is a file of <{root.tag}>, which servoid does not read; give an arm's MJCF "
            "(<mujoco>) or URDF (<robot>)"
        )
    return root.tag


def _of_xacro(path: Path) -> str:
    return (
        f"{path} is a xacro file, of which a URDF is yet to be made; "
        f"run 'xacro {path.name} > arm.urdf' first (pip install xacrodoc brings it without ROS), "
        "and give that URDF"
    )


def _compiled(spec: Any, name: str) -> Any:
    try:
        return spec.compile()
    except ValueError as error:
        raise SimError(f"{name} cannot be used as an arm: {in_one_line(error)}") from error


def _mount(spec: Any, model: Any, settings: ArmSettings) -> tuple[Any, Any]:
    """Return the body that carries the hand, and the mount's pose on it, as a row (7,)."""
    name = settings.mount
    for site in spec.sites:
        if name is not None and site.name == name:
            found = model.site(name)
            return site.parent, unit_row((*found.quat, *found.pos))
    for body in spec.bodies[1:]:
        if body.name == name:
            return body, unit_row((1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    known = [one.name for one in (*spec.sites, *spec.bodies[1:]) if one.name]
    given = "arm.mount is not given" if name is None else f"unknown mount '{name}'"
    raise SimError(
        f"{settings.name}: {given}; name the site or body that carries the hand, one of "
        f"{', '.join(known)}"
    )


def _chain(spec: Any, mount: Any, name: str) -> list[Any]:
    """Return the joints from the base to the mount."""
    kinds = load_mujoco().mjtJoint
    joints: list[Any] = []
    body = mount
    while body is not None and body.name != spec.worldbody.name:
        joints = [*body.joints, *joints]
        body = body.parent
    for joint in joints:
        if joint.type != kinds.mjJNT_HINGE:
            raise SimError(
                f"{name}: joint '{joint.name}' between the base and the mount does not turn; "
                "servoid drives turning joints only"
            )
    if not joints or any(not joint.name for joint in joints):
        raise SimError(
            f"{name}: between the base and the mount there must be joints, each with a name; "
            f"there are {len(joints)}"
        )
    return joints


def _check_reach(model: Any, mount: Any, name: str) -> None:
    """Check that the links from the first joint to the mount are as long as an arm can be.

    Where the base stands in its file, far from the origin or not, is no part of them.
    """
    links, body = [], model.body(mount.name).id
    while body > 0:
        links.append(body)
        body = model.body_parentid[body]
    jointed = max(at for at, link in enumerate(links) if model.body_jntnum[link])
    reach = sum(exact.norm(model.body_pos[link]) for link in links[:jointed])
    absurd = implausible(f"{name}: the length of the arm from link to link", reach, REACH_M)
    if absurd is not None:
        raise SimError(f"{absurd} and so on in the file")


def _home(model: Any, joints: list[str]) -> tuple[float, ...]:
    """Return the angles of the file's first key frame, or its reference angles."""
    angles = model.key_qpos[0] if model.nkey else model.qpos0
    return tuple(float(angles[model.joint(name).qposadr[0]]) for name in joints)


def _check_range(name: str, joint: Any) -> None:
    """Refuse limits that MuJoCo would ignore, so that the joint would turn freely.

    A joint without limits has the range 0 to 0.
    """
    lower, upper = (float(limit) for limit in joint.range)
    if not (lower < upper or lower == upper == 0.0):
        raise SimError(
            f"{name}: joint '{joint.name}' has the lower limit {digits(lower)} and the upper limit "
            f"{digits(upper)}; the lower limit must be below the upper one, so correct the file"
        )


def _check_urdf(name: str, urdf: Urdf, model: Any, joints: list[Any]) -> None:
    """Refuse limits that are missing, equal or in degrees, and joints that follow others."""
    for joint in joints:
        leader = urdf.leaders.get(joint.name)
        if leader is not None:
            raise SimError(
                f"{name}: joint '{joint.name}' between the base and the mount follows "
                f"'{leader}' (<mimic>), and servoid drives each joint by itself; if it has a motor "
                "of its own, remove <mimic>, otherwise make the joint fixed or choose a mount "
                "before it"
            )
        if joint.name in urdf.endless:
            continue
        known = model.joint(joint.name)
        if known.range[0] == known.range[1] == 0.0:
            raise SimError(
                f"{name}: joint '{joint.name}' is revolute with limits of 0 and 0, or none, so "
                "that it cannot turn; write the lower and upper limits of the data sheet, or "
                'type="continuous" if it turns without an end, or type="fixed" if it is locked'
            )
        farthest = max((float(limit) for limit in known.range), key=abs)
        if abs(farthest) > TURN:
            raise SimError(
                f"{name}: joint '{joint.name}' has a limit of {digits(farthest)}, but limits of a "
                f"URDF are in radians (degrees were probably meant: {digits(farthest)} degrees are "
                f"{measured(math.radians(farthest))} rad); if it turns without an end, write "
                'type="continuous"'
            )


def _servo(
    model: Any, name: str, settings: ArmSettings, speeds: dict[str, float], lag_s: float
) -> JointServo:
    at = model.joint(name).id
    lower, upper = model.jnt_range[at] if model.jnt_limited[at] else (-ENDLESS, ENDLESS)
    return JointServo(
        joint=name,
        lower=float(lower),
        upper=float(upper),
        speed=min(settings.speed, speeds.get(name, settings.speed)),
        acceleration=settings.acceleration,
        torque=float(model.jnt_actfrcrange[at][1]) if model.jnt_actfrclimited[at] else math.inf,
        lag_s=lag_s,
    )


def _strip(spec: Any, driven: set[str]) -> None:
    """Remove everything that would move or hold the arm besides the servos."""
    for kind in ("keys", "sensors", "actuators", "equalities", "tendons", "excludes"):
        for one in list(getattr(spec, kind)):
            spec.delete(one)
    for joint in list(spec.joints):
        if joint.name not in driven:
            spec.delete(joint)
    spec.option.integrator = load_mujoco().mjtIntegrator.mjINT_EULER
