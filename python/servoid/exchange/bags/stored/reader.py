"""Opens the files of a bag, and reads messages at any position in them."""

import struct
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from servoid.config import BAG_MESSAGE, check_regular, is_file, is_folder
from servoid.errors import CaptureError, MissingExtraError, ServoidError
from servoid.words import reason_of

ReadT = TypeVar("ReadT")

SUFFIXES = (".mcap", ".bag", ".db3")
_METADATA = "metadata.yaml"
_ROS1 = ".bag"
_OPEN = 4  # bags that stay open
_AHEAD = 8  # messages to skip, beyond which seeking is faster
_KEPT = 8  # messages of a topic: threads request neighbours, not quite in order
_KEPT_BYTES = 1 << 26
_DATABASE_HEADER, _LARGEST_PAGE = 100, 1 << 16  # bytes, of SQLite
_REMEDIES = {
    ".bag": "copy it again, or mend it with `rosbag reindex`",
    ".mcap": "copy it again, or mend it with `mcap recover`",
    ".db3": "copy it again, or mend it with `ros2 bag reindex`",
    "": "copy it again, or mend it with `ros2 bag reindex`",
}


@dataclass(frozen=True)
class Stored:
    """The position of a message: its topic, when it was written, and its index at that time."""

    topic: str
    log_ns: int
    twin: int = 0


@dataclass(frozen=True)
class Message:
    """One message as stored in the bag, not decoded yet."""

    at: Stored
    kind: str
    data: bytes


def is_bag(path: str | Path) -> bool:
    """Return whether a path is named like a bag, or is a folder that holds one; nothing is read."""
    path = Path(path)
    if is_folder(path):
        return is_file(path / _METADATA) or bool(_storages(path))
    return path.suffix.lower() in SUFFIXES


def open_files(path: Path) -> "Bag":
    """Open the bag at `path`, or return the open one if its files are unchanged.

    Raises:
        CaptureError: there is no such bag, or it is cut short, damaged or of an unknown kind.
        MissingExtraError: the library that reads bags is missing.

    """
    place = _place(path)
    return _opened(place, _version(place))


class Bag:
    """An open bag. `kinds` maps each topic to the type of its messages, `counts` to their number.

    Several threads may read from it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.is_ros1: bool = path.suffix.lower() == _ROS1
        self._lock = threading.RLock()
        with self._damage():
            self._reader = _any_reader(path)
            for file in _storages(path) if is_folder(path) else [path]:
                _check_database(file)
            self._reader.open()
            topics = self._reader.topics
        self.counts: dict[str, int] = {topic: info.msgcount for topic, info in topics.items()}
        self.kinds: dict[str, str] = {}  # in the order of creation
        for connection in self._reader.connections:
            known = self.kinds.setdefault(connection.topic, connection.msgtype)
            self.kinds[connection.topic] = known if known == connection.msgtype else ""
        self._cursors: dict[str, _Cursor] = {}

    def messages(self, topics: Sequence[str], start_ns: int | None = None) -> Iterator[Message]:
        """Yield the messages of topics in the order in which they were written.

        Raises:
            CaptureError: the bag is damaged.

        """
        wanted = [one for one in self._reader.connections if one.topic in topics]
        if not wanted:
            return
        last: dict[str, Stored] = {}
        found = self._reader.messages(wanted, start=start_ns)
        while True:
            with self._lock, self._damage():
                following = next(found, None)
            if following is None:
                return
            connection, log_ns, data = following
            if len(data) > BAG_MESSAGE.most_bytes:
                raise CaptureError(
                    f"{self.path}: a message on {connection.topic} has more than "
                    f"{BAG_MESSAGE.text}, the maximum that servoid accepts; leave the topic out"
                )
            before = last.get(connection.topic)
            twin = before.twin + 1 if before is not None and before.log_ns == log_ns else 0
            at = Stored(connection.topic, log_ns, twin)
            last[connection.topic] = at
            yield Message(at, connection.msgtype, bytes(data))

    def first(self, topic: str) -> Message | None:
        """Return the first message of a topic, None if there is none.

        Raises:
            CaptureError: the bag is damaged.

        """
        return next(self.messages([topic]), None)

    def read(self, at: Stored) -> Message:
        """Return one message; reading in order reads each message once.

        Raises:
            CaptureError: the bag is damaged.

        """
        with self._lock:
            return self._cursors.setdefault(at.topic, _Cursor(self, at.topic)).read(at)

    def decode(self, message: Message, read: Callable[[Any], ReadT]) -> ReadT:
        """Return what `read` finds in a message, whose fields are attributes.

        A bag contains the definitions of its types: fields may be missing, or have other types.

        Raises:
            CaptureError: its bytes do not match its type, or `read` does not find its fields.

        """
        with self._damage():
            return read(self._reader.deserialize(message.data, message.kind))

    @contextmanager
    def _damage(self) -> Iterator[None]:
        """Report damage of the bag if reading it fails in any way."""
        try:
            yield
        except ServoidError:
            raise
        except OSError as reason:
            raise CaptureError(f"cannot read {self.path}: {reason_of(reason)}") from reason
        except Exception as reason:
            # The library checks little: a damaged file may raise any exception.
            words = str(reason).strip().rstrip(".") or type(reason).__name__
            remedy = _REMEDIES.get(self.path.suffix.lower(), _REMEDIES[""])
            raise CaptureError(
                f"{self.path} is cut short, damaged or not a bag ({words[:200]}); {remedy}"
            ) from reason


class _Cursor:
    """Reads one topic forwards, and caches the last messages."""

    def __init__(self, bag: Bag, topic: str) -> None:
        self._bag, self._topic = bag, topic
        self._coming: Iterator[Message] = iter(())
        self._kept: OrderedDict[Stored, Message] = OrderedDict()
        self._start_ns = 0
        self._position: Stored | None = None

    def read(self, at: Stored) -> Message:
        if at in self._kept:
            return self._kept[at]
        position = self._position
        is_ahead = position is not None and (position.log_ns, position.twin) < (at.log_ns, at.twin)
        found = self._advance(at, _AHEAD) if is_ahead else None
        if found is None:
            self._coming = self._bag.messages([self._topic], start_ns=at.log_ns)
            found = self._advance(at, at.twin + 1)
        if found is None:
            raise CaptureError(
                f"{self._bag.path} changed while it was read: a message on {self._topic} is "
                "gone; run it again"
            )
        return found

    def _advance(self, to: Stored, most: int) -> Message | None:
        for _ in range(most):
            message = next(self._coming, None)
            if message is None:
                break
            self._position = message.at
            self._keep(message)
            if message.at == to:
                return message
        self._position = None
        return None

    def _keep(self, message: Message) -> None:
        self._kept[message.at] = message
        most = min(_KEPT, max(1, _KEPT_BYTES // max(len(message.data), 1)))
        while len(self._kept) > most:
            self._kept.popitem(last=False)


@lru_cache(maxsize=_OPEN)
def _opened(path: Path, _version: tuple[tuple[int, int], ...]) -> Bag:
    return Bag(path)


def _any_reader(path: Path) -> Any:
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise MissingExtraError.of("bags", "rosbags", "bags") from error
    # Recorders before 2023 did not store the type definitions; the standard ones have not changed.
    return AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))


def _place(path: Path) -> Path:
    """Return the file or folder to open; for a folder without a summary, its only file.

    Raises:
        CaptureError: there is none, or it is ambiguous.

    """
    if not is_folder(path):
        check_regular(path, CaptureError)
        return path
    if is_file(path / _METADATA):
        return path
    found = _storages(path)
    if len(found) != 1:
        raise CaptureError(
            f"{path} has no {_METADATA} and {len(found)} bag files; name one of them, or write the "
            "missing file with `ros2 bag reindex`"
        )
    return found[0]


def _storages(folder: Path) -> list[Path]:
    return sorted(one for one in folder.iterdir() if one.suffix.lower() in SUFFIXES)


def _check_database(path: Path) -> None:
    """Check that a database has its stated length: SQLite treats missing parts as empty.

    Raises:
        CaptureError: its end is missing.

    """
    if path.suffix.lower() != ".db3":
        return
    with path.open("rb") as file:
        start = file.read(_DATABASE_HEADER)
    if len(start) < _DATABASE_HEADER:
        raise CaptureError(f"{path} is cut short: its end is missing; {_REMEDIES['.db3']}")
    (page,) = struct.unpack_from(">H", start, 16)
    changes, count = struct.unpack_from(">II", start, 24)
    (changes_then,) = struct.unpack_from(">I", start, 92)
    promised = (_LARGEST_PAGE if page == 1 else page) * count
    # Old writers do not update the count; the change counters then differ.
    if changes == changes_then and path.stat().st_size < promised:
        raise CaptureError(
            f"{path} is cut short: it has {path.stat().st_size} of {promised} bytes; "
            f"{_REMEDIES['.db3']}"
        )


def _version(path: Path) -> tuple[tuple[int, int], ...]:
    """Return what changes when a bag is rewritten."""
    files = [path] if is_file(path) else [path / _METADATA, *_storages(path)]
    return tuple((one.stat().st_size, one.stat().st_mtime_ns) for one in files)
