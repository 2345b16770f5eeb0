"""Cameras and images: lenses, undistorted pinhole cameras, images, masks and depth images."""

from servoid._native import Camera, Lens
from servoid.camera.depth import read_depth
from servoid.camera.images import read_image, read_mask
from servoid.camera.picture import Picture
from servoid.camera.undistort import Undistortion, undistortion

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
