"""Cameras and images: lenses, undistorted pinhole cameras, images, masks and depth images."""

from servoid._native import Camera, Lens
from servoid.camera.bit_depth import WHOLE_BITS, dark_words, likely_bits, narrowed
from servoid.camera.depth import StoredDepth, read_depth, to_metres
from servoid.camera.exif import Exif, read_exif
from servoid.camera.grey_mask import grey_note, grey_share
from servoid.camera.image_size import JPEG, PNG, read_image_size, size_in_header
from servoid.camera.images import (
    IMAGE_SUFFIXES,
    Recorded,
    check_size,
    decode_bytes,
    largest_in_bytes,
    largest_value,
    read_image,
    read_mask,
    read_upright,
    shrink,
    shrink_mask,
)
from servoid.camera.lenses import make_lens, pinhole_lens
from servoid.camera.pages import count_pages
from servoid.camera.picture import Picture
from servoid.camera.principal_point import (
    off_center_note,
    outside_note,
    principal_point_note,
    square_note,
    wrong_size,
)
from servoid.camera.resection import resect
from servoid.camera.smoothing import gaussian
from servoid.camera.srgb import linear_light
from servoid.camera.undistort import IdealCamera, Undistortion, needs_object, undistortion
from servoid.camera.video import (
    VIDEO_SUFFIXES,
    VideoFacts,
    count_video_images,
    describe_video,
    shortage,
    upright_images,
)

__all__ = [
    "Camera",
    "Lens",
    "Picture",
    "Undistortion",
    "read_depth",
    "read_image",
    "read_mask",
    "undistortion",
]
