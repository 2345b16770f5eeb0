"""`servoid track`: tracks objects in a source, and writes poses, a video and a summary."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import typer

from servoid.capture import Capture
from servoid.cli.doubting import settled
from servoid.cli.interrupting import INTERRUPTED
from servoid.cli.messages import print_message
from servoid.cli.overwriting import Output, check_inputs_kept, files_of
from servoid.cli.progress import progress_bar
from servoid.cli.source.footage import Draw, Footage, LiveFootage, open_footage
from servoid.cli.source.lacking import Given, check_nothing_lacks
from servoid.cli.source.recorders import check_recorder
from servoid.cli.track.subjects import body_path, read_subjects
from servoid.cli.track.track_command import TrackOrder
from servoid.cli.track.track_reporting import Reports, check_reports
from servoid.cli.track.track_summary import notes_on, print_track_summary
from servoid.cli.wrong_options import OptionError, of_options
from servoid.errors import OutputError, ServoidError, TrackError
from servoid.exchange.bags.writing import check_mcap, check_mcap_suffix
from servoid.opening import SourceWord, parse_source
from servoid.output import check_file
from servoid.record import (
    check_suffix,
    check_video,
    check_video_suffix,
    waypoints,
    write_trajectory,
)
from servoid.shape import save_body
from servoid.track import Collector, Request, Subject, TrackResult, TrackStep, doubt_capture
from servoid.track import Method as TrackMethod
from servoid.words import counted

_MS_PER_S = 1e3


def run_track(order: TrackOrder) -> None:
    """Track, write the results even if tracking was interrupted, and print a summary."""
    _check_options(order)
    subjects = read_subjects(order.bodies, order.targets, order.starts)
    _check_outputs(order, subjects)
    word = parse_source(order.source)
    _check_inputs_kept(order, subjects, word)
    order = replace(order, source=word.text)  # without a password
    _check_source(order, word)
    check_nothing_lacks("track", word, order.known, _given(order, subjects))
    with open_footage(
        word,
        order.known,
        topics=order.topics,
        world=order.world,
        unit_m=order.unit,
        duration_s=order.duration,
        record=order.record,
    ) as footage:
        _track(order, subjects, footage)


def _track(order: TrackOrder, subjects: list[Subject], footage: Footage) -> None:
    collector, lacking = Collector(), list[str]()
    reports = _reports(order, subjects, footage.capture)

    def work(trusted: bool) -> BaseException | None:
        request = _request(replace(order, trust_targets=trusted))
        with ExitStack() as stack:
            watch: list[Draw] = [] if reports is None else [reports.historian.add]
            if order.video is not None:
                film = footage.video(order.video, len(subjects), request)
                watch.append(stack.enter_context(film))
            if order.mcap is not None:
                run = stack.enter_context(footage.mcap(order.mcap))
                watch.append(run.add)
                stack.callback(lambda: lacking.extend(run.notes()))
            return _follow(footage, subjects, request, collector, watch)

    try:
        stopped = settled(work, order)
    except OutputError as error:  # of video or recording: the poses are kept without it
        if not len(collector):
            raise
        stopped = error
    results = collector.results()
    files = _write(order, results, reports)  # first: an interrupt of what follows loses no pose
    results = doubt_capture(footage.capture, results, _request(order))
    if any(one.notices_on_all for one in results):
        _write_poses(order, results)  # once more, with these notices
    lacking += results[0].capture_doubts
    if reports is not None:
        notes = [*notes_on(footage), *lacking, *footage.notes]
        pages = reports.write(results, _ending(stopped, len(collector)), notes)
        files.extend(("report", page) for page in pages)
    if not isinstance(stopped, OutputError):
        beside = (("video", order.video), ("recording", order.mcap))
        files.extend((kind, path) for kind, path in beside if path is not None)
    if order.record is not None and isinstance(footage, LiveFootage):
        try:
            footage.finish_recording()
            files.append(("recording", order.record))
        except OutputError as error:  # the poses are kept without the recording
            stopped = error
    print_track_summary(order.source, footage, results, files, lacking)
    if isinstance(stopped, KeyboardInterrupt):
        print_message(_ending(stopped, len(collector)))
        raise typer.Exit(INTERRUPTED)
    if stopped is not None:
        raise stopped


def place_of(path: Path, name: str, count: int) -> Path:
    """Return the path of one of `count` objects: with `_name` if there are several."""
    return path if count == 1 else path.with_stem(f"{path.stem}_{name}")


def _check_options(order: TrackOrder) -> None:
    """Check the settings and the names of the outputs, before any folder is accessed.

    Raises:
        OptionError: a setting is out of range, a name has an unknown ending, or two names are the
            same.

    """
    with of_options():
        _request(order).check()
        check_suffix(order.out)
        if order.smooth is not None:
            check_suffix(order.smooth)
        if order.video is not None:
            check_video_suffix(order.video)
        if order.mcap is not None:
            check_mcap_suffix(order.mcap)
    if order.save_body is not None and order.save_body.suffix != ".json":
        raise OptionError(f"cannot write {order.save_body}: the file of a body ends in .json")
    if order.mcap is not None and order.record == order.mcap:
        raise OptionError(
            f"{order.mcap} would hold both the run and its recorded images; give --record "
            "another file than --mcap"
        )
    if order.smooth is not None and order.smooth.resolve() == order.out.resolve():
        raise OptionError(
            f"{order.out} would hold both the original and the smoothed poses; give --smooth "
            "another file than --out"
        )


def _check_source(order: TrackOrder, word: SourceWord) -> None:
    """Check that no option was given that does not apply to the source.

    Raises:
        OptionError: one was.

    """
    if word.is_live:
        given = {
            "--observations": order.observations not in (None, slice(None)),
            "--every": order.every != 1,
        }
        given |= {"--topic": bool(order.topics), "--world": order.world is not None}
        given |= {"--unit": order.unit is not None}
        for option in (option for option, is_given in given.items() if is_given):
            raise OptionError(
                f"{word} is live, and the newest observation of its cameras is tracked each time; "
                f"leave {option} out"
            )
        return
    for option, value in (("--duration", order.duration), ("--record", order.record)):
        if value is not None:
            raise OptionError(f"{word} is recorded, so {option} does not apply; leave it out")


def _given(order: TrackOrder, subjects: list[Subject]) -> Given:
    named = {"--body": order.bodies, "--target": order.targets, "--start": order.starts}
    return Given(
        options=tuple((option, value) for option, values in named.items() for value in values),
        distance_m=order.distance,
        is_marked=all(
            one.targets or one.start is not None or one.appearance is not None for one in subjects
        ),
        has_shape=all(one.body is not None for one in subjects),
    )


def _check_outputs(order: TrackOrder, subjects: list[Subject]) -> None:
    folders = _report_folders(order, subjects)
    check_reports(folders)
    to_make = [folder.resolve() for folder in folders if not folder.exists()]
    for path in (order.out, order.save_body, order.smooth):
        if path is not None:
            for subject in subjects:
                place = place_of(path, subject.name, len(subjects))
                if place.resolve().parent not in to_make:
                    check_file(place)
    if order.video is not None:
        check_video(order.video)
    if order.mcap is not None:
        check_mcap(order.mcap)
    if order.record is not None:
        check_recorder(order.record)


def _check_inputs_kept(order: TrackOrder, subjects: list[Subject], word: SourceWord) -> None:
    """Check that no output is a file of the source, or a body, mask or calibration that is read.

    Raises:
        OptionError: one is.

    """
    named = {"--out": order.out, "--save-body": order.save_body, "--smooth": order.smooth}
    outputs: list[Output] = [
        (option, place_of(path, subject.name, len(subjects)))
        for option, path in named.items()
        for subject in subjects
        if path is not None
    ]
    outputs += [("--report", folder) for folder in _report_folders(order, subjects)]
    outputs += [("--video", order.video), ("--mcap", order.mcap), ("--record", order.record)]
    targets = (target for subject in subjects for target in subject.targets)
    inputs = [*map(body_path, order.bodies), *files_of(targets), *order.known.files]
    check_inputs_kept(outputs, word, inputs)


def _report_folders(order: TrackOrder, subjects: list[Subject]) -> list[Path]:
    if order.report is None:
        return []
    return [place_of(order.report, subject.name, len(subjects)) for subject in subjects]


def _reports(order: TrackOrder, subjects: list[Subject], capture: Capture) -> Reports | None:
    folders = _report_folders(order, subjects)
    return Reports.into(folders, capture, order.source) if folders else None


def _ending(stopped: BaseException | None, count: int) -> str:
    """Describe what ended the tracking early; empty if nothing did."""
    if isinstance(stopped, KeyboardInterrupt):
        return f"interrupted after {counted(count, 'observation')}"
    return "" if stopped is None else f"ended after {counted(count, 'observation')}: {stopped}"


def _follow(
    footage: Footage,
    subjects: list[Subject],
    request: Request,
    collector: Collector,
    watch: Sequence[Draw],
) -> BaseException | None:
    """Collect steps to the end; return what ended it early, unless nothing was tracked yet."""
    try:
        with progress_bar("tracking") as update:
            request = replace(
                request, progress=lambda made: update(0.0, f"modelling, {made.share:.0%}")
            )
            if isinstance(footage, LiveFootage):
                footage.report_silence = lambda why: update(footage.passed_share, why or "")
            for step in footage.steps(subjects, request):
                collector.add(step)
                for heed in watch:
                    heed(step)
                update(footage.share(step), _note(step))
    except (KeyboardInterrupt, ServoidError) as error:
        if not len(collector):
            raise
        return error
    return None


def _request(order: TrackOrder) -> Request:
    budget_ms = order.budget_ms
    return Request(
        method=TrackMethod(order.method.value),
        seed=order.seed,
        population=order.population,
        generations=order.generations,
        budget_s=None if budget_ms is None else budget_ms / _MS_PER_S,
        evolve=order.evolve,
        adjust=order.adjust,
        adjust_outlines=order.adjust_outlines,
        depth_from_motion=order.depth_from_motion,
        observations=order.observations or slice(None),
        every=order.every,
        distance_m=order.distance,
        trust_targets=order.trust_targets,
        trust_poses=order.trust_poses,
    )


def _note(step: TrackStep) -> str:
    """Describe the status of the objects in a few words."""
    words = [f"{one.words}, confidence {one.estimate.confidence:.0%}" for one in step.tracked[:3]]
    spent = sum(one.seconds for one in step.tracked)
    return "; ".join(words) + (f", {1.0 / spent:.0f} Hz" if spent > 0.0 else "")


def _write(
    order: TrackOrder, results: list[TrackResult], reports: Reports | None
) -> list[tuple[str, Path]]:
    """Write poses and bodies, and make the reports' folders; return each file's kind and path."""
    if not results:
        raise TrackError(f"{order.source}: nothing was tracked")
    if reports is not None:
        reports.make_folders()
    files = _write_poses(order, results)
    for result in results:
        if order.save_body is not None:
            path = place_of(order.save_body, result.name, len(results))
            save_body(
                path,
                result.body,
                result.colors,
                appearance=result.appearance,
                is_metric=result.is_metric,
            )
            files.append(("body", path))
    return files


def _write_poses(order: TrackOrder, results: list[TrackResult]) -> list[tuple[str, Path]]:
    """Write the poses of each object, and the smoothed ones; return each file's kind and path."""
    files = []
    for result in results:
        all_poses = {"poses": (order.out, None), "smoothed": (order.smooth, result.smoothed)}
        for kind, (path, smoothed) in all_poses.items():
            if path is not None:
                place = place_of(path, result.name, len(results))
                on_all = result.notices_on_all
                write_trajectory(place, waypoints(result.tracked, smoothed, notices_on_all=on_all))
                files.append((kind, place))
    return files
