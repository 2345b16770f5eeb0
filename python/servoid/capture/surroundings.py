"""Matches what the cameras of a rig at rest see around the objects at several instants.

What is inside of balls around the objects may move, and is left out.
"""

from collections.abc import Sequence

import numpy as np

from servoid.capture.capture import Capture
from servoid.capture.matched_features import FIRST_OF_VIDEO, alike_features, unit_rays
from servoid.capture.neighbours import Album, is_video
from servoid.capture.rig_sightings import Balls, beside_balls
from servoid.pose import Floats


def instants(capture: Capture, among: Sequence[int] | None, places: int) -> list[int]:
    """Return the first observation with an image of the first camera, and up to `places` later.

    They are chosen evenly `among` these observations; without, among all. Late ones of a video are
    not chosen.
    """
    pictures = capture.cameras[0].pictures
    indices = range(len(capture)) if among is None else among
    there = [index for index in indices if pictures[index] is not None]
    if is_video(capture.cameras[0]):
        there = [index for index in there if index < FIRST_OF_VIDEO]
    chosen = np.linspace(0, len(there) - 1, places + 1).round().astype(int)
    return [there[place] for place in np.unique(chosen)] if there else []


def match_surroundings(
    album: Album, place: int, indices: tuple[int, int], balls: Balls
) -> tuple[Floats, Floats] | None:
    """Return where one camera sees its surroundings at two instants, (N, 2) px; None without."""
    here, later = (album.posed(place, index) for index in indices)
    both = None if here is None or later is None else alike_features(here, later)
    if both is None:
        return None
    camera = album.capture.cameras[place]
    kept = np.ones(len(both[0]), np.bool_)
    for index, pixels in zip(indices, both, strict=True):
        pose = album.capture.world_from_rig[index] @ camera.rig_from_camera
        rays = unit_rays(camera.lens, pixels)
        kept &= np.isfinite(rays).all(axis=1) & beside_balls(rays, pose, balls(index))
    return both[0][kept], both[1][kept]
