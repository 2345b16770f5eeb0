"""Draws what leads a tracker to be wrongly sure, or to lose an object.

That is turns, a board, leaps, a way out of the images, and objects without print.

A course is drawn as a capture with its truth, as the research recordings are laid out: a stereo
pair, a mask in the first left image only, `truth/left_from_object.csv` and `truth/mesh.obj`.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.exchange.shapes.mesh_closing import close_mesh
from servoid.exchange.shapes.mesh_file import read_mesh
from servoid.pose import Pose
from servoid.record import Waypoint, write_trajectory
from servoid.sim.samples.surface import obj_text
from servoid.sim.world.events.motions import row_of
from servoid.sim.world.objects.loft import lathe
from servoid.sim.world.scene.visuals import OBJECT, Capsule, Finish, MeshShape, Texture, Visual
from servoid_experiments.modelling.designs import design_of
from servoid_experiments.stage import EyeMode
from servoid_experiments.tracking.scene import RATE_HZ, Scene, SetUp

SMALL, FULL = (320, 240), (640, 480)
PRINTED, PLAIN = ("bottle", "mug", "drill", "painted_ellipsoid"), ("plain_mug", "two_ellipsoids")
MESHES = Path(__file__).parents[2].parent / "shared" / "data" / "meshes"
GLOSS = 0.25  # of a plain mesh
NOISE, BASELINE_MM = 2.0, 100.0  # grey levels; from eye to eye
TILT = 0.2  # of the axis of a turn, each way
DEPTH_UNIT_M, DEPTH_HOLES = 1e-4, 0.03  # of depth images, and the share of their pixels without
DEPTH_EDGE_M = 0.02  # from a pixel to the next, at which nothing is measured
DEPTH_NOISE, NEAR_M = (1.2e-3, 1.9e-3), 0.4  # of structured light: in metres at 0.4 m, and beyond

Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]  # vertices (N, 3) in metres, faces (M, 3)

_CAMERA = """
[[camera]]
name = "{name}"
images = "{name}/*.bmp"
{masks}size_px = [{size[0]}, {size[1]}]
model = "pinhole"
focal_px = [{focal[0]!r}, {focal[1]!r}]
center_px = [{center[0]!r}, {center[1]!r}]
rig_from_camera = {pose}
"""


def on_and_on(index: int) -> float:
    """Return how far an object has turned that turns on and on, in degrees: 4.5 an image."""
    return 4.5 * max(index - 3, 0)


def sway(index: int) -> float:
    """Return how far an object has turned that turns to and fro, in degrees: up to 4 an image."""
    return 50.0 * float(np.sin(0.08 * index))


def leave(index: int) -> float:
    """Return how far to the right an object has gone that leaves twice and comes back, in mm."""
    phase = (index - 10) % 55
    return 25.0 * float(np.clip(min(phase, 45 - phase), 0, 20))


@dataclass(frozen=True)
class Toy:
    """A mesh of `MESHES` in one colour: the diagonal of its bounding box in metres, and sRGB."""

    diagonal_m: float
    color: tuple[float, float, float]


TOYS = {
    "banana": Toy(0.2, (0.85, 0.72, 0.15)),
    "mug": Toy(0.25, (0.2, 0.35, 0.7)),
    "duck": Toy(0.15, (0.9, 0.75, 0.1)),
    "spot": Toy(0.15, (0.75, 0.7, 0.65)),
}
_TOY = "toy "  # before the name of one
# Turned on a lathe: a skittle and a bottle of one colour, whose spin nothing shows, a lamp and a
# tower whose creases have the contrast of print, and a bottle with a label on a third of its girth.
# Profiles are radii and heights in millimetres.
SKITTLE, PLAIN_BOTTLE, LABELLED = "skittle", "plain bottle", "labelled bottle"
LAMP, TOWER = "lamp", "tower"
_BOTTLE = ((30, -90), (34, -85), (34, 30), (20, 55), (12, 70), (12, 90))
_PROFILES = {
    PLAIN_BOTTLE: _BOTTLE,
    SKITTLE: ((20, -90), (34, -60), (36, -20), (20, 20), (14, 50), (19, 70), (12, 90)),
    LABELLED: _BOTTLE,
    LAMP: ((50, -80), (50, -70), (8, -65), (8, 0), (25, 1), (50, 30), (20, 80)),
    TOWER: ((50, -80), (20, -41), (45, -40), (18, -1), (38, 0), (15, 39), (30, 40), (2, 80)),
}
_RINGS = 60
_PAINTS = {
    SKITTLE: (0.8, 0.25, 0.2),
    PLAIN_BOTTLE: (0.25, 0.5, 0.75),
    LAMP: (0.75, 0.8, 0.2),
    TOWER: (0.75, 0.85, 0.25),
}
# A pale jug, open at the top, with a handle of capsules: its rims and handle look like print.
JUG = "jug"
_JUG = ((0, -75), (60, -75), (45, 75), (42, 75), (57, -72), (0, -72))
_HANDLE = ((45, 55), (82, 50), (88, -25), (56, -45))  # in millimetres to the left, and up
_HANDLE_MM = 9  # radius
_LABEL_PX, _GLASS = (200, 600), (60, 120, 190)  # of its texture, once around; grey levels of sRGB


@cache
def mesh_of(name: str) -> Mesh:
    """Return vertices (N, 3) in metres and faces (M, 3) of an object, in its own frame."""
    if name in _PROFILES:
        made = _lathed(name)
        return close_mesh(made.vertices, made.faces)[:2]
    if name == JUG:
        pot = _pot()
        return pot.vertices, pot.faces
    if not name.startswith(_TOY):
        design = design_of(name)
        return design.vertices, design.faces
    file = name.removeprefix(_TOY)
    mesh = read_mesh(MESHES / f"{file}.ply")
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    scale = TOYS[file].diagonal_m / np.linalg.norm(high - low)
    return np.ascontiguousarray((mesh.vertices - 0.5 * (low + high)) * scale), mesh.faces


def _lathed(name: str) -> MeshShape:
    radii, heights = 1e-3 * np.array(_PROFILES[name]).T
    rings = np.linspace(heights[0], heights[-1], _RINGS)  # many, for sharp creases
    return _upright(lathe(list(zip(np.interp(rings, heights, radii), rings, strict=True))))


def _upright(made: MeshShape) -> MeshShape:
    return replace(made, vertices=made.vertices[:, [0, 2, 1]] * (1.0, -1.0, 1.0))


def _pot() -> MeshShape:
    return _upright(lathe([(1e-3 * radius, 1e-3 * height) for radius, height in _JUG]))


def _jug() -> tuple[Visual, ...]:
    finish = Finish(color=(0.8, 0.8, 0.75), gloss=GLOSS)
    parts = [Visual(_pot(), finish, OBJECT)]
    for one, other in itertools.pairwise(1e-3 * np.array(_HANDLE)):
        middle, half = 0.5 * (one + other), 0.5 * (other - one)
        # The capsule's axis z is turned up, then aside.
        lean = float(np.arctan2(-half[0], half[1]))
        turn = Pose.exp([0.0, 0.0, 0.0, 0.0, 0.0, lean]) @ Pose.exp([0, 0, 0, np.pi / 2, 0, 0])
        place = Pose.exp([-middle[0], -middle[1], 0.0, 0.0, 0.0, 0.0]) @ turn
        capsule = Capsule(1e-3 * _HANDLE_MM, float(np.linalg.norm(half)))
        parts.append(Visual(capsule, finish, OBJECT, row_of(place)))
    return tuple(parts)


def _label() -> Texture:
    """Draw a label of coloured blocks on a third of a bottle's girth, at first in front."""
    height, width = _LABEL_PX
    rows, columns = slice(height // 3, 5 * height // 6), slice(7 * width // 12, 11 * width // 12)
    texture = np.full((height, width, 3), _GLASS, np.uint8)
    random = np.random.default_rng(5)
    blocks = random.integers(0, 2, (20, 40, 1)) * random.integers(120, 255, (20, 40, 3))
    texture[rows, columns] = np.kron(blocks, np.ones((5, 5, 1)))
    return texture


def parts_of(name: str) -> tuple[Visual, ...] | None:
    """Return what a toy is drawn as; nothing for the world's own objects, which it draws itself."""
    if name == JUG:
        return _jug()
    if name == LABELLED:
        return (Visual(_lathed(name), Finish(texture=_label(), gloss=GLOSS), OBJECT),)
    if name not in _PAINTS and not name.startswith(_TOY):
        return None
    color = _PAINTS[name] if name in _PAINTS else TOYS[name.removeprefix(_TOY)].color
    finish = Finish(color=color, gloss=GLOSS)
    return (Visual(MeshShape(*mesh_of(name)), finish, OBJECT),)


@dataclass(frozen=True)
class Course:
    """What happens to an object, and to which: objects take turns from seed to seed.

    `way_mm` is how far its middle goes from image to image, `hidden` the share of it that a board
    hides in the third quarter, `turned_deg` how far it has turned about an axis that is nearly
    upright, and `aside_mm` how far it has gone to the right of the first camera.
    """

    objects: tuple[str, ...]
    images: int
    way_mm: float
    hidden: float = 0.0
    turned_deg: Callable[[int], float] | None = None
    aside_mm: Callable[[int], float] | None = None

    def object_of(self, seed: int) -> str:
        """Return which object a seed shows."""
        return self.objects[seed % len(self.objects)]

    def vertices(self, seed: int) -> NDArray[np.float64]:
        """Return the vertices (N, 3) of the object that a seed shows, in its own frame."""
        return mesh_of(self.object_of(seed))[0]

    def set_up(self, seed: int, size_px: tuple[int, int]) -> SetUp:
        """Return what a seed shows, ready to be drawn."""
        scene = Scene(
            object=self.object_of(seed),
            way_mm=self.way_mm,
            noise=NOISE,
            light=1.0,
            hidden=self.hidden,
            baseline_mm=BASELINE_MM,
            eyes=EyeMode.VERGED,
            images=self.images,
            size_px=size_px,
            seed=seed,
        )
        made = SetUp(scene, parts_of(scene.object))
        if self.turned_deg is not None:
            random = np.random.default_rng([seed, 11])
            axis = np.array([0.0, 1.0, 0.0]) + random.uniform(-TILT, TILT, 3)
            axis *= random.choice((-1.0, 1.0)) / np.linalg.norm(axis)
            angles = [np.radians(self.turned_deg(index)) for index in range(self.images)]
            turns = [Pose.exp([0.0, 0.0, 0.0, *(angle * axis)]) for angle in angles]
            ways = zip(made.world_from_objects, turns, strict=True)
            made.world_from_objects = tuple(way @ turn for way, turn in ways)
        if self.aside_mm is not None:
            right = 1e-3 * made.eyes[0].matrix()[:3, 0]
            ways = [self.aside_mm(index) * right for index in range(self.images)]
            poses = zip(ways, made.world_from_objects, strict=True)
            made.world_from_objects = tuple(
                Pose.exp([*way, 0.0, 0.0, 0.0]) @ pose for way, pose in poses
            )
        return made


COURSES = {
    "turn": Course(PRINTED, 60, 3.0, turned_deg=on_and_on),
    "half hidden": Course(PRINTED, 48, 6.0, hidden=0.5),
    "jump": Course(PRINTED, 40, 36.0),
    "plain": Course(PLAIN, 60, 3.0, turned_deg=sway),
}
PLAIN_COURSES = {"plain that turns": Course(PLAIN, 60, 3.0, turned_deg=on_and_on)}
# An object that leaves the images twice and comes back, and one that sways meanwhile.
LEAVING_COURSES = {
    "leaves": Course(PRINTED, 120, 3.0, aside_mm=leave),
    "leaves and turns": Course(PRINTED, 120, 3.0, turned_deg=sway, aside_mm=leave),
}
_ALL_TOYS = tuple(f"{_TOY}{name}" for name in TOYS)
TOY_COURSES = {
    "toys": Course(_ALL_TOYS, 60, 3.0, turned_deg=sway),
    "toys that turn": Course(_ALL_TOYS, 60, 3.0, turned_deg=on_and_on),
}
JUGS = {
    "jug": Course((JUG,), 60, 3.0, turned_deg=sway),
    "jug that turns": Course((JUG,), 60, 3.0, turned_deg=on_and_on),
}
SPINS = {
    "skittle": Course((SKITTLE,), 60, 3.0, turned_deg=on_and_on),
    "plain bottle": Course((PLAIN_BOTTLE,), 60, 3.0, turned_deg=on_and_on),
    "labelled bottle": Course((LABELLED,), 100, 3.0, turned_deg=on_and_on),
    "lamp": Course((LAMP,), 60, 3.0, turned_deg=on_and_on),
    "tower": Course((TOWER,), 60, 3.0, turned_deg=on_and_on),
}
# The toys only where their meshes lie beside the repository.
ALL_COURSES = COURSES | PLAIN_COURSES | LEAVING_COURSES | SPINS | JUGS | TOY_COURSES


def write_course(folder: Path, name: str, seed: int, size_px: tuple[int, int] = SMALL) -> Path:
    """Draw a course as a capture with its truth into a new folder; return the folder."""
    course = ALL_COURSES[name]
    made = course.set_up(seed, size_px)
    indices = range(len(made.world_from_objects))
    return write_made(folder, made, mesh_of(course.object_of(seed)), indices)


def write_made(folder: Path, made: SetUp, mesh: Mesh, indices: Sequence[int]) -> Path:
    """Draw some images of a scene as a capture with its truth into a folder; return the folder.

    The first of them has a mask. Images are BMP: to pack and unpack the noise in them as PNG takes
    a fifth of the time in which they are drawn and tracked, and saves little.
    """
    for inner in ("left", "right", "masks", "truth"):
        (folder / inner).mkdir(parents=True)
    _write(folder / "masks" / "0000.png", made.masks(indices[0])[0])
    for place, index in enumerate(indices):
        for side, image in zip(("left", "right"), made.images(index), strict=True):
            _write(folder / side / f"{place:04}.bmp", image[..., ::-1])
    left = made.eyes[0].inverse()
    poses = [left @ made.world_from_objects[index] for index in indices]
    points = [Waypoint(place / RATE_HZ, pose) for place, pose in enumerate(poses)]
    write_trajectory(folder / "truth" / "left_from_object.csv", points)
    (folder / "truth" / "mesh.obj").write_text(obj_text(*mesh))
    tables = [
        _CAMERA.format(
            name=side,
            masks='masks = "masks/*.png"\n' if side == "left" else "",
            size=made.camera.size_px,
            focal=made.camera.focal_px,
            center=made.camera.center_px,
            pose=(left @ eye).matrix().tolist(),
        )
        for side, eye in zip(("left", "right"), made.eyes, strict=True)
    ]
    (folder / "capture.toml").write_text(f"version = 1\nrate_hz = {RATE_HZ}\n{''.join(tables)}")
    return folder


def _write(path: Path, pixels: NDArray[np.uint8]) -> None:
    assert cv2.imwrite(str(path), np.ascontiguousarray(pixels))


def write_depth_course(
    folder: Path, name: str, seed: int, size_px: tuple[int, int] = SMALL, images: int | None = None
) -> Path:
    """Draw a course as one camera with depth sees it, with noise and holes; return the folder.

    Without `images` it is drawn to its end.
    """
    course = ALL_COURSES[name]
    made = course.set_up(seed, size_px)
    indices = range(len(made.world_from_objects))[:images]
    write_made(folder, made, mesh_of(course.object_of(seed)), indices)
    (folder / "depth").mkdir()
    random = np.random.default_rng([seed, 12])
    for index in indices:
        metres = made.depths(index)[0].astype(np.float64)
        noise = DEPTH_NOISE[0] + DEPTH_NOISE[1] * np.maximum(metres - NEAR_M, 0.0) ** 2
        metres += noise * random.standard_normal(metres.shape)
        down, across = np.gradient(np.nan_to_num(metres))
        step = np.hypot(down, across)
        blind = (step > DEPTH_EDGE_M) | (random.uniform(size=metres.shape) < DEPTH_HOLES)
        steps = np.where(np.isfinite(metres) & ~blind, metres / DEPTH_UNIT_M, 0.0)
        pixels = np.clip(np.rint(steps), 0, np.iinfo(np.uint16).max).astype(np.uint16)
        assert cv2.imwrite(str(folder / "depth" / f"{index:04}.png"), pixels)
    left, _, _ = (folder / "capture.toml").read_text().partition('[[camera]]\nname = "right"')
    depth = f'depths = "depth/*.png"\ndepth_scale_m = {DEPTH_UNIT_M}\n'
    (folder / "capture.toml").write_text(f"{left.rstrip()}\n{depth}")
    return folder
