"""The motions of the moving sample: smooth paths of the toy, of the rig and of the occluder."""

import numpy as np

from servoid.pose import Floats, Pose, looking

RATE_HZ = 30.0

_MIDDLE = np.array([0.0, 0.575, 0.155])  # of the toy's path, in the room
_SWAY = np.array([0.060, 0.045, 0.030])  # metres to each side
_SWAY_PERIODS = np.array([72.0, 110.0, 55.0])  # images
_MOST_TURN_DEG, _TURN_PERIOD = 58.0, 130.0
_FIRST_YAW_DEG = -35.0  # the toy's head is to the left and a little nearer

WHOLE_TURN = 300  # images of a whole turn and back
_HASTE = 0.95  # 1: constant speed and sudden reversal; 0: sinusoidal
_HELD_SWAY = np.array(
    [0.018, 0.014, 0.012]
)  # metres to each side, by the hand that rotates the toy
_HELD_PERIODS = np.array([97.0, 131.0, 73.0])  # images
_LEAN_DEG, _LEAN_PERIODS = np.array([16.0, 11.0]), np.array([151.0, 103.0])

_EYE_HEIGHT = 0.27
_LEFT_OF_TOY = 0.05  # half the baseline: both cameras see the toy
_PASS_DEPTH = 0.72  # share of the distance from the camera to the toy
_PASS_SPAN = (0.2, 0.8)  # share of the recording in which the occluder passes
_PASS_REACH = 0.36  # metres at the toy, to each side


def toy_pose(index: int, seed: int) -> Floats:
    """Return the toy's pose room_from_object (4, 4) at an image: 5 mm and 2 degrees an image."""
    random = np.random.default_rng([seed, 2])
    phases, first, second = random.uniform(-0.6, 0.6, 3), *random.normal(size=(2, 3))
    angle = np.radians(_MOST_TURN_DEG) * np.sin(2.0 * np.pi * index / _TURN_PERIOD)
    axis = np.array([0.25, 0.2, 1.0]) + 0.35 * first
    axis += 0.3 * np.sin(2.0 * np.pi * index / 90.0) * second
    place = _MIDDLE + _SWAY * np.sin(2.0 * np.pi * index / _SWAY_PERIODS + phases)
    turned = Pose.exp([0.0, 0.0, 0.0, *(angle * axis / np.linalg.norm(axis))]).matrix()
    pose = turned @ Pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.radians(180.0 + _FIRST_YAW_DEG)]).matrix()
    pose[:3, 3] = place
    return pose


def turning_pose(index: int, seed: int) -> Floats:
    """Return the pose room_from_object (4, 4) of a toy that rotates once around, and back.

    It rotates about a nearly vertical axis, as in a hand, by 2 to 3 degrees per image; after
    `WHOLE_TURN` images it is near its initial pose.
    """
    phases = np.random.default_rng([seed, 4]).uniform(-0.6, 0.6, 5)
    way = np.arcsin(_HASTE * np.cos(2.0 * np.pi * index / WHOLE_TURN)) / np.arcsin(_HASTE)
    yaw = np.pi * (1.0 - way) + np.radians(180.0 + _FIRST_YAW_DEG)
    lean = np.radians(_LEAN_DEG) * np.sin(2.0 * np.pi * index / _LEAN_PERIODS + phases[:2])
    leaning = Pose.exp([0.0, 0.0, 0.0, *lean, 0.0]).matrix()
    pose = leaning @ Pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, yaw]).matrix()
    pose[:3, 3] = _MIDDLE + _HELD_SWAY * np.sin(2.0 * np.pi * index / _HELD_PERIODS + phases[2:])
    return pose


def resting_rig() -> Floats:
    """Return the pose room_from_rig (4, 4) of a rig on a stand."""
    beside = np.array([-_LEFT_OF_TOY, 0.0, 0.0])
    return looking(np.array([0.0, 0.0, _EYE_HEIGHT]) + beside, _MIDDLE + beside).matrix()


def hand_rig(index: int, seed: int) -> Floats:
    """Return the pose room_from_rig (4, 4) of a rig in a hand, about 1 degree an image around."""
    random = np.random.default_rng([seed, 3])
    phases = random.uniform(-0.5, 0.5, 4)
    azimuth, elevation, away, lean = np.sin(
        2.0 * np.pi * index / np.array([150.0, 95.0, 80.0, 60.0]) + phases
    )
    azimuth, elevation = np.radians(26.0) * azimuth, np.radians(18.0 + 9.0 * elevation)
    toward = [np.sin(azimuth), -np.cos(azimuth), np.tan(elevation)]
    place = _MIDDLE + (0.57 + 0.05 * away) * np.array(toward) / np.linalg.norm(toward)
    pose = looking(place, _MIDDLE).matrix()
    pose[:3, 3] -= _LEFT_OF_TOY * pose[:3, 0]
    return pose @ Pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, np.radians(5.0 * lean)]).matrix()


def passing_pose(index: int, count: int, room_from_left: Floats, toy: Floats) -> Floats:
    """Return the pose room_from_occluder (4, 4) of the occluder, which moves from left to right.

    Its x is the camera's, its z the camera's up.
    """
    share = index / max(count - 1, 1)
    first, last = _PASS_SPAN
    aside = _PASS_REACH * (2.0 * (share - first) / (last - first) - 1.0)
    turn = room_from_left[:3, :3]
    pose = np.eye(4)
    pose[:3, :3] = np.stack([turn[:, 0], turn[:, 2], -turn[:, 1]], axis=1)
    at_toy = toy[:3, 3] + aside * turn[:, 0]
    pose[:3, 3] = room_from_left[:3, 3] + _PASS_DEPTH * (at_toy - room_from_left[:3, 3])
    return pose
