"""What a scan is asked for."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from servoid._native import Lens
from servoid.scan.footage import image_name
from servoid.scan.metres.board import Board
from servoid.scan.metres.pair import Partner
from servoid.scan.metres.scale import Baseline, Length
from servoid.segment import Target

Progress = Callable[[float, str], None]
"""Is told the share done and what is being done."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """How images are to be scanned.

    `lengths`, `board`, `baselines` and `partner`, the second eye of a pair, tell the scale; of
    several kinds the first of this order is used. `wanted` names images of a film that are key
    images in any case. `masks` is a folder of object masks, named like the images, which go into
    the capture. `inside` says where features are sought: a folder of masks, or a target, which is
    looked for in each image; of a box it is the box itself. With `turntable` what stays at its
    place in the image is left out, for an object that turns before a camera that stands.
    `told_lens` is how a person or a file says that the camera sees, which is compared with what is
    found. `notes` are passed on to the result. `threads` find and compare features (default: all
    cores); poses are found on one, so that the same images give the same bits.
    """

    lengths: tuple[Length, ...] = ()
    baselines: tuple[Baseline, ...] = ()
    board: Board | None = None
    partner: Partner | None = None
    wanted: tuple[str, ...] = ()
    masks: Path | None = None
    inside: Path | Target | None = None
    turntable: bool = False
    told_lens: Lens | None = None
    notes: tuple[str, ...] = ()
    threads: int | None = None
    progress: Progress | None = None

    def keys(self) -> tuple[str, ...]:
        """Return the names of images that must be among the key images."""
        marked = [one.name for one in self.lengths]
        ends = [name for one in self.baselines for name in (one.first, one.second)]
        return tuple(image_name(name) for name in (*self.wanted, *marked, *ends))
