"""Models a capture, and prints how much each further ellipsoid helps.

Run it after `make samples`: `.venv/bin/python examples/model_a_capture.py out/sample`
"""

import sys

from servoid.capture import open_capture
from servoid.errors import ServoidError
from servoid.model import Progress, fit


def show(progress: Progress) -> None:
    """Show progress on one line that is overwritten."""
    print(f"\r{progress.share:4.0%}  {progress.count} ellipsoids", end="", file=sys.stderr)


def main(folder: str) -> None:
    """Model every second view of the capture in `folder`, and evaluate the others too."""
    capture = open_capture(folder)
    result = fit(
        capture.views(), max_ellipsoids=5, delta=0.0, views=slice(0, None, 2), progress=show
    )
    print(file=sys.stderr)
    by_count = result.iou_by_count
    print("ellipsoids  IoU on used views  IoU on the others")
    for count, used, unused in zip(by_count.counts, by_count.used, by_count.unused, strict=True):
        print(f"{count:10d}  {used:17.3f}  {unused:17.3f}")
    worst = result.used_views[int(result.iou_used.argmin())]
    print(f"worst of the used views: {worst.name}, IoU {result.iou_used.min():.3f}")


if __name__ == "__main__":
    try:
        main(sys.argv[1] if len(sys.argv) > 1 else "out/sample")
    except ServoidError as error:  # says what to do
        sys.exit(f"error: {error}")
