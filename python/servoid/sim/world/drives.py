"""The speed servos of an arm's joints, and how its angles went."""

from collections import deque
from typing import Any

import numpy as np

from servoid.pose import exact
from servoid.sim.world.engine import load_mujoco
from servoid.sim.world.kinematics import Kinematics
from servoid.sim.world.motions import Floats
from servoid.sim.world.robot import Robot

_REMEMBERED_S = 1.0  # more than the longest exposure and control period take together


class Drives:
    """Turns joints at commanded speeds, as the servos of a real arm do.

    Each joint's speed follows the command with a first-order lag, within its acceleration, speed
    and torque, and it brakes before its limits. Gravity is balanced.
    """

    def __init__(self, robot: Robot, model: Any, kinematics: Kinematics, start: Floats) -> None:
        self._mujoco = load_mujoco()
        self._model, self._data = model, self._mujoco.MjData(model)
        self._places, self._speeds = kinematics.places, kinematics.speeds
        step = model.opt.timestep
        self._lag = np.array([drive.lag_s for drive in robot.drives])
        self._gain = -exact.expm1(-step / self._lag) / step  # exact for a command that lasts a step
        self._acceleration = np.array([drive.acceleration for drive in robot.drives])
        self._speed = np.array([drive.speed for drive in robot.drives])
        self._torque = np.array([drive.torque for drive in robot.drives])
        self._lower = np.array([drive.lower for drive in robot.drives])
        self._upper = np.array([drive.upper for drive in robot.drives])
        self._data.qpos[self._places] = start
        self._steps = 0
        self._went: deque[Floats] = deque([start.copy()], maxlen=int(_REMEMBERED_S / step))

    @property
    def time_s(self) -> float:
        """Return the time since the world began, without the drift of a sum."""
        return self._steps * self._model.opt.timestep

    @property
    def positions(self) -> Floats:
        """Return the joints' angles (N,)."""
        return self._data.qpos[self._places].copy()

    @property
    def velocities(self) -> Floats:
        """Return the joints' speeds (N,)."""
        return self._data.qvel[self._speeds].copy()

    def step(self, velocities: Floats) -> None:
        """Let one physics step pass with the joints told to turn at (N,) rad/s."""
        data = self._data
        self._mujoco.mj_step1(self._model, data)
        wanted = np.zeros(self._model.nv)
        wanted[self._speeds] = self._answer(velocities)
        needed = np.zeros(self._model.nv)
        self._mujoco.mj_mulM(self._model, data, needed, wanted)
        needed += data.qfrc_bias - data.qfrc_passive
        data.qfrc_applied[:] = needed
        data.qfrc_applied[self._speeds] = np.clip(needed[self._speeds], -self._torque, self._torque)
        self._mujoco.mj_step2(self._model, data)
        self._steps += 1
        self._went.append(self.positions)

    def positions_at(self, time_s: float) -> Floats:
        """Return the angles (N,) at a time within the last second, between two physics steps."""
        place = time_s / self._model.opt.timestep - (self._steps - len(self._went) + 1)
        place = min(max(place, 0.0), len(self._went) - 1.0)
        index = min(int(place), max(len(self._went) - 2, 0))
        if len(self._went) == 1:
            return self._went[0].copy()
        share = place - index
        return (1.0 - share) * self._went[index] + share * self._went[index + 1]

    def _answer(self, velocities: Floats) -> Floats:
        """Return the accelerations (N,) with which the joints answer a command."""
        angles, speeds = self._data.qpos[self._places], self._data.qvel[self._speeds]
        allowed = np.clip(velocities, -self._speed, self._speed)
        allowed = np.clip(
            allowed, -self._braked(angles - self._lower), self._braked(self._upper - angles)
        )
        return np.clip((allowed - speeds) * self._gain, -self._acceleration, self._acceleration)

    def _braked(self, room: Floats) -> Floats:
        """Return the speeds (N,) from which joints can stop within so many radians, lag and all."""
        room = np.maximum(room, 0.0)
        return np.minimum(np.sqrt(self._acceleration * room), room / (4.0 * self._lag))
