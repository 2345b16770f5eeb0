"""Opens the scenes of BOP datasets as captures."""

from collections.abc import Mapping
from pathlib import Path

from servoid.camera import Picture, make_lens, read_image_size
from servoid.capture import Capture
from servoid.config import check_held, first_file, is_file
from servoid.errors import CaptureError
from servoid.exchange.captures.bop_files import BopCamera, BopPose, read_scene_camera, read_scene_gt
from servoid.exchange.captures.gathering import Shot, ShotCamera, gather, group, number
from servoid.pose import Pose

FILE_NAME = "scene_camera.json"

_IMAGES = tuple(
    f"{folder}/{{:06}}{suffix}" for folder in ("rgb", "gray") for suffix in (".png", ".jpg", ".tif")
)
_DEPTHS = ("depth/{:06}.png", "depth/{:06}.tif")

_Key = tuple[BopCamera, tuple[int, int]]


def open_bop(folder: str | Path, object_index: int | None = None) -> Capture:
    """Open a scene of a BOP dataset, the folder of a `scene_camera.json`, as a capture.

    `object_index` is the object's index, from 0, among those that `scene_gt.json` lists for an
    image; it may be omitted if there is only one. Its masks are those of its visible part. Poses
    are `cam_R_w2c` if every image has one. Otherwise the world is the object's own frame, and
    images without the object are left out.

    Raises:
        CaptureError: a file is missing or malformed, or the object is not there.
        CameraError: a camera cannot exist.
        ImageError: the size of an image is unknown.
        PoseError: a pose is not a rigid motion.

    """
    folder = Path(folder)
    cameras = read_scene_camera(folder / FILE_NAME)
    truth_path = folder / "scene_gt.json"
    truth = read_scene_gt(truth_path) if is_file(truth_path) else {}
    index = _choose(truth, object_index, truth_path)
    world_is_given = all(camera.has_pose for camera in cameras.values())
    shots: list[tuple[_Key, Shot]] = []
    for image, camera in sorted(cameras.items()):
        found = truth.get(image, ())
        pose = found[index] if index < len(found) else None
        place = f"{folder / FILE_NAME}, image {image}"
        if world_is_given:
            camera_from_world = camera.pose(place)
        elif pose is not None:
            camera_from_world = pose.pose(f"{truth_path}, image {image}")
        else:
            continue
        shot = _find(folder, image, index if pose else None, camera_from_world.inverse())
        shots.append(((camera.without_pose(), read_image_size(shot.picture.path)), shot))
    if not shots:
        raise CaptureError(
            f"{folder}: no image has a pose: {FILE_NAME} has no cam_R_w2c, and scene_gt.json no "
            f"object with index {index}; choose one that is listed"
        )
    return _gather(folder, group(shots))


def _gather(folder: Path, groups: dict[_Key, list[Shot]]) -> Capture:
    return gather(
        folder,
        [
            ShotCamera(
                number(index, len(groups)),
                make_lens(
                    f"{folder / FILE_NAME}, cam_K",
                    model="pinhole",
                    size_px=size_px,
                    focal_px=camera.focal_px,
                    # BOP's cameras are OpenCV's: pixel (0, 0) is a pixel's centre, as in servoid.
                    center_px=camera.center_px,
                ),
                shots,
                depth_scale_m=camera.depth_scale_m,
            )
            for index, ((camera, size_px), shots) in enumerate(groups.items())
        ],
        metric=True,
    )


def _choose(truth: Mapping[int, tuple[BopPose, ...]], requested: int | None, path: Path) -> int:
    """Return the index of the chosen object, after checking that it is one object throughout."""
    most = max((len(found) for found in truth.values()), default=0)
    if requested is None and most > 1:
        longest = max(truth.values(), key=len)
        objects = ", ".join(f"{index}: object {one.obj_id}" for index, one in enumerate(longest))
        raise CaptureError(f"{path} lists several objects; choose one by its index ({objects})")
    index = 0 if requested is None else requested
    if index < 0 or (most and index >= most):
        raise CaptureError(f"{path} has no object with index {index}; choose 0 to {most - 1}")
    first: tuple[int, int] | None = None
    for image, found in sorted(truth.items()):
        if index >= len(found):
            continue
        first = first or (image, found[index].obj_id)
        if found[index].obj_id != first[1]:
            raise CaptureError(
                f"{path}: index {index} is object {first[1]} in image {first[0]}, but object "
                f"{found[index].obj_id} in image {image}; servoid needs one index throughout"
            )
    return index


def _find(folder: Path, image: int, object_index: int | None, world_from_lens: Pose) -> Shot:
    picture = first_file(folder / name.format(image) for name in _IMAGES)
    if picture is None:
        raise CaptureError(
            f"{folder} has no image {image:06} in rgb or gray, but {FILE_NAME} lists it; copy the "
            "whole scene"
        )
    mask = None
    if object_index is not None:
        mask = first_file([folder / "mask_visib" / f"{image:06}_{object_index:06}.png"])
    depth = first_file(folder / name.format(image) for name in _DEPTHS)
    found = [path for path in (picture, mask, depth) if path is not None]
    check_held(found, folder, f"{folder / FILE_NAME}, image {image}")
    return Shot(
        picture=Picture(picture),
        world_from_lens=world_from_lens,
        mask_path=mask,
        depth_path=depth,
    )
