"""Opens captures: reads `capture.toml` and finds the files that it names."""

import glob
from collections.abc import Iterator, Sequence
from pathlib import Path

from servoid._native import Pose
from servoid.camera import VIDEO_SUFFIXES, Picture, count_video_images, describe_video
from servoid.capture.capture import Capture, CaptureCamera
from servoid.capture.capture_file import (
    CalibrationSupplier,
    CameraEntry,
    CaptureFile,
    MountedLens,
    read_capture_file,
    read_poses,
    read_versioned,
)
from servoid.capture.examined import examined
from servoid.capture.name_order import check_pictured_once, order_note
from servoid.capture.recorded_times import times_notes, video_rate_note
from servoid.config import check_held, check_inside, path_of
from servoid.errors import CaptureError
from servoid.words import counted, joined

_MOST_NAMED = 3  # files of no image, in a note
_Found = dict[str, list[Path]]  # masks and depth images, by kind
_DEPTH_SUFFIXES = (".png", ".tif", ".tiff", ".npy")


def open_capture(path: str | Path, *, supplier: CalibrationSupplier | None = None) -> Capture:
    """Open a capture: a folder with a `capture.toml`, or that file itself.

    Images are listed; only the first one of each camera is read, and a few more if that has 16
    bits, as each is checked when a view reads it. A video is decoded once, to count its images.
    `supplier` returns the calibration for a capture that has none.

    Raises:
        CaptureError: a file is missing or malformed, or files contradict each other.
        CameraError: a camera cannot exist, or its model is unknown.
        PoseError: a pose is not a rigid motion.

    """
    toml = _find_toml(path_of(path, CaptureError))
    file, lenses = read_capture_file(toml, supplier)
    listed = [
        _list_camera(toml, entry, lens) for entry, lens in zip(file.camera, lenses, strict=True)
    ]
    cameras = tuple(camera for camera, _ in listed)
    count = len(cameras[0].pictures)
    for camera in cameras[1:]:
        _check_pairs(toml, cameras[0], camera)
    times_s, poses = _read_motion(toml, file, count)
    timing = _timing_notes(toml, file, cameras, times_s)
    capture = Capture(
        toml,
        cameras,
        poses,
        times_s,
        rate_hz=file.rate_hz,
        metric=file.metric,
        notes=(*_order_notes(cameras), *timing, *_lone_notes(listed)),
    )
    return examined(capture)


def count_uncalibrated(path: str | Path) -> int:
    """Count the cameras of a capture.toml that calibrates none of them; 0 if it calibrates any.

    Raises:
        CaptureError: the file is missing or malformed.

    """
    file, _ = read_versioned(_find_toml(Path(path)), CaptureFile, "captures")
    return len(file.camera) if file.is_uncalibrated else 0


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
    check_inside(file.rig.poses, f"{toml}, rig.poses")
    csv_path = toml.parent / file.rig.poses
    check_held([csv_path], toml.parent, f"{toml}, rig.poses")
    times_s, poses = read_poses(csv_path)
    if len(poses) != count:
        raise CaptureError(
            f"{csv_path} has {counted(len(poses), 'pose')}, but each camera has "
            f"{counted(count, 'image')}; write one "
            "line an observation"
        )
    return tuple(times_s), tuple(poses)


def _timing_notes(
    toml: Path,
    file: CaptureFile,
    cameras: Sequence[CaptureCamera],
    times_s: Sequence[float] | None,
) -> Iterator[str]:
    """Report times of poses, or of videos, that contradict the rate of the capture."""
    if file.rig.poses is not None:
        yield from times_notes(toml.parent / file.rig.poses, times_s or (), file.rate_hz)
    elif file.rate_hz is not None:
        videos = [one for camera in cameras if (one := camera.pictures[0]) and one.index == 0]
        notes = [
            video_rate_note(one.path, describe_video(one.path), file.rate_hz) for one in videos
        ]
        yield from [note for note in notes if note is not None][:1]  # those of a pair are alike


def _list_camera(
    toml: Path, entry: CameraEntry, mounted: MountedLens
) -> tuple[CaptureCamera, _Found]:
    """List the files of a camera; return also the masks and depth images that it names."""
    place = f"{toml}, camera '{entry.name}'"
    pictures = _list_pictures(toml, entry.images, f"{place}, images")
    masks: dict[str, Path] = {}
    if entry.masks is not None:
        masks = _list_masks(toml, entry.masks, f"{place}, masks")
        _check_names(pictures, masks, f"{place}, masks = '{entry.masks}'")
    depths: dict[str, Path] = {}
    if entry.depths is not None:
        depths = _list_depths(toml, entry.depths, f"{place}, depths")
        _check_names(pictures, depths, f"{place}, depths = '{entry.depths}'")
    camera = CaptureCamera(
        name=entry.name,
        lens=mounted.lens,
        rig_from_camera=mounted.rig_from_camera,
        pictures=pictures,
        mask_paths=tuple(masks.get(picture.stem) for picture in pictures),
        depth_paths=tuple(depths.get(picture.stem) for picture in pictures),
        depth_scale_m=entry.depth_scale_m,
    )
    return camera, {"mask": [*masks.values()], "depth image": [*depths.values()]}


def _list_pictures(toml: Path, pattern: str, place: str) -> tuple[Picture, ...]:
    paths = _matches(toml, pattern, place, "images/*.jpg")
    if Path(pattern).suffix.lower() not in VIDEO_SUFFIXES:
        check_pictured_once(paths, place)
        return tuple(Picture(path) for path in paths)
    if len(paths) > 1:
        raise CaptureError(
            f"{place}: '{pattern}' matches {len(paths)} videos; name one, and add a [[camera]] "
            "table for each of the others"
        )
    return tuple(Picture(paths[0], index) for index in range(count_video_images(paths[0])))


def _check_pairs(toml: Path, one: CaptureCamera, other: CaptureCamera) -> None:
    """Check that two cameras have as many images, and the same ones if they share names."""
    counts = len(one.pictures), len(other.pictures)
    gap = _first_gap(one, other)
    hint = "" if gap is None else f": {gap}"
    if counts[0] != counts[1]:
        raise CaptureError(
            f"{toml}: camera '{one.name}' has {counted(counts[0], 'image')} and camera "
            f"'{other.name}' has "
            f"{counts[1]}; every observation needs one image of each camera{hint}"
        )
    if gap is not None:
        raise CaptureError(
            f"{toml}: the images of camera '{one.name}' and camera '{other.name}' do not belong "
            f"together in their order{hint}"
        )


def _first_gap(one: CaptureCamera, other: CaptureCamera) -> str | None:
    """Describe the first image that one camera lacks, if most have the same names in both."""
    pictures = [[picture for picture in camera.pictures if picture] for camera in (one, other)]
    if any(picture.index is not None for listed in pictures for picture in listed):
        return None  # images of a video have only numbers
    stems = [{picture.stem for picture in listed} for listed in pictures]
    if 2 * len(stems[0] & stems[1]) < max(map(len, stems)):
        return None  # each camera has its own names, such as its clock's time
    lone = sorted(stems[0] ^ stems[1])
    if not lone:
        return None
    lacking = other if lone[0] in stems[0] else one
    return (
        f"camera '{lacking.name}' has no '{lone[0]}'; add an empty file of that name, "
        "which is then skipped, or remove the other camera's image"
    )


def _check_names(pictures: tuple[Picture, ...], found: dict[str, Path], place: str) -> None:
    """Check that at least one of the files that belong to images has an image's name."""
    if not any(picture.stem in found for picture in pictures):
        kind = "mask" if ", masks" in place else "depth image"
        first = next(iter(found.values()))
        raise CaptureError(
            f"{place}: no {kind} has the name of an image: the pattern matches {first.name} and "
            f"others; name each {kind} like its image, such as {pictures[0].stem}{first.suffix}"
        )


def _order_notes(cameras: Sequence[CaptureCamera]) -> Iterator[str]:
    """Report cameras whose images are in another order than the numbers in their names."""
    listed = {
        camera.name: [one.path for one in camera.pictures if one is not None and one.index is None]
        for camera in cameras
    }
    concerned = [name for name, paths in listed.items() if order_note(paths, name) is not None]
    if concerned:
        cameras_named = joined([f"'{name}'" for name in concerned])
        plural = "" if len(concerned) == 1 else "s"
        note = order_note(listed[concerned[0]], f"the images of camera{plural} {cameras_named}")
        yield str(note)


def _lone_notes(listed: Sequence[tuple[CaptureCamera, _Found]]) -> Iterator[str]:
    """Report the files that belong to no image of any camera, and are not used."""
    used = {path for camera, _ in listed for path in (*camera.mask_paths, *camera.depth_paths)}
    for camera, found in listed:
        for kind, paths in found.items():
            lone = sorted(path for path in paths if path not in used)
            used.update(lone)  # another camera may have the same pattern
            if not lone:
                continue
            more = f" and {len(lone) - _MOST_NAMED} more" if len(lone) > _MOST_NAMED else ""
            have = "has" if len(lone) == 1 else "have"
            names = ", ".join(path.name for path in lone[:_MOST_NAMED])
            yield (
                f"{counted(len(lone), kind)} of camera '{camera.name}' {have} no image of the same "
                f"name, of {len(paths)}: {names}{more}; name each {kind} like its image"
            )


def _list_masks(toml: Path, pattern: str, place: str) -> dict[str, Path]:
    """Map the stem of each mask's name to the mask."""
    if Path(pattern).suffix != ".png":
        raise CaptureError(
            f"{place}: '{pattern}' does not end in .png; save masks as PNG, which keeps every pixel"
        )
    return _by_stem(_matches(toml, pattern, place, "masks/*.png"), place)


def _list_depths(toml: Path, pattern: str, place: str) -> dict[str, Path]:
    """Map the stem of each depth image's name to the depth image."""
    if Path(pattern).suffix not in _DEPTH_SUFFIXES:
        raise CaptureError(
            f"{place}: '{pattern}' ends in none of {', '.join(_DEPTH_SUFFIXES)}; save depth as "
            "16-bit PNG, 16-bit or float32 TIFF, or .npy"
        )
    return _by_stem(_matches(toml, pattern, place, "depths/*.png"), place)


def _by_stem(paths: list[Path], place: str) -> dict[str, Path]:
    found: dict[str, Path] = {}
    for path in paths:
        if path.stem in found:
            raise CaptureError(
                f"{place}: {found[path.stem]} and {path} have the same name; keep one of them"
            )
        found[path.stem] = path
    return found


def _matches(toml: Path, pattern: str, place: str, example: str) -> list[Path]:
    """List what a pattern matches in the capture's folder, sorted by name; at least one file.

    `example` is a pattern that is allowed there, for the message where nothing matches.
    """
    check_inside(pattern, place)
    # Path.glob would also match hidden files, such as those that macOS leaves beside each image.
    names = sorted(glob.glob(pattern, root_dir=toml.parent))  # noqa: PTH207
    if not names:
        folder = Path(pattern).parent
        if not glob.has_magic(str(folder)) and not (toml.parent / folder).is_dir():
            raise CaptureError(
                f"{place}: '{pattern}' matches no file, because there is no folder '{folder}' in "
                f"{toml.parent}; correct the pattern, or put the folder there"
            )
        raise CaptureError(
            f"{place}: '{pattern}' matches no file in {toml.parent}; correct the pattern, such as "
            f"'{example}'"
        )
    paths = [toml.parent / name for name in names]
    check_held(paths, toml.parent, place)
    return paths
