"""Checks whether views of a static scene from several poses contradict the calibration.

Each image of one camera from several poses is compared with a neighbour, whichever camera took it.
Of a rig that moves, each camera is compared with itself, which determines its focal length. What
the first two locate is compared with later images of the first, which determines the distance
between the two.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from servoid.capture.capture import Capture
from servoid.capture.center_fit import views_note
from servoid.capture.focal_fit import FIT_PX, FocalFit, focal_note, usual_off
from servoid.capture.located import OffInThird, off_in_third
from servoid.capture.matched_features import MatchedFeatures
from servoid.capture.neighbours import (
    APART,
    FAR_APART,
    Album,
    PosedView,
    matched_neighbours,
)
from servoid.pose import exact
from servoid.words import camera_called, digits

_PAIRS = 4
_PAIRS_OF_LENSES = 6  # if several cameras took the images
_PAIRS_OF_RIG = 6  # of all its cameras together
_CAMERAS = 4  # of a rig, at most
_SEATED_PX = 5.0  # at 1000 px of diagonal: a hand-eye calibration is usually nearer than this
_ALIKE = 1.03  # times: of the shares of focal lengths that are wrong for one reason
_LEAST_WRONG = 2  # instants
_NEXT = 4  # views
_APART_M = 5e-3


def doubt_views(album: Album) -> str | None:
    """Return a message if images from several poses contradict the calibration, else None."""
    views = album.views()
    if len({view.index for view in views}) < len(views):
        return _doubt_moving(album, views)
    count = _PAIRS if len(album.capture.cameras) == 1 else _PAIRS_OF_LENSES
    apart = FAR_APART if album.capture.is_recording else APART
    matched = matched_neighbours(album, views, count=count, apart=apart)
    return views_note([pair for _, pair in matched])


def farthest_off(capture: Capture) -> float:
    """Return how far features are from where another image predicts them, at 1000 px of diagonal.

    Of each view of a static scene and the next ones half of the features are nearer to their
    epipolar lines; the worst two views count. 0 where nothing matches.
    """
    album = Album(capture)
    views = album.views()
    beside = [(one, other) for at, one in enumerate(views) for other in views[at + 1 : at + _NEXT]]
    apart = (two for two in beside if _are_apart(*two))
    matched = (album.match(*two) for two in apart)
    return max((usual_off([pair]) for pair in matched if pair is not None), default=0.0)


def _are_apart(one: PosedView, other: PosedView) -> bool:
    """Return whether two views are at different places, so that they have epipolar lines."""
    shift = np.subtract(one.world_from_lens.translation, other.world_from_lens.translation)
    return exact.norm(shift) > _APART_M


def _doubt_moving(album: Album, views: Sequence[PosedView]) -> str | None:
    """Compare the views of a rig, of which several cameras have images at the same instants."""
    names = [camera.name for camera in album.capture.cameras[:_CAMERAS]]
    count = max(_PAIRS_OF_RIG // len(names), 2)
    matched = [
        matched_neighbours(
            album, [view for view in views if view.camera == at], count=count, apart=FAR_APART
        )
        for at in range(len(names))
    ]
    pairs = [[pair for _, pair in one] for one in matched]
    fits = [FocalFit.of(each) for each in pairs]
    better = [fit.share for fit in fits if fit is not None and fit.is_better]
    together = [pair for each in pairs for pair in each]
    if len(better) == len(fits) and max(better) <= _ALIKE * min(better):
        return focal_note(together, is_rig=False)
    named = zip(names, fits, strict=True)
    notes = [f"of {camera_called(name)}, {fit.note}" for name, fit in named if fit and fit.explains]
    if notes:
        return "; ".join(notes)
    beside = [view for view in views if view.camera == 1]
    seats = _doubt_seats((names[0], names[1]), pairs[0], _off(album, matched[0], beside))
    return seats or focal_note(together, is_rig=False)


def _off(
    album: Album, matched: Sequence[tuple[PosedView, MatchedFeatures]], beside: Sequence[PosedView]
) -> Iterator[OffInThird]:
    """Yield how far what two cameras locate is off in a later image of the first."""
    seen = {view.index: view for view in beside}
    for view, later in matched:
        second = album.match(view, seen[view.index]) if view.index in seen else None
        off = second and off_in_third(second, later, allowed=_SEATED_PX)
        if off is not None:
            yield off


def _doubt_seats(
    names: tuple[str, str], own: Sequence[MatchedFeatures], offs: Iterable[OffInThird]
) -> str | None:
    """Return a message if what two cameras of a rig locate is mostly elsewhere when it moves.

    The first one's `own` images fit each other: otherwise its focal length or its poses are wrong.
    """
    if not own or usual_off(own) > FIT_PX:
        return None
    compared = list(offs)
    wrong = [off.off_px for off in compared if off.is_off]
    if len(wrong) < _LEAST_WRONG or 2 * len(wrong) < len(compared):
        return None
    one, other = names
    return (
        f"the images contradict the poses of {one} and {other} on the rig, or the poses of the "
        f"rig: half of what both locate is {digits(round(float(np.median(wrong)), 1))} px or more "
        f"from where it should be in a later image of {one}, though the images of {one} fit each "
        "other; measure the distance between the cameras (rig_from_camera), and write the poses of "
        "the rig in the same unit, metres"
    )
