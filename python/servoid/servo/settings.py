"""How to servo: every default, once, with its unit and what it does."""

from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

from msgspec import Meta

from servoid.config.checked import Checked
from servoid.config.strict import convert, read_toml
from servoid.errors import ServoError, ServoidError

Triple = tuple[float, float, float]


class JointLaw(Enum):
    """How a hand velocity becomes joint speeds."""

    QP = "qp"
    PAPER = "paper"


class GazeMode(Enum):
    """What the eyes do."""

    FIXATE = "fixate"
    PARALLEL = "parallel"


def _above(what: str) -> Meta:
    return Meta(gt=0, description=what)


def _from_0(what: str) -> Meta:
    return Meta(ge=0, description=what)


class _Settings(Checked, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Is the base of settings of servoing."""

    def refusal(self, message: str) -> ServoidError:
        """Return the error that refuses a value."""
        return ServoError(message)


class TargetSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the motion of the object is filtered and predicted."""

    RENAMED = MappingProxyType({"oddness": "nis_gate"})

    use_covariance: Annotated[
        bool, Meta(description="weigh estimates by the tracker's covariance, beside the noise")
    ] = True
    linear_noise: Annotated[float, _above("least noise of an estimate's position, m")] = 0.0005
    angular_noise: Annotated[float, _above("least noise of an estimate's turn, rad")] = 0.005
    linear_rest: Annotated[
        float, _above("how far an object that rests may wander, m per root s")
    ] = 0.0003
    angular_rest: Annotated[float, _above("how far it may turn then, rad per root s")] = 0.01
    linear_jerk: Annotated[
        float, _above("how fast the acceleration of one that goes wanders, m/s² per root s")
    ] = 6.0
    angular_jerk: Annotated[float, _above("how fast its turning changes, rad/s² per root s")] = 0.5
    going_s: Annotated[float, _above("how long an acceleration lasts, s")] = 0.1
    turning_s: Annotated[float, _above("how long one of its turning lasts, s")] = 0.5
    gliding_jerk: Annotated[
        float, _above("the same of one that goes smoothly, m/s² per root s")
    ] = 0.8
    rolling_jerk: Annotated[float, _above("the same of its turning, rad/s² per root s")] = 0.15
    gliding_s: Annotated[
        float, _above("how long accelerations last of one that goes smoothly, s")
    ] = 2.0
    period_s: Annotated[
        float, _from_0("after which an object that swings is where it was, s; 0: none is known")
    ] = 0.0
    swinging_jerk: Annotated[
        float, _above("how fast the acceleration of its swing wanders, m/s² per root s")
    ] = 0.1
    change_s: Annotated[float, _above("how long an object rests, goes, or goes smoothly, s")] = 2.0
    fading_s: Annotated[float, _above("how long a turn stays wrong that the tracker doubts, s")] = (
        15.0
    )
    wrong_turn: Annotated[
        float, _above("turn by which a wrong pose errs, as a standard deviation, rad")
    ] = 1.0
    fresh: Annotated[
        float,
        Meta(gt=0, le=1, description="share of an estimate's variance that is new in each image"),
    ] = 0.11
    nis_gate: Annotated[
        float,
        _above(
            "normalised innovation squared (NIS, 3 values) beyond which an outlier loses weight"
        ),
    ] = 16.0
    compensate: Annotated[
        bool, Meta(description="move what images showed ahead by the time that has passed since")
    ] = True
    horizon_s: Annotated[float, _from_0("how far ahead motion is extrapolated, s")] = 0.25
    linear_speed: Annotated[float, _above("speed that the object cannot exceed, m/s")] = 1.0
    angular_speed: Annotated[float, _above("turning that it cannot exceed, rad/s")] = 6.0
    linear_jump: Annotated[float, _above("error of an estimate that is still credible, m")] = 0.03
    angular_jump: Annotated[float, _above("turn of it that is still credible, rad")] = 0.5
    agreeing: Annotated[
        int, Meta(ge=1, description="estimates in a row that prove a jump of the object")
    ] = 5


class HandSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the hand closes in on its goal."""

    position_gain: Annotated[float, _above("K_Pp of the position error, 1/s")] = 4.0
    position_rate_gain: Annotated[float, _from_0("K_Vp of its rate of change")] = 0.1
    turn_gain: Annotated[float, _above("K_Po of the quaternion error, 1/s")] = 8.0
    turn_rate_gain: Annotated[float, _from_0("K_Vo of its rate of change")] = 0.1
    feed_forward: Annotated[bool, Meta(description="add the goal's estimated velocity")] = True
    sure_speed: Annotated[
        float, _above("standard deviation of that velocity from which on less is added, m/s")
    ] = 0.5
    sure_turning: Annotated[float, _above("the same of its turning, rad/s")] = 0.5
    lead_s: Annotated[
        float, _from_0("how far ahead the goal's velocity is fed, for the joints' lag, s")
    ] = 0.02
    linear_speed: Annotated[float, _above("fastest hand, m/s")] = 0.5
    angular_speed: Annotated[float, _above("fastest turn of the hand, rad/s")] = 1.5
    linear_acceleration: Annotated[float, _above("of the hand, m/s²")] = 2.0
    angular_acceleration: Annotated[float, _above("of the hand, rad/s²")] = 8.0
    speed_share: Annotated[
        float, Meta(gt=0, le=1, description="share of the hand's speed limits that is used")
    ] = 0.95
    acceleration_share: Annotated[
        float, Meta(gt=0, le=1, description="share of its acceleration limits that is used")
    ] = 0.9


class JointSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a hand velocity becomes joint speeds."""

    law: Annotated[
        JointLaw, Meta(description="qp: within all limits; paper: pseudo-inverse and feedback")
    ] = JointLaw.QP
    feedback_gain: Annotated[float, _from_0("k_p of the paper's joint feedback, 1/s")] = 1.0
    newton_steps: Annotated[
        int, Meta(ge=1, description="steps of the paper's inverse kinematics each period")
    ] = 3
    angular_weight: Annotated[
        float, _above("metres that weigh as much as a radian of the hand's turn")
    ] = 0.3
    damping: Annotated[float, _from_0("greatest damping at a singular pose, m/s per rad/s")] = 0.05
    damped_below: Annotated[
        float, _above("singular value from which damping sets in, m/s per rad/s")
    ] = 0.05
    posture_gain: Annotated[
        float, _from_0("pull of the free motion towards the first posture, 1/s")
    ] = 0.5
    speed_share: Annotated[
        float, Meta(gt=0, le=1, description="share of the joints' speed limits that is used")
    ] = 0.95
    acceleration_share: Annotated[
        float, Meta(gt=0, le=1, description="share of the joints' acceleration limits that is used")
    ] = 0.9
    ramp_s: Annotated[
        float, _above("least time in which a joint's acceleration grows from 0 to its limit, s")
    ] = 0.04
    margin: Annotated[float, _from_0("distance kept from the joints' position limits, rad")] = 0.01
    reaction_s: Annotated[
        float, _from_0("time in which joints may go on before they brake, their lag, s")
    ] = 0.03


class GazeSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the eyes turn."""

    mode: Annotated[
        GazeMode, Meta(description="fixate: each eye on the target; parallel: fixed, straight on")
    ] = GazeMode.FIXATE
    gain: Annotated[float, _above("of the error of the angles, 1/s")] = 12.0
    rate_gain: Annotated[float, _from_0("of its rate of change")] = 0.1
    feed_forward: Annotated[
        bool, Meta(description="add what the target's and the hand's motion ask for")
    ] = True


class SafetySettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """When the arm is held, and where it may not go."""

    least_confidence: Annotated[
        float, Meta(ge=0, le=1, description="confidence below which an estimate is not trusted")
    ] = 0.8
    coast_s: Annotated[
        float,
        _from_0("gap of trusted estimates that is bridged, above delay and interval of images, s"),
    ] = 0.25
    resume_after: Annotated[
        int, Meta(ge=1, description="trusted estimates in a row after which a held arm moves on")
    ] = 12
    resume_s: Annotated[float, _above("in which the hand regains its full speed, s")] = 0.8
    rough: Annotated[
        float, _above("standard deviation of the goal's place from which on it is told, m")
    ] = 0.025
    away: Annotated[
        float, _above("distance of the hand from its goal from which on it is told, m")
    ] = 0.025
    adrift: Annotated[
        float,
        _above(
            "how far turns that come and go, unbelieved, or that are believed though told roughly, "
            "move a goal before the arm is held, m"
        ),
    ] = 0.03
    calm_s: Annotated[
        float, _above("for which they must move it half as far before the arm moves again, s")
    ] = 2.0
    parted_s: Annotated[
        float,
        _above("odd estimates that are told; the arm is held after twice as long, s"),
    ] = 0.5
    frozen_after: Annotated[
        int, Meta(ge=2, description="equal images in a row of a moving camera that mean it hangs")
    ] = 3
    frozen_shift: Annotated[float, _above("motion that a camera must show, m or rad")] = 0.0005
    workspace_lower: Annotated[
        Triple, Meta(description="corner of the box that the hand stays in, in the world, m")
    ] = (-1.5, -1.5, 0.05)
    workspace_upper: Annotated[Triple, Meta(description="the opposite corner, m")] = (1.5, 1.5, 2.0)
    least_distance: Annotated[float, _from_0("between the hand's and the object's origins, m")] = (
        0.2
    )
    least_clearance: Annotated[
        float, _from_0("between parts of an arm that knows its shape, and the room, m")
    ] = 0.015
    braking: Annotated[
        float, _above("deceleration before walls, the object and other parts, m/s²")
    ] = 0.8


class LookSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the hand looks around an object before it is modelled."""

    count: Annotated[int, Meta(ge=1, description="places from which the object is looked at")] = 5
    nearest: Annotated[float, _above("to which the hand comes to the object, m")] = 0.45
    farthest: Annotated[float, _above("from which it still looks, where nearer is no way, m")] = 0.8
    widest_deg: Annotated[
        float, Meta(gt=0, le=90, description="from where the object was first seen, degrees")
    ] = 60.0
    least_gain: Annotated[
        float, _from_0("share of the surface that a further place must newly show")
    ] = 0.02
    near: Annotated[float, _above("error of the hand at which it has arrived, m and rad")] = 0.01
    still: Annotated[float, _above("speed of the hand below which it rests, m/s and rad/s")] = 0.02
    patience_s: Annotated[float, _above("after which the hand looks from where it is, s")] = 8.0


class ServoSettings(_Settings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How to servo, nested by stage."""

    look: LookSettings = LookSettings()
    target: TargetSettings = TargetSettings()
    hand: HandSettings = HandSettings()
    joints: JointSettings = JointSettings()
    gaze: GazeSettings = GazeSettings()
    safety: SafetySettings = SafetySettings()

    def __post_init__(self) -> None:
        """Check each value, and what hangs together.

        Raises:
            ServoError: a value cannot be, a side of the workspace is empty, or looks are nearer
                than they may be.

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
    """Convert parsed TOML to settings; `place` names the file, `text` is what it holds.

    Raises:
        ServoError: a key is unknown, or a value has the wrong type or range.

    """
    return convert(data, ServoSettings, place, ServoError, text)


def read_settings(path: str | Path) -> ServoSettings:
    """Read settings from a TOML file; what it leaves out keeps its default.

    Raises:
        ServoError: the file cannot be read, or says what cannot be.

    """
    return read_toml(Path(path), ServoSettings, ServoError)
