"""Chooses the recording format by the output's name: a capture folder or an MCAP file."""

from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType

from servoid.cli.wrong_options import OptionError
from servoid.errors import CaptureError
from servoid.pose import Pose
from servoid.record import QueuedRecording, check_recording, record_folder
from servoid.source import MountedCamera, RawInstant

_MCAP = ".mcap"
_WRITING = "servoid.exchange.bags.writing"

Write = Callable[[Iterable[RawInstant]], object]


def check_recorder(out: Path) -> None:
    """Check that a recording can be written to a folder, or to a file that ends in .mcap.

    Raises:
        OutputError: it cannot be written.
        OptionError: the name is neither.
        CaptureError: this version of servoid writes no MCAP.

    """
    if is_mcap(out):
        mcap_writing().check_mcap(out)
    elif out.suffix and not out.is_dir():
        raise OptionError(
            f"cannot record {out}: a recording is a folder, or a file that ends in {_MCAP}"
        )
    else:
        check_recording(out)


def writer_of(
    out: Path, rig: Sequence[MountedCamera], began: datetime, *, is_calibrated: bool = True
) -> Write:
    """Return a function that writes observations of a rig to `out`; their time 0 was `began`."""
    if is_mcap(out):
        return partial(_write_mcap, out, rig)
    when = began.isoformat(sep=" ", timespec="microseconds")
    return lambda raw: record_folder(out, rig, raw, began=when, is_calibrated=is_calibrated)


def recording_of(
    out: Path, rig: Sequence[MountedCamera], began: datetime, *, is_calibrated: bool = True
) -> QueuedRecording:
    """Begin to record in the background; otherwise as `writer_of`."""
    return QueuedRecording(writer_of(out, rig, began, is_calibrated=is_calibrated))


def _write_mcap(out: Path, rig: Sequence[MountedCamera], raw: Iterable[RawInstant]) -> object:
    writing = mcap_writing()

    def image_of(raw: RawInstant, place: int) -> object:
        image = raw.images[place]
        if image is None:
            return None
        if image.encoded is not None:
            return writing.RawImage(image.encoded, "jpeg")
        return writing.RawImage(image.pixels, "rgb8")

    observations = (
        writing.RawObservation(
            time_s=one.time_s,
            world_from_rig=Pose.identity(),
            images=tuple(image_of(one, place) for place in range(len(rig))),
            depths=tuple(None if image is None else image.depth_m for image in one.images),
        )
        for one in raw
    )
    return writing.write_mcap_recording(out, rig, observations)


def is_mcap(out: Path) -> bool:
    """Return whether a name is that of an MCAP file."""
    return out.suffix.lower() == _MCAP


def mcap_writing() -> ModuleType:
    """Return the module that writes MCAP.

    Raises:
        CaptureError: this version of servoid has no such module.

    """
    try:
        return import_module(_WRITING)
    except ModuleNotFoundError as error:
        if error.name is None or not _WRITING.startswith(error.name):
            raise
        raise CaptureError(
            f"this version of servoid writes no {_MCAP}; record into a folder"
        ) from error
