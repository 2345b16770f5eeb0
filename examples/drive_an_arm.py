"""Servos an arm whose driver runs in a process of its own, with the tracker in a thread.

Run it after `make samples`: `.venv/bin/python examples/drive_an_arm.py out/moving`. The driver
moves a simulated arm, and the cameras play a recording: the hand moves as the toy does in it.
"""

import sys
import tempfile
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from servoid.capture import open_capture
from servoid.errors import ServoidError
from servoid.servo import Controller, RememberingArm, TrackingThread, brought_to_rest, servo_tracked
from servoid.servo.link import LinkedArm
from servoid.sim import SerialArm, read_arm
from servoid.sim.joint_driver import drive_joints
from servoid.source import Recording, cameras_of
from servoid.track import Tracker, follow


def main(folder: str, address: str) -> None:
    """Model the toy in the first observation, and follow it through the others."""
    capture = open_capture(folder)
    first = next(iter(follow(capture)))
    body = first.objects[0].body
    tracker = Tracker(cameras_of(capture), body)
    with LinkedArm(SerialArm(read_arm()), address) as linked:  # from here on the arm may move
        arm = RememberingArm(linked)
        controller, start = Controller(arm), arm.world_from_hand(arm.state().positions)
        goal_from_object = start.inverse() @ body.world_from_object
        source = Recording(capture, clock=linked.now_s)
        poses, images = first.instant.world_from_camera, first.instant.images
        tracker.start(linked.now_s(), poses, images, body.world_from_object)
        ticks = []
        with TrackingThread(source, tracker) as tracking, brought_to_rest(arm, controller):
            for tick in servo_tracked(arm, tracking, controller, lambda _: goal_from_object):
                ticks.append(tick)
                if source.is_over and tick.instant is None:
                    break
        counts = linked.last_state
    hands = [arm.world_from_hand(tick.state.positions).translation for tick in ticks]
    moved_mm = 1e3 * np.linalg.norm(np.subtract(hands, start.translation), axis=1)
    tracked = [tick for tick in ticks if tick.instant is not None]
    track_ms = 1e3 * np.median([tick.track_s for tick in tracked])
    dropped = sum(tick.dropped for tick in tracked)
    print(f"{len(ticks)} control periods, {len(tracked)} observations, {dropped} dropped")
    print(f"the tracker took {track_ms:.1f} ms (median); the hand moved {moved_mm.max():.0f} mm")
    print(
        f"the driver took {counts.accepted} commands, "
        f"missed {counts.missing}, refused {counts.refused}"
    )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        address = str(Path(folder) / "arm")
        driver = get_context("spawn").Process(target=drive_joints, args=(address,), daemon=True)
        driver.start()
        try:
            main(sys.argv[1] if len(sys.argv) > 1 else "out/moving", address)
        except ServoidError as error:  # says what to do
            sys.exit(f"error: {error}")
        finally:
            driver.terminate()
