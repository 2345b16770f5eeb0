"""Writes the moving sample: a recording of a toy, with its true poses."""

from collections.abc import Callable, Iterable
from pathlib import Path

from servoid.pose import Floats, Pose
from servoid.sim.samples import snail
from servoid.sim.samples.folder import (
    MARK,
    POSES,
    TRUE_MESH,
    TRUE_POSES,
    TRUTH,
    encode,
    moving_name,
    write_folder,
)
from servoid.sim.samples.motion import RATE_HZ
from servoid.sim.samples.scene import MovingScene, Scenario
from servoid.sim.samples.surface import obj_text, outer_mesh

_NAMES = ("left", "right")
_JPEG_QUALITY = 95
_HEADER = "time_s,x,y,z,qw,qx,qy,qz"

_CAPTURE = """{mark}: a painted toy snail, 0.2 m long, {what}
version = 1
rate_hz = {rate_hz!r}
"""
_CAMERA = """
[[camera]]
name = "{name}"
images = "{name}/*.jpg"
{masks}size_px = [{width}, {height}]
model = "pinhole"
focal_px = [{focal!r}, {focal!r}]
center_px = [{center_u!r}, {center_v!r}]
distortion = []
rig_from_camera = [[1, 0, 0, {offset!r}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""
_MASKS = 'masks = "masks/*.png"          # of the first image only; non-zero = object\n'
_RIG = """
[rig]
poses = "poses.csv"            # world_from_rig, one line an observation
"""


def write_moving_sample(
    directory: Path,
    scenario: Scenario | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a recording of a moving toy as a capture, and return its folder.

    `truth/left_from_object.csv` holds the toy's pose in the left camera at each observation, and
    `truth/mesh.obj` its surface in its own frame, in metres. Only the first left image has a mask.
    The world is the left camera, or the room where the rig moves. The same scenario gives the same
    bytes. An earlier sample in `directory` is replaced. `progress` is called with how many of the
    observations are done, and of how many.

    Raises:
        OutputError: `directory` holds something else or cannot be written; it stays as it was.

    """
    scene = MovingScene(scenario or Scenario())
    directory = Path(directory)
    write_folder(directory, lambda draft: _write_files(draft, scene, progress))
    return directory


def _write_files(
    draft: Path, scene: MovingScene, progress: Callable[[int, int], None] | None
) -> None:
    """Write the whole recording into the empty folder `draft`."""
    names = _NAMES[: len(scene.offsets)]
    for folder in (*names, "masks", TRUTH):
        (draft / folder).mkdir()
    for index in range(len(scene)):
        look = scene.look(index)
        for name, image in zip(names, look.images, strict=True):
            data = encode(".jpg", image, _JPEG_QUALITY)
            (draft / name / f"{moving_name(index)}.jpg").write_bytes(data)
        if index == 0:
            mask = draft / "masks" / f"{moving_name(index)}.png"
            mask.write_bytes(encode(".png", look.mask))
        if progress is not None:
            progress(index + 1, len(scene))
    times_s = [scene.time_s(index) for index in range(len(scene))]
    truth = zip(times_s, map(scene.left_from_object, range(len(scene))), strict=True)
    _write_text(draft / TRUTH / TRUE_POSES, _poses(truth))
    _write_text(draft / TRUTH / TRUE_MESH, obj_text(*outer_mesh(snail.PARTS)))
    if scene.scenario.hand:
        rig = zip(times_s, map(scene.room_from_rig, range(len(scene))), strict=True)
        _write_text(draft / POSES, _poses(rig))
    _write_text(draft / "capture.toml", _capture(scene))


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def _capture(scene: MovingScene) -> str:
    what = "at rest before a rig that moves" if scene.scenario.hand else "that moves"
    text = _CAPTURE.format(mark=MARK, what=what, rate_hz=RATE_HZ)
    width, height = scene.camera.size_px
    for name, offset in zip(_NAMES, scene.offsets, strict=False):
        text += _CAMERA.format(
            name=name,
            masks=_MASKS if name == _NAMES[0] else "",
            width=width,
            height=height,
            focal=scene.camera.focal_px[0],
            center_u=scene.camera.center_px[0],
            center_v=scene.camera.center_px[1],
            offset=offset,
        )
    return text + _RIG if scene.scenario.hand else text


def _poses(timed: Iterable[tuple[float, Floats]]) -> str:
    lines = [_HEADER]
    for time_s, matrix in timed:
        pose = Pose(matrix)
        numbers = (*pose.translation, *pose.quaternion)
        lines.append(",".join([f"{time_s:.9g}", *(f"{number:.12g}" for number in numbers)]))
    return "\n".join(lines) + "\n"
