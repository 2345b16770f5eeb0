"""Find the objects of the research captures from a box and from clicks, and compare with masks.

Prints one line per capture: intersection over union for boxes 5 % larger than the mask and for
clicks inside it, with a ? after refused ones, and the milliseconds for growing a mask, for a box
and for a click. Then, for boxes that differ by 3 px, how many are refused, and how well the masks
of the others agree. Missing captures are skipped.
"""

import time
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from servoid.capture import CaptureView, open_capture
from servoid.errors import TargetError
from servoid.model.finding import find_in_view
from servoid.segment import BoxTarget, ClickTarget, Found, Target, grow_mask

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
CAPTURES = {"photos": ("skull", "temple", "blowtorch"), "stereo": ("mustard", "drill", "teabox")}
ALONE = {
    "real": ("cube_hand",),
    "mono": ("dragon_red",),
    "hard": ("bleach_turn", "mug_sway", "mustard_half", "sugar_jump"),
}
VIEWS = 6
SLACKS = (0.0, 0.05, 0.15, 0.3)  # margins of a box around the object, on each side
MOVES = (
    (0, 0, 0, 0), (-3, -3, 3, 3), (3, 3, -3, -3), (3, 3, 3, 3), (-3, -3, -3, -3), (3, -3, 3, -3),
    (-3, 3, -3, 3),
)  # fmt: skip

Mask = NDArray[np.uint8]


def overlap(one: Mask, other: Mask) -> float:
    """Measure the intersection over union."""
    return float(((one > 0) & (other > 0)).sum() / ((one > 0) | (other > 0)).sum())


def box(mask: Mask, slack: float = 0.05, move: tuple[int, ...] = MOVES[0]) -> Target:
    """Draw a box around a mask, 5 % of its size larger on each side."""
    rows, columns = np.nonzero(mask)
    du, dv = slack * np.ptp(columns), slack * np.ptp(rows)
    corners = columns.min() - du, rows.min() - dv, columns.max() + du, rows.max() + dv
    return BoxTarget(*(corner + by for corner, by in zip(corners, move, strict=True)))


def clicks(mask: Mask) -> list[Target]:
    """Choose the pixel deepest inside a mask, and another one well inside."""
    depth = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, 5))
    rows, columns = np.nonzero(depth > 0.4 * depth.max())
    other = np.random.default_rng(0).integers(len(rows))
    v, u = np.unravel_index(depth.argmax(), depth.shape)
    return [ClickTarget(int(u), int(v)), ClickTarget(int(columns[other]), int(rows[other]))]


def find(target: Target, view: CaptureView, views: list[CaptureView]) -> Found:
    """Find what a target means in one of a capture's views, as `model` and `track` do."""
    return find_in_view(target, view, view.recorded_image(), views)


def score(target: Target, view: CaptureView, views: list[CaptureView], mask: Mask) -> str:
    """Compare what a target finds with a mask; mark what is doubtful."""
    found = find(target, view, views)
    return f"{overlap(found.mask, mask):.2f}{'' if found.doubt is None else '?'}"


def steadiness(
    view: CaptureView, views: list[CaptureView]
) -> list[tuple[int, list[float], list[float]]]:
    """Report for each slack how many moved boxes are accepted.

    Also, how well each pair of their masks agrees, and how well each agrees with the true one.
    """
    mask = view.mask()
    results = []
    for slack in SLACKS:
        found = [segmented(box(mask, slack, move), view, views) for move in MOVES]
        sure = [one for one in found if one is not None]
        pairs = [overlap(one, other) for at, one in enumerate(sure) for other in sure[:at]]
        results.append((len(sure), pairs, [overlap(one, mask) for one in sure]))
    return results


def segmented(target: Target, view: CaptureView, views: list[CaptureView]) -> Mask | None:
    """Return what a target finds; None if it is refused."""
    try:
        found = find(target, view, views)
    except TargetError:
        return None
    return found.mask if found.doubt is None else None


def print_steadiness() -> None:
    """Print one line per capture, and one for all."""
    whole: list[float] = []
    right: list[float] = []
    accepted = tried = 0
    for kind, names in {**CAPTURES, **ALONE}.items():
        for name in names:
            folder = DATA / kind / name
            if not folder.is_dir():
                print(f"{name}: not there, skipped")
                continue
            capture = open_capture(folder)
            results = steadiness(capture.views()[0], capture.all_views())
            words = [
                f"{slack:.0%} larger: {count} of {len(MOVES)} accepted"
                + (f", agree to {min(pairs):.2f}" if pairs else "")
                + (f", right to {min(sound):.2f}" if sound else "")
                for slack, (count, pairs, sound) in zip(SLACKS, results, strict=True)
            ]
            print(f"{name}: {'; '.join(words)}")
            whole += [pair for _, pairs, _ in results for pair in pairs]
            right += [one for _, _, sound in results for one in sound]
            accepted += sum(count for count, _, _ in results)
            tried += len(results) * len(MOVES)
    if whole:
        print(
            f"boxes moved by 3 px: {accepted} of {tried} accepted; these agree to {min(whole):.2f} "
            f"at worst, {np.median(whole):.2f} in the median; "
            f"{sum(one < 0.8 for one in right)} are wrong, with less than 0.8 of the true mask"
        )


def target_ms(target: Target, view: CaptureView, views: list[CaptureView]) -> float:
    """Time a target."""
    times = []
    for _ in range(3):
        start = time.perf_counter()
        segmented(target, view, views)
        times.append(time.perf_counter() - start)
    return 1000.0 * min(times)


def growth_ms(view: CaptureView, mask: Mask) -> float:
    """Time the growth of a mask from a band around its border."""
    side = max(3, int(0.08 * max(np.ptp(place) for place in np.nonzero(mask))))
    square = np.ones((side, side), np.uint8)
    certain = np.asarray(cv2.erode(mask, square), np.uint8)
    possible = np.asarray(cv2.dilate(mask, square), np.uint8)
    image = view.image()
    times = []
    for _ in range(3):
        start = time.perf_counter()
        grow_mask(image, certain, possible)
        times.append(time.perf_counter() - start)
    return 1000.0 * min(times)


def main() -> None:
    """Print one line per capture."""
    for kind, names in CAPTURES.items():
        for name in names:
            folder = DATA / kind / name
            if not folder.is_dir():
                print(f"{name}: not there, skipped")
                continue
            capture = open_capture(folder)
            views, seen = capture.views(), capture.all_views()
            views = views[:: max(1, len(views) // VIEWS)][:VIEWS]
            masks = [view.mask() for view in views]
            pairs = list(zip(views, masks, strict=True))
            boxed = [score(box(mask), view, seen, mask) for view, mask in pairs]
            clicked = [
                score(click, view, seen, mask) for view, mask in pairs for click in clicks(mask)
            ]
            print(
                f"{name}: box {' '.join(boxed)}, clicks {' '.join(clicked)}, "
                f"growth {growth_ms(*pairs[0]):.0f} ms, "
                f"box {target_ms(box(masks[0]), views[0], seen):.0f} ms, "
                f"click {target_ms(clicks(masks[0])[0], views[0], seen):.0f} ms"
            )
    print_steadiness()


if __name__ == "__main__":
    main()
