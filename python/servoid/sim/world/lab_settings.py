"""Declares the errors of a laboratory: of calibration, sensors, joints and people."""

from typing import Annotated

from msgspec import Meta

from servoid.sim.world.events.faults import SimSettings

# Values of random errors are standard deviations, along each axis or for each part.
Metres = Annotated[float, Meta(ge=0.0, le=0.1)]
Degrees = Annotated[float, Meta(ge=0.0, le=10.0)]
Share = Annotated[float, Meta(ge=0.0, le=0.2)]
Pixels = Annotated[float, Meta(ge=0.0, le=50.0)]
Seconds = Annotated[float, Meta(ge=0.0, le=1.0)]


class LabSettings(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The errors of what the robot's software knows, and of its sensors, drives and users.

    The defaults are those of a decent laboratory; docs/howto/world.md gives their sources. Random
    errors depend on the world's seed alone; each kind has a random stream of its own.
    """

    hand_eye_m: Annotated[
        Metres, Meta(description="hand-eye calibration error, m along each axis")
    ] = 0.0006
    hand_eye_deg: Annotated[Degrees, Meta(description="the same, degrees about each axis")] = 0.08
    stereo_m: Annotated[
        Metres, Meta(description="stereo calibration error of the right eye, m along each axis")
    ] = 0.0002
    stereo_deg: Annotated[Degrees, Meta(description="the same, degrees about each axis")] = 0.02
    eye_zeros_deg: Annotated[
        Degrees, Meta(description="zero errors of the encoders of tilt and pans, degrees each")
    ] = 0.03
    focal: Annotated[
        Share, Meta(description="relative error of the calibrated focal length of each eye")
    ] = 0.002
    center_px: Annotated[
        Pixels, Meta(description="principal point error of each eye, px along each axis")
    ] = 0.5
    encoder: Annotated[
        float, Meta(ge=0.0, le=0.1, description="noise of each reading of a joint's angle, rad")
    ] = 2e-5
    encoder_speed: Annotated[
        float, Meta(ge=0.0, le=1.0, description="noise of each reading of a joint's speed, rad/s")
    ] = 0.002
    read_once: Annotated[
        bool,
        Meta(
            description="true: joints are read once per control period and interpolated; false: "
            "their positions are known at each physics step"
        ),
    ] = True
    stamp_offset_s: Annotated[
        float, Meta(ge=0.0, le=0.1, description="constant error of all image time stamps, s")
    ] = 0.002
    stamp_jitter_s: Annotated[
        float, Meta(ge=0.0, le=0.01, description="additional random error of each time stamp, s")
    ] = 0.001
    readout_s: Annotated[
        float,
        Meta(
            ge=0.0,
            le=0.5,
            description="read-out from first to last image row; 0: global shutter, s",
        ),
    ] = 0.0
    auto_exposure_s: Annotated[
        float,
        Meta(ge=0.0, le=60.0, description="time constant of auto-exposure; 0: fixed exposure, s"),
    ] = 1.0
    masses: Annotated[
        Share, Meta(description="relative error of each link mass in the servos' model")
    ] = 0.05
    friction: Annotated[
        float,
        Meta(
            ge=0.0,
            le=0.5,
            description="dry friction of each joint, a share of its torque at full acceleration",
        ),
    ] = 0.05
    track_s: Annotated[
        Seconds, Meta(description="computing time of the tracker per image while it tracks, s")
    ] = 0.003
    search_s: Annotated[
        Seconds, Meta(description="the same while it searches, s; it misses images meanwhile")
    ] = 0.045
    mask_px: Annotated[Pixels, Meta(description="error of what a person draws or clicks, px")] = 1.5


IDEAL = LabSettings(
    hand_eye_m=0.0,
    hand_eye_deg=0.0,
    stereo_m=0.0,
    stereo_deg=0.0,
    eye_zeros_deg=0.0,
    focal=0.0,
    center_px=0.0,
    encoder=0.0,
    encoder_speed=0.0,
    read_once=False,
    stamp_offset_s=0.0,
    stamp_jitter_s=0.0,
    auto_exposure_s=0.0,
    masses=0.0,
    friction=0.0,
    track_s=0.0,
    search_s=0.0,
    mask_px=0.0,
)
"""No errors."""
