"""`servoid scan`: turns recorded images into a capture, a summary and a report."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import typer

from servoid.cli.extras import check_extras
from servoid.cli.overwriting import check_inputs_outside
from servoid.cli.progress import progress_bar
from servoid.cli.rows import wrapped
from servoid.cli.scan.scan_command import ScanOrder
from servoid.cli.wrong_options import OptionError, of_options
from servoid.opening import open_filmed, parse_source
from servoid.scan import Request, Scan, parse_baseline, parse_board, parse_length, scan
from servoid.segment import ClickTarget, MaskTarget, Target, parse_target
from servoid.words import measured

_LABEL_WIDTH = 15
_VALUE_WIDTH = 80 - len("  ") - _LABEL_WIDTH - len(" ")


def run_scan(order: ScanOrder) -> None:
    """Scan the source, write the capture with its report, and print a summary."""
    print_scan(scanned(order))
    typer.echo(
        f"  {'next':<{_LABEL_WIDTH}} servoid model {order.out} --out body.json --target click:U,V"
    )


def scanned(order: ScanOrder, wanted: Sequence[str] = ()) -> Scan:
    """Scan the source and write the capture, with a progress bar; `wanted` are key images."""
    check_extras("servoid scan", {"pycolmap": "scan", "matplotlib": "view"})
    from servoid.view.scan import scan_page

    base = _request(order, wanted)
    word = parse_source(order.source)
    check_inputs_outside(("--out", order.out), [*word.places, order.masks, *order.known.files])
    filmed = open_filmed(word, order.known, topics=order.topics)
    with progress_bar("scanning") as update:
        request = replace(
            base,
            partner=filmed.partner,
            given_lens=filmed.lens,
            notes=filmed.notes,
            progress=update,
        )
        return scan(filmed.footage, order.out, request, scan_page)


def _request(order: ScanOrder, wanted: Sequence[str]) -> Request:
    with of_options():
        return Request(
            lengths=tuple(map(parse_length, order.length)),
            board=None if order.board is None else parse_board(order.board),
            baselines=tuple(map(parse_baseline, order.apart)),
            inside=None if order.inside is None else _inside(order.inside),
            turntable=order.turntable,
            masks=order.masks,
            wanted=tuple(wanted),
            threads=order.threads,
        )


def _inside(text: str) -> Path | Target:
    if Path(text).is_dir():
        return Path(text)
    target = parse_target(text)
    if isinstance(target, (ClickTarget, MaskTarget)) or target.view is not None:
        raise OptionError(
            f"--inside {text} applies to one image; give a folder of masks, or box:U0,V0,U1,V1, "
            "hue:LOW..HIGH or background:FILE, which apply to every image"
        )
    return target


def print_scan(made: Scan) -> None:
    """Print the result, its uncertainty, and its files."""
    typer.echo(f"Scanned {made.source}")
    for label, value in _rows(made):
        typer.echo(f"  {label:<{_LABEL_WIDTH}} {value}")


def _rows(made: Scan) -> Iterator[tuple[str, str]]:
    solution, scale = made.solution, made.scale
    found = f"{len(solution.names)} of {made.keys} registered"
    yield "images", found if made.keys == made.count else f"{found}, chosen from {made.count}"
    yield (
        "focal length",
        f"{solution.focal_px:.1f} px, standard deviation {solution.focal_std_px:.1f} px",
    )
    yield (
        "features",
        f"{len(solution.points)} points, reprojection error {solution.rms_px:.2f} px RMS",
    )
    parallax, around = (math.degrees(one) for one in (solution.parallax_rad, made.around_rad))
    yield "parallax", f"{parallax:.0f} degrees in the median, {around:.0f} in all"
    if scale is None:
        yield "scale", "UNKNOWN: lengths are not in metres"
    else:
        yield "scale", f"{scale.words}, standard deviation {100.0 * scale.deviation:.2g} %"
    unit = "" if scale is None else " m"
    yield "distance", f"{measured(solution.distance)}{unit} to the points, in the median"
    yield "seconds", ", ".join(f"{value:.1f} {stage}" for stage, value in made.times.items())
    yield "capture", str(made.path)
    yield "report", str(made.path / "report.html")
    for note in (*made.notes, *made.doubts):
        yield from wrapped("note", note, _VALUE_WIDTH)
