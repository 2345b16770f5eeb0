"""Captures that the tests draw themselves: an independent account of what a camera sees."""

import gc
import signal
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

import cv2
import hypothesis
import numpy as np
import pytest
from commands import Command, Outcome, servoid_command
from drawn import Drawn, once
from fake_tracker import FakeSettings, FakeTracker
from numpy.typing import NDArray
from recordings import Alone, Recording, recorder, track_alone
from scipy.spatial.transform import Rotation
from tiers import longest_first

from servoid import _native
from servoid.pose import Pose
from servoid.shape import Body

__all__ = ["Command", "Outcome", "servoid_command"]

SIZE_PX = (160, 120)
FOCAL_PX = 210.0
CENTER_PX = (79.5, 59.5)
BACKGROUND = (90, 90, 90)
QUICK_EXAMPLES = 20
REAL_PHOTOS = Path(__file__).parents[1].parent / "shared" / "data" / "photos"


@dataclass(frozen=True)
class DrawnEllipsoid:
    """An ellipsoid in the world; its colour is RGB."""

    center: tuple[float, float, float]
    radii: tuple[float, float, float]
    turn_deg: tuple[float, float, float]
    color: tuple[int, int, int]

    def inverse_shape(self) -> NDArray[np.float64]:
        turn = Rotation.from_euler("xyz", self.turn_deg, degrees=True).as_matrix()
        return turn @ np.diag(1.0 / np.square(self.radii)) @ turn.T


def _two_parts() -> tuple[DrawnEllipsoid, ...]:
    return (
        DrawnEllipsoid((0.02, -0.01, 0.03), (0.05, 0.035, 0.03), (20, -30, 10), (200, 40, 30)),
        DrawnEllipsoid((-0.03, 0.02, 0.06), (0.025, 0.04, 0.02), (-15, 25, 50), (30, 60, 190)),
    )


@dataclass(frozen=True)
class Drawing:
    """What to draw: ellipsoids, and cameras in a ring around them that look at the middle."""

    ellipsoids: tuple[DrawnEllipsoid, ...] = field(default_factory=_two_parts)
    views: int = 8
    distance: float = 0.45

    def world_from_cameras(self) -> list[NDArray[np.float64]]:
        """Return the cameras' poses, (4, 4) each: x right, y down, z towards the object."""
        poses = []
        for index in range(self.views):
            azimuth = 2.0 * np.pi * index / self.views
            elevation = np.radians((15.0, 50.0, -25.0)[index % 3])
            away = np.array(
                [
                    np.cos(elevation) * np.cos(azimuth),
                    np.cos(elevation) * np.sin(azimuth),
                    np.sin(elevation),
                ]
            )
            right = np.cross(-away, [0.0, 0.0, 1.0])
            right /= np.linalg.norm(right)
            pose = np.eye(4)
            pose[:3, :3] = np.stack([right, np.cross(-away, right), -away], axis=1)
            pose[:3, 3] = np.array([0.0, 0.0, 0.04]) + self.distance * away
            poses.append(pose)
        return poses

    def picture(self, world_from_camera: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Cast a ray through each pixel's centre; return the nearest colour, (H, W, 3) RGB."""
        image = np.full((SIZE_PX[1], SIZE_PX[0], 3), BACKGROUND, dtype=np.uint8)
        nearest = np.full(image.shape[:2], np.inf)
        for ellipsoid in self.ellipsoids:
            depth = hit_depths(
                world_from_camera, ellipsoid.inverse_shape(), np.array(ellipsoid.center)
            )
            image[depth < nearest] = ellipsoid.color
            nearest = np.minimum(nearest, depth)
        return image

    def mask(self, world_from_camera: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return the object's pixels, (H, W), 255 inside."""
        image = self.picture(world_from_camera)
        return (image != BACKGROUND).any(axis=2).astype(np.uint8) * np.uint8(255)

    def body(self) -> Body:
        """Return the ellipsoids as servoid's body, whose frame is the world's."""
        turns = [Rotation.from_euler("xyz", one.turn_deg, degrees=True) for one in self.ellipsoids]
        return Body(
            world_from_object=Pose.identity(),
            centers=np.array([one.center for one in self.ellipsoids]),
            radii=np.array([one.radii for one in self.ellipsoids]),
            rotations=np.array([turn.as_quat(scalar_first=True) for turn in turns]),
        )

    @once
    def write(self, folder: Path) -> Path:
        """Write the drawing as a capture with one camera that moves; return its folder."""
        for name in ("images", "masks"):
            (folder / name).mkdir(parents=True)
        lines = ["time_s,x,y,z,qw,qx,qy,qz"]
        for index, pose in enumerate(self.world_from_cameras()):
            image = self.picture(pose)
            write_png(folder / "images" / f"{index:04}.png", image)
            write_png(folder / "masks" / f"{index:04}.png", self.mask(pose))
            x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
            numbers = [0.1 * index, *pose[:3, 3], w, x, y, z]
            lines.append(",".join(f"{number:.12g}" for number in numbers))
        (folder / "poses.csv").write_text("\n".join(lines) + "\n")
        (folder / "capture.toml").write_text(capture_toml())
        return folder


def hit_depths(
    world_from_camera: NDArray[np.float64],
    inverse_shape: NDArray[np.float64],
    center: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return where each pixel's ray meets an ellipsoid, (H, W); infinite where it does not."""
    x, y = np.meshgrid(np.arange(SIZE_PX[0]), np.arange(SIZE_PX[1]))
    rays = np.stack(
        [(x - CENTER_PX[0]) / FOCAL_PX, (y - CENTER_PX[1]) / FOCAL_PX, np.ones(x.shape)], axis=-1
    )
    rays = rays @ world_from_camera[:3, :3].T
    origin = world_from_camera[:3, 3] - center
    a = np.einsum("hwi,ij,hwj->hw", rays, inverse_shape, rays)
    b = rays @ inverse_shape @ origin
    c = origin @ inverse_shape @ origin - 1.0
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    depth = (-b - root) / a
    return np.where((b * b > a * c) & (depth > 0.0), depth, np.inf)


def capture_toml(cameras: str | None = None, rig: str = '[rig]\nposes = "poses.csv"\n') -> str:
    """Write a capture.toml around [[camera]] tables."""
    return f"version = 1\n\n{camera_toml() if cameras is None else cameras}\n{rig}"


def camera_toml(name: str = "eye", images: str = "images/*.png", masks: str | None = None) -> str:
    """Write one [[camera]] table."""
    return f"""[[camera]]
name = "{name}"
images = "{images}"
masks = "{masks or "masks/*.png"}"
size_px = [{SIZE_PX[0]}, {SIZE_PX[1]}]
model = "pinhole"
focal_px = [{FOCAL_PX}, {FOCAL_PX}]
center_px = [{CENTER_PX[0]}, {CENTER_PX[1]}]
distortion = []
rig_from_camera = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""


def write_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write grey or RGB pixels."""
    stored = pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[..., ::-1])
    assert cv2.imwrite(str(path), stored)


def pytest_configure(config: pytest.Config) -> None:
    """Try fewer examples in the quick tests; let Ctrl-C interrupt background runs, too."""
    hypothesis.settings.register_profile("whole", deadline=None)
    hypothesis.settings.register_profile("quick", deadline=None, max_examples=QUICK_EXAMPLES)
    quick = config.option.markexpr == "not extended"
    hypothesis.settings.load_profile("quick" if quick else "whole")
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Search no garbage in what is collected: it all stays to the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what takes longest."""
    longest_first(items)


def everything_in(folder: Path) -> dict[str, bytes | None]:
    """Return the content of every file under a folder, hidden ones too, and every folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


@pytest.fixture
def drawing() -> Drawing:
    return Drawing()


@pytest.fixture
def drawn_capture(tmp_path: Path, drawing: Drawing) -> Path:
    return drawing.write(tmp_path / "photos")


@pytest.fixture(scope="session")
def photos() -> Callable[[str], Path]:
    """Find a set of real photographs, or skip the test that asks for it."""

    def find(name: str) -> Path:
        folder = REAL_PHOTOS / name
        if not folder.is_dir():
            pytest.skip(f"the photographs of the {name} lie beside the repository, and not here")
        return folder

    return find


def put_fake_core(monkeypatch: pytest.MonkeyPatch) -> type[FakeTracker]:
    import_module("servoid.cli.app")  # its help shows the core's own defaults

    class Fake(FakeTracker):
        made: list[FakeTracker] = []  # noqa: RUF012

    monkeypatch.setattr(_native, "Tracker", Fake, raising=False)
    monkeypatch.setattr(_native, "TrackSettings", FakeSettings, raising=False)
    return Fake


@pytest.fixture
def fake_core(monkeypatch: pytest.MonkeyPatch) -> type[FakeTracker]:
    """Put the fake in the place of the core's tracker; `made` lists those that were made."""
    return put_fake_core(monkeypatch)


@pytest.fixture(scope="session")
def drawn(pytestconfig: pytest.Config) -> Drawn:
    """Draw, or fetch what an earlier run of the tests drew in the same way."""
    cache = getattr(pytestconfig, "cache", None)
    return Drawn(None if cache is None else cache.mkdir("drawn"))


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory, drawn: Drawn) -> Callable[[str], Recording]:
    """Make a short recording of the moving scene, by its name in `SCENARIOS`."""
    return recorder(tmp_path_factory.mktemp("recordings"), drawn)


@pytest.fixture(scope="session")
def alone(recording: Callable[[str], Recording], tmp_path_factory: pytest.TempPathFactory) -> Alone:
    """Track the moving toy once, with no body, for all tests that need a track or a body."""
    folder = tmp_path_factory.mktemp("alone")
    return track_alone(recording("colour"), folder, "--video", "o.mp4")
