"""Writes an MCAP file with ROS 2 messages atomically."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from servoid.errors import MissingExtraError, OutputError
from servoid.exchange.bags.mcap.messages import Messages
from servoid.exchange.bags.names import STATIC_TOPIC
from servoid.output import check_file, move_to
from servoid.words import reason_of

SUFFIX = ".mcap"

_VERSION = 8  # of the summary: the newest that all releases since Humble can read


def check_mcap(path: Path) -> None:
    """Check that an MCAP file can be written to `path`.

    Raises:
        OutputError: it does not end in .mcap, or nothing can be written there.
        MissingExtraError: the library that writes bags is missing.

    """
    check_mcap_suffix(path)
    check_file(path)
    _library()


def check_mcap_suffix(path: Path) -> None:
    """Check that a name is that of an MCAP file.

    Raises:
        OutputError: it does not end in .mcap.

    """
    if path.suffix != SUFFIX:
        raise OutputError(f"cannot write {path}: a recording with ROS messages ends in {SUFFIX}")


class McapFile:
    """An MCAP file that is being written; `messages` encodes its content."""

    def __init__(self, path: Path, writer: Any) -> None:
        self.messages: Messages = Messages()
        self._path, self._writer = path, writer
        self._connections: dict[str, Any] = {}
        self.counts: dict[str, int] = {}

    def add(self, topic: str, kind: str, stamp_ns: int, data: bytes) -> None:
        """Write a message of a ROS 2 type, measured at a time in nanoseconds.

        Raises:
            OutputError: the time is before 0, or the file cannot be written.

        """
        if stamp_ns < 0:
            raise OutputError(
                f"cannot write {self._path}: {stamp_ns * 1e-9:g} s is before 0, which a ROS "
                "recording cannot represent; let times begin later"
            )
        with reporting_write_errors(self._path):
            if topic not in self._connections:
                self._connections[topic] = self._writer.add_connection(
                    topic,
                    kind,
                    typestore=self.messages.store,
                    offered_qos_profiles=_qos(is_latched=topic == STATIC_TOPIC),
                )
            self._writer.write(self._connections[topic], stamp_ns, data)
        self.counts[topic] = self.counts.get(topic, 0) + 1


@contextmanager
def mcap_file(path: str | Path) -> Iterator[McapFile]:
    """Write an MCAP file that appears at `path` when the block ends; on an error nothing is left.

    Raises:
        OutputError: the file cannot be written; an existing file at `path` is unchanged.
        MissingExtraError: the library that writes bags is missing.

    """
    path = Path(path)
    check_mcap(path)
    writer_class, plugin = _library()
    target = path.resolve()
    with tempfile.TemporaryDirectory(prefix=".servoid-", dir=target.parent) as drafts:
        # The library writes a folder with the file and a summary, which is also in the file.
        folder = Path(drafts) / target.stem
        writer = writer_class(folder, version=_VERSION, storage_plugin=plugin)
        with reporting_write_errors(path):
            writer.open()
        try:
            yield McapFile(path, writer)
        except BaseException:
            writer.abort()
            raise
        with reporting_write_errors(path):
            writer.close()
            draft = folder / f"{folder.name}{SUFFIX}"
            with draft.open("rb+") as file:
                os.fsync(file.fileno())
            move_to(path, draft)


@contextmanager
def reporting_write_errors(path: Path) -> Iterator[None]:
    """Report a disk error as a failure to write `path`."""
    try:
        yield
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"cannot write {path}: {reason_of(error)}") from error


def _library() -> tuple[Any, Any]:
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
    except ImportError as error:
        raise MissingExtraError.of("recordings with ROS messages", "rosbags", "bags") from error
    return Writer, StoragePlugin.MCAP


def _qos(*, is_latched: bool) -> list[Any]:
    """Return the topic's QoS for players; late subscribers still receive latched messages."""
    from rosbags.interfaces import (
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    forever = QosTime(9223372036, 854775807)
    return [
        Qos(
            QosHistory.KEEP_LAST,
            1 if is_latched else 10,
            QosReliability.RELIABLE,
            QosDurability.TRANSIENT_LOCAL if is_latched else QosDurability.VOLATILE,
            forever,
            forever,
            QosLiveliness.AUTOMATIC,
            forever,
            False,
        )
    ]
