"""Writes a file whole or not at all."""

import errno
import os
import secrets
import stat
import tempfile
from collections.abc import Callable, Iterator, Mapping, Set
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from servoid.errors import OutputError
from servoid.words import reason_of

_FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)
_ELSEWHERE = "choose a folder that you may write to"
_NO_FILES = {
    "a device": lambda mode: stat.S_ISCHR(mode) or stat.S_ISBLK(mode),
    "a pipe": stat.S_ISFIFO,
    "a socket": stat.S_ISSOCK,
}
_ledgers: list[list[Path]] = []  # of the blocks whose writes are noted


@contextmanager
def noted_writes() -> Iterator[list[Path]]:
    """Yield a list of the files and folders that are written during the block."""
    ledger: list[Path] = []
    _ledgers.append(ledger)
    try:
        yield ledger
    finally:
        _ledgers.remove(ledger)


def move_to(path: Path, draft: Path) -> None:
    """Move a finished file or folder to `path`, or where a link there leads; raises OSError."""
    draft.replace(path.resolve())
    for ledger in _ledgers:
        ledger.append(path)


def write_whole(path: Path, data: bytes) -> None:
    """Write `data` to `path` atomically, so that no partial file ever exists there.

    Raises:
        OutputError: the file cannot be written, or `path` is a device, a pipe or a socket; what
            was at `path` is unchanged.

    """
    target = path.resolve()  # a link keeps pointing to the file, which is replaced
    _check_replaced(target, path)
    partial = _beside(target)
    try:
        with partial.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        move_to(path, partial)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {_reason(error)}") from error
    finally:
        partial.unlink(missing_ok=True)


def write_together(files: Mapping[Path, bytes]) -> None:
    """Write several files whole, all of them or none.

    Raises:
        OutputError: a file cannot be written; the previous files are unchanged.

    """
    old = {path: _content(path) for path in files}
    written: list[Path] = []
    try:
        for path, data in files.items():
            write_whole(path, data)
            written.append(path)
    except BaseException:
        for path in written:
            before = old[path]
            if before is None:
                path.unlink(missing_ok=True)
            else:
                write_whole(path, before)
        for ledger in _ledgers:
            ledger[:] = (path for path in ledger if path not in files)
        raise


@contextmanager
def written_beside(path: Path) -> Iterator[Path]:
    """Yield a temporary path beside `path`; its file is moved to `path` when the block ends.

    The temporary path ends as `path` does, for libraries that depend on the ending. If the block
    raises, nothing is left behind and the previous file at `path` is unchanged.

    Raises:
        OutputError: the file cannot be moved to `path`, or `path` is a device, a pipe or a socket.

    """
    target = path.resolve()
    _check_replaced(target, path)
    partial = _beside(target).with_suffix(target.suffix)
    try:
        yield partial
        try:
            move_to(path, partial)
        except OSError as error:
            raise OutputError(f"cannot write {path}: {_reason(error)}") from error
    finally:
        partial.unlink(missing_ok=True)


@dataclass(frozen=True)
class FolderKind:
    """A kind of folder that servoid writes as a whole, and may replace by another of its kind.

    `what` names it, such as `a sample`; its capture.toml begins with `mark`; `own` returns the
    paths below such a folder, with `/`, that writing it may have left there, folders too.
    """

    what: str
    mark: str
    own: Callable[[Path], Set[str]]


def write_folder(directory: Path, fill: Callable[[Path], None], kind: FolderKind) -> None:
    """Let `fill` write into a new folder, then replace `directory` by it.

    Raises:
        OutputError: `directory` is not a folder of this kind or cannot be written; it is
            unchanged.

    """
    check_replaceable(directory, kind)
    target = directory.resolve()
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".servoid-", dir=target.parent) as scratch:
            draft = Path(scratch) / "draft"
            draft.mkdir()
            fill(draft)
            check_replaceable(directory, kind)  # again, because filling it took a while
            if target.exists():
                target.rename(Path(scratch) / "earlier")
            move_to(directory, draft)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"cannot write {kind.what} into {directory}: {_reason(error)}") from error


def check_replaceable(directory: Path, kind: FolderKind) -> None:
    """Check that writing a folder would overwrite nothing but an earlier one of its kind.

    Raises:
        OutputError: `directory` is something else.

    """
    if not directory.exists():
        return
    if not directory.is_dir():
        raise OutputError(f"cannot write {kind.what} into {directory}: it is a file; name a folder")
    found = {path.relative_to(directory).as_posix() for path in directory.rglob("*")}
    foreign = found - kind.own(directory) if _is_of(directory, kind) else found
    if foreign:
        raise OutputError(
            f"cannot write {kind.what} into {directory}: the folder holds other files, such as "
            f"{_first_file(directory, foreign)}, and would be replaced as a whole; move them, or "
            "name a folder that is empty or does not exist yet"
        )


def _is_of(directory: Path, kind: FolderKind) -> bool:
    capture = directory / "capture.toml"
    return capture.is_file() and capture.read_bytes().startswith(kind.mark.encode())


def _first_file(directory: Path, found: Set[str]) -> str:
    """Return the first of these paths below a folder, of a file if there is one."""
    return min(found, key=lambda path: ((directory / path).is_dir(), path))


def check_file(path: Path) -> None:
    """Check that `write_whole(path, ...)` can work, and leave nothing behind.

    Raises:
        OutputError: `path` is a folder, a device, a pipe or a socket, its folder is missing, or
            nothing can be written there.

    """
    if path.is_dir():
        raise OutputError(f"cannot write {path}: it is a folder; name a file in it")
    target = path.resolve()
    _check_replaced(target, path)
    _check_writable(target.parent, named=path)


def check_folder(path: Path, *, parents: bool = False) -> None:
    """Check that files can be written into the folder `path`, or that it can be made.

    With `parents`, the folders above it may be missing, too.

    Raises:
        OutputError: `path` is a file, the folder above it is missing, or it is read-only.

    """
    if path.exists() and not path.is_dir():
        raise OutputError(f"cannot write into {path}: it is a file; name a folder")
    folder = path.resolve() if path.is_dir() else path.resolve().parent
    while parents and not folder.exists():
        folder = folder.parent
    if parents and not folder.is_dir():
        raise OutputError(f"cannot write into {path}: {folder} is a file; name another folder")
    _check_writable(folder, named=path)


def make_folder(path: Path, *, parents: bool = False) -> None:
    """Make the folder `path` if it does not exist; the one above it must, unless `parents`.

    Raises:
        OutputError: the folder cannot be made.

    """
    try:
        path.mkdir(exist_ok=True, parents=parents)
    except OSError as error:
        raise OutputError(f"cannot make the folder {path}: {_reason(error)}") from error


@contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Claim an existing folder for the block, so that no other run writes into it meanwhile.

    The kernel keeps the claim, so that a run that is killed leaves none. Where folders cannot be
    locked, as on Windows and some network drives, nothing is claimed.

    Raises:
        OutputError: another run has claimed it, or it cannot be opened.

    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    try:
        held = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise OutputError(f"cannot write into {folder}: {_reason(error)}") from error
    try:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise OutputError(
                f"another run is writing into {folder}; wait until it has ended, or name another "
                "folder"
            ) from error
        except OSError:  # this file system has no locks
            pass
        yield
    finally:
        os.close(held)


def remove_file(path: Path) -> None:
    """Remove the file or link at `path`, if there is one.

    Raises:
        OutputError: it cannot be removed.

    """
    try:
        if path.is_symlink() or path.is_file():
            path.unlink()
    except OSError as error:
        raise OutputError(f"cannot remove {path}: {_reason(error)}") from error


def _content(path: Path) -> bytes | None:
    try:
        return path.read_bytes() if path.exists() else None
    except OSError as error:
        raise OutputError(f"cannot replace {path}: {_reason(error)}") from error


def _check_replaced(target: Path, named: Path) -> None:
    """Check that writing to `target`, where links end, replaces nothing but a file.

    Moving a file to it would delete a device or a pipe, and what reads from it would wait forever.
    """
    try:
        mode = target.stat().st_mode
    except OSError:  # nothing is there, or writing to it fails with the reason
        return
    for what, is_it in _NO_FILES.items():
        if is_it(mode):
            link = "it" if not named.is_symlink() else f"{target}, where its link leads,"
            raise OutputError(
                f"cannot write {named}: {link} is {what}, which a file would replace; name a file, "
                "or a path where nothing is yet"
            )


def _check_writable(folder: Path, named: Path) -> None:
    if not folder.is_dir():
        raise OutputError(f"cannot write {named}: there is no folder {folder}; make it first")
    probe = _beside(folder / "probe")
    try:
        probe.open("xb").close()
        probe.unlink()
    except OSError as error:
        raise OutputError(f"cannot write {named}: {_reason(error)}") from error


def _beside(path: Path) -> Path:
    # An independent short name, because a long name may leave no room for a suffix.
    return path.with_name(f".servoid-{secrets.token_hex(6)}.part")


def _reason(error: OSError) -> str:
    """Return why nothing could be written, and what to do where another place is all it takes."""
    reason = reason_of(error)
    return f"{reason}; {_ELSEWHERE}" if error.errno in _FORBIDDEN else reason
