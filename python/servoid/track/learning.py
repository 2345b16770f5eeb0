"""Learns the appearance of a modelled object, so that it can be found in other recordings."""

from servoid._native import Tracker
from servoid.errors import TrackError
from servoid.model import ModelResult

_MOST_VIEWS = 8  # views to learn from


def learn_appearance(result: ModelResult) -> bytes | None:
    """Learn surface points and colours from the views that a body was modelled from.

    Returns an appearance for `Tracker.recall`, or None where the body has no pictures.

    Raises:
        ImageError, MaskError: a picture can no longer be read.

    """
    views = result.used_views[:: max(1, -(-len(result.used_views) // _MOST_VIEWS))]
    if not views:
        return None
    tracker = Tracker([view.camera for view in views], result.body)
    try:
        tracker.start(
            0.0,
            [view.world_from_camera for view in views],
            [view.image() for view in views],
            result.body.world_from_object,
            [view.mask() for view in views],
        )
    except TrackError:  # the body is in none of them, so it has no appearance
        return None
    return tracker.appearance()
