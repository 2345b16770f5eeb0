"""Samples the errors of a laboratory from its seed, reproducibly."""

import math
from enum import IntEnum

import numpy as np

from servoid._native import Camera
from servoid.pose import Floats, Pose
from servoid.sim.world.lab_settings import LabSettings

_LAB = 0x1AB  # separates this random stream from others of the same seed


class _Kind(IntEnum):
    """The kinds of errors; each has a random stream of its own."""

    HAND_EYE = 0
    STEREO = 1
    EYE_ZEROS = 2
    CAMERA = 3
    ENCODER = 4
    ENCODER_SPEED = 5
    STAMP_OFFSET = 6
    STAMP = 7
    MASS = 8


class Lab:
    """A laboratory: its settings, and the errors sampled with its seed."""

    def __init__(self, settings: LabSettings, seed: int) -> None:
        self.settings: LabSettings = settings
        self._seed = seed

    @property
    def head_from_true(self) -> Pose | None:
        """Return the error of the head's calibrated pose; None without an error."""
        return self._motion(_Kind.HAND_EYE, self.settings.hand_eye_m, self.settings.hand_eye_deg)

    @property
    def right_from_true(self) -> Pose | None:
        """Return the error of the right camera's calibrated pose; None without an error."""
        return self._motion(_Kind.STEREO, self.settings.stereo_m, self.settings.stereo_deg)

    def zeros(self, count: int, hand_count: int) -> Floats:
        """Return the zero errors of the encoders of all joints, (N,) rad."""
        found = np.zeros(count)
        drawn = self._normal(_Kind.EYE_ZEROS, count - hand_count)
        found[hand_count:] = math.radians(self.settings.eye_zeros_deg) * drawn
        return found

    def camera(self, true: Camera, number: int) -> Camera:
        """Return the calibration of a camera, with its errors."""
        focal, *center = self._normal(_Kind.CAMERA, 3, number)
        scale = 1.0 + self.settings.focal * focal
        return Camera(
            size_px=true.size_px,
            focal_px=(scale * true.focal_px[0], scale * true.focal_px[1]),
            center_px=(
                true.center_px[0] + self.settings.center_px * center[0],
                true.center_px[1] + self.settings.center_px * center[1],
            ),
        )

    def angle_noise(self, count: int, reading: int) -> Floats:
        """Return the errors of one reading of the angles, (N,) rad."""
        return self._scaled(self.settings.encoder, _Kind.ENCODER, count, reading)

    def speed_noise(self, count: int, reading: int) -> Floats:
        """Return the errors of one reading of the speeds, (N,) rad/s."""
        return self._scaled(self.settings.encoder_speed, _Kind.ENCODER_SPEED, count, reading)

    def stamp_error(self, index: int) -> float:
        """Return the error of the time stamp of an observation, in seconds."""
        offset = self._scaled(self.settings.stamp_offset_s, _Kind.STAMP_OFFSET, 1)[0]
        return float(offset + self._scaled(self.settings.stamp_jitter_s, _Kind.STAMP, 1, index)[0])

    def mass_shares(self, count: int) -> Floats:
        """Return each body's true mass as a share of its modelled one, (B,)."""
        # No mass is less than half of its modelled value.
        return np.maximum(1.0 + self._scaled(self.settings.masses, _Kind.MASS, count), 0.5)

    def _motion(self, kind: _Kind, metres: float, degrees: float) -> Pose | None:
        if metres == 0.0 and degrees == 0.0:
            return None
        drawn = self._normal(kind, 6)
        turn = math.radians(degrees) * drawn[3:]
        return Pose.from_parts(
            (metres * drawn[:3]).tolist(), Pose.exp([0.0, 0.0, 0.0, *turn]).quaternion
        )

    def _scaled(self, size: float, kind: _Kind, count: int, number: int = 0) -> Floats:
        return np.zeros(count) if size == 0.0 else size * self._normal(kind, count, number)

    def _normal(self, kind: _Kind, count: int, number: int = 0) -> Floats:
        return np.random.default_rng((_LAB, self._seed, kind, number)).normal(size=count)
