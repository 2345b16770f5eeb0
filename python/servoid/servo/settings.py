"""Declares the settings of servoing: each default once, with its unit and its effect."""

from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from msgspec import Meta

from servoid.config import (
    BRAKING,
    FAR_M,
    HAND_SPEED,
    NEAR_M,
    OBJECT_SPEED,
    Checked,
    Most,
    convert,
    read_toml,
)
from servoid.errors import ServoError

Triple = tuple[float, float, float]
_Corner = Annotated[Triple, Most(FAR_M)]
_Near = Most(NEAR_M)  # distances of the hand from the object and other parts
_Speed = Most(HAND_SPEED, "m/s")
_Braking = Most(BRAKING, "m/s²")


class JointLaw(Enum):
    """How a hand velocity becomes joint speeds."""

    QP = "qp"
    PAPER = "paper"


class GazeMode(Enum):
    """How the eyes move."""

    FIXATE = "fixate"
    PARALLEL = "parallel"


def _above(what: str) -> Meta:
    return Meta(gt=0, description=what)


def _from_0(what: str) -> Meta:
    return Meta(ge=0, description=what)


class _Settings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The base class of the settings of servoing."""

    REFUSAL = ServoError


class TargetSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the object's motion is filtered and predicted."""

    RENAMED = MappingProxyType({"oddness": "nis_gate"})

    use_covariance: Annotated[
        bool, Meta(description="weight estimates by the tracker's covariance, plus the noise")
    ] = True
    linear_noise: Annotated[float, _above("minimum noise of an estimated position, m")] = 0.0005
    angular_noise: Annotated[float, _above("minimum noise of an estimated rotation, rad")] = 0.005
    linear_rest: Annotated[
        float, _above("random walk of the position of an object at rest, m per root s")
    ] = 0.0003
    angular_rest: Annotated[float, _above("random walk of its rotation, rad per root s")] = 0.01
    linear_jerk: Annotated[float, _above("jerk of an object that moves, m/s² per root s")] = 6.0
    angular_jerk: Annotated[float, _above("its angular jerk, rad/s² per root s")] = 0.5
    going_s: Annotated[float, _above("time constant of its acceleration, s")] = 0.1
    turning_s: Annotated[float, _above("time constant of its angular acceleration, s")] = 0.5
    gliding_jerk: Annotated[
        float, _above("jerk of an object that moves smoothly, m/s² per root s")
    ] = 0.8
    rolling_jerk: Annotated[float, _above("its angular jerk, rad/s² per root s")] = 0.15
    gliding_s: Annotated[
        float, _above("time constant of its linear and angular acceleration, s")
    ] = 2.0
    period_s: Annotated[
        float, _from_0("period of an object that swings, s; 0: no period is known")
    ] = 0.0
    swinging_jerk: Annotated[float, _above("jerk of its swing, m/s² per root s")] = 0.1
    change_s: Annotated[
        float, _above("mean time between changes of rest, motion and smooth motion, s")
    ] = 2.0
    fading_s: Annotated[
        float, _above("time constant of the rotation error of doubtful estimates, s")
    ] = 15.0
    wrong_turn: Annotated[
        float, _above("standard deviation of the rotation error of a wrong pose, rad")
    ] = 1.0
    fresh: Annotated[
        float,
        Meta(gt=0, le=1, description="share of the variance that is independent in each image"),
    ] = 0.11
    nis_gate: Annotated[
        float,
        _above(
            "normalised innovation squared (NIS, 3 values) above which an outlier is down-weighted"
        ),
    ] = 16.0
    compensate: Annotated[
        bool, Meta(description="predict the pose from the time of the image to the present")
    ] = True
    horizon_s: Annotated[float, _from_0("how far ahead motion is extrapolated, s")] = 0.25
    linear_speed: Annotated[
        float, Most(OBJECT_SPEED, "m/s"), _above("maximum speed of the object, m/s")
    ] = 1.0
    angular_speed: Annotated[float, _above("its maximum angular speed, rad/s")] = 6.0
    linear_jump: Annotated[float, _Near, _above("largest credible position error, m")] = 0.03
    angular_jump: Annotated[float, _above("largest credible rotation error, rad")] = 0.5
    agreeing: Annotated[
        int, Meta(ge=1, description="consecutive estimates that confirm a jump of the object")
    ] = 5


class HandSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the hand closes in on its goal."""

    position_gain: Annotated[float, _above("K_Pp of the position error, 1/s")] = 4.0
    position_rate_gain: Annotated[float, _from_0("K_Vp of its rate of change")] = 0.1
    turn_gain: Annotated[float, _above("K_Po of the quaternion error, 1/s")] = 8.0
    turn_rate_gain: Annotated[float, _from_0("K_Vo of its rate of change")] = 0.1
    feed_forward: Annotated[bool, Meta(description="add the goal's estimated velocity")] = True
    sure_speed: Annotated[
        float, _above("standard deviation of that velocity above which less is added, m/s")
    ] = 0.5
    sure_turning: Annotated[float, _above("the same for the angular velocity, rad/s")] = 0.5
    lead_s: Annotated[
        float, _from_0("lead of the fed-forward velocity, for the joints' lag, s")
    ] = 0.02
    linear_speed: Annotated[float, _Speed, _above("maximum speed of the hand, m/s")] = 0.5
    angular_speed: Annotated[float, _above("maximum angular speed of the hand, rad/s")] = 1.5
    linear_acceleration: Annotated[float, _above("maximum of the hand, m/s²")] = 2.0
    angular_acceleration: Annotated[float, _above("maximum of the hand, rad/s²")] = 8.0
    speed_share: Annotated[
        float, Meta(gt=0, le=1, description="share of the hand's speed limits to use")
    ] = 0.95
    acceleration_share: Annotated[
        float, Meta(gt=0, le=1, description="share of its acceleration limits to use")
    ] = 0.9


class JointSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a hand velocity becomes joint speeds."""

    law: Annotated[
        JointLaw,
        Meta(
            description="how a hand velocity becomes joint speeds: qp, within all limits, or "
            "paper, by its pseudo-inverse and feedback"
        ),
    ] = JointLaw.QP
    feedback_gain: Annotated[float, _from_0("k_p of the paper's joint feedback, 1/s")] = 1.0
    newton_steps: Annotated[
        int, Meta(ge=1, description="Newton steps of the paper's inverse kinematics each period")
    ] = 3
    angular_weight: Annotated[
        float, _above("metres that weigh as much as a radian of the hand's rotation")
    ] = 0.3
    damping: Annotated[float, _from_0("maximum damping at a singular pose, m/s per rad/s")] = 0.05
    damped_below: Annotated[
        float, _above("singular value below which damping acts, m/s per rad/s")
    ] = 0.05
    posture_gain: Annotated[
        float, _from_0("gain of the null-space motion towards the first posture, 1/s")
    ] = 0.5
    speed_share: Annotated[
        float, Meta(gt=0, le=1, description="share of the joints' speed limits to use")
    ] = 0.95
    acceleration_share: Annotated[
        float, Meta(gt=0, le=1, description="share of the joints' acceleration limits to use")
    ] = 0.9
    ramp_s: Annotated[
        float, _above("minimum time for a joint's acceleration to rise from 0 to its limit, s")
    ] = 0.04
    margin: Annotated[float, _from_0("distance kept from the joints' position limits, rad")] = 0.01
    reaction_s: Annotated[
        float, _from_0("time that joints may move on before they brake, their lag, s")
    ] = 0.03


class GazeSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the eyes turn."""

    mode: Annotated[
        GazeMode, Meta(description="fixate: each eye on the target; parallel: fixed, straight on")
    ] = GazeMode.FIXATE
    gain: Annotated[float, _above("gain of the angle errors, 1/s")] = 12.0
    rate_gain: Annotated[float, _from_0("gain of their rates of change")] = 0.1
    feed_forward: Annotated[
        bool, Meta(description="add the rates that the target's and the hand's motion require")
    ] = True


class SafetySettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """When the arm is held, and where it may not go."""

    least_confidence: Annotated[
        float, Meta(ge=0, le=1, description="confidence below which an estimate is not trusted")
    ] = 0.8
    coast_s: Annotated[
        float,
        _from_0("gap in trusted estimates to bridge, more than image delay plus interval, s"),
    ] = 0.25
    resume_after: Annotated[
        int, Meta(ge=1, description="consecutive trusted estimates before a held arm moves again")
    ] = 12
    resume_s: Annotated[float, _above("time for the hand to regain its full speed, s")] = 0.8
    rough: Annotated[
        float,
        _Near,
        _above("standard deviation of the goal's position above which it is reported, m"),
    ] = 0.025
    away: Annotated[
        float, _Near, _above("distance of the hand from its goal above which it is reported, m")
    ] = 0.025
    adrift: Annotated[
        float,
        _Near,
        _above(
            "shift of the goal by rotations that the filter has not followed, or has followed "
            "though uncertain, above which the arm is held, m"
        ),
    ] = 0.03
    calm_s: Annotated[
        float, _above("time below half of that shift before the arm moves again, s")
    ] = 2.0
    parted_s: Annotated[
        float,
        _above("duration of outliers that is reported; twice as long holds the arm, s"),
    ] = 0.5
    stale_s: Annotated[
        float, _above("time without a newer joint state before the arm is held, s")
    ] = 0.1
    joint_lag_s: Annotated[
        float,
        Meta(
            gt=0,
            le=2,
            description="time within which joints do what is commanded: latency of the joint "
            "states plus 2.5 time constants of the joints, s",
        ),
    ] = 0.35
    joint_share: Annotated[
        float,
        Meta(
            ge=0,
            lt=1,
            description="share of the commanded motion by which a joint's measured one may differ",
        ),
    ] = 0.4
    joint_off: Annotated[
        float, _above("further difference of both motions above which the arm is held, rad")
    ] = 0.02
    frozen_after: Annotated[
        int,
        Meta(ge=2, description="consecutive equal images of a moving camera that mean it hangs"),
    ] = 3
    frozen_shift: Annotated[
        float, _above("camera motion above which its image must change, m or rad")
    ] = 0.0005
    workspace_lower: Annotated[
        _Corner, Meta(description="lower corner of the box that the hand stays in, in the world, m")
    ] = (-1.5, -1.5, 0.05)
    workspace_upper: Annotated[_Corner, Meta(description="its upper corner, m")] = (1.5, 1.5, 2.0)
    least_distance: Annotated[
        float, _Near, _from_0("minimum between the hand's and the object's origins, m")
    ] = 0.2
    least_clearance: Annotated[
        float, _Near, _from_0("minimum between parts of an arm of known shape, and to the room, m")
    ] = 0.015
    braking: Annotated[
        float, _Braking, _above("deceleration towards walls, the object and other parts, m/s²")
    ] = 0.8


class LookSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the hand looks around an object before it is modelled."""

    count: Annotated[
        int,
        Meta(
            ge=1,
            description="viewpoints from which the hand looks at the object before it is modelled, "
            "the first one included; with 1 the hand stays where it is",
        ),
    ] = 5
    nearest: Annotated[
        float, _Near, _above("minimum distance of a viewpoint from the object, m")
    ] = 0.45
    farthest: Annotated[float, _Near, _above("maximum, where no nearer one can be reached, m")] = (
        0.8
    )
    widest_deg: Annotated[
        float, Meta(gt=0, le=90, description="maximum angle from the first viewpoint, degrees")
    ] = 60.0
    least_gain: Annotated[
        float, _from_0("share of the surface that a further viewpoint must newly show")
    ] = 0.02
    near: Annotated[
        float, _Near, _above("pose error below which the hand has arrived, m and rad")
    ] = 0.01
    still: Annotated[float, _above("speed of the hand below which it rests, m/s and rad/s")] = 0.02
    patience_s: Annotated[float, _above("time after which the hand looks from where it is, s")] = (
        8.0
    )


class ServoSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All settings of servoing, nested by stage."""

    look: LookSettings = LookSettings()
    target: TargetSettings = TargetSettings()
    hand: HandSettings = HandSettings()
    joints: JointSettings = JointSettings()
    gaze: GazeSettings = GazeSettings()
    safety: SafetySettings = SafetySettings()

    def __post_init__(self) -> None:
        """Check each value, and the values that depend on each other.

        Raises:
            ServoError: a value is out of range, a side of the workspace is empty, or viewpoints
                are nearer than the least distance.

        """
        super().__post_init__()
        look, least = self.look, self.safety.least_distance
        if not least < look.nearest <= look.farthest:
            raise ServoError(
                f"look.nearest is {look.nearest:g} m, look.farthest {look.farthest:g} m and "
                f"safety.least_distance {least:g} m; make nearest greater than least_distance and "
                "no greater than farthest"
            )
        box = (self.safety.workspace_lower, self.safety.workspace_upper)
        for axis, lower, upper in zip("xyz", *box, strict=True):
            if not lower < upper:
                raise ServoError(
                    f"workspace_lower is {lower:g} m in {axis} and workspace_upper {upper:g} m; "
                    "lower must be below upper"
                )


def settings_from(data: dict[str, Any], place: str, text: str = "") -> ServoSettings:
    """Convert parsed TOML to settings; `place` names the file, `text` is its content.

    Raises:
        ServoError: a key is unknown, or a value has the wrong type or range.

    """
    return convert(data, ServoSettings, place, ServoError, text)


def read_settings(path: str | Path) -> ServoSettings:
    """Read settings from a TOML file; keys that it leaves out keep their defaults.

    Raises:
        ServoError: the file cannot be read, or a key or value is invalid.

    """
    return read_toml(Path(path), ServoSettings, ServoError)
