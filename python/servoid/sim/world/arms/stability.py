"""Whether the physics of an arm are stable."""

from typing import Any

from servoid.errors import SimError
from servoid.sim.world.scene.engine import load_mujoco
from servoid.words import digits


class Stability:
    """Reads from a `mujoco.MjData` whether its physics have become unstable.

    MuJoCo then warns of angles, speeds or accelerations that are huge or not finite, and begins
    anew from the reference angles.
    """

    def __init__(self, model: Any, data: Any) -> None:
        kinds = load_mujoco().mjtWarning
        self._model, self._warnings = model, data.warning
        self._kinds = [
            int(kind) for kind in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
        ]

    @property
    def is_lost(self) -> bool:
        """Return whether MuJoCo has warned."""
        return bool(self._warnings.number[self._kinds].any())

    def error(self, time_s: float) -> SimError:
        """Return the error of physics that became unstable at a time."""
        counts, places = self._warnings.number, self._warnings.lastinfo
        kind = next(kind for kind in self._kinds if counts[kind])
        # All joints turn: angles and speeds are numbered alike.
        joint = self._model.joint(int(self._model.dof_jntid[places[kind]])).name
        return SimError(
            f"the simulation became unstable at {time_s:.3f} s: joint '{joint}' moved without "
            f"bound; lower world.physics.step_s, which is {digits(self._model.opt.timestep)}, "
            "correct masses, inertias and armatures in the arm's file that are too small, or keep "
            "the object from being driven into the arm"
        )
