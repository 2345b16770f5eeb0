"""`servoid model`: from a capture, a mesh or a cloud to a body, a summary and a report."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from servoid.cli.doubting import settled
from servoid.cli.model.model_command import ModelOrder
from servoid.cli.model.summary import print_summary
from servoid.cli.overwriting import check_inputs_kept, files_of
from servoid.cli.progress import progress_bar
from servoid.cli.scan.filming import find_first, needs_scan, open_first, print_time, scan_first
from servoid.cli.scan.scan_command import ScanOrder
from servoid.cli.source.lacking import Given, check_nothing_lacks
from servoid.cli.values import Method
from servoid.cli.wrong_options import OptionError, of_options
from servoid.config import distance_fault, is_file
from servoid.errors import ModelError, OutputError
from servoid.exchange import is_bag
from servoid.exchange.shapes import SUFFIXES, is_cloud, read_cloud, read_mesh
from servoid.model import (
    ModelResult,
    Progress,
    Request,
    fit_capture,
    fit_capture_by_paper,
    fit_mesh,
    fit_range_samples,
    range_samples_of_cloud,
)
from servoid.opening import open_recorded, parse_source
from servoid.output import check_file, check_folder, make_folder, move_to
from servoid.segment import Target, parse_target
from servoid.track import learn_appearance
from servoid.words import counted, reason_of

WriteReport = Callable[..., list[Path]]


def run_model(order: ModelOrder) -> None:
    """Model the source, then write the report, then the body, and print a summary."""
    _check_outputs(order.out, order.report)
    with of_options():
        targets = [parse_target(text) for text in order.targets]
        _check_settings(order)
    word = parse_source(order.source)
    check_inputs_kept(
        [("--out", order.out), ("--report", order.report)],
        word,
        [*files_of(targets), *order.known.files],
    )
    filmed = needs_scan(order.source, order.known, order.scale_options, order.topics)
    if not filmed and not word.is_live and order.method is Method.region:
        options = (*(("--target", text) for text in order.targets), ("--out", order.out))
        given = Given(options=options, distance_m=order.distance, is_marked=bool(targets))
        check_nothing_lacks("model", word, order.known, given)
    write_report = _report_writer() if order.report is not None else None
    scanned_s, source = 0.0, order.source
    if filmed:
        scan, footage = _scan_order(order), open_first(source, order.topics)
        trusted = settled(lambda trust: find_first(footage, targets, trusted=trust), order)
        order = replace(order, trust_targets=trusted)
        found = scan_first(scan, footage, targets)
        order = replace(order, source=str(found.capture), topics=[])
        targets, scanned_s = found.targets, found.seconds
    result = settled(lambda trusted: _fit(order, targets, trusted=trusted), order)
    files: list[Path] = []
    if order.report is not None and write_report is not None:
        files = _write_report_whole(write_report, result, order.report, word.text)
    result.save(order.out, learn_appearance(result))
    print_summary(source, result, order.out, files)
    if filmed:
        print_time(scanned_s, result.seconds)


def _scan_order(order: ModelOrder) -> ScanOrder:
    """Return the order of the scan that comes first, into a folder beside the body."""
    chosen = {
        "--rate": order.known.rate_hz is not None,
        "--bop-object": order.bop_object is not None,
        "--images": order.images is not None,
        "--unit": order.unit is not None,
        "--topic": bool(order.topics) and not is_bag(order.source),
        "--world": order.world is not None,
    }
    for option in (option for option, given in chosen.items() if given):
        raise OptionError(
            f"{order.source} is scanned first, because the calibration and the poses of its camera "
            f"are not known, and to a scan {option} does not apply; leave it out"
        )
    return ScanOrder(
        source=order.source,
        out=order.out.with_name(f"{order.out.stem}_scan"),
        length=order.length,
        board=order.board,
        apart=order.apart,
        threads=order.threads,
        topics=order.topics,
    )


def _check_outputs(out: Path, report: Path | None) -> None:
    if out.suffix != ".json":
        raise OptionError(f"cannot write {out}: the file of a body ends in .json")
    if report is not None:
        check_folder(report)
        if not report.exists() and out.resolve().parent == report.resolve():
            return  # The folder of the report will be made, and holds the body.
    check_file(out)


def _check_settings(order: ModelOrder) -> None:
    """Check the settings of the method before anything is read.

    Raises:
        ModelError: a setting is out of range.

    """
    request = _request(order)
    _ = request.settings() if order.method is Method.region else request.paper_settings()
    fault = distance_fault("--distance", order.distance)
    if fault is not None:
        raise ModelError(fault)


def _request(order: ModelOrder) -> Request:
    return Request(
        max_ellipsoids=order.max_ellipsoids,
        delta=order.delta,
        seed=order.seed,
        threads=order.threads,
    )


def _report_writer() -> WriteReport:
    # Imported before the long work, so that a missing library is found first.
    from servoid.view import write_report

    return write_report


def _fit(order: ModelOrder, targets: list[Target], *, trusted: bool) -> ModelResult:
    with progress_bar("modelling") as update:

        def show(progress: Progress) -> None:
            if progress.count:
                note = f"{counted(progress.count, 'ellipsoid')}, F = {progress.fitness:.4f}"
            else:
                note = progress.stage
            update(progress.share, note)

        request = replace(_request(order), trust_targets=trusted, progress=show)
        path = Path(order.source)
        if is_file(path) and path.suffix.lower() in SUFFIXES:
            return _fit_shape(order, path, request, targets)
        if order.viewpoint is not None:
            raise OptionError("--viewpoint applies to a point cloud, and this is a capture")
        opened = open_recorded(
            parse_source(order.source),
            order.known,
            bop_object=order.bop_object,
            images=order.images,
            unit_m=order.unit,
            topics=order.topics,
            world=order.world,
        )
        chosen = {"observations": order.observations, "views": order.chosen}
        if order.method is Method.region:
            made = fit_capture(
                opened.capture, request, targets=targets, distance_m=order.distance, **chosen
            )
        elif order.distance is not None:
            raise OptionError("--distance does not apply to the paper's method; leave it out")
        else:
            made = fit_capture_by_paper(opened.capture, request, targets=targets, **chosen)
        return replace(made, notes=(*opened.capture.notes, *made.notes, *opened.notes))


def _fit_shape(
    order: ModelOrder, path: Path, request: Request, targets: list[Target]
) -> ModelResult:
    """Model a mesh or a point cloud."""
    chosen = {
        "--target": bool(targets),
        "--method paper": order.method is Method.paper,
        "--views": order.chosen != slice(None),
        "--observations": order.observations is not None,
        "--distance": order.distance is not None,
        "--bop-object": order.bop_object is not None,
        "--images": order.images is not None,
        "--topic": bool(order.topics),
        "--world": order.world is not None,
    }
    for option in (option for option, given in chosen.items() if given):
        raise OptionError(f"{order.source} is no capture, so {option} does not apply; leave it out")
    with of_options():
        order.known.refuse(order.source)
    unit_m = 1.0 if order.unit is None else order.unit
    if is_cloud(path):
        cloud = read_cloud(path, order.viewpoint, unit_m)
        samples = range_samples_of_cloud(cloud.points, cloud.normals, order.viewpoint)
        return fit_range_samples(samples, request, notes=(*cloud.notes, _own_frame("cloud")))
    if order.viewpoint is not None:
        raise OptionError(f"{order.source} is a mesh, so --viewpoint does not apply; leave it out")
    mesh = read_mesh(path, unit_m)
    notes = (*mesh.notes, _own_frame("mesh"))
    return fit_mesh(mesh.vertices, mesh.faces, request, notes=notes)


def _own_frame(what: str) -> str:
    """Return a note on how the body's frame relates to the frame of its source."""
    return (
        f"the body has a frame of its own, not the {what}'s: at its centre and along its principal "
        f"axes; world_from_object in its file is {what}_from_object, and track --start takes "
        f"world_from_{what} * {what}_from_object"
    )


def _write_report_whole(
    write_report: WriteReport, result: ModelResult, directory: Path, source: str
) -> list[Path]:
    """Draw all pictures beside `directory`, and move them there when the last one is done."""
    above = directory.resolve().parent
    with tempfile.TemporaryDirectory(prefix=".servoid-", dir=above) as drafts:
        try:
            drawn = write_report(result, Path(drafts), notes=result.all_notes, source=source)
        except OutputError as error:  # the name of the temporary folder means nothing to the user
            raise OutputError(str(error).replace(drafts, str(directory))) from error
        make_folder(directory)
        targets = [directory / draft.relative_to(drafts) for draft in drawn]
        for draft, target in zip(drawn, targets, strict=True):
            make_folder(target.parent)
            try:
                move_to(target, draft)
            except OSError as error:
                raise OutputError(f"cannot write {target}: {reason_of(error)}") from error
    return targets
