"""The options of a scan."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from servoid._native import Lens
from servoid.brief import brief
from servoid.scan.footage import image_name
from servoid.scan.metres.board import Board
from servoid.scan.metres.pair import Partner
from servoid.scan.metres.scale import Baseline, Length, check_lengths
from servoid.segment import Target

Progress = Callable[[float, str], None]
"""Receives the share done and a description of the current stage."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """How to scan images.

    `lengths`, `board`, `baselines` and `partner`, the second camera of a pair, determine the scale;
    if several kinds are given, the first in this order is used. `wanted` names images of a film
    that are always key images. `masks` is a folder of object masks, named like the images, which
    are copied into the capture.

    `inside` limits feature detection: a folder of masks, or a target that is found in each image; a
    box is used as it is. With `turntable`, features that do not move in the image are left out, for
    an object that turns before a stationary camera.

    `given_lens` is the calibration from the user or a file, which is compared with the estimate.
    `notes` are passed on to the result. `threads` detect and match features (default: all cores);
    poses are estimated on one, so that the same images give the same bits.
    """

    lengths: tuple[Length, ...] = ()
    baselines: tuple[Baseline, ...] = ()
    board: Board | None = None
    partner: Partner | None = None
    wanted: tuple[str, ...] = ()
    masks: Path | None = None
    inside: Path | Target | None = None
    turntable: bool = False
    given_lens: Lens | None = None
    notes: tuple[str, ...] = ()
    threads: int | None = None
    progress: Progress | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        """Check the lengths, which the images are not needed for.

        Raises:
            ScanError: a length is marked in one image only.

        """
        check_lengths(self.lengths)

    def keys(self) -> tuple[str, ...]:
        """Return the names of images that must be key images."""
        marked = [one.name for one in self.lengths]
        ends = [name for one in self.baselines for name in (one.first, one.second)]
        return tuple(image_name(name) for name in (*self.wanted, *marked, *ends))
