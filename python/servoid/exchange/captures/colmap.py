"""Opens COLMAP sparse models, text or binary, as captures."""

from pathlib import Path

from servoid.camera import Picture
from servoid.capture import Capture
from servoid.config import check_held, check_inside, first_file, is_file, is_folder
from servoid.errors import CaptureError, located
from servoid.exchange.captures.colmap_binary import read_cameras_binary, read_images_binary
from servoid.exchange.captures.colmap_model import ColmapCamera, ColmapImage, lens_of
from servoid.exchange.captures.colmap_text import read_cameras_text, read_images_text
from servoid.exchange.captures.gathering import Shot, ShotCamera, gather, short_names
from servoid.pose import Pose

MODEL_FOLDERS = ("sparse/0", "", "sparse")
_READERS = {
    ".bin": (read_cameras_binary, read_images_binary),
    ".txt": (read_cameras_text, read_images_text),
}


def find_colmap_model(folder: Path) -> Path | None:
    """Return the folder of the sparse model in a project, or None: `sparse/0`, itself, `sparse`."""
    found = (folder / name for name in MODEL_FOLDERS)
    return next((model for model in found if _suffix(model) is not None), None)


def open_colmap(folder: str | Path, images: str | Path | None = None) -> Capture:
    """Open a COLMAP project, or a folder with a sparse model, as a capture.

    Each camera of the model becomes a camera, each image an observation of its own, sorted by name.
    Images are in `images`, by default the folder of that name beside the model. A mask is in
    `masks` beside it, as `NAME.jpg.png` or `NAME.png`. Lengths are in the model's unit, which is
    unknown.

    Raises:
        CaptureError: a file is missing or malformed, or files contradict each other.
        CameraError: a camera cannot exist.
        PoseError: a pose is not a rigid motion.

    """
    folder = Path(folder)
    model = find_colmap_model(folder)
    if model is None:
        raise CaptureError(
            f"there is no COLMAP model in {folder}; name a folder with cameras.bin and images.bin "
            "(or .txt), or one in which they are in sparse/0"
        )
    suffix = _suffix(model) or ".bin"
    read_cameras, read_images = _READERS[suffix]
    cameras = _by_id(read_cameras(model / f"cameras{suffix}"), model / f"cameras{suffix}")
    listed = read_images(model / f"images{suffix}")
    place = f"{model / f'images{suffix}'}"
    taken = _find_images(model, folder, images)
    # A folder that the user names may be a link; one that was found may not lead outside.
    home = taken.parent if images is None else taken
    shots = _shots(listed, cameras, taken, home, place)
    return gather(
        model,
        [
            ShotCamera(str(key), lens_of(camera, f"{model}, camera {key}"), shots[key])
            for key, camera in sorted(cameras.items())
            if shots[key]
        ],
        metric=False,
    )


def _suffix(model: Path) -> str | None:
    """Return the suffix of a folder's model files, if there are any; binary takes precedence."""
    both = (".bin", ".txt")
    return next((end for end in both if is_file(model / f"cameras{end}")), None)


def _by_id(cameras: list[ColmapCamera], path: Path) -> dict[int, ColmapCamera]:
    found = {camera.camera_id: camera for camera in cameras}
    if len(found) < len(cameras):
        raise CaptureError(f"{path}: two cameras have the same number; export the model again")
    return found


def _find_images(model: Path, folder: Path, given: str | Path | None) -> Path:
    if given is not None:
        if not is_folder(Path(given)):
            raise CaptureError(f"there is no folder {given}; name the one with the model's images")
        return Path(given)
    # Use the absolute path, so that the parent folders of a model named '.' are found, too.
    above = [folder, *(model.absolute().parents[:2])]
    found = next((place / "images" for place in above if is_folder(place / "images")), None)
    if found is None:
        raise CaptureError(
            f"there is no folder 'images' beside the COLMAP model in {model}; give the folder of "
            "its images"
        )
    return found


def _shots(
    listed: list[ColmapImage],
    cameras: dict[int, ColmapCamera],
    images: Path,
    home: Path,
    place: str,
) -> dict[int, list[Shot]]:
    shots: dict[int, list[Shot]] = {key: [] for key in cameras}
    ordered = sorted(listed, key=lambda image: image.name)
    labels = short_names([image.name for image in ordered])
    for image, label in zip(ordered, labels, strict=True):
        where = f"{place}, image {image.image_id}"
        if image.camera_id not in shots:
            raise CaptureError(
                f"{where}: it is of camera {image.camera_id}, which the model does not have; "
                "export the model again"
            )
        shots[image.camera_id].append(_shot(image, label, images, home, where))
    return shots


def _shot(image: ColmapImage, label: str, images: Path, home: Path, place: str) -> Shot:
    check_inside(image.name, place)
    path = images / image.name
    if not is_file(path):
        raise CaptureError(f"{place}: there is no {path}; give the folder of the model's images")
    check_held([path], home, place)
    with located(place):
        camera_from_world = Pose.from_parts(image.translation, image.quaternion)
    masks = images.parent / "masks"
    names = (f"{image.name}.png", Path(image.name).with_suffix(".png"))
    mask = first_file(masks / name for name in names)
    check_held([] if mask is None else [mask], images.parent, place)
    return Shot(
        picture=Picture(path, label=label),
        world_from_lens=camera_from_world.inverse(),
        mask_path=mask,
    )
