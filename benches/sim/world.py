"""Measures the wall time of a simulated second, with and without its images.

Run it with: python benches/sim/world.py [OBJECT]
"""

import sys
import time

import numpy as np

from servoid.sim.world import ObjectSettings, World, WorldSettings

SIMULATED_S = 3.0


def measure(
    background: str, name: str, looking: bool, ideal: bool = True
) -> tuple[float, float, int]:
    """Return wall seconds per simulated second, the worst control step in ms, and images drawn."""
    settings = WorldSettings(
        object=ObjectSettings(name=name, path="sine:0.15@10s"), background=background, ideal=ideal
    )
    world = World(settings)
    world.start_path()
    count = len(world.arm.joints.names)
    speeds = 0.1 * np.sin(np.arange(count))
    steps, images, began = [], 0, time.perf_counter()
    while world.time_s < SIMULATED_S:
        before = time.perf_counter()
        world.arm.command(speeds)
        steps.append(time.perf_counter() - before)
        if looking and world.source.newest() is not None:
            images += len(world.cameras)
    wall_s = time.perf_counter() - began
    return wall_s / SIMULATED_S, 1e3 * float(np.quantile(steps, 0.99)), images


def main() -> None:
    """Print lines for physics alone, ideal and in a laboratory, and for each background."""
    name = sys.argv[1] if len(sys.argv) > 1 else "bottle"
    print(f"{name}: wall seconds a simulated second, two cameras of 640x480 at 30 Hz")
    for background, looking, ideal in (
        ("plain", False, True),
        ("plain", False, False),
        ("plain", True, True),
        ("cluttered", True, True),
    ):
        wall_s, step_ms, images = measure(background, name, looking, ideal)
        each_ms = 1e3 * wall_s * SIMULATED_S / images if images else 0.0
        what = f"{background}, {images} images" if looking else "physics alone"
        what += "" if ideal else ", laboratory"
        print(
            f"{what:26} {wall_s:6.2f} s   p99 step {step_ms:5.2f} ms   {each_ms:5.1f} ms an image"
        )


if __name__ == "__main__":
    main()
