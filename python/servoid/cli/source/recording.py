"""`servoid record`: records a source into a folder or an MCAP file."""

from collections import Counter

import typer

from servoid.cli.interrupting import INTERRUPTED
from servoid.cli.messages import print_message
from servoid.cli.overwriting import check_inputs_kept
from servoid.cli.progress import progress_bar
from servoid.cli.rows import wrapped
from servoid.cli.source.converting import convert
from servoid.cli.source.footage import LiveFootage
from servoid.cli.source.record_command import RecordOrder
from servoid.cli.source.recorders import check_recorder, is_mcap
from servoid.cli.wrong_options import OptionError
from servoid.opening import (
    Kind,
    SourceWord,
    any_cameras,
    check_openable,
    count_uncalibrated_cameras,
    open_recorded,
    parse_source,
)
from servoid.record import FrozenWatch
from servoid.words import counted

_LABEL_WIDTH = 12
_VALUE_WIDTH = 80 - len("  ") - _LABEL_WIDTH - len(" ")
_MOST_NOTICES = 3
_UNCALIBRATED = (
    "the cameras are not calibrated; track and model need --fov or --calibration, and scan "
    "calibrates them"
)

_UNMASKED = (
    "masks are not part of a recording; mark the object in it with --target, or give a --body"
)

_UNSEATED = (
    "the distance between the cameras is not stored without a calibration; give --baseline or "
    "--calibration when the recording is used"
)


def run_record(order: RecordOrder) -> None:
    """Record until the end or Ctrl-C, move the recording to its path, and print a summary."""
    word = parse_source(order.source)
    check_inputs_kept([("--out", order.out)], word, order.known.files)
    if word.is_live:
        _check_live(order, word)
    else:
        check_openable(word)
        _check_recorded(order, word)
    check_recorder(order.out)
    if word.is_live:
        _record(order, word)
    else:
        _convert(order, word)


def _check_live(order: RecordOrder, word: SourceWord) -> None:
    for option, value in (("--topic", order.topics), ("--world", order.world)):
        if value:
            raise OptionError(f"{word} is live, and {option} applies to a bag only; leave it out")
    if is_mcap(order.out) and _is_uncalibrated(order, word):
        raise OptionError(
            f"{order.out} needs a calibration, and the cameras of {word} have none; give "
            "--fov or --calibration, or record into a folder and calibrate later"
        )


def _is_uncalibrated(order: RecordOrder, word: SourceWord) -> bool:
    """Return whether neither the source nor the options calibrate the cameras.

    Raises:
        OptionError: only the baseline is given, which would not be stored.

    """
    if order.known.supplies_lens:
        return False
    if word.is_live:
        is_silent = word.kind in (Kind.CAMERA, Kind.STREAM, Kind.GENICAM)
    else:
        is_silent = count_uncalibrated_cameras(word, order.topics) > 0
    if is_silent and order.known.baseline_m is not None:
        raise OptionError(
            "--baseline alone is no calibration and would not be stored; add --fov, or leave it "
            "out until the recording is used"
        )
    return is_silent


def _check_recorded(order: RecordOrder, word: SourceWord) -> None:
    for option, value in (("--duration", order.duration), ("--count", order.count)):
        if value is not None:
            raise OptionError(f"{word} is recorded, so {option} does not apply; leave it out")
    if word.kind is Kind.CAPTURE and not is_mcap(order.out):
        raise OptionError(
            f"{word} is recorded already; it can be converted to MCAP, with --out {order.out}.mcap"
        )


def _convert(order: RecordOrder, word: SourceWord) -> None:
    is_uncalibrated = not is_mcap(order.out) and _is_uncalibrated(order, word)
    known = any_cameras(order.known) if is_uncalibrated else order.known
    opened = open_recorded(word, known, topics=order.topics, world=order.world)
    whole = len(opened.capture)
    with progress_bar("writing") as update:
        done = convert(
            opened.capture,
            order.out,
            lambda count: update(count / whole, f"{count} of {whole}"),
            is_calibrated=not is_uncalibrated,
        )
    typer.echo(f"Wrote {word}: {counted(done.observations, 'observation')}")
    notes = [("note", note) for note in opened.capture.notes]
    if done.unread:
        left_out = counted(len(done.unread), "image")
        notes.append(("note", f"{left_out} could not be read; the first: {done.unread[0]}"))
    if is_uncalibrated and len(opened.capture.cameras) > 1 and not opened.is_made_up:
        notes.append(("note", _UNSEATED))
    if not opened.capture.metric:
        notes.append(("note", "no length is in metres, which an MCAP recording does not store"))
    if any(path is not None for one in opened.capture.cameras for path in one.mask_paths):
        notes.append(("note", _UNMASKED))
    if is_uncalibrated:
        notes.append(("note", _UNCALIBRATED))
    notes += [("assumed", note) for note in opened.notes]
    _print([*notes, ("recording", str(order.out))])


def _record(order: RecordOrder, word: SourceWord) -> None:
    notices: Counter[str] = Counter()
    reasons: Counter[str] = Counter()  # why observations had no image
    first_s = last_s = 0.0
    is_stopped = False
    is_uncalibrated = _is_uncalibrated(order, word)
    footage = LiveFootage(
        word,
        any_cameras(order.known) if is_uncalibrated else order.known,
        duration_s=order.duration,
        record=order.out,
        is_calibrated=not is_uncalibrated,
        keeps_dark=False,
    )
    watch = FrozenWatch(footage.rig)
    with footage, progress_bar("recording") as update:
        footage.report_silence = lambda why: update(footage.passed_share, why or "")
        first_s = last_s = footage.first_time_s
        notices.update(footage.first_notices)
        try:
            observations = footage.raw()
            while order.count is None or footage.handed_out + footage.dark < order.count:
                raw = next(observations, None)
                if raw is None:
                    break
                if raw.is_dark:
                    reasons.update(raw.notices)
                else:
                    watch.add(raw)
                    last_s = raw.time_s
                    notices.update(raw.notices)
                update(footage.passed_share, _progress(footage))
        except KeyboardInterrupt:
            is_stopped = True
        footage.finish_recording()
    seconds, count = last_s - first_s, footage.handed_out
    cameras = counted(len(footage.capture.cameras), "camera")
    typer.echo(f"Recorded {word}: {counted(count, 'observation')}, {cameras}")
    rows = [("time 0", f"{footage.began:%Y-%m-%d %H:%M:%S} UTC")]
    if seconds > 0.0:
        rows.append(("seconds", f"{seconds:.1f}, {(count - 1) / seconds:.1f} a second"))
    if footage.missed:
        rows.append(
            ("missed", f"{counted(footage.missed, 'observation')} arrived too fast to write")
        )
    if footage.dark:
        rows.append(("not stored", _not_stored(footage.dark, reasons)))
    rows += [
        ("notice", f"{notice}{f' ({times} times)' if times > 1 else ''}")
        for notice, times in notices.most_common(_MOST_NOTICES)
    ]
    rows += [("note", note) for note in watch.notes()]
    if is_uncalibrated:
        rows.append(("note", _UNCALIBRATED))
    rows += [("assumed", note) for note in footage.notes]
    _print([*rows, ("recording", str(order.out))])
    if is_stopped and order.duration is not None:
        print_message(f"interrupted after {counted(count, 'observation')}")
        raise typer.Exit(INTERRUPTED)


def _progress(footage: LiveFootage) -> str:
    without = f", {footage.dark} without an image" if footage.dark else ""
    return f"{footage.handed_out} observations{without}"


def _not_stored(dark: int, reasons: Counter[str]) -> str:
    """Say how many observations had no image of any camera, and the most frequent reason."""
    why = "; ".join(reason for reason, _ in reasons.most_common(1))
    return f"{counted(dark, 'observation')} without an image of any camera{why and f': {why}'}"


def _print(rows: list[tuple[str, str]]) -> None:
    for label, value in rows:
        if label == "recording":  # a path is not cut
            typer.echo(f"  {label:<{_LABEL_WIDTH}} {value}")
            continue
        for name, line in wrapped(label, value, _VALUE_WIDTH):
            typer.echo(f"  {name:<{_LABEL_WIDTH}} {line}")
