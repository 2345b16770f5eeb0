"""Reports masks with grey borders, whose object is too large."""

from collections.abc import Sequence

import numpy as np

from servoid.camera import grey_note, grey_share
from servoid.capture import CaptureView
from servoid.errors import MaskError
from servoid.model.running import in_parallel

_MOST = 24  # views that are looked at, evenly chosen


def grey_mask_notes(views: Sequence[CaptureView]) -> list[str]:
    """Report masks of which many pixels are grey, by the usual one; empty if there are none.

    Only masks in files are looked at. What cannot be read is reported where it is needed.
    """
    seen = [view for view in views if view.mask_path is not None and view.recorded_mask is None]
    places = np.linspace(0, len(seen) - 1, min(_MOST, len(seen)), dtype=int)
    shares = in_parallel(_share, [seen[place] for place in places])
    if not shares:
        return []
    usual = int(np.argsort(shares)[len(shares) // 2])
    note = grey_note(shares[usual])
    return [] if note is None else [f"the mask of {seen[places[usual]].name}: {note}"]


def _share(view: CaptureView) -> float:
    try:
        return 0.0 if view.mask_path is None else grey_share(view.mask_path)
    except MaskError:
        return 0.0
