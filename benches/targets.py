"""Find the objects of the research captures from a box and from clicks, and compare with masks.

Prints one line a capture: intersection over union for boxes 5 % larger than the mask and for
clicks inside it, and the milliseconds that one growth of a mask takes. Skips what is not there.
"""

import time
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.observe import (
    BoxTarget,
    CaptureView,
    ClickTarget,
    Target,
    find_object,
    grow_mask,
    open_capture,
)

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
CAPTURES = {"photos": ("skull", "temple", "blowtorch"), "stereo": ("mustard", "drill", "teabox")}
VIEWS = 6

Mask = NDArray[np.uint8]


def overlap(one: Mask, other: Mask) -> float:
    """Measure the intersection over union."""
    return float(((one > 0) & (other > 0)).sum() / ((one > 0) | (other > 0)).sum())


def box(mask: Mask) -> Target:
    """Draw a box around a mask, 5 % of its size larger on each side."""
    rows, columns = np.nonzero(mask)
    du, dv = 0.05 * np.ptp(columns), 0.05 * np.ptp(rows)
    return BoxTarget(columns.min() - du, rows.min() - dv, columns.max() + du, rows.max() + dv)


def clicks(mask: Mask) -> list[Target]:
    """Choose the pixel deepest inside a mask, and another one well inside."""
    depth = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, 5))
    rows, columns = np.nonzero(depth > 0.4 * depth.max())
    other = np.random.default_rng(0).integers(len(rows))
    v, u = np.unravel_index(depth.argmax(), depth.shape)
    return [ClickTarget(int(u), int(v)), ClickTarget(int(columns[other]), int(rows[other]))]


def growth_ms(view: CaptureView, mask: Mask) -> float:
    """Time the growth of a mask from a band around its border."""
    side = max(3, int(0.08 * max(np.ptp(place) for place in np.nonzero(mask))))
    square = np.ones((side, side), np.uint8)
    certain, possible = np.asarray(cv2.erode(mask, square)), np.asarray(cv2.dilate(mask, square))
    image = view.image()
    times = []
    for _ in range(3):
        start = time.perf_counter()
        grow_mask(image, certain, possible)
        times.append(time.perf_counter() - start)
    return 1000.0 * min(times)


def main() -> None:
    """Print one line a capture."""
    for kind, names in CAPTURES.items():
        for name in names:
            folder = DATA / kind / name
            if not folder.is_dir():
                print(f"{name}: not there, skipped")
                continue
            views = open_capture(folder).views()
            views = views[:: max(1, len(views) // VIEWS)][:VIEWS]
            masks = [view.mask() for view in views]
            pairs = list(zip(views, masks, strict=True))
            boxed = [overlap(find_object(box(mask), view.image()), mask) for view, mask in pairs]
            clicked = [
                overlap(find_object(click, view.image()), mask)
                for view, mask in pairs
                for click in clicks(mask)
            ]
            print(
                f"{name}: box {' '.join(f'{one:.2f}' for one in boxed)}, "
                f"clicks {' '.join(f'{one:.2f}' for one in clicked)}, "
                f"growth {growth_ms(*pairs[0]):.0f} ms"
            )


if __name__ == "__main__":
    main()
