"""Opens captures: reads what `capture.toml` says and finds the files it names."""

import glob
from pathlib import Path

from servoid._native import Pose
from servoid.errors import CaptureError
from servoid.observe.capture import Capture, CaptureCamera
from servoid.observe.capture_file import (
    CameraEntry,
    CaptureFile,
    Lens,
    read_capture_file,
    read_poses,
)

_VIDEO_SUFFIXES = (".mp4", ".avi", ".mov", ".mkv", ".webm", ".m4v")


def open_capture(path: str | Path) -> Capture:
    """Open a capture: a folder with a `capture.toml`, or that file itself.

    Images are listed, not read; each is checked when a view reads it.

    Raises:
        CaptureError: a file is missing or malformed, or files contradict each other.
        CameraError: a camera cannot exist, or its model is not supported.
        PoseError: a pose is no rigid motion.

    """
    toml = _find_toml(Path(path))
    file, lenses = read_capture_file(toml)
    cameras = tuple(
        _list_camera(toml, entry, lens) for entry, lens in zip(file.camera, lenses, strict=True)
    )
    count = len(cameras[0].image_paths)
    for camera in cameras[1:]:
        if len(camera.image_paths) != count:
            raise CaptureError(
                f"{toml}: camera '{cameras[0].name}' has {count} images and camera "
                f"'{camera.name}' has {len(camera.image_paths)}; every observation needs one "
                "image of each camera"
            )
    times_s, poses = _read_motion(toml, file, count)
    return Capture(path=toml, cameras=cameras, world_from_rig=poses, times_s=times_s)


def _find_toml(path: Path) -> Path:
    toml = path / "capture.toml" if path.is_dir() else path
    if toml.is_file():
        return toml
    if path.is_dir():
        raise CaptureError(f"there is no capture.toml in {path}; name a folder that holds one")
    raise CaptureError(f"there is no {path}; name a folder with a capture.toml, or such a file")


def _read_motion(
    toml: Path, file: CaptureFile, count: int
) -> tuple[tuple[float, ...] | None, tuple[Pose, ...]]:
    if file.rig.poses is None:
        rate_hz = file.rate_hz
        times_s = None if rate_hz is None else tuple(index / rate_hz for index in range(count))
        return times_s, (Pose.identity(),) * count
    _check_inside(file.rig.poses, f"{toml}, rig.poses")
    csv_path = toml.parent / file.rig.poses
    times_s, poses = read_poses(csv_path)
    if len(poses) != count:
        raise CaptureError(
            f"{csv_path} has {len(poses)} poses, but each camera has {count} images; write one "
            "line an observation"
        )
    return tuple(times_s), tuple(poses)


def _list_camera(toml: Path, entry: CameraEntry, lens: Lens) -> CaptureCamera:
    place = f"{toml}, camera '{entry.name}'"
    if Path(entry.images).suffix.lower() in _VIDEO_SUFFIXES:
        raise CaptureError(
            f"{place}: images = '{entry.images}' is a video, which is not supported yet; save its "
            "pictures as image files and write their pattern"
        )
    images = _matches(toml, entry.images, f"{place}, images")
    masks: dict[str, Path] = {}
    if entry.masks is not None:
        masks = _list_masks(toml, entry.masks, f"{place}, masks")
        if not any(image.stem in masks for image in images):
            raise CaptureError(
                f"{place}: no mask has the name of an image: '{entry.masks}' matches "
                f"{next(iter(masks.values())).name} and others, '{entry.images}' matches "
                f"{images[0].name}; name each mask like its image, with .png at the end"
            )
    return CaptureCamera(
        name=entry.name,
        camera=lens.camera,
        rig_from_camera=lens.rig_from_camera,
        image_paths=tuple(images),
        mask_paths=tuple(masks.get(image.stem) for image in images),
    )


def _list_masks(toml: Path, pattern: str, place: str) -> dict[str, Path]:
    """Map the stem of each mask's name to the mask."""
    if Path(pattern).suffix != ".png":
        raise CaptureError(
            f"{place}: '{pattern}' does not end in .png; save masks as PNG, which keeps every pixel"
        )
    masks: dict[str, Path] = {}
    for path in _matches(toml, pattern, place):
        if path.stem in masks:
            raise CaptureError(
                f"{place}: {masks[path.stem]} and {path} have the same name; keep one of them"
            )
        masks[path.stem] = path
    return masks


def _matches(toml: Path, pattern: str, place: str) -> list[Path]:
    """List what a pattern matches in the capture's folder, sorted by name; at least one file."""
    _check_inside(pattern, place)
    # Path.glob would also match hidden files, such as those that macOS leaves beside each image.
    names = sorted(glob.glob(pattern, root_dir=toml.parent))  # noqa: PTH207
    if not names:
        raise CaptureError(
            f"{place}: '{pattern}' matches no file in {toml.parent}; correct the pattern, such as "
            "'images/*.jpg'"
        )
    return [toml.parent / name for name in names]


def _check_inside(pattern: str, place: str) -> None:
    path = Path(pattern)
    if path.is_absolute() or ".." in path.parts:
        raise CaptureError(
            f"{place}: '{pattern}' leaves the capture's folder; write it relative to that folder, "
            "without '..'"
        )
