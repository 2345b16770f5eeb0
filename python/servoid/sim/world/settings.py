"""Declares the settings of a simulated world, each default once."""

from typing import Annotated

from msgspec import Meta

from servoid.config import NEAR_M, OBJECT_MOST_M, REACH_M, Most
from servoid.errors import PoseError, SimError
from servoid.pose import Pose
from servoid.sim.world.events.faults import Fault, Occlude, SimSettings
from servoid.sim.world.lab_settings import IDEAL, LabSettings
from servoid.words import counted, digits

Triple = tuple[float, float, float]
Seven = tuple[float, float, float, float, float, float, float]
BEFORE_HAND: Triple = (0.0, -0.09, 0.545)  # initial and desired pose of the object, as in the paper
Positive = Annotated[float, Meta(gt=0.0)]
NotNegative = Annotated[float, Meta(ge=0.0)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]

_LEAST_HZ, _MOST_HZ = 0.5, 1000.0  # images per second: less often, an arm cannot be servoed
_MOST_LATENCY_S = 2.0
_MS_PER_S = 1e3


def _check_pose(name: str, seven: Seven | None) -> None:
    """Check that a setting, w, x, y, z, tx, ty, tz, is a pose."""
    if seven is None:
        return
    try:
        Pose.from_parts(seven[4:], seven[:4])
    except PoseError as error:
        raise SimError(
            f"{name} is {list(seven)}: {error}; write the rotation first: w, x, y, z, tx, ty, "
            "tz, where 1, 0, 0, 0 is no rotation"
        ) from error


class ArmSettings(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The arm, and its head with two cameras."""

    name: Annotated[str, Meta(description="the arm: pa10, or an MJCF or URDF file")] = "pa10"
    links: Annotated[
        str | None, Meta(description="link lengths of a shipped arm; none: those of its file")
    ] = None
    mount: Annotated[
        str | None, Meta(description="site or body of a file's arm that carries the hand")
    ] = None
    mount_from_hand: Annotated[
        Seven,
        Most(NEAR_M),
        Meta(description="the hand (x right, y down, z forward) on it: w, x, y, z, tx, ty, tz"),
    ] = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    speed: Annotated[
        Positive,
        Meta(description="joint speed limit of a file's arm in rad/s; a URDF may lower it"),
    ] = 2.0
    acceleration: Annotated[
        Positive, Meta(description="joint acceleration limit of a file's arm in rad/s²")
    ] = 8.0
    lag_s: Annotated[
        Positive | None,
        Meta(description="lag of the joints' speed servos; none: that of the shipped arm's file"),
    ] = None
    half_baseline: Annotated[
        Positive | None,
        Most(NEAR_M),
        Meta(description="half the cameras' baseline in m; none: that of the shipped arm's file"),
    ] = None
    stop_torque: Annotated[
        Positive,
        Meta(description="unexplained torque that stops the arm, as a share of a joint's maximum"),
    ] = 0.1
    turning_eyes: Annotated[
        bool,
        Meta(description="true: cameras have a common tilt and a pan each; false: fixed cameras"),
    ] = True
    eyes_on_object: Annotated[
        bool, Meta(description="moving cameras start on the object, not straight ahead")
    ] = True
    start: Annotated[
        tuple[float, ...] | None,
        Meta(description="joint angles at the start in radians; none: those of its file"),
    ] = None
    world_from_hand: Annotated[
        Seven | None,
        Most(REACH_M),
        Meta(description="hand pose at the start, instead of angles: w, x, y, z, tx, ty, tz"),
    ] = None

    def __post_init__(self) -> None:
        """Check each value, and that poses are rigid motions.

        Raises:
            SimError: a value is out of range, or a rotation is no unit quaternion.

        """
        super().__post_init__()
        _check_pose("arm.mount_from_hand", self.mount_from_hand)
        _check_pose("arm.world_from_hand", self.world_from_hand)


class ObjectSettings(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The object, its initial pose and its motion."""

    name: Annotated[
        str,
        Meta(
            description="the object: bottle, drill, ellipsoid, mug, painted_ellipsoid, "
            "plain_bottle, plain_mug or two_ellipsoids"
        ),
    ] = "bottle"
    radii: Annotated[
        tuple[Positive, Positive, Positive] | None,
        Most(OBJECT_MOST_M),
        Meta(description="radii of the object ellipsoid along x, y, z in m; none: the paper's"),
    ] = None
    hand_from_object: Annotated[
        Seven,
        Most(NEAR_M),
        Meta(description="its first pose before the hand: w, x, y, z, tx, ty, tz; Eq. 20"),
    ] = (1.0, 0.0, 0.0, 0.0, *BEFORE_HAND)
    path: Annotated[
        str,
        Meta(
            description="the object's motion: still, line:0.2@5s, circle:0.1@10s, sine:0.15@10s, "
            "random:7 or recorded:FILE"
        ),
    ] = "still"

    def __post_init__(self) -> None:
        """Check each value, and that its pose is a rigid motion.

        Raises:
            SimError: a value is out of range, or a rotation is no unit quaternion.

        """
        super().__post_init__()
        _check_pose("object.hand_from_object", self.hand_from_object)


class CameraSettings(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The cameras of the head."""

    size_px: Annotated[tuple[int, int], Meta(description="width and height of an image")] = (
        640,
        480,
    )
    focal_px: Annotated[
        Positive | None, Meta(description="focal length; none: 50 degrees horizontal field of view")
    ] = None
    distortion: Annotated[
        tuple[float, ...], Meta(description="Brown-Conrady coefficients of the lens, if any")
    ] = ()
    rate_hz: Annotated[Positive, Meta(description="images per second")] = 30.0
    latency_s: Annotated[
        float, Meta(ge=0.0, description="from the middle of the exposure to the image's arrival")
    ] = 0.04
    exposure_s: Annotated[
        float,
        Meta(ge=0.0, le=0.5, description="exposure time, which sets the motion blur"),
    ] = 0.006
    moments: Annotated[
        int, Meta(ge=1, le=32, description="instants of an exposure rendered for the blur")
    ] = 4
    samples: Annotated[int, Meta(ge=1, le=8, description="rays along each side of a pixel")] = 2
    noise: Annotated[
        float,
        Meta(ge=0.0, le=255.0, description="standard deviation of the image noise in grey levels"),
    ] = 1.5

    def __post_init__(self) -> None:
        """Check each value, and the values that depend on each other.

        Raises:
            SimError: a value is out of range, or probably in another unit, an exposure is longer
                than the interval between images, or it has more moments than a pixel has rays.

        """
        super().__post_init__()
        self._check_timing()
        rays = self.samples * self.samples
        if self.moments > rays:
            raise SimError(
                f"an exposure has {self.moments} moments, but a pixel has only "
                f"{counted(rays, 'ray')}; "
                "lower cameras.moments or raise cameras.samples"
            )
        if self.exposure_s * self.rate_hz > 1.0:
            raise SimError(
                f"an exposure takes {self.exposure_s} s, but at {self.rate_hz:g} Hz there are "
                f"{1.0 / self.rate_hz:.4g} s per image; lower cameras.exposure_s or cameras.rate_hz"
            )

    def _check_timing(self) -> None:
        if not _LEAST_HZ <= self.rate_hz <= _MOST_HZ:
            meant = 1.0 / self.rate_hz
            hint = f"; if that is the interval in seconds, write {digits(meant)}"
            raise SimError(
                f"cameras.rate_hz is {digits(self.rate_hz)}; give the images per second, from "
                f"{digits(_LEAST_HZ)} to {digits(_MOST_HZ)}"
                f"{hint if _LEAST_HZ <= meant <= _MOST_HZ else ''}"
            )
        if self.latency_s > _MOST_LATENCY_S:
            meant = self.latency_s / _MS_PER_S
            hint = f"; if milliseconds were meant, write {digits(meant)}"
            raise SimError(
                f"cameras.latency_s is {digits(self.latency_s)}; give at most "
                f"{digits(_MOST_LATENCY_S)} seconds"
                f"{hint if meant <= _MOST_LATENCY_S else ''}"
            )


class LightSettings(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The light, and how it changes once the object starts to move."""

    level: Annotated[Positive, Meta(description="brightness; 1 exposes well")] = 1.0
    toward: Annotated[Triple, Meta(description="direction to the lamp, in the world")] = (
        0.45,
        -0.30,
        0.85,
    )
    step_at_s: Annotated[
        NotNegative | None, Meta(description="time of a step in the level; none: no step")
    ] = None
    step_to: Annotated[Positive, Meta(description="factor by which the step changes the level")] = (
        0.6
    )
    swing: Annotated[
        Share, Meta(description="relative amplitude of a slow oscillation of the level")
    ] = 0.0
    swing_period_s: Annotated[Positive, Meta(description="period of the oscillation")] = 8.0


class PhysicsSettings(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The time steps of the simulation."""

    step_s: Annotated[float, Meta(ge=1e-5, le=0.25, description="physics step")] = 0.002
    period_s: Annotated[
        float, Meta(gt=0.0, le=0.25, description="control period, a multiple of the physics step")
    ] = 0.008

    def __post_init__(self) -> None:
        """Check each value, and the values that depend on each other.

        Raises:
            SimError: a value is out of range, or the period is no multiple of the step.

        """
        super().__post_init__()
        steps = self.period_s / self.step_s
        if round(steps) < 1 or abs(steps - round(steps)) > 1e-6:
            raise SimError(
                f"the control period is {self.period_s} s and the physics step {self.step_s} s; "
                "make the period a multiple of the step"
            )


class WorldSettings(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A world with an arm, an object and a room."""

    arm: ArmSettings = ArmSettings()
    object: ObjectSettings = ObjectSettings()
    cameras: CameraSettings = CameraSettings()
    light: LightSettings = LightSettings()
    physics: PhysicsSettings = PhysicsSettings()
    lab: LabSettings = LabSettings()
    ideal: Annotated[bool, Meta(description="no errors, regardless of [world.lab]")] = False
    faults: Annotated[
        tuple[Fault, ...], Meta(description="faults; their times count from the start of the path")
    ] = ()
    background: Annotated[str, Meta(description="the background: cluttered or plain")] = "cluttered"
    renderer: Annotated[
        str, Meta(description="raycast, servoid's own, or mujoco, which needs OpenGL")
    ] = "raycast"
    seed: Annotated[
        int, Meta(ge=0, description="seed of the noise, the clutter and the errors of [world.lab]")
    ] = 0
    threads: Annotated[int, Meta(ge=0, description="rendering threads; 0: one per core")] = 0

    def __post_init__(self) -> None:
        """Check each value, and the values that depend on each other.

        Raises:
            SimError: a value is out of range, boards differ in size, or an image takes too long.

        """
        super().__post_init__()
        taken_s = self.cameras.exposure_s + self.in_effect.readout_s
        if taken_s * self.cameras.rate_hz > 1.0:
            raise SimError(
                f"exposure and read-out of an image take {taken_s:.4g} s, but at "
                f"{self.cameras.rate_hz:g} Hz there are {1.0 / self.cameras.rate_hz:.4g} s for "
                "each image; lower lab.readout_s, cameras.exposure_s or cameras.rate_hz"
            )
        boards = {fault.half_size for fault in self.faults if isinstance(fault, Occlude)}
        if len(boards) > 1:
            raise SimError(
                f"the boards of {len(boards)} occlusions differ in size, but a world has one "
                "board; give all Occlude faults the same half_size"
            )

    @property
    def in_effect(self) -> LabSettings:
        """Return the errors of this world, none in an ideal one."""
        return IDEAL if self.ideal else self.lab
