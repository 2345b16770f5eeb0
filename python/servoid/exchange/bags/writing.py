"""Writes observations as MCAP with ROS 2 messages, so that they replay to the same bits."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from servoid.errors import OutputError
from servoid.exchange.bags.mcap.mcap_file import check_mcap, check_mcap_suffix, mcap_file
from servoid.exchange.bags.mcap.observations import ObservationRecorder, RecordedCamera
from servoid.exchange.bags.mcap.raw_images import (
    RawImage,
    RawObservation,
    raw_depth,
    raw_image,
    raw_observations,
)
from servoid.exchange.bags.mcap.run import McapRun, ObjectState, RunRig, mcap_run

__all__ = [
    "McapRun",
    "ObjectState",
    "RawImage",
    "RawObservation",
    "RecordedCamera",
    "RunRig",
    "check_mcap",
    "check_mcap_suffix",
    "mcap_run",
    "raw_depth",
    "raw_image",
    "raw_observations",
    "write_mcap_recording",
]


def write_mcap_recording(
    path: str | Path,
    cameras: Sequence[RecordedCamera],
    observations: Iterable[RawObservation],
    watch: Callable[[int], None] | None = None,
) -> int:
    """Write observations as they come, and return their number.

    The file appears at `path` when the last one is written; on any error nothing is left of it.
    Compressed images stay compressed, and pixels are written unchanged. `open_bag` opens the file
    as a capture with the same images, times and poses, to the last bit. `watch` receives the number
    of observations so far.

    Raises:
        OutputError: the file cannot be written, there is no observation, or times do not increase.
        MissingExtraError: the library that writes bags is missing.
        Whatever `observations` raises.

    """
    count = 0
    with mcap_file(path) as file:
        recorder = ObservationRecorder(Path(path), file, cameras)
        for observation in observations:
            recorder.add(observation)
            count += 1
            if watch is not None:
                watch(count)
        if not count:
            raise OutputError(f"cannot write {path}: there is no observation to record")
    return count
