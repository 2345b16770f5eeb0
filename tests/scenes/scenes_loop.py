"""A closed loop without images, whose estimates are noisy."""

from pathlib import Path

import numpy as np
from scene_table import Figures, Scene, scene
from servo_loop import Loop, position_errors, rms, to_and_fro

from servoid.servo import JointLaw, ServoSettings
from servoid.servo.settings import JointSettings

NOISE = (0.0005, float(np.radians(0.3)))


def _noisy(law: JointLaw) -> Scene:
    @scene(f"loop of noisy estimates, {law.value}", {"position rms": "mm", "held": "periods"})
    def noisy(seed: int, _folder: Path) -> Figures:
        settings = ServoSettings(joints=JointSettings(law=law))
        loop = Loop(to_and_fro(10), settings, noise=NOISE, seed=seed)
        loop.run(4)
        ticks = loop.run(10)
        return {
            "position rms": 1e3 * rms(position_errors(ticks)),
            "held": sum(bool(tick.command.holding) for tick in ticks),
        }

    return noisy


NOISY = {law: _noisy(law) for law in JointLaw}
