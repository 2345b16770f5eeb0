"""Short recordings of the moving scene, and how a track of one agrees with what is true."""

import io
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
import pytest
from drawn import Drawn
from faults import Moment, Moments
from numpy.typing import NDArray
from tracking_errors import TrackingErrors, tracking_errors

from servoid._native import Tracker, TrackSettings, View, silhouette_ious
from servoid.capture import Capture, open_capture
from servoid.cli import main
from servoid.pose import Pose
from servoid.record import Waypoint, read_trajectory
from servoid.shape import Body, load_body
from servoid.sim import MovingScene, Scenario, snail, write_moving_sample
from servoid.sim.surface import outer_mesh
from servoid.track import cameras_of, read_instants

Array = NDArray[np.float64]

WRONG_M, WRONG_RAD = 0.03, np.radians(20.0)
SNAIL = outer_mesh(snail.PARTS)[0]
SCENARIOS = {
    "colour": Scenario(count=40, size="small"),
    "grey": Scenario(count=14, size="small", grey=True),
    "one camera": Scenario(count=14, size="small", one_camera=True),
    "hand": Scenario(count=5, size="small", hand=True),
}


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording on disk, and the scene that it shows."""

    folder: Path
    scene: MovingScene

    @cached_property
    def capture(self) -> Capture:
        return open_capture(self.folder)

    def truth(self, index: int) -> Array:
        """Return the toy's true pose (4, 4) in the capture's world."""
        if self.scene.scenario.hand:
            return self.scene.room_from_object(index)
        return self.scene.left_from_object(index)

    def moments(self) -> Moments:
        instants = read_instants(self.capture, self.capture.observations())
        return [Moment(one.time_s, one.world_from_camera, one.images) for one in instants]

    def errors(self, points: Sequence[Waypoint]) -> TrackingErrors:
        """Compare a track with the truth since its first pose."""
        truth = [self.truth(point.observation or 0) for point in points]
        return tracking_errors([one.world_from_object.matrix() for one in points], truth, SNAIL)

    def overlaps(self, body: Body, points: Iterable[Waypoint]) -> Array:
        """Return the overlap of the body's outlines with the true masks of the left camera."""
        found = []
        for point in points:
            mask = self.scene.look(point.observation or 0).mask
            view = View(
                camera=cameras_of(self.capture)[0], world_from_camera=Pose.identity(), mask=mask
            )
            found.extend(silhouette_ious(placed(body, point.world_from_object), [view]))
        return np.array(found)


@dataclass(frozen=True, eq=False)
class Alone:
    """What `servoid track` made of a recording, a mask and nothing else."""

    recording: Recording
    folder: Path
    said: str

    @cached_property
    def points(self) -> list[Waypoint]:
        return read_trajectory(self.folder / "poses.csv")

    @cached_property
    def body(self) -> Body:
        return load_body(self.folder / "body.json").body()

    @cached_property
    def toy_from_body(self) -> Array:
        """Return where the body's frame is in the toy, (4, 4)."""
        return np.linalg.inv(self.recording.truth(0)) @ self.points[0].world_from_object.matrix()

    def start_in(self, recording: Recording, index: int = 0) -> Pose:
        """Return where the body is in an observation of a recording of the same toy."""
        return Pose(recording.truth(index) @ self.toy_from_body)

    def tracker_in(self, recording: Recording, moment: Moment) -> Tracker:
        """Start a tracker of the body in the first of a recording's moments."""
        tracker = Tracker(cameras_of(recording.capture), self.body, TrackSettings(seed=1))
        start = self.start_in(recording)
        tracker.start(moment.time_s, moment.world_from_camera, moment.images, start)
        return tracker


def recorder(folder: Path, drawn: Drawn) -> Callable[[str], Recording]:
    """Return what makes each recording of `SCENARIOS` once, when it is asked for."""
    made: dict[str, Recording] = {}

    def record(name: str) -> Recording:
        if name not in made:
            scenario, path = SCENARIOS[name], folder / name.replace(" ", "_")
            drawn(path, "moving", scenario, lambda new: write_moving_sample(new, scenario))
            made[name] = Recording(path, MovingScene(scenario))
        return made[name]

    return record


def run_servoid(folder: Path, *arguments: object) -> str:
    """Run `servoid ARGUMENTS` in a folder, in this process; return what it says."""
    said, complaints = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as ended:
        patch.chdir(folder)
        patch.setenv("COLUMNS", "80")
        patch.setenv("NO_COLOR", "1")
        with redirect_stdout(said), redirect_stderr(complaints):
            main([str(argument) for argument in arguments])
    assert not ended.value.code, complaints.getvalue()
    return said.getvalue()


def run_apart(folder: Path, *arguments: object, threads: int | None = None) -> str:
    """Run `servoid ARGUMENTS` in a folder and a process of its own; return what it says."""
    environment = os.environ | {"COLUMNS": "80", "NO_COLOR": "1"}
    if threads is not None:
        environment["RAYON_NUM_THREADS"] = str(threads)
    command = [sys.executable, "-m", "servoid", *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def track_alone(recording: Recording, folder: Path, *options: object) -> Alone:
    """Track a recording with no body, into a folder."""
    arguments = ("track", recording.folder, "--save-body", "body.json", *options)
    return Alone(recording, folder, run_servoid(folder, *arguments))


def placed(body: Body, world_from_object: Pose) -> Body:
    return Body(
        world_from_object=world_from_object,
        centers=body.centers,
        radii=body.radii,
        rotations=body.rotations,
    )


def pose_text(pose: Pose) -> str:
    """Write a pose as `--start` takes it."""
    return ",".join(f"{number:.9f}" for number in (*pose.translation, *pose.quaternion))


def wrong(errors: TrackingErrors) -> NDArray[np.bool_]:
    """Say which estimates must not be called tracked."""
    return (errors.add > WRONG_M) | (errors.rotation > WRONG_RAD)


def repaint(folder: Path, index: int, images: Sequence[NDArray[np.uint8]]) -> None:
    """Replace the images of one observation on disk."""
    for name, image in zip(("left", "right"), images, strict=False):
        path = folder / name / f"{index:06d}.jpg"
        assert cv2.imwrite(str(path), np.ascontiguousarray(image[..., ::-1]))
