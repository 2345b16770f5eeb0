"""Says why the depth images of a capture do not tell how far an object is."""

import numpy as np

from servoid.capture import Capture, CaptureView


def missing_depth(capture: Capture, view: CaptureView) -> str | None:
    """Return why a view has no depth of its object, although its camera has some; else None.

    Raises:
        CaptureError, ImageError, MaskError: a file cannot be used.

    """
    depth = view.depth() if view.has_depth else None
    if depth is not None:
        inside = view.mask() != 0
        known = np.isfinite(depth) & (depth > 0.0)
        where = (
            "in any pixel"
            if not known.any()
            else f"in the object's mask, but in {100.0 * float(known.mean()):.0f} % of its pixels"
        )
        return (
            f"the depth image of {view.name} has no distance {where}"
            if not known[inside].any()
            else f"the depth image of {view.name} has too few distances in the object's mask"
        ) + (
            ": is the object in the range of the sensor, is the image registered to the colour "
            "image, and are its values positive?"
        )
    camera = next(one for one in capture.cameras if one.name == view.camera_name)
    depths = camera.depths_m or camera.depth_paths
    there = (index for index, one in enumerate(depths) if one is not None and index > view.index)
    later = next(there, None)
    if later is None:
        return None
    return (
        f"{view.name} has no depth image, but observation {later} has: begin there "
        f"(--observations {later}:, or observations=slice({later}, None) in Python), and "
        "mark the object there"
    )
