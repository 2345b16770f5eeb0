"""One run whose object swings at many frequencies: the responses of recognition, eyes and hand."""

from typing import Annotated

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from servoid import model
from servoid._native import Body
from servoid.batch import Experiment
from servoid.errors import ServoError
from servoid.pose.exact import Floats
from servoid.servo import Controller, ServoSettings, servo
from servoid.servo.exploration import awaited
from servoid.sim.world import ArmSettings, CameraSettings, ObjectSettings, World, WorldSettings
from servoid.track import Follower, Method
from servoid_experiments.bode.recording import Course, RunRecorder
from servoid_experiments.bode.swinging import Swing, Swinging, amplitudes
from servoid_experiments.design import about

_CAMERAS = CameraSettings(size_px=(320, 240), samples=1, moments=1)
_ELLIPSOIDS = 4
_SAME_M = 1e-7  # closer vertices are merged
_HELD_S = 0.1  # for which the hand may be held in the recorded period


class ResponseCase(msgspec.Struct, frozen=True, kw_only=True):
    """A run: the object and its motion, and whether its known motion is fed forward.

    `feed_forward` applies to hand and eyes. Without `eyes_follow`, the eyes are fixed to the hand
    and look straight ahead. `scale` multiplies all amplitudes.
    """

    seed: int
    feed_forward: bool
    eyes_follow: bool
    object: str
    background: str
    base_hz: float
    sideways_lines: tuple[int, ...]
    depth_lines: tuple[int, ...]
    speed: float
    amplitude: float
    run_in_s: float
    scale: float = 1.0

    @property
    def axes(self) -> tuple[tuple[int, str, tuple[int, ...]], ...]:
        """Return index, name and lines of each axis along which the object moves."""
        return (0, "sideways", self.sideways_lines), (2, "depth", self.depth_lines)


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """The response of one signal to the object's motion along one axis, by frequency.

    `real` and `imag` are those of the ratio of complex amplitudes; `floor` is the RMS amplitude at
    frequencies without excitation, in m.
    """

    signal: str
    axis: str
    hz: list[float]
    real: list[float]
    imag: list[float]
    floor: float

    @property
    def ratio(self) -> NDArray[np.complex128]:
        """Return the complex response, (L,)."""
        return np.array(self.real) + 1j * np.array(self.imag)


class ResponseRow(msgspec.Struct, frozen=True, kw_only=True):
    """The responses of a run, and the used share of its limits.

    The shares of the joints' limits in speed and acceleration are the maxima; `limited_share` is
    the share of control periods in which a limit of joints or hand was reached.
    """

    answers: list[Answer]
    images: Annotated[int, about("observations that count")]
    joint_speed_share: Annotated[float, about("of the limit, the greatest in use")]
    joint_acceleration_share: Annotated[float, about("of the limit, the greatest in use")]
    limited_share: Annotated[float, about("of control periods, at a limit")]

    def answer(self, signal: str, axis: str) -> Answer | None:
        """Return the response of a signal along an axis, None if there is none."""
        return next((one for one in self.answers if (one.signal, one.axis) == (signal, axis)), None)


def run_response(case: ResponseCase) -> ResponseRow:
    """Follow an object that swings, and compare the responses with its motion.

    Raises:
        ServoError: the hand was held, so that its motion does not describe the loop.
        SimError: the case names what does not exist.

    """
    world = World(_world(case), path=_path(case))
    body = body_of(world)
    object_from_body = body.world_from_object
    tracker = _start_tracker(world, body, case.seed)
    settings = _servo(case)
    goal_from_body = (
        world.arm.world_from_hand(world.arm.state().positions).inverse()
        @ world.world_from_object_at(world.time_s)
        @ object_from_body
    )
    world.start_path()
    recorder = RunRecorder(world, object_from_body, settings)
    controller = Controller(world.arm, settings)
    first = round(case.run_in_s / world.arm.period_s)
    count = round(1.0 / (case.base_hz * world.arm.period_s))
    ticks = servo(world.arm, world.source, tracker, controller, lambda _: goal_from_body)
    for place, tick in enumerate(ticks):
        if place == first + count:
            break
        recorder.record(tick, counts=place >= first)
    if recorder.held_s > _HELD_S:
        raise ServoError(
            f"the hand was held for {recorder.held_s:.2f} s of the {1.0 / case.base_hz:g} s that "
            "count; lower response.speed, or choose an object that is seen better"
        )
    return ResponseRow(
        answers=_answers(case, recorder),
        images=len(recorder.courses["seen"]),
        joint_speed_share=recorder.joint_speed_share,
        joint_acceleration_share=recorder.joint_acceleration_share,
        limited_share=recorder.limited / count,
    )


RESPONSE = Experiment("bode.response", run_response, ResponseCase, ResponseRow)


def body_of(world: World) -> Body:
    """Model the object of a world from its true surface: exploration is not part of the study."""
    vertices, faces = _welded(*world.object_mesh())
    request = model.Request(max_ellipsoids=_ELLIPSOIDS, seed=0, threads=1)
    return model.fit_mesh(vertices, faces, request).body


def _welded(vertices: Floats, faces: NDArray[np.int64]) -> tuple[Floats, NDArray[np.int64]]:
    """Merge vertices at one position, which textures keep apart, so that the mesh is closed."""
    grid = np.round(vertices / _SAME_M).astype(np.int64)
    _, first, number = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    joined = number.reshape(-1)[faces]
    flat = (joined == np.roll(joined, 1, axis=1)).any(axis=1)
    return np.ascontiguousarray(vertices[first]), np.ascontiguousarray(joined[~flat])


def _world(case: ResponseCase) -> WorldSettings:
    return WorldSettings(
        arm=ArmSettings(turning_eyes=case.eyes_follow),
        object=ObjectSettings(name=case.object),
        cameras=_CAMERAS,
        ideal=True,
        background=case.background,
        seed=case.seed,
        threads=1,
    )


def _path(case: ResponseCase) -> Swinging:
    swings = [
        Swing.of(
            lines,
            case.base_hz,
            speed=case.scale * case.speed,
            amplitude=case.scale * case.amplitude,
            seed=(case.seed, axis),
        )
        for axis, _, lines in case.axes
    ]
    return Swinging(*swings)


def _servo(case: ResponseCase) -> ServoSettings:
    settings = ServoSettings()
    return replace(
        settings,
        hand=replace(settings.hand, feed_forward=case.feed_forward),
        gaze=replace(settings.gaze, feed_forward=case.feed_forward),
    )


def _start_tracker(world: World, body: Body, seed: int) -> Follower:
    """Start a tracker on the static object."""
    instant = awaited(world.arm, world.source)
    tracker = Method.REGION.maker(world.cameras, body, {"seed": seed})
    tracker.start(
        instant.time_s,
        instant.world_from_camera,
        instant.images,
        world.world_from_object_at(instant.time_s) @ body.world_from_object,
        world.masks(),
    )
    return tracker


def _answers(case: ResponseCase, recorder: RunRecorder) -> list[Answer]:
    """Compare each signal with the object's motion, along both axes."""
    return [
        _answer(case, signal, course, axis)
        for signal, course in recorder.courses.items()
        for axis in case.axes
        if case.eyes_follow or (signal, axis[1]) != ("gaze", "depth")
    ]


def _answer(
    case: ResponseCase, signal: str, course: Course, along: tuple[int, str, tuple[int, ...]]
) -> Answer:
    axis, name, lines = along
    moved = {*case.sideways_lines, *case.depth_lines}
    most = max(moved)
    times, truth, reported = map(np.array, zip(*course, strict=True))
    pairs = np.array([truth[:, axis], reported[:, axis]]).T
    spectrum = amplitudes(times, pairs, case.base_hz, most)
    at = np.array(lines) - 1
    ratio = spectrum[at, 1] / spectrum[at, 0]
    others = [line - 1 for line in range(1, most + 1) if line not in moved]
    quiet = spectrum[others, 1]
    return Answer(
        signal=signal,
        axis=name,
        hz=[line * case.base_hz for line in lines],
        real=ratio.real.tolist(),
        imag=ratio.imag.tolist(),
        floor=float(np.sqrt(np.mean(np.abs(quiet) ** 2))) if others else 0.0,
    )
