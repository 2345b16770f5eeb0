"""Makes a simulated arm explore and follow a drill, and prints how well hand and cameras follow.

Run it with `.venv/bin/python examples/servo_to_an_object.py`; it takes about ten seconds.
"""

import tempfile

from servoid.servo import ServoMetrics
from servoid.sim.trial import TrialSettings, changed, run_servo_trial

VALUES = {
    "world.object.name": "drill",
    "world.object.path": "circle:0.03@4s",
    "world.cameras.size_px": (320, 240),
    "servo.look.count": 2,
    "run.seconds": 3.0,
    "run.settle_s": 1.5,
}


def main() -> None:
    """Explore the drill, model it, and follow it for three seconds."""
    settings = changed(TrialSettings(), VALUES, "this example")
    with tempfile.TemporaryDirectory() as folder:
        trial = run_servo_trial(settings, folder)
    body, looks = trial.exploration.body, trial.exploration.looks
    print(f"a body of {len(body)} ellipsoids, looked at from {len(looks)} viewpoints")
    for name, value in ServoMetrics.of(trial.log, settings.run.settle_s).figures().items():
        print(f"{name}: {value}")


if __name__ == "__main__":
    main()
