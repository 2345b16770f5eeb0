"""`servoid model --each`: models each capture in a folder, in a batch."""

import textwrap
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import typer

from servoid.batch import Done, workers_for
from servoid.batch.captures import CaptureCase, folders_in, model_folder
from servoid.cli.batch_progress import watched_batch
from servoid.cli.model.model_command import ModelOrder
from servoid.cli.overwriting import check_inputs_kept
from servoid.cli.values import Method
from servoid.cli.wrong_options import OptionError, of_options
from servoid.errors import ServoidError
from servoid.exchange import is_capture
from servoid.opening import parse_source
from servoid.shape import load_body

FAILED = 1
_WIDTH = 80


def run_each(order: ModelOrder) -> None:
    """Model all captures of a folder, and print a line for each."""
    _check(order)
    _check_captures_kept(order)
    with of_options():
        place = workers_for(order.workers, order.cluster)
    with watched_batch(f"modelling, {place.words}") as show:
        folder = model_folder(
            Path(order.source), order.out, _case(order), workers=place, watch=show
        )
    _print_table(folder.trials)
    made = {name for name, done in folder.trials.items() if done.row is not None}
    for path in _earlier(order.out, made):
        typer.echo(f"  {path.name} is of an earlier run, not of this one")
    for name in folder.passed_over:
        typer.echo(f"  {name} holds no capture and was skipped")
    of_some = "" if len(made) == len(folder.trials) else f", of {len(made)} of {len(folder.trials)}"
    typer.echo(f"  bodies  {order.out}/NAME.json{of_some}")
    typer.echo(f"  table   {order.out / 'captures.parquet'}")
    failed = sum(done.row is None for done in folder.trials.values())
    if failed:
        typer.echo(
            f"{failed} of {len(folder.trials)} captures could not be modelled; the same command "
            "tries them again",
            err=True,
        )
        raise typer.Exit(FAILED)


def _earlier(out: Path, made: Collection[str]) -> Iterator[Path]:
    """List the bodies in a folder that are not among those that were made."""
    for path in sorted(out.glob("*.json")):
        if path.stem in made:
            continue
        try:
            load_body(path)
        except ServoidError:
            continue  # another file, which nobody takes for a body
        yield path


def _check(order: ModelOrder) -> None:
    """Refuse options that do not apply to many captures, and the name of a single body.

    Raises:
        OptionError: such an option or name was given.

    """
    given = {
        "--report": order.report,
        "--viewpoint": order.viewpoint,
        "--images": order.images,
        "--unit": order.unit,
        "--bop-object": order.bop_object,
        "--threads": order.threads,
        "--topic": order.topics or None,
        "--world": order.world,
        **dict.fromkeys(order.known.given(), True),
        **dict.fromkeys(order.scale_options, True),
    }
    for option in (option for option, value in given.items() if value is not None):
        raise OptionError(f"{option} does not apply to a folder of captures; leave it out")
    if order.out.suffix.lower() == ".json" and not order.out.is_dir():
        raise OptionError(
            f"--each writes a body for each capture into a folder, but {order.out} is the name of "
            f"a single body; give a folder, such as --out {order.out.with_suffix('')}"
        )


def _check_captures_kept(order: ModelOrder) -> None:
    """Refuse to write into a capture that is modelled.

    Raises:
        OptionError: that was asked for.

    """
    source = Path(order.source)
    for path in filter(is_capture, folders_in(source) if source.is_dir() else ()):
        check_inputs_kept([("--out", order.out)], parse_source(str(path)))


def _case(order: ModelOrder) -> CaptureCase:
    return CaptureCase(
        capture="",
        content="",
        by_paper=order.method is Method.paper,
        targets=tuple(order.targets),
        views=_bounds(order.chosen),
        observations=None if order.observations is None else _bounds(order.observations),
        distance=order.distance,
        trust_targets=order.trust_targets,
        max_ellipsoids=order.max_ellipsoids,
        delta=order.delta,
        seed=order.seed,
    )


def _bounds(part: slice) -> tuple[int | None, int | None, int | None]:
    return part.start, part.stop, part.step


def _print_table(trials: Mapping[str, Done]) -> None:
    """Print a line for each capture, and below them their notes and why some failed."""
    width = max(map(len, trials))
    typer.echo(f"  {'':{width}}  verdict  ellipsoids  IoU used  unused  seconds")
    for name, done in trials.items():
        row = done.row
        if row is None:
            typer.echo(f"  {name:{width}}  failed")
            continue
        used, unused = _known(row.iou_used), _known(row.iou_unused)
        figures = f"{row.ellipsoids:10}  {used:>8}  {unused:>6}  {row.seconds:7.1f}"
        typer.echo(f"  {name:{width}}  {row.verdict or '':7}  {figures}")
    for name, done in trials.items():
        if done.row is None:
            typer.echo(f"  {name}: {done.failure}")
            continue
        for note in done.row.notes:
            for line in textwrap.wrap(
                f"{name}: {note}", _WIDTH, initial_indent="  ", subsequent_indent="    "
            ):
                typer.echo(line)


def _known(value: float | None) -> str:
    return "" if value is None else f"{value:.4f}"
