"""`servoid model` of a video or of photographs without poses: the scan that comes first."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import typer

from servoid.cli.scan.scanning import ScanOrder, print_scan, scanned
from servoid.cli.wrong_options import OptionError
from servoid.errors import ScanError
from servoid.exchange import is_capture
from servoid.opening import Known, parse_source
from servoid.opening.word import Kind
from servoid.scan import CAMERA, Footage, is_footage, open_footage
from servoid.scan.footage import image_name
from servoid.segment import HueTarget, Target, seek_object, undoubted


@dataclass(frozen=True)
class Scale:
    """What tells the scale of images without poses, as it was typed."""

    lengths: tuple[str, ...] = ()
    board: str | None = None
    baselines: tuple[str, ...] = ()

    def given(self) -> list[str]:
        """Name the options that were given."""
        known = {"--length": self.lengths, "--board": self.board, "--apart": self.baselines}
        return [option for option, value in known.items() if value]


@dataclass(frozen=True)
class Scanned:
    """The capture that a scan made, the targets with the names of its views, and its seconds."""

    capture: Path
    targets: list[Target]
    seconds: float


def needs_scan(source: str, known: Known, scale: Scale) -> bool:
    """Say if a source is images of which nothing says where they were taken.

    What is told of the camera means that it stood still.

    Raises:
        OptionError: it is not, and yet something tells its scale.

    """
    told = known.fov_deg or known.baseline_m or known.calibration
    if not told and is_footage(source) and not is_capture(Path(source)):
        word = parse_source(source)
        if word.kind is not Kind.VIDEOS and not word.halves:
            return True
    for option in scale.given():
        raise OptionError(
            f"{option} tells the scale of a video or of photographs without poses, and {source} "
            "is neither; leave it out"
        )
    return False


def find_first(source: str, targets: Sequence[Target], *, trusted: bool) -> bool:
    """Look for the object in its image before the scan, which takes longer; return `trusted`.

    Raises:
        DoubtError: a target may mean several objects, and is not trusted.
        TargetError: it finds nothing.
        OptionError: nothing says what the object is, or a target means an image that is not there.

    """
    footage = open_footage(source)
    for target, name in zip(targets, _names(footage, targets), strict=True):
        if name is not None:
            ((_, image),) = footage.images([name])
            found = seek_object(target, image)
            if not trusted:
                undoubted(found, target, image)
    return trusted


def scan_first(
    source: str, out: Path, targets: Sequence[Target], scale: Scale, threads: int | None
) -> Scanned:
    """Scan the images into a folder beside the body, and print what was found.

    Raises:
        OptionError: as for `find_first`.
        ScanError: the images cannot be scanned, or that of a target found no place.

    """
    start = time.perf_counter()
    named = _names(open_footage(source), targets)
    capture = out.with_name(f"{out.stem}_scan")
    made = scanned(
        ScanOrder(
            source=source,
            out=capture,
            lengths=scale.lengths,
            board=scale.board,
            baselines=scale.baselines,
            wanted=tuple(name for name in named if name is not None),
            threads=threads,
        )
    )
    for name in named:
        if name is not None and name not in made.solution.names:
            raise ScanError(
                f"image {name}, in which the object is marked, found no place; mark it in another, "
                f"such as --target click:320,240@{made.solution.names[0]}; the scan is in {capture}"
            )
    print_scan(made)
    seen = [
        target if name is None else replace(target, view=f"{CAMERA}/{name}")
        for target, name in zip(targets, named, strict=True)
    ]
    return Scanned(capture, seen, time.perf_counter() - start)


def print_time(scanned_s: float, modelled_s: float) -> None:
    """Print how long all took, and how long each part."""
    typer.echo(
        f"  {'altogether':<15} {scanned_s + modelled_s:.0f} s: {scanned_s:.0f} for the scan, "
        f"{modelled_s:.0f} for the model"
    )


def _names(footage: Footage, targets: Sequence[Target]) -> list[str | None]:
    """Return the image that each target means."""
    if not targets:
        raise OptionError(
            f"{footage.path} does not say what the object is; mark it in the first image, such as "
            "--target click:320,240 or --target box:120,80,420,400, or in another one, such as "
            "--target click:320,240@0012"
        )
    return [_name(target, footage) for target in targets]


def _name(target: Target, footage: Footage) -> str | None:
    """Return the image that a target means; None: a hue window means all."""
    if target.view is None:
        return None if isinstance(target, HueTarget) else footage.names[0]
    name = image_name(target.view.rpartition("/")[2])
    if name not in footage.names:
        first, last = footage.names[0], footage.names[-1]
        raise OptionError(
            f"'{target}' names no image of {footage.path}; they are named {first} to {last}, such "
            f"as --target click:320,240@{last}"
        )
    return name
