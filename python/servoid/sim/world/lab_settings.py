"""What is not quite right in a laboratory: how far calibration, sensors and joints are off."""

from typing import Annotated

from msgspec import Meta

from servoid.sim.world.events.faults import SimSettings

# Of what is drawn, the values are standard deviations, each along each axis or of each part.
Metres = Annotated[float, Meta(ge=0.0, le=0.1)]
Degrees = Annotated[float, Meta(ge=0.0, le=10.0)]
Share = Annotated[float, Meta(ge=0.0, le=0.2)]
Pixels = Annotated[float, Meta(ge=0.0, le=50.0)]
Seconds = Annotated[float, Meta(ge=0.0, le=1.0)]


class LabSettings(SimSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How far what the robot's software believes is off, and what its parts do not do exactly.

    The defaults are those of a decent laboratory; docs/howto/world.md says where they come from.
    What is drawn at random is drawn by the world's seed, each kind by itself.
    """

    hand_eye_m: Annotated[
        Metres, Meta(description="calibration of the head on the hand, m along each axis")
    ] = 0.0006
    hand_eye_deg: Annotated[Degrees, Meta(description="the same, degrees about each axis")] = 0.08
    stereo_m: Annotated[
        Metres, Meta(description="calibration of the right eye to the left, m along each axis")
    ] = 0.0002
    stereo_deg: Annotated[Degrees, Meta(description="the same, degrees about each axis")] = 0.02
    eye_zeros_deg: Annotated[
        Degrees, Meta(description="zeros of the encoders of tilt and pans, degrees each")
    ] = 0.03
    focal: Annotated[
        Share, Meta(description="calibrated focal length of each eye, as a share of it")
    ] = 0.002
    center_px: Annotated[
        Pixels, Meta(description="calibrated principal point of each eye, px along each axis")
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
            description="joints are read once a control period, and taken to have turned evenly "
            "between; else where they were is known at each physics step"
        ),
    ] = True
    stamp_offset_s: Annotated[
        float, Meta(ge=0.0, le=0.1, description="by which all time stamps of images are off, s")
    ] = 0.002
    stamp_jitter_s: Annotated[
        float, Meta(ge=0.0, le=0.01, description="by which each time stamp is off besides, s")
    ] = 0.001
    readout_s: Annotated[
        float,
        Meta(
            ge=0.0, le=0.5, description="from the first to the last row of an image; 0: at once, s"
        ),
    ] = 0.0
    auto_exposure_s: Annotated[
        float,
        Meta(ge=0.0, le=60.0, description="time constant of exposure control; 0: it is fixed, s"),
    ] = 1.0
    masses: Annotated[
        Share, Meta(description="mass of each link against what its servos count with")
    ] = 0.05
    friction: Annotated[
        float,
        Meta(
            ge=0.0,
            le=0.5,
            description="dry friction of each joint, a share of the torque that speeds it up most",
        ),
    ] = 0.05
    track_s: Annotated[
        Seconds, Meta(description="what a tracker takes for an image while it tracks, s")
    ] = 0.003
    search_s: Annotated[
        Seconds, Meta(description="the same while it searches, s; it misses images meanwhile")
    ] = 0.045
    mask_px: Annotated[
        Pixels, Meta(description="by which a person's hand misses what it draws or clicks, px")
    ] = 1.5


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
"""Nothing is off."""
