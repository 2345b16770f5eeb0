"""The speed servos of an arm's joints, and the recent history of its angles."""

from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from servoid.errors import SimError
from servoid.pose import Floats, exact
from servoid.sim.world.arms.kinematics import Kinematics
from servoid.sim.world.arms.protective_stop import ProtectiveStop
from servoid.sim.world.arms.robot import Robot
from servoid.sim.world.arms.stability import Stability
from servoid.sim.world.scene.contacts import greatest_force
from servoid.sim.world.scene.engine import load_mujoco

_REMEMBERED_S = 1.0  # more than the longest exposure and control period together


class JointServos:
    """Moves joints at commanded speeds, as the servos of a real arm do.

    Each joint's speed follows the command with a first-order lag, within its acceleration, speed
    and torque limits, and it brakes before its position limits. The torques are computed with a
    `model` of the arm; if the true arm, the `plant`, differs, the servos correct the speed errors.
    External torques stop the arm. When its physics become unstable, which `instability`
    then says, it stays where it was.
    """

    def __init__(
        self,
        robot: Robot,
        model: Any,
        kinematics: Kinematics,
        start: Floats,
        plant: Any,
        protection: ProtectiveStop,
        *,
        known: bool,
    ) -> None:
        """Take the servos' model of an arm and the true arm; `known` if both move alike."""
        self._mujoco = load_mujoco()
        self._model, self._plant = model, plant
        self.protection: ProtectiveStop = protection
        self._data = self._mujoco.MjData(self._plant)
        self._places, self._speeds = kinematics.places, kinematics.speeds
        step = model.opt.timestep
        self._lag = np.array([servo.lag_s for servo in robot.servos])
        self._gain = -exact.expm1(-step / self._lag) / step  # exact for a command of one step
        self._acceleration = np.array([servo.acceleration for servo in robot.servos])
        self._speed = np.array([servo.speed for servo in robot.servos])
        self._torque = np.array([servo.torque for servo in robot.servos])
        self._lower = np.array([servo.lower for servo in robot.servos])
        self._upper = np.array([servo.upper for servo in robot.servos])
        self._data.qpos[self._places] = start
        self._stability = Stability(plant, self._data)
        self.instability: SimError | None = None
        self._corrections = None if known else self._settled(start)
        self._steps = 0
        self._went: deque[Floats] = deque([start.copy()], maxlen=int(_REMEMBERED_S / step))

    @property
    def time_s(self) -> float:
        """Return the simulated time, without accumulated rounding errors."""
        return self._steps * self._model.opt.timestep

    @property
    def steps(self) -> int:
        """Return the number of physics steps so far."""
        return self._steps

    @property
    def step_s(self) -> float:
        """Return the duration of a physics step."""
        return float(self._model.opt.timestep)

    @property
    def positions(self) -> Floats:
        """Return the joints' angles (N,)."""
        return self._data.qpos[self._places].copy()

    @property
    def velocities(self) -> Floats:
        """Return the joints' speeds (N,)."""
        return self._data.qvel[self._speeds].copy()

    @property
    def contact_force(self) -> float:
        """Return the greatest contact force in N, 0 without contact."""
        return greatest_force(self._plant, self._data)

    def step(self, velocities: Floats, world_from_object: Floats) -> None:
        """Simulate one physics step with commanded joint speeds (N,) in rad/s.

        The object is at a pose (7,) meanwhile. After a protective stop the joints brake, regardless
        of the command; once the physics are unstable, they rest.
        """
        self._steps += 1
        if self.instability is None:
            angles = self.positions
            self._simulate(velocities, world_from_object)
            if self._stability.is_lost:
                self.instability = self._stability.error(self.time_s)
                self._data.qpos[self._places], self._data.qvel[:] = angles, 0.0
        self._went.append(self.positions)

    def _simulate(self, velocities: Floats, world_from_object: Floats) -> None:
        data = self._data
        data.mocap_quat[0], data.mocap_pos[0] = world_from_object[:4], world_from_object[4:]
        self._mujoco.mj_step1(self._plant, data)
        wanted = np.zeros(self._model.nv)
        stopped = self.protection.stopped
        wanted[self._speeds] = self._answer(np.zeros_like(velocities) if stopped else velocities)
        needed = self._computed(wanted)
        data.qfrc_applied[:] = needed
        data.qfrc_applied[self._speeds] = np.clip(needed[self._speeds], -self._torque, self._torque)
        before = data.qvel.copy()
        self._mujoco.mj_step2(self._plant, data)
        off = (data.qvel - before) / self.step_s - wanted
        self.protection.see(self._unexplained(off, needed))

    def positions_at(self, time_s: float) -> Floats:
        """Return the angles (N,) at a time within the last second, between two physics steps."""
        place = time_s / self._model.opt.timestep - (self._steps - len(self._went) + 1)
        place = min(max(place, 0.0), len(self._went) - 1.0)
        index = min(int(place), max(len(self._went) - 2, 0))
        if len(self._went) == 1:
            return self._went[0].copy()
        share = place - index
        return (1.0 - share) * self._went[index] + share * self._went[index + 1]

    def positions_of(self, step: int) -> Floats:
        """Return the angles (N,) after a number of steps, within the last second."""
        place = step - (self._steps - len(self._went) + 1)
        return self._went[min(max(place, 0), len(self._went) - 1)].copy()

    def _unexplained(self, off: Floats, needed: Floats) -> Floats:
        """Return the external torques (N,) on joints with acceleration errors `off` (V,).

        `needed` (V,) are the torques of the model for its accelerations.
        """
        outside = np.zeros(self._model.nv)
        known = self._data if self._corrections is None else self._corrections.known
        self._mujoco.mj_mulM(self._model, known, outside, off)
        return (outside + needed - self._data.qfrc_applied)[self._speeds]

    def _computed(self, wanted: Floats) -> Floats:
        """Return the torques of accelerations, by the servos' model."""
        data = self._data
        if self._corrections is not None:
            data = self._corrections.known
            data.qpos[:], data.qvel[:] = self._data.qpos, self._data.qvel
            self._mujoco.mj_step1(self._model, data)
        needed = np.zeros(self._model.nv)
        self._mujoco.mj_mulM(self._model, data, needed, wanted)
        return needed + (data.qfrc_bias - data.qfrc_passive)

    def _settled(self, start: Floats) -> "_Corrections":
        """Return the integral term of an arm that has been at rest for a while."""
        known = self._mujoco.MjData(self._model)
        known.qpos[self._places] = start
        for model, data in ((self._model, known), (self._plant, self._data)):
            self._mujoco.mj_step1(model, data)
        held = np.zeros((1, self._model.nv))
        missing = (self._data.qfrc_bias - known.qfrc_bias)[None]
        self._mujoco.mj_solveM(self._model, known, held, missing)
        return _Corrections(known, np.zeros(len(start)), held[0, self._speeds].copy())

    def _answer(self, velocities: Floats) -> Floats:
        """Return the accelerations (N,) of the joints for a command."""
        angles, speeds = self._data.qpos[self._places], self._data.qvel[self._speeds]
        if self._corrections is not None:
            return self._corrected(self._corrections, velocities, angles, speeds)
        return self._wanted(velocities, angles, speeds)

    def _corrected(
        self, corrections: "_Corrections", velocities: Floats, angles: Floats, speeds: Floats
    ) -> Floats:
        """Return accelerations (N,) by which the arm follows the speeds of its model."""
        step, most = self.step_s, self._acceleration
        if self.protection.stopped and self.protection.pushed:
            corrections.speeds = speeds  # the arm yields to external torques
        accelerations = self._wanted(velocities, angles, corrections.speeds)
        off = corrections.speeds - speeds
        answer = accelerations + self._gain * off + corrections.held
        if not self.protection.pushed:
            # Both poles are at half the gain, so there is no overshoot.
            held = corrections.held + 0.25 * self._gain * self._gain * step * off
            corrections.held = np.clip(held, -most, most)
        corrections.speeds = corrections.speeds + step * accelerations
        return answer

    def _wanted(self, velocities: Floats, angles: Floats, speeds: Floats) -> Floats:
        """Return the accelerations (N,) at speeds (N,) of an arm that is known exactly."""
        allowed = np.clip(velocities, -self._speed, self._speed)
        allowed = np.clip(
            allowed, -self._braked(angles - self._lower), self._braked(self._upper - angles)
        )
        return np.clip((allowed - speeds) * self._gain, -self._acceleration, self._acceleration)

    def _braked(self, room: Floats) -> Floats:
        """Return the speeds (N,) from which lagging joints can stop within some radians."""
        room = np.maximum(room, 0.0)
        return np.minimum(np.sqrt(self._acceleration * room), room / (4.0 * self._lag))


@dataclass
class _Corrections:
    """The feedback of servos whose model of the arm has errors.

    `known` (`mujoco.MjData`) is that of the model; `speeds` (N,) are the desired joint speeds, and
    `held` (N,) is the integral term, as accelerations.
    """

    known: Any
    speeds: Floats
    held: Floats
