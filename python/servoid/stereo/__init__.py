"""Depth from the two images of a stereo pair."""

from servoid.stereo.stereo import StereoDepth, rough_depth, stereo_depth

__all__ = [
    "StereoDepth",
    "rough_depth",
    "stereo_depth",
]
