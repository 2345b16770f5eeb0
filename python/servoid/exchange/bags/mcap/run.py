"""Writes a run of tracking or servoing as MCAP in the background."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Camera, Estimate, Lens
from servoid.camera import pinhole_lens
from servoid.capture import Capture
from servoid.exchange.bags.mcap import messages as ros
from servoid.exchange.bags.mcap.background import Background
from servoid.exchange.bags.mcap.mcap_file import McapFile, mcap_file
from servoid.exchange.bags.mcap.observations import ObservationRecorder, RecordedCamera, stamp_of
from servoid.exchange.bags.mcap.raw_images import RawImage, RawObservation, raw_observations
from servoid.exchange.bags.names import RIG, TF_TOPIC, WORLD, topic_of, word_of
from servoid.pose import Pose
from servoid.servo import JointState
from servoid.source import Instant
from servoid.track import TrackStep
from servoid.words import counted

MOST_WAITING = 64
"""The maximum number of observations to be written that are pending; a live source drops more."""

DIAGNOSTICS_TOPIC, JOINTS_TOPIC = "/diagnostics", "/joint_states"
_LEVELS = {"tracking": 0, "searching": 1, "lost": 2}  # OK, WARN, ERROR
_DARK = 2
_MS_PER_S = 1e3


@dataclass(frozen=True)
class RunRig:
    """The cameras of a run, and the conversion of an instant to a recorded observation."""

    cameras: tuple[RecordedCamera, ...]
    observe: Callable[[Instant], RawObservation]

    @classmethod
    def of_capture(cls, capture: Capture) -> "RunRig":
        """Record the images of a capture as they are stored."""
        observations = capture.observations()

        def observe(instant: Instant) -> RawObservation:
            raw = next(raw_observations(capture, [observations[instant.index]]))
            return replace(raw, time_s=instant.time_s)

        return cls(capture.cameras, observe)

    @classmethod
    def of_source(cls, cameras: Sequence[Camera], names: Sequence[str]) -> "RunRig":
        """Record the images of a source's ideal pinhole cameras; each may move on its own."""
        both = zip(names, cameras, strict=True)
        return cls(tuple(_Pinhole(name, pinhole_lens(camera)) for name, camera in both), _seen)


@dataclass(frozen=True, eq=False)
class ObjectState:
    """The result for one object in one observation; `body` is present if it is new.

    `colors` are those of the body's ellipsoids, (K, 3) uint8 RGB. `seconds` is the tracker's time.
    Without an `estimate`, no camera delivered an image.
    """

    name: str
    estimate: Estimate | None
    body: Body | None = None
    colors: NDArray[np.uint8] | None = None
    notices: tuple[str, ...] = ()
    seconds: float = 0.0


@dataclass(frozen=True, eq=False)
class _Pinhole:
    """An ideal pinhole camera, which moves on its own."""

    name: str
    lens: Lens
    rig_from_camera: Pose = Pose.identity()  # noqa: RUF009 - poses are immutable


@dataclass(frozen=True, eq=False)
class _PendingObservation:
    """A pending observation, with its results."""

    instant: Instant
    states: tuple[ObjectState, ...]


@dataclass(frozen=True, eq=False)
class _PendingJoints:
    """A pending state of an arm's joints."""

    names: tuple[str, ...]
    state: JointState


@contextmanager
def mcap_run(path: str | Path, rig: RunRig, *, can_wait: bool) -> Iterator["McapRun"]:
    """Record a run to an MCAP file that appears at `path` when the block ends.

    It is written in a thread of its own. Up to `MOST_WAITING` jobs may be pending. Beyond that, the
    run waits if it `can_wait`; otherwise observations are dropped, which `notes` reports. If the
    block raises, nothing is left of the file.

    Raises:
        OutputError: the file cannot be written.
        MissingExtraError: the library that writes bags is missing.

    """
    with mcap_file(path) as file:
        run = McapRun(Path(path), file, rig, can_wait=can_wait)
        try:
            yield run
        except BaseException:
            run.give_up()
            raise
        run.close()


class McapRun:
    """A recording that is written during a run; adding to it only puts data into a queue."""

    def __init__(self, path: Path, file: McapFile, rig: RunRig, *, can_wait: bool) -> None:
        self._path, self._file, self._rig = path, file, rig
        self._recorder = ObservationRecorder(path, file, rig.cameras)
        self._background: Background[_PendingObservation | _PendingJoints] = Background(
            self._write, MOST_WAITING, can_wait=can_wait
        )
        self._known: set[str] = set()
        self._owed: dict[str, Body] = {}  # bodies that have not been written yet

    def add(self, step: TrackStep) -> None:
        """Record a step of tracking: images, poses, new bodies, and diagnostics.

        Raises:
            OutputError: the file cannot be written.

        """
        self.see(
            step.instant,
            [
                ObjectState(
                    name=one.name,
                    estimate=tracked.estimate,
                    body=one.body if tracked.evolved or one.name not in self._known else None,
                    colors=one.colors,
                    notices=tracked.notices,
                    seconds=tracked.seconds,
                )
                for one, tracked in zip(step.objects, step.tracked, strict=True)
            ],
        )

    def see(self, instant: Instant, states: Sequence[ObjectState]) -> None:
        """Record an observation and the results for its objects.

        Raises:
            OutputError: the file cannot be written.

        """
        for one in states:
            if one.body is not None:
                self._known.add(one.name)
                self._owed[one.name] = one.body
        # A body whose observation was dropped is written with the next one that is not.
        whole = tuple(replace(one, body=self._owed.get(one.name)) for one in states)
        if self._background.put(_PendingObservation(instant, whole)):
            self._owed.clear()

    def feel(self, names: Sequence[str], state: JointState) -> None:
        """Record the state of an arm's joints.

        Raises:
            OutputError: the file cannot be written.

        """
        self._background.put(_PendingJoints(tuple(names), state))

    def notes(self) -> list[str]:
        """Return messages on what the recording lacks."""
        lacking, whole = self._background.dropped, self._background.handed
        if not lacking:
            return []
        return [
            f"{self._path} lacks {lacking} of {counted(whole, 'message')} that were to be written: "
            "writing was too slow; use a faster disk, or record fewer images"
        ]

    def close(self) -> None:
        """Write the pending data.

        Raises:
            OutputError: the file cannot be written.

        """
        self._background.close()

    def give_up(self) -> None:
        """Discard the pending data."""
        self._background.give_up()

    def _write(self, job: "_PendingObservation | _PendingJoints") -> None:
        """Write one pending job; runs in the other thread."""
        made = self._file.messages
        if isinstance(job, _PendingJoints):
            stamp_ns, state = stamp_of(job.state.time_s), job.state
            message = made.joints(stamp_ns, job.names, state.positions, state.velocities)
            self._file.add(JOINTS_TOPIC, ros.JOINTS, stamp_ns, message)
            return
        stamp_ns = self._recorder.add(self._rig.observe(job.instant))
        for state in job.states:
            self._object(stamp_ns, state)
        if job.states:
            entries = [_diagnosis(state) for state in job.states]
            message = made.diagnostics(stamp_ns, entries)
            self._file.add(DIAGNOSTICS_TOPIC, ros.DIAGNOSTICS, stamp_ns, message)

    def _object(self, stamp_ns: int, state: ObjectState) -> None:
        """Write an object's pose, if it is to be trusted, and its body if it is new."""
        made, frame = self._file.messages, _frame_of(state.name)
        if state.body is not None:
            message = made.markers(stamp_ns, frame, state.body, state.colors)
            self._file.add(topic_of(state.name, "body"), ros.MARKERS, stamp_ns, message)
        estimate = state.estimate
        if estimate is None or estimate.status != "tracking":
            return
        pose = estimate.world_from_object
        message = made.pose(stamp_ns, WORLD, pose, estimate.covariance)
        self._file.add(topic_of(state.name, "pose"), ros.POSE, stamp_ns, message)
        link = made.transforms(stamp_ns, [(WORLD, frame, pose)])
        self._file.add(TF_TOPIC, ros.TRANSFORMS, stamp_ns, link)


def _frame_of(name: str) -> str:
    word = word_of(name)
    return f"object_{word}" if word in (WORLD, RIG) else word


def _diagnosis(state: ObjectState) -> ros.Entry:
    """Return an object's diagnostics: its level, its status, and the tracker's values."""
    name, estimate = f"servoid: {state.name}", state.estimate
    if estimate is None:
        return name, _DARK, "dark", {}
    values = {
        "confidence": f"{estimate.confidence:.4f}",
        "located": str(estimate.located).lower(),
        "evolved": str(estimate.evolved).lower(),
        "milliseconds": f"{_MS_PER_S * state.seconds:.3f}",
        "hypotheses": str(estimate.evaluations),
    }
    values |= {f"notice {number}": notice for number, notice in enumerate(state.notices, start=1)}
    return name, _LEVELS[estimate.status], estimate.status, values


def _seen(instant: Instant) -> RawObservation:
    return RawObservation(
        time_s=instant.time_s,
        world_from_rig=Pose.identity(),
        images=tuple(
            None if image is None else RawImage(image, "mono8" if image.ndim == 2 else "rgb8")
            for image in instant.images
        ),
        depths=instant.depths,
        world_from_cameras=instant.world_from_camera,
    )
