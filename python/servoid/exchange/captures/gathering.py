"""Combines images that were each taken from a separate pose into a capture."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import TypeVar

from servoid.camera import Lens, Picture
from servoid.capture import Capture, CaptureCamera
from servoid.errors import CaptureError
from servoid.exchange.units import check_unit
from servoid.pose import Pose
from servoid.words import counted

KeyT = TypeVar("KeyT", bound=Hashable)

# Every camera has an entry for every observation.
_MOST_PLACES = 1 << 24


@dataclass(frozen=True)
class Shot:
    """One image, its pose, and the files that belong to it."""

    picture: Picture
    world_from_lens: Pose
    mask_path: Path | None = None
    depth_path: Path | None = None


@dataclass(frozen=True)
class ShotCamera:
    """One camera and the images that it took, in order."""

    name: str
    lens: Lens
    shots: Sequence[Shot]
    depth_scale_m: float | None = None


def gather(path: Path, cameras: Sequence[ShotCamera], *, metric: bool) -> Capture:
    """Return a capture in which each image is an observation of its own.

    Lengths are in metres if it is `metric`, else in an unknown unit.

    Raises:
        CaptureError: there is no image, or cameras and images are too many.

    """
    count = sum(len(camera.shots) for camera in cameras)
    if count == 0:
        raise CaptureError(f"{path} has no image; nothing can be modelled from it")
    if count * len(cameras) > _MOST_PLACES:
        raise CaptureError(
            f"{path} has {count} images of {counted(len(cameras), 'camera')}, more than servoid "
            "supports; let images share a camera, or use fewer"
        )
    first, done = 0, []
    for camera in cameras:
        done.append(_place(camera, first, count))
        first += len(camera.shots)
    poses = tuple(shot.world_from_lens for camera in cameras for shot in camera.shots)
    return Capture(path, tuple(done), poses, times_s=None, metric=metric)


def in_metres(capture: Capture, unit_m: float) -> Capture:
    """Return a capture in metres, of which one unit of length is `unit_m`.

    Raises:
        CaptureError: the unit is not a positive number.

    """
    check_unit(capture.path, unit_m, CaptureError)
    cameras = (
        replace(
            one, depth_scale_m=None if one.depth_scale_m is None else one.depth_scale_m * unit_m
        )
        for one in capture.cameras
    )
    poses = (
        Pose.from_parts([unit_m * one for one in pose.translation], pose.quaternion)
        for pose in capture.world_from_rig
    )
    return replace(capture, cameras=tuple(cameras), world_from_rig=tuple(poses), metric=True)


def short_names(names: Sequence[str]) -> list[str]:
    """Return short names of images: without folder and suffix, if those are unique."""
    paths = [PurePosixPath(name) for name in names]
    stems = [path.stem for path in paths]
    if len(set(stems)) == len(stems):
        return stems
    return [str(path.parent / path.stem) for path in paths]


def group(shots: Sequence[tuple[KeyT, Shot]]) -> dict[KeyT, list[Shot]]:
    """Group the images with the same key, in the order of the keys' first occurrence."""
    groups: dict[KeyT, list[Shot]] = {}
    for key, shot in shots:
        groups.setdefault(key, []).append(shot)
    return groups


def number(index: int, count: int) -> str:
    """Return the name of one of several cameras without names, or of the only one."""
    return "camera" if count == 1 else f"camera_{index + 1}"


def _place(camera: ShotCamera, first: int, count: int) -> CaptureCamera:
    """Put a camera's images into the observations from `first` on."""
    before, after = (None,) * first, (None,) * (count - first - len(camera.shots))
    return CaptureCamera(
        name=camera.name,
        lens=camera.lens,
        rig_from_camera=Pose.identity(),
        pictures=(*before, *(shot.picture for shot in camera.shots), *after),
        mask_paths=(*before, *(shot.mask_path for shot in camera.shots), *after),
        depth_paths=(*before, *(shot.depth_path for shot in camera.shots), *after),
        depth_scale_m=camera.depth_scale_m,
    )
