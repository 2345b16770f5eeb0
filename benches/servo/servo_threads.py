"""Measures how long an arm waits for its next command while the tracker searches a lost object.

A driver in a process of its own measures by its own clock. The images are those of a moving sample,
mirrored, so that the object is not found. Run it after `make samples`.
"""

import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from servoid.capture import open_capture
from servoid.servo import (
    Controller,
    Perception,
    RememberingArm,
    Tick,
    TrackingInTurn,
    TrackingThread,
    brought_to_rest,
    servo_tracked,
)
from servoid.servo.link import LinkedArm, LinkSettings
from servoid.sim.arm_file import read_arm
from servoid.sim.joint_driver import drive_joints
from servoid.sim.serial_arm import SerialArm
from servoid.source import Instant, Recording, Source
from servoid.track import Tracker, follow

SETTINGS = LinkSettings(hold_s=1.0)  # longer than any tracking step, so that all are measured


class Mirrored:
    """Plays a recording mirrored from left to right."""

    def __init__(self, inner: Recording) -> None:
        self.inner, self.cameras = inner, inner.cameras

    def newest(self) -> Instant | None:
        """Return the newest observation."""
        found = self.inner.newest()
        if found is None:
            return None
        images = tuple(None if one is None else one[:, ::-1].copy() for one in found.images)
        return replace(found, images=images)


def ticks(folder: str, address: str, *, threaded: bool) -> Iterator[Tick]:
    """Servo through a recording."""
    capture = open_capture(folder)
    first = next(iter(follow(capture)))
    body = first.objects[0].body
    with ExitStack() as stack:
        linked = stack.enter_context(LinkedArm(SerialArm(read_arm()), address, SETTINGS))
        arm = RememberingArm(linked)
        recording = Recording(capture, clock=linked.now_s)
        source: Source = Mirrored(recording)
        tracker = Tracker(recording.cameras, body)
        poses, images = first.instant.world_from_camera, first.instant.images
        tracker.start(linked.now_s(), poses, images, body.world_from_object)
        controller = Controller(arm)
        perception: Perception = (
            stack.enter_context(TrackingThread(source, tracker))
            if threaded
            else TrackingInTurn(source, tracker)
        )
        stack.enter_context(brought_to_rest(arm, controller))
        for tick in servo_tracked(arm, perception, controller, lambda _: None):
            yield tick
            if recording.is_over and tick.instant is None:
                return


def main(folder: str) -> None:
    """Measure both variants."""
    with tempfile.TemporaryDirectory() as place:
        for threaded in (False, True):
            address = str(Path(place) / f"arm-{threaded}")
            drive = get_context("spawn").Process(
                target=drive_joints, args=(address, None, SETTINGS), daemon=True
            )
            drive.start()
            found = list(ticks(folder, address, threaded=threaded))
            drive.terminate()
            seen = [tick for tick in found if tick.instant is not None]
            looks = 1e3 * np.array([tick.track_s for tick in seen])
            gaps = 1e3 * np.diff([tick.state.time_s for tick in found])
            print(f"{'in a thread' if threaded else 'in turn'}:")
            print(f"  a look: {np.median(looks):.0f} ms, at most {looks.max():.0f} ms")
            shares = ", ".join(f"{np.percentile(gaps, share):.0f}" for share in (50, 99, 100))
            print(f"  between states that are answered: {shares} ms (50, 99, 100 %)")
            print(f"  {len(seen)} observations, {sum(tick.dropped for tick in seen)} dropped")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "out/moving")
