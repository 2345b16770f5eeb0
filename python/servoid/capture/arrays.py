"""Makes captures from arrays in memory, without reading or writing files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid._native import Camera, Lens, Pose, View, taken_depth, taken_image, taken_mask
from servoid.brief import brief
from servoid.camera import IdealCamera, Picture, pinhole_lens, shrink
from servoid.capture.capture import Capture, CaptureCamera, CaptureView
from servoid.config import MOST_CAMERAS
from servoid.errors import CameraError, CaptureError, ImageError, MaskError, PoseError, ServoidError
from servoid.words import counted

_APART = 1e-5  # metres and radians between poses of one camera on a rig: float32 rounds
_PLACE = Path("arrays")  # replaces the file name in messages


@dataclass(frozen=True, eq=False)
class ArrayPicture(Picture):
    """One image in memory, (H, W, 3) uint8 RGB, or None where there is only a mask."""

    pixels: NDArray[np.uint8] | None = None

    __repr__ = brief

    @property
    def is_there(self) -> bool:
        """Return whether there is an image."""
        return self.pixels is not None

    @property
    def is_in_memory(self) -> bool:
        """Return that the image is in memory."""
        return True

    def read(self, size_px: tuple[int, int], by: int = 1) -> NDArray[np.uint8]:
        """Return the image, which has (width, height) pixels, shrunk `by` a factor.

        Raises:
            ImageError: there is no image, or it has another size.

        """
        if self.pixels is None:
            raise ImageError(f"view {self.stem} has no image; give one with its mask")
        _check_size("image", self.pixels, size_px, ImageError)
        return np.asarray(shrink(self.pixels, by), np.uint8)


@dataclass(frozen=True, eq=False, kw_only=True)
class PosedImage:
    """One image in memory with its camera and the camera's pose.

    `image` is (H, W) or (H, W, 3) uint8, RGB. `mask` is optional, (H, W) bool or integer, non-zero
    on the object. `depth_m` is optional, (H, W) float, in metres along z; zero, NaN or infinity
    means unknown. A `Lens` may distort the image: the mask and the depth then refer to the pixels
    of the recorded, distorted image.

    Raises:
        ImageError, MaskError: an array has the wrong type, or does not have the camera's size.
        CameraError, PoseError: the camera or the pose has the wrong type.

    """

    camera: Camera | Lens
    world_from_camera: Pose
    image: NDArray[np.uint8]
    mask: NDArray[Any] | None = None
    depth_m: NDArray[Any] | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        if not isinstance(self.camera, Camera | Lens):
            raise CameraError(_other("camera", "a Camera or a Lens", self.camera))
        if not isinstance(self.world_from_camera, Pose):
            raise PoseError(_other("world_from_camera", "a Pose", self.world_from_camera))
        size_px = self.camera.size_px
        # Copy: a caller may read the camera's next image into the same memory.
        object.__setattr__(self, "image", np.array(taken_image(self.image)))
        _check_size("image", self.image, size_px, ImageError)
        if self.mask is not None:
            object.__setattr__(self, "mask", taken_mask(self.mask))
            _check_size("mask", self.mask, size_px, MaskError)
        if self.depth_m is not None:
            depth = taken_depth(self.depth_m)
            depth[~(np.isfinite(depth) & (depth > 0.0))] = np.nan
            object.__setattr__(self, "depth_m", depth)
            _check_size("depth image", depth, size_px, ImageError)


def capture_of(
    observations: Sequence[PosedImage | Sequence[PosedImage]],
    *,
    times_s: Sequence[float] | None = None,
    rate_hz: float | None = None,
) -> Capture:
    """Make a capture from arrays, for use wherever a capture is accepted.

    An observation is one image, or a list of images that the cameras took at the same instant, in
    the order of the cameras. With `rate_hz` the capture is a recording, in which the object may
    move.

    Raises:
        CaptureError: there is no image, or the number of times differs from that of observations.

    """
    instants = [_instant(one) for one in observations]
    if not instants or not all(instants):
        raise CaptureError("there is no image, or an observation without one; give at least one")
    if times_s is not None and len(times_s) != len(instants):
        raise CaptureError(
            f"{counted(len(instants), 'observation has', 'observations have')} "
            f"{counted(len(times_s), 'time')}; give one for each"
        )
    places = tuple(images[0].world_from_camera for images in instants)
    cameras: list[_Gathered] = []
    for index, images in enumerate(instants):
        for slot, image in enumerate(images):
            from_rig = Pose.identity()
            if slot:
                from_rig = places[index].inverse() @ image.world_from_camera
            _place(cameras, (slot, _lens_of(image.camera), from_rig))[index] = image
    if len(cameras) > MOST_CAMERAS:
        raise CaptureError(
            f"the images are of {len(cameras)} cameras or poses on the rig; at most "
            f"{MOST_CAMERAS} are allowed; give cameras that are fixed on their rig, or "
            "observations of one image each"
        )
    count = len(instants)
    return Capture(
        path=_PLACE,
        cameras=tuple(
            one.camera("camera" if len(cameras) == 1 else f"camera_{number}", count)
            for number, one in enumerate(cameras, 1)
        ),
        world_from_rig=places,
        times_s=None if times_s is None else tuple(map(float, times_s)),
        rate_hz=rate_hz,
    )


def _instant(given: PosedImage | Sequence[PosedImage]) -> list[PosedImage]:
    """Return the images of an observation."""
    images = list(given) if isinstance(given, list | tuple) else [given]
    wrong = next((one for one in images if not isinstance(one, PosedImage)), None)
    if wrong is not None:
        raise CaptureError(
            "an observation must be a PosedImage, or a list of some, but one is of type "
            f"{type(wrong).__name__}; make PosedImage(camera=, world_from_camera=, image=) of it"
        )
    return images  # pyright: ignore[reportReturnType]


def views_of(
    views: Sequence[View], images: Sequence[NDArray[np.uint8]] | None = None
) -> list[CaptureView]:
    """Convert views in memory to views of a capture; `images` are (H, W, 3) uint8, one per view.

    Raises:
        ImageError: there is not one image per view, or an image has another type or size.

    """
    if images is not None and len(images) != len(views):
        raise ImageError(
            f"{counted(len(views), 'view has', 'views have')} {counted(len(images), 'image')}; "
            "give one for each"
        )
    shared: dict[Camera, IdealCamera] = {}
    made = []
    for index, view in enumerate(views):
        pixels = None if images is None else taken_image(images[index])
        picture = ArrayPicture(path=_PLACE, label=str(index), pixels=pixels)
        if pixels is not None:
            _check_size(f"image {index}", pixels, view.camera.size_px, ImageError)
        lens = _lens_of(view.camera)
        made.append(
            CaptureView(
                camera_name="view",
                index=index,
                picture=picture,
                mask_path=None,
                depth_path=None,
                lens=lens,
                world_from_lens=view.world_from_camera,
                given_mask=view.mask,
                shared=shared.setdefault(view.camera, IdealCamera(lens)),
            )
        )
    return made


class _Gathered(dict[int, PosedImage]):
    """The images of one camera of a rig, by observation."""

    def __init__(self, slot: int, lens: Lens, rig_from_camera: Pose) -> None:
        super().__init__()
        self.slot, self.lens, self.rig_from_camera = slot, lens, rig_from_camera

    def is_of(self, slot: int, lens: Lens, rig_from_camera: Pose) -> bool:
        moved = (self.rig_from_camera.inverse() @ rig_from_camera).log()
        return (slot, lens) == (self.slot, self.lens) and bool(np.abs(moved).max() < _APART)

    def camera(self, name: str, count: int) -> CaptureCamera:
        images = [self.get(index) for index in range(count)]
        return CaptureCamera(
            name=name,
            lens=self.lens,
            rig_from_camera=self.rig_from_camera,
            pictures=tuple(
                image and ArrayPicture(path=_PLACE, label=str(index), pixels=image.image)
                for index, image in enumerate(images)
            ),
            mask_paths=(None,) * count,
            depth_paths=(None,) * count,
            masks=tuple(image and image.mask for image in images),
            depths_m=tuple(image and image.depth_m for image in images),
        )


def _place(cameras: list[_Gathered], wanted: tuple[int, Lens, Pose]) -> _Gathered:
    found = next((one for one in cameras if one.is_of(*wanted)), None)
    if found is None:
        found = _Gathered(*wanted)
        cameras.append(found)
    return found


def _lens_of(camera: Camera | Lens) -> Lens:
    return camera if isinstance(camera, Lens) else pinhole_lens(camera)


def _check_size(
    what: str, array: NDArray[np.generic], size_px: tuple[int, int], error: type[ServoidError]
) -> None:
    height, width = array.shape[:2]
    if (width, height) != size_px:
        raise error(
            f"the {what} has {width}x{height} pixels, but its camera has "
            f"{size_px[0]}x{size_px[1]}; give the camera that took it"
        )


def _other(name: str, needed: str, given: object) -> str:
    how = "make one with Pose(matrix)" if needed == "a Pose" else "create one first"
    return f"{name} must be {needed}, but it is a {type(given).__name__}; {how}"
