"""Viewpoints that an arm chooses to see more of a body, and places that it did not choose."""

from pathlib import Path

import numpy as np
from scene_table import Figures, scene
from servo_loop import WORLD_FROM_OBJECT

from servoid.pose import Pose
from servoid.servo import LookSettings, next_viewpoint
from servoid.servo.law.reach import reached
from servoid.servo.surface import Surface
from servoid.shape import Body
from servoid.sim.arm_file import read_arm
from servoid.sim.serial_arm import SerialArm
from servoid.source.source import Instant

SETTINGS = LookSettings(patience_s=4.0)
PLACE = np.array(WORLD_FROM_OBJECT.translation)
TRIED = 60


def body_at(pose: Pose) -> Body:
    return Body(
        world_from_object=pose,
        centers=np.array([[0.0, 0.02, 0.0], [0.0, -0.06, 0.0]]),
        radii=np.array([[0.035, 0.085, 0.035], [0.016, 0.06, 0.016]]),
        rotations=np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)),
    )


def look_from(arm: SerialArm, positions: np.ndarray) -> Instant:
    return Instant(0, 0.0, arm.world_from_cameras(positions), (None, None))


def look_at(pose: Pose) -> Instant:
    return Instant(0, 0.0, (pose, pose), (None, None))


def facing(place: np.ndarray, forward: np.ndarray) -> Pose:
    right = np.cross([0.0, 0.0, -1.0], forward)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, np.cross(forward, right), forward, place])
    return Pose(matrix)


def seen_by(surface: Surface, looks: list[Instant]) -> np.ndarray:
    eyes = [np.array(pose.translation) for look in looks for pose in look.world_from_camera]
    return np.logical_or.reduce([surface.seen_from(eye) for eye in eyes])


@scene("look around", {"better": "1"}, {"tried": "places"})
def no_better(seed: int, _folder: Path) -> Figures:
    """Compare the gain of a viewpoint with those of other places that the arm reaches."""
    body, arm = body_at(WORLD_FROM_OBJECT), SerialArm(read_arm())
    start, surface, random = arm.state().positions, Surface(body), np.random.default_rng(seed)
    here = look_from(arm, start)
    viewpoint = next_viewpoint(arm, body, [here], SETTINGS, start)
    assert viewpoint is not None
    seen, gains = seen_by(surface, [here]), []
    for azimuth, rise in random.uniform((-0.8, -0.6), (0.8, 0.5), (TRIED, 2)):
        forward = -np.array(
            [np.cos(rise) * np.cos(azimuth), np.cos(rise) * np.sin(azimuth), np.sin(rise)]
        )
        goal = facing(PLACE - random.uniform(0.45, 0.8) * forward, forward)
        if reached(arm, goal, start) is not None:
            gains.append((surface.seen_from(np.array(goal.translation)) & ~seen).mean())
    # Ways are tried 15 to 20 degrees apart, so that others may be a little better.
    return {"better": max(0.0, float(max(gains)) - viewpoint.gain), "tried": len(gains)}
