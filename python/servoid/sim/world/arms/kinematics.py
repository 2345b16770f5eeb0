"""The kinematics of an arm for given joint angles, independent of the simulation."""

import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.errors import SimError
from servoid.pose import Floats, Pose
from servoid.servo import Joints, reached
from servoid.sim.world.arms.file_notes import TINY
from servoid.sim.world.arms.robot import EYES, HAND, Robot
from servoid.sim.world.events.motions import pose_of
from servoid.sim.world.scene.engine import load_mujoco
from servoid.words import counted, measured

_TRIES = 60  # initial values that are tried for a hand pose
_SEED = 5
_ENOUGH = 6
_MOST_KEPT = 1000

# Joint angles (N,) for poses that hands reached before: worlds of one arm start alike, and to find
# them takes half of the time in which a plain world is built.
_kept: dict[bytes, Floats] = {}


class Kinematics:
    """Computes kinematics of joint angles (N,) in radians, in the order of the robot's servos."""

    def __init__(self, robot: Robot, model: Any) -> None:
        self._mujoco = load_mujoco()
        self._model = model
        self._data = self._mujoco.MjData(model)
        joints = [model.joint(servo.joint) for servo in robot.servos]
        self.places: NDArray[np.int64] = np.array([joint.qposadr[0] for joint in joints])
        self.speeds: NDArray[np.int64] = np.array([joint.dofadr[0] for joint in joints])
        self._hand = model.body(HAND).id
        self._eyes = [model.body(name).id for name in EYES]
        self.joints: Joints = Joints(
            names=tuple(servo.joint for servo in robot.servos),
            hand_count=robot.hand_count,
            lower=np.array([servo.lower for servo in robot.servos]),
            upper=np.array([servo.upper for servo in robot.servos]),
            speed=np.array([servo.speed for servo in robot.servos]),
            acceleration=np.array([servo.acceleration for servo in robot.servos]),
        )
        # Six joints determine a pose; a seventh would be redundant.
        self._free = slice(1 if robot.hand_count > _ENOUGH else 0, robot.hand_count)

    def world_from_hand(self, positions: Floats) -> Pose:
        """Return the pose of the hand."""
        self._place(positions)
        return self._pose(self._hand)

    def world_from_eyes(self, positions: Floats) -> tuple[Pose, ...]:
        """Return the poses of the cameras."""
        self._place(positions)
        return tuple(self._pose(eye) for eye in self._eyes)

    def jacobian(self, positions: Floats) -> Floats:
        """Return the hand's velocity (6, N), linear and angular in the world, by joint."""
        self._place(positions)
        self._mujoco.mj_comPos(self._model, self._data)
        found = np.zeros((6, self._model.nv))
        self._mujoco.mj_jacBody(self._model, self._data, found[:3], found[3:], self._hand)
        return np.ascontiguousarray(found[:, self.speeds])

    def bodies(self, positions: Floats) -> Floats:
        """Return the poses (B, 7) of all bodies as (w, x, y, z, tx, ty, tz), by their number."""
        self._place(positions)
        return np.concatenate([self._data.xquat, self._data.xpos], axis=1)

    def reach(self, world_from_hand: Pose) -> Floats:
        """Return joint angles (N,) for a hand pose, with the cameras straight ahead.

        Of seven joints or more the first stays at 0, if possible. Of several solutions, the one
        with the highest elbow is returned.

        Raises:
            SimError: the pose cannot be reached.

        """
        key = self._key(world_from_hand)
        if key in _kept:
            return _kept[key].copy()
        every = slice(0, self._free.stop)
        for free in (self._free,) if self._free == every else (self._free, every):
            found = self._reached(world_from_hand, free)
            if found is not None:
                if len(_kept) >= _MOST_KEPT:
                    _kept.clear()
                _kept[key] = found.copy()
                return found
        place = ", ".join(f"{part:.3f}" for part in world_from_hand.translation)
        raise SimError(
            f"the arm cannot start with its hand at ({place}) m{self._why_not()}; give joint "
            "angles as arm.start"
        )

    def _why_not(self) -> str:
        """Return what keeps most poses out of reach, if that is known."""
        count = self._free.stop
        if count < _ENOUGH:
            return (
                f": it has {counted(count, 'joint')}, and to take any pose an arm needs {_ENOUGH}"
            )
        most = float(np.abs([self.joints.lower[:count], self.joints.upper[:count]]).max())
        if most <= TINY:
            return (
                f": its joints turn by at most {measured(np.degrees(most))} degrees; an MJCF has "
                'ranges in degrees, unless it says <compiler angle="radian"/>'
            )
        return ", by its reach or the ranges of its joints"

    def _key(self, world_from_hand: Pose) -> bytes:
        """Return a hash of all on which the joint angles for a hand pose depend."""
        stored = np.zeros(self._mujoco.mj_sizeModel(self._model), np.uint8)
        self._mujoco.mj_saveModel(self._model, None, stored)
        known = hashlib.sha256(stored.tobytes())
        numbers = (self.places, self.joints.lower, self.joints.upper, world_from_hand.matrix())
        for array in (*numbers, np.array([self._hand, self._free.start, self._free.stop])):
            known.update(np.asarray(array).tobytes())
        return known.digest()

    def _reached(self, world_from_hand: Pose, free: slice) -> Floats | None:
        """Return the joint angles (N,) with the highest elbow, if some joints are redundant."""
        random = np.random.default_rng(_SEED)
        best: tuple[float, Floats] | None = None
        lower, upper = self.joints.lower[free], self.joints.upper[free]
        for _ in range(_TRIES):
            start = np.zeros(len(self.places))
            start[free] = 0.5 * (lower + upper + 0.7 * random.uniform(lower - upper, upper - lower))
            angles = reached(self, world_from_hand, start, free)
            if angles is None:
                continue
            self._place(angles)
            height = float(self._data.xpos[1 : self._hand, 2].sum()) - 0.05 * float(
                np.abs(angles).sum()
            )
            if best is None or height > best[0] + 1e-6:
                best = height, angles
        return None if best is None else best[1]

    def _place(self, positions: Floats) -> None:
        self._data.qpos[self.places] = positions
        self._mujoco.mj_kinematics(self._model, self._data)

    def _pose(self, body: int) -> Pose:
        return pose_of(np.concatenate([self._data.xquat[body], self._data.xpos[body]]))
