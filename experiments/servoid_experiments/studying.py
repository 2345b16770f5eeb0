"""`servoid study`: runs a study, shows its progress, and prints the verdicts."""

import textwrap
from pathlib import Path
from typing import Any

import msgspec
import typer

from servoid.batch import workers_for
from servoid.cli.batch_progress import watched_batch
from servoid.cli.extras import check_extras
from servoid.cli.wrong_options import OptionError, of_options
from servoid.output import check_folder, make_folder
from servoid.servo import settings_toml
from servoid_experiments.design import Study
from servoid_experiments.running import StudyReport, read_study_settings, run_study, study_named

_EXTRAS = {"matplotlib": "view", "pyarrow": "batch", "mujoco": "sim", "daqp": "servo"}
_WIDTH = 80


def print_study_settings(name: str, config: Path | None, *, quick: bool) -> None:
    """Print all settings as commented TOML."""
    typer.echo(settings_toml(_settings(study_named(name), config, quick=quick)), nl=False)


def run_named_study(
    name: str,
    out: Path | None,
    config: Path | None,
    *,
    quick: bool,
    workers: int | None,
    cluster: str | None,
) -> None:
    """Run a study, and print a summary; the arguments are the options of `servoid study`."""
    if out is None:
        raise typer.BadParameter(
            "nothing says where the results are to be written; give a folder, such as results",
            param_hint="--out",
        )
    check_extras("servoid study", _EXTRAS)
    study = study_named(name)
    settings = _settings(study, config, quick=quick)
    with of_options():
        pool = workers_for(workers, cluster)
    check_folder(out, parents=True)
    make_folder(out, parents=True)
    folder = out / study.name
    with watched_batch(f"study {study.name}, {pool.words}") as show:
        report = run_study(study, settings, folder, workers=pool, watch=show)
    _print_report(study, report, folder)


def _settings(study: Study[Any], config: Path | None, *, quick: bool) -> msgspec.Struct:
    """Return the selected settings.

    Raises:
        OptionError: both a file and `--quick` are given.
        StudyError: the file cannot be read.

    """
    if config is None:
        return study.quick if quick else study.settings()
    if quick:
        raise OptionError(
            "a file of settings and --quick are both given; leave one of them out, or start "
            f"your file from 'servoid study {study.name} --quick --print-config'"
        )
    return read_study_settings(study, config)


def _print_report(study: Study[Any], report: StudyReport, folder: Path) -> None:
    """Print the results in 80 columns."""
    typer.echo(study.title)
    if report.quick is not None:
        _print_words(report.quick)
    for section in report.sections:
        typer.echo(f"\n{section.heading}")
        for claim, verdict in section.findings.items():
            _print_words(f"{verdict.value}: {claim}", "- ")
    typer.echo()
    for failure in report.failures:
        _print_words(f"failed: {failure}")
    if report.failures:
        _print_words(
            f"{len(report.failures)} of {report.trials} trials failed; the same command tries "
            "them again"
        )
    typer.echo(f"  page    {report.page}")
    typer.echo(f"  tables  {folder}/*.parquet, {folder}/*.csv")


def _print_words(words: str, mark: str = "") -> None:
    first, rest = f"  {mark}", " " * (2 + len(mark))
    typer.echo(
        textwrap.fill(
            words, _WIDTH, initial_indent=first, subsequent_indent=rest, break_on_hyphens=False
        )
    )
