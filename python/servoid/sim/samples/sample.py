"""Writes the sample: a rendered capture of a painted bird."""

from collections.abc import Callable
from pathlib import Path

from servoid.pose import Pose
from servoid.sim.samples.folder import MARK, POSES, encode, still_name, write_folder
from servoid.sim.samples.studio import Shot, photograph, plan_shots

_FIRST_LINE = f"{MARK}: a painted wooden bird, 0.2 m high"

_CAPTURE = """{first_line}
version = 1

[[camera]]
name = "eye"
images = "images/*.jpg"
masks = "masks/*.png"          # same file stem as the image; non-zero = object
size_px = [{width}, {height}]
model = "pinhole"
focal_px = [{focal!r}, {focal!r}]
center_px = [{center_u!r}, {center_v!r}]
distortion = []
rig_from_camera = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]

[rig]
poses = "poses.csv"            # world_from_rig, one line an image
"""


def write_sample(
    directory: Path,
    *,
    views: int = 16,
    size_px: tuple[int, int] = (480, 360),
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a capture of a painted wooden bird, seen from all around, and return its folder.

    The world is the table: metres, z up, its origin under the bird. The same arguments give the
    same bytes. An earlier sample in `directory` is replaced. `progress` is called with how many
    of the views are done, and of how many.

    Raises:
        ValueError: `views` or a side of `size_px` is less than 1.
        OutputError: `directory` holds something else or cannot be written; it stays as it was.

    """
    if views < 1 or min(size_px) < 1:
        raise ValueError(f"a sample needs views and sides of at least 1, not {views}, {size_px}")
    directory = Path(directory)
    write_folder(directory, lambda draft: _write_files(draft, plan_shots(views, size_px), progress))
    return directory


def _write_files(
    draft: Path, shots: list[Shot], progress: Callable[[int, int], None] | None
) -> None:
    """Write the whole capture into the new folder `draft`."""
    for folder in ("images", "masks"):
        (draft / folder).mkdir(parents=True)
    for index, shot in enumerate(shots):
        image, mask = photograph(shot, seed=index)
        (draft / "images" / f"{still_name(index)}.jpg").write_bytes(encode(".jpg", image))
        (draft / "masks" / f"{still_name(index)}.png").write_bytes(encode(".png", mask))
        if progress is not None:
            progress(index + 1, len(shots))
    (draft / POSES).write_text(_poses(shots), encoding="utf-8", newline="\n")
    (draft / "capture.toml").write_text(_capture(shots[0]), encoding="utf-8", newline="\n")


def _capture(shot: Shot) -> str:
    width, height = shot.size_px
    return _CAPTURE.format(
        first_line=_FIRST_LINE,
        width=width,
        height=height,
        focal=float(shot.focal_px),
        center_u=float(shot.center_px[0]),
        center_v=float(shot.center_px[1]),
    )


def _poses(shots: list[Shot]) -> str:
    lines = ["time_s,x,y,z,qw,qx,qy,qz"]
    for index, shot in enumerate(shots):
        pose = Pose(shot.world_from_camera)
        numbers = (*pose.translation, *pose.quaternion)
        lines.append(",".join([str(index), *(f"{number:.12g}" for number in numbers)]))
    return "\n".join(lines) + "\n"
