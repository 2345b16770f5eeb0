"""Scans images without poses and calibration before `servoid model` models them."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import typer

from servoid.cli.scan.scan_command import ScanOrder
from servoid.cli.scan.scanning import print_scan, scanned
from servoid.cli.wrong_options import OptionError
from servoid.errors import ScanError
from servoid.exchange import is_capture
from servoid.opening import (
    GivenCalibration,
    Kind,
    count_uncalibrated_cameras,
    open_filmed,
    parse_source,
)
from servoid.scan import CAMERA, Footage, image_name, is_footage
from servoid.segment import HueTarget, Target, find_with_doubts, undoubted


@dataclass(frozen=True)
class Scanned:
    """The capture of a scan, the targets with the names of its views, and its duration."""

    capture: Path
    targets: list[Target]
    seconds: float


def needs_scan(
    source: str,
    known: GivenCalibration,
    scale_options: Sequence[str],
    topics: Sequence[str] = (),
) -> bool:
    """Return whether a source consists of images without camera poses and calibration.

    If the user gives a calibration, the camera stood still, or a bag contains its poses. `topics`
    are the chosen topics of a bag.

    Raises:
        OptionError: it does not, and yet an option sets its scale.
        CaptureError: there is no such source, or a bag is damaged.

    """
    if not known.supplies_calibration and _is_silent(source, topics):
        return True
    for option in scale_options:
        raise OptionError(
            f"{option} sets the scale of images without poses and calibration, which {source} "
            "is not; leave it out"
        )
    return False


def _is_silent(source: str, topics: Sequence[str]) -> bool:
    if is_footage(source) and not is_capture(Path(source)):
        word = parse_source(source)
        return word.kind is not Kind.VIDEOS and not word.halves
    word = parse_source(source)
    return word.kind is Kind.BAG and count_uncalibrated_cameras(word, topics) > 0


def open_first(source: str, topics: Sequence[str]) -> Footage:
    """Open the images to scan, as `open_filmed` does."""
    return open_filmed(parse_source(source), topics=topics).footage


def find_first(footage: Footage, targets: Sequence[Target], *, trusted: bool) -> bool:
    """Look for the object in its image before the scan, which takes longer; return `trusted`.

    Raises:
        DoubtError: a target may mean several objects, and is not trusted.
        TargetError: it finds nothing.
        OptionError: no target marks the object, or a target names an image that does not exist.

    """
    for target, name in zip(targets, _names(footage, targets), strict=True):
        if name is not None:
            ((_, image),) = footage.images([name])
            found = find_with_doubts(target, image)
            if not trusted:
                undoubted(found, target, image)
    return trusted


def scan_first(order: ScanOrder, footage: Footage, targets: Sequence[Target]) -> Scanned:
    """Scan the images of an order, which are opened as `footage`, and print the result.

    Raises:
        OptionError: as for `find_first`.
        ScanError: the images cannot be scanned, or the image of a target was not registered.

    """
    start = time.perf_counter()
    named = _names(footage, targets)
    made = scanned(order, [name for name in named if name is not None])
    for name in named:
        if name is not None and name not in made.solution.names:
            raise ScanError(
                f"image {name}, in which the object is marked, was not registered; mark it in "
                f"another, such as --target click:320,240@{made.solution.names[0]}; the scan is in "
                f"{order.out}"
            )
    print_scan(made)
    seen = [
        target if name is None else replace(target, view=f"{CAMERA}/{name}")
        for target, name in zip(targets, named, strict=True)
    ]
    return Scanned(order.out, seen, time.perf_counter() - start)


def print_time(scanned_s: float, modelled_s: float) -> None:
    """Print the duration of the whole and of each part."""
    typer.echo(
        f"  {'total':<15} {scanned_s + modelled_s:.0f} s: {scanned_s:.0f} for the scan, "
        f"{modelled_s:.0f} for the model"
    )


def _names(footage: Footage, targets: Sequence[Target]) -> list[str | None]:
    """Return the image that each target refers to."""
    if not targets:
        raise OptionError(
            f"{footage.path} has no mask of the object; mark it in the first image, such as "
            "--target click:320,240 or --target box:120,80,420,400, or in another one, such as "
            "--target click:320,240@0012"
        )
    return [_name(target, footage) for target in targets]


def _name(target: Target, footage: Footage) -> str | None:
    """Return the image that a target refers to; None for a hue window, which applies to all."""
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
