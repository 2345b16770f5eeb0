"""A simulated world: an arm with moving cameras, a moving object, and a room."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Lens
from servoid.camera import pinhole_lens
from servoid.errors import SimError
from servoid.pose import Floats, Pose
from servoid.sim.world.arms.calibration import Calibration
from servoid.sim.world.arms.encoders import Encoders
from servoid.sim.world.arms.joint_servos import JointServos
from servoid.sim.world.arms.kinematics import Kinematics
from servoid.sim.world.arms.own_weight import at_rest, check_strength
from servoid.sim.world.arms.protective_stop import ProtectiveStop, stop_torques
from servoid.sim.world.arms.sim_arm import SimArm
from servoid.sim.world.cameras.camera_simulator import (
    NAMES,
    CameraSimulator,
    Exposure,
    WorldParts,
    true_cameras,
)
from servoid.sim.world.cameras.gl_renderer import OpenGl
from servoid.sim.world.cameras.overview import overview_from
from servoid.sim.world.cameras.renderer import Raycaster, Renderer, Shot
from servoid.sim.world.events.faults import Occlude
from servoid.sim.world.events.motions import STILL, pose_of, row_of, unit_row
from servoid.sim.world.events.paths import Path, parse_path
from servoid.sim.world.events.timeline import Timeline
from servoid.sim.world.lab import Lab
from servoid.sim.world.objects import make_object, spin_axis
from servoid.sim.world.scene.building import build_plant, build_robot, compile_robot, start_angles
from servoid.sim.world.scene.engine import without_warnings
from servoid.sim.world.scene.layout import Layout
from servoid.sim.world.scene.meshes import as_mesh
from servoid.sim.world.scene.room import make_room
from servoid.sim.world.scene.solids import Solids, add_solids
from servoid.sim.world.scene.start_contact import check_free
from servoid.sim.world.scene.true_object import TrueObject, true_object
from servoid.sim.world.scene.visuals import BOARD, OBJECT, Box, Finish, Visual
from servoid.sim.world.settings import WorldSettings
from servoid.words import alternatives

_OVERVIEW_FOCAL = 1.05  # in widths of the picture
_RENDERERS = {"raycast": Raycaster, "mujoco": OpenGl}
_BOARD = Finish(color=(0.45, 0.36, 0.27))


class World:
    """Simulates a world, whose time advances with each command to its arm.

    Its time is independent of wall-clock time, and the same settings and commands give the same
    images, bit for bit. The object follows its path through obstacles; a collision stops the arm,
    until `arm.reset()`. Use it from one thread at a time.
    """

    arm: SimArm
    source: CameraSimulator
    notes: tuple[str, ...]  # messages for the user about its arm

    def __init__(self, settings: WorldSettings | None = None, *, path: Path | None = None) -> None:
        """Build the world; `path` replaces the one in the settings.

        Raises:
            SimError: a setting names what does not exist, or is out of its range, or the arm's
                motors do not carry its weight, or it starts in contact.
            MissingExtraError: MuJoCo is not installed.

        """
        self.settings: WorldSettings = settings or WorldSettings()
        settings = self.settings
        steps = round(settings.physics.period_s / settings.physics.step_s)
        path = path or parse_path(settings.object.path)
        visuals = [*make_object(settings.object.name, settings.object.radii), *_board(settings)]
        room = make_room(settings.background, settings.seed)
        visuals += room
        robot = build_robot(settings)
        add_solids(robot.spec, room)
        self.notes = robot.notes
        visuals += robot.visuals
        model = compile_robot(robot, settings.physics.step_s)
        kinematics = Kinematics(robot, model)
        lab = Lab(settings.in_effect, settings.seed)
        start = start_angles(robot, kinematics, settings)
        hand_from_object = pose_of(settings.object.hand_from_object)
        self._timeline = Timeline(
            settings, kinematics.world_from_hand(start) @ hand_from_object, path
        )
        solids = Solids(model, kinematics, start)
        plant, known = build_plant(robot, model, lab, solids, visuals)
        check_strength(robot, plant, start, settings.arm.name)
        first = row_of(self._timeline.world_from_object_at(0.0))
        check_free(plant, at_rest(robot, plant, start), solids, first, settings.arm.name)
        thresholds = stop_torques(robot, model, start, settings.arm.stop_torque)
        protection = ProtectiveStop(thresholds, settings.physics.step_s)
        self._servos = JointServos(robot, model, kinematics, start, plant, protection, known=known)
        self._layout = Layout(visuals, model, kinematics, self._timeline)
        self._visuals = tuple(visuals)
        self._renderer = _renderer(settings, self._visuals)
        self._kinematics = kinematics
        encoders = Encoders(self._servos, lab, steps, robot.hand_count)
        calibration = Calibration(robot, kinematics, lab, true_cameras(settings.cameras))
        parts = WorldParts(
            servos=self._servos,
            kinematics=kinematics,
            layout=self._layout,
            timeline=self._timeline,
            renderer=self._renderer,
            lab=lab,
            encoders=encoders,
            calibration=calibration,
        )
        self.source = CameraSimulator(settings, parts)
        period_s = settings.physics.period_s
        # Without a reference from the arm to the world there is no reference cycle.
        advance = partial(_advance, self._servos, self._timeline, self.source, steps)
        self.arm = SimArm(kinematics, calibration, encoders, period_s, advance, solids, protection)

    @property
    def time_s(self) -> float:
        """Return the time since the start of the simulation, in seconds."""
        return self._servos.time_s

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the ideal pinhole cameras of the source, as calibrated."""
        return self.source.cameras

    @property
    def camera_names(self) -> tuple[str, ...]:
        """Return the names of the source's cameras."""
        return NAMES

    @property
    def spin_axis(self) -> tuple[float, float, float] | None:
        """Return the unit axis of rotational symmetry in the object's frame, if any."""
        return spin_axis(self.settings.object.name, self.settings.object.radii)

    @property
    def contact_force(self) -> float:
        """Return the greatest present contact force of the arm in N, 0 without contact."""
        return self._servos.contact_force

    def start_path(self) -> None:
        """Start the object's path; until then the object rests.

        Raises:
            SimError: it has already started.

        """
        if self._timeline.path_starts_s is not None:
            raise SimError(
                f"the object's path began at {self._timeline.path_starts_s:g} s; it begins once"
            )
        self._timeline.path_starts_s = self.time_s

    def world_from_object_at(self, time_s: float) -> Pose:
        """Return the object's true pose at a time."""
        return self._timeline.world_from_object_at(time_s)

    def world_from_hand_at(self, time_s: float) -> Pose:
        """Return the hand's true pose at a control period's time within the last second."""
        step = round(time_s / self._servos.step_s)
        return self._kinematics.world_from_hand(self._servos.positions_of(step))

    def true_views(self) -> tuple[tuple[Camera, Pose], ...]:
        """Return the true cameras and their true poses in the newest observation.

        Raises:
            SimError: no observation was handed out yet.

        """
        poses = self._kinematics.world_from_eyes(self._newest().positions_at_time)
        return tuple(zip(self.source.true_cameras, poses, strict=True))

    def true_time_s(self) -> float:
        """Return the true time of the newest observation.

        Raises:
            SimError: no observation was handed out yet.

        """
        return self._newest().time_s

    def twist_at(self, time_s: float) -> Floats:
        """Return the object's true twist (6,) in the world: of its origin in m/s, and in rad/s."""
        return self._timeline.twist_at(time_s)

    def masks(self) -> tuple[NDArray[np.uint8], ...]:
        """Return the object's true masks, (H, W) with 255 inside, in the newest observation.

        Raises:
            SimError: no observation was handed out yet.

        """
        exposure = self._newest()
        visuals = self._layout.world_from_visuals(exposure.positions_at_time, exposure.time_s)
        numbers = [index for index, one in enumerate(self._visuals) if one.carrier == OBJECT]
        masks = []
        for camera, pose in self.true_views():
            _, ids = self._renderer.depth(pinhole_lens(camera), row_of(pose), visuals)
            masks.append(np.where(np.isin(ids, numbers), np.uint8(255), np.uint8(0)))
        return tuple(masks)

    def overview(
        self, size_px: tuple[int, int] = (960, 720), samples: int = 3
    ) -> NDArray[np.uint8]:
        """Return a picture (H, W, 3) uint8 RGB of the arm, its head, the object and the room.

        `samples` are rays along each side of a pixel.
        """
        width, height = size_px
        focal = _OVERVIEW_FOCAL * width
        lens = Lens(
            model="pinhole",
            size_px=size_px,
            focal_px=(focal, focal),
            center_px=(0.5 * (width - 1), 0.5 * (height - 1)),
        )
        pose = overview_from(self._timeline.world_from_object_at(0.0).translation)
        visuals = self._layout.world_from_visuals(self._servos.positions, self.time_s)
        return self._renderer.image(
            Shot(
                lens=lens,
                world_from_lens=row_of(pose)[None],
                world_from_visuals=visuals[None],
                toward=self.settings.light.toward,
                level=self._timeline.level_at(self.time_s),
                samples=samples,
                threads=self.settings.threads,
            )
        )

    def object_mesh(self) -> tuple[Floats, NDArray[np.int64]]:
        """Return the object's surface in its own frame: vertices (N, 3) and faces (M, 3).

        Adjacent parts of the object overlap.
        """
        vertices, faces, count = [], [], 0
        for visual in self._visuals:
            if visual.carrier == OBJECT:
                mesh = as_mesh(visual.shape)
                place = pose_of(unit_row(visual.carrier_from_visual))
                vertices.append(place.transform(np.ascontiguousarray(mesh.vertices)))
                faces.append(mesh.faces + count)
                count += len(mesh.vertices)
        return np.concatenate(vertices), np.concatenate(faces)

    def true_object(self) -> TrueObject:
        """Return the object's true shape, for evaluation only."""
        return true_object([one for one in self._visuals if one.carrier == OBJECT])

    def _newest(self) -> Exposure:
        exposure = self.source.handed_out
        if exposure is None:
            raise SimError("no observation was handed out yet; call source.newest() first")
        return exposure


def _advance(
    servos: JointServos, timeline: Timeline, source: CameraSimulator, steps: int, velocities: Floats
) -> None:
    """Simulate one control period of a number of steps.

    Raises:
        SimError: the physics became unstable; later commands move nothing.

    """
    before = servos.instability
    with without_warnings():
        for _ in range(steps):
            servos.step(velocities, row_of(timeline.world_from_object_at(servos.time_s)))
    source.expose()
    if before is None and servos.instability is not None:
        raise servos.instability


def _board(settings: WorldSettings) -> list[Visual]:
    """Return the board of an occlusion, if there is one; it moves along its x axis."""
    boards = [fault for fault in settings.faults if isinstance(fault, Occlude)]
    if not boards:
        return []
    width, height = boards[0].half_size
    return [Visual(Box((width, height, 0.004)), _BOARD, BOARD, STILL)]


def _renderer(settings: WorldSettings, visuals: tuple[Visual, ...]) -> Renderer:
    if settings.renderer not in _RENDERERS:
        known = alternatives(settings.renderer, _RENDERERS)
        raise SimError(f"unknown renderer '{settings.renderer}'{known}")
    return _RENDERERS[settings.renderer](visuals)
