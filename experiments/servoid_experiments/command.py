"""The options of `servoid study`."""

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from servoid.cli.values import check_threads


class Name(str, Enum):
    """What can be studied."""

    paper = "paper"
    bode = "bode"
    track = "track"
    model = "model"


def study(
    name: Annotated[
        Name,
        typer.Argument(
            help="paper: the experiments of the source paper; bode: how recognition, gaze and hand "
            "answer a moving target; track: what tracking withstands; model: what modelling needs.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Where the study's own folder goes, NAME, with page, pictures and tables.",
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Settings in TOML, as --print-config shows them."),
    ] = None,
    print_config: Annotated[
        bool,
        typer.Option(
            "--print-config",
            help="Print every setting as commented TOML, and do nothing else.",
        ),
    ] = False,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="A small study, to see what it does; its figures are rough."),
    ] = False,
    workers: Annotated[
        int | None,
        typer.Option(
            callback=check_threads,
            metavar="N",
            help="Run trials in so many processes (default: one for each core). The results do "
            "not depend on it.",
        ),
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Run trials on a Dask cluster, by its scheduler's address, such as "
            "tcp://host:8786.",
        ),
    ] = None,
) -> None:
    """Redo the paper's experiments, or find out how fast, how precise, and until when.

    Finished trials are kept in FOLDER and not run again: an interrupted study resumes.

    [bold]servoid study paper --out results[/bold]

    [bold]servoid study bode --print-config > bode.toml[/bold]

    [bold]servoid study bode --config bode.toml --out results --workers 8[/bold]
    """
    from servoid_experiments.studying import print_study_settings, run_named_study

    if print_config:
        print_study_settings(name.value, config, quick=quick)
    else:
        run_named_study(name.value, out, config, quick=quick, workers=workers, cluster=cluster)
