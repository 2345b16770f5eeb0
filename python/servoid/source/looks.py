"""Writes observations of a static object as a capture, which `servoid model` reads."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera
from servoid.errors import OutputError
from servoid.output import make_folder, write_together
from servoid.pose import Pose
from servoid.source.source import Instant

Masks = Sequence[NDArray[np.uint8] | None]


def write_looks(
    folder: str | Path,
    cameras: Sequence[Camera],
    looks: Sequence[Instant],
    masks: Masks = (),
) -> Path:
    """Write observations as the folder of a capture; `masks` are those of the first, by camera.

    Each image becomes a static camera of its own in the world, since eyes that rotate have no fixed
    pose on a rig. Returns the path of the capture.toml.

    Raises:
        OutputError: a file cannot be written.

    """
    folder = Path(folder)
    make_folder(folder)
    files: dict[Path, bytes] = {}
    tables = ["version = 1"]
    for number, look in enumerate(looks):
        for place, (camera, image) in enumerate(zip(cameras, look.images, strict=True)):
            if image is None:
                continue
            name = f"{look.names[place] if look.names else place}-{number:02d}"
            files[folder / name / "image.png"] = _png(folder / name, image)
            mask = masks[place] if number == 0 and place < len(masks) else None
            if mask is not None:
                files[folder / f"{name}-mask" / "image.png"] = _png(folder / name, mask)
            masked = None if mask is None else f"{name}-mask/*.png"
            tables.append(_table(name, camera, look.world_from_camera[place], masked))
    for path in files:
        make_folder(path.parent)
    toml = folder / "capture.toml"
    files[toml] = ("\n".join(tables) + "\n").encode()
    write_together(files)
    return toml


def _png(path: Path, image: NDArray[np.uint8]) -> bytes:
    done, data = cv2.imencode(".png", image[..., ::-1] if image.ndim == 3 else image)
    if not done:
        raise OutputError(f"cannot write {path}: the image cannot be encoded as PNG")
    return data.tobytes()


def _table(name: str, camera: Camera, world_from_camera: Pose, masks: str | None) -> str:
    lines = [
        "",
        "[[camera]]",
        f'name = "{name}"',
        f'images = "{name}/*.png"',
        'model = "pinhole"',
        f"size_px = {list(camera.size_px)}",
        f"focal_px = {list(camera.focal_px)}",
        f"center_px = {list(camera.center_px)}",
        f"rig_from_camera = {world_from_camera.matrix().tolist()}",
    ]
    if masks is not None:
        lines.append(f'masks = "{masks}"')
    return "\n".join(lines)
