"""`servoid model`: from a capture to a body, a summary and a report."""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from servoid.cli.progress import progress_bar
from servoid.cli.summary import print_summary
from servoid.errors import OutputError
from servoid.model import ModelResult, Progress, fit
from servoid.observe import CaptureView, open_capture
from servoid.output import check_file, check_folder, make_folder

WriteReport = Callable[[ModelResult, Path], list[Path]]


@dataclass(frozen=True)
class Request:
    """What `servoid model` was asked for; None leaves a setting to the core."""

    capture: Path
    out: Path
    max_ellipsoids: int | None
    delta: float | None
    views: slice
    seed: int | None
    threads: int | None
    report: Path | None


def run_model(request: Request) -> None:
    """Model the capture, then write the report, then the body, and print a summary."""
    _check_outputs(request.out, request.report)
    write_report = _report_writer() if request.report is not None else None
    capture = open_capture(request.capture)
    result = _fit(request, capture.views())
    pictures: list[Path] = []
    if request.report is not None and write_report is not None:
        pictures = _write_report_whole(write_report, result, request.report)
    result.save(request.out)
    print_summary(request.capture, result, request.out, pictures)


def _check_outputs(out: Path, report: Path | None) -> None:
    if out.suffix != ".json":
        raise OutputError(f"cannot write {out}: the file of a body ends in .json")
    if report is not None:
        check_folder(report)
        if not report.exists() and out.resolve().parent == report.resolve():
            return  # The report's folder will be made, and the body put into it.
    check_file(out)


def _report_writer() -> WriteReport:
    # Imported before the long work, so that a missing library is found first.
    from servoid.view import write_report

    return write_report


def _fit(request: Request, views: list[CaptureView]) -> ModelResult:
    with progress_bar("modelling") as update:

        def show(progress: Progress) -> None:
            update(progress.share, f"{progress.count} ellipsoids, F = {progress.fitness:.4f}")

        return fit(
            views,
            max_ellipsoids=request.max_ellipsoids,
            delta=request.delta,
            views=request.views,
            seed=request.seed,
            threads=request.threads,
            progress=show,
        )


def _write_report_whole(
    write_report: WriteReport, result: ModelResult, directory: Path
) -> list[Path]:
    """Draw all pictures beside `directory`, and move them there when the last one is done."""
    above = directory.resolve().parent
    with tempfile.TemporaryDirectory(prefix=".servoid-", dir=above) as drafts:
        drawn = write_report(result, Path(drafts))
        make_folder(directory)
        targets = [directory / draft.relative_to(drafts) for draft in drawn]
        for draft, target in zip(drawn, targets, strict=True):
            make_folder(target.parent)
            try:
                draft.replace(target)
            except OSError as error:
                raise OutputError(f"cannot write {target}: {error.strerror}") from error
    return targets
