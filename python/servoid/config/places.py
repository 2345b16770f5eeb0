"""Finds files that a capture names, and confines them to the capture's folder."""

import os
from collections.abc import Iterable, Sequence
from itertools import islice
from pathlib import Path, PureWindowsPath

from servoid.errors import CaptureError, ServoidError
from servoid.words import joined

_LONGEST_NAME = 100  # bytes; file systems take 255, and names of files are made of these
_MOST_COMPARED = 1000  # names of files in a folder
_MOST_NAMED = 3
_SHOWN_NAME = 40  # characters in a message


def check_inside(name: str, place: str) -> None:
    """Check that a path or pattern in a file stays inside the capture's folder.

    Raises:
        CaptureError: it is empty or no file name, is absolute, or goes up with '..'.

    """
    if "\0" in name or not Path(name).name:
        raise CaptureError(f"{place}: {name!r} is not a file name; write one such as 'a/b.png'")
    windows = PureWindowsPath(name)
    parts = {*Path(name).parts, *windows.parts}
    if Path(name).is_absolute() or windows.drive or windows.root or ".." in parts:
        raise CaptureError(
            f"{place}: '{name}' leaves the capture's folder; write it relative to that folder, "
            "without '..'"
        )


def path_of(given: object, error: type[ServoidError]) -> Path:
    """Return what a program gives as a path.

    Raises:
        error: it is no path.

    """
    if not isinstance(given, (str, os.PathLike)):
        raise error(f"a path must be a text or a pathlib.Path, but {given!r:.60} was given")
    return Path(os.fspath(given))


def name_fault(name: str) -> str | None:
    """Return why a camera cannot have a name, which also names the folder of its images, or None.

    The reason names what is allowed.
    """
    if "/" in name or "\\" in name:
        reason = "it has a slash"
    elif name.startswith("."):
        reason = "it begins with a dot"
    elif not name.isprintable():
        reason = "it has a character that cannot be printed"
    elif len(name.encode("utf-8", "surrogatepass")) > _LONGEST_NAME:
        reason = "it is too long"
    elif not name.strip():
        reason = "it is empty"
    else:
        return None
    shown = name if len(name) <= _SHOWN_NAME else f"{name[:_SHOWN_NAME]}..."
    return (
        f"a camera cannot be named {shown!r}, because {reason}; name it with letters, digits, "
        f"spaces and signs other than slashes, at most {_LONGEST_NAME} bytes in UTF-8 and no dot "
        "in front, such as 'left'"
    )


def check_held(paths: Iterable[Path], folder: Path, place: str) -> None:
    """Check that files are inside a capture's folder after links on their paths are followed.

    Raises:
        CaptureError: a link leads out of the folder.

    """
    home = followed(folder)
    within: dict[Path, Path] = {}  # a folder has many files
    for path in paths:
        if path.parent not in within:
            within[path.parent] = followed(path.parent)
        target = followed(path) if _is_link(path) else within[path.parent] / path.name
        if not target.is_relative_to(home):
            raise CaptureError(
                f"{place}: a link leads from {path} to {target}, out of the capture's folder "
                f"{folder}; copy its target into the folder, or link it hard (ln without -s)"
            )


def beside(path: Path, suffixes: Sequence[str]) -> str:
    """Name the files with one of the suffixes in the folder of a missing one, the likeliest first.

    Of a folder with very many files only some are compared with the missing name.
    """
    from difflib import SequenceMatcher  # not above, as few messages need it

    folder = path.parent
    if not is_folder(folder):
        return f"there is no folder {folder}"
    try:
        there = (one.name for one in folder.iterdir() if one.suffix.lower() in suffixes)
        names = list(islice(there, _MOST_COMPARED))
    except OSError:
        return f"the folder {folder} cannot be read"
    if not names:
        return f"the folder has no {joined(list(suffixes), 'or')} file"
    alike = {name: SequenceMatcher(None, name, path.name).ratio() for name in names}
    names.sort(key=lambda name: (-alike[name], name))
    more = [f"{len(names) - _MOST_NAMED} more"] if len(names) > _MOST_NAMED else []
    return f"the folder has {joined([*names[:_MOST_NAMED], *more])}"


def is_file(path: Path) -> bool:
    """Return whether the path is a file; False for names that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long, for instance
        return False


def is_same(path: Path, other: Path) -> bool:
    """Return whether two paths lead to the same file or folder, which need not exist."""
    try:
        if path.exists() and other.exists():
            return path.samefile(other)
    except (OSError, ValueError):  # no file can have one of the names
        return False
    return followed(path) == followed(other)


def exists(path: Path) -> bool:
    """Return whether anything is at the path; False for names that nothing can have."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def is_folder(path: Path) -> bool:
    """Return whether the path is a folder; False for names that no folder can have."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def _is_link(path: Path) -> bool:
    try:
        return path.is_symlink()
    except OSError:  # the name is too long
        return False


def followed(path: Path) -> Path:
    """Resolve the links of a path; a loop resolves to itself, which cannot be read."""
    try:
        return path.resolve()
    except (OSError, RuntimeError):
        return path.absolute()


def first_file(paths: Iterable[Path]) -> Path | None:
    """Return the first path that is a file."""
    return next((path for path in paths if is_file(path)), None)
