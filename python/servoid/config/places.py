"""Finds files that a capture names, and keeps to the capture's folder."""

from collections.abc import Iterable
from pathlib import Path, PureWindowsPath

from servoid.errors import CaptureError


def check_inside(name: str, place: str) -> None:
    """Check that a path or pattern that a file names stays in the capture's folder.

    Raises:
        CaptureError: it names nothing, is absolute, or goes up with '..'.

    """
    if "\0" in name or not Path(name).name:
        raise CaptureError(f"{place}: {name!r} is no name of a file; write one such as 'a/b.png'")
    windows = PureWindowsPath(name)
    parts = {*Path(name).parts, *windows.parts}
    if Path(name).is_absolute() or windows.drive or windows.root or ".." in parts:
        raise CaptureError(
            f"{place}: '{name}' leaves the capture's folder; write it relative to that folder, "
            "without '..'"
        )


def check_held(paths: Iterable[Path], folder: Path, place: str) -> None:
    """Check that files lie in a capture's folder also when links on the way are followed.

    Raises:
        CaptureError: a link leads out of the folder.

    """
    home = _followed(folder)
    within: dict[Path, Path] = {}  # a folder has many files
    for path in paths:
        if path.parent not in within:
            within[path.parent] = _followed(path.parent)
        target = _followed(path) if _is_link(path) else within[path.parent] / path.name
        if not target.is_relative_to(home):
            raise CaptureError(
                f"{place}: a link leads from {path} to {target}, out of the capture's folder "
                f"{folder}; copy what it leads to into the folder"
            )


def is_file(path: Path) -> bool:
    """Say if there is a file; a name that no file can have is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long, for instance
        return False


def is_folder(path: Path) -> bool:
    """Say if there is a folder; a name that no folder can have is none."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def _is_link(path: Path) -> bool:
    try:
        return path.is_symlink()
    except OSError:  # the name is too long
        return False


def _followed(path: Path) -> Path:
    """Return where the links of a path lead; a circle leads to itself, which no one can read."""
    try:
        return path.resolve()
    except (OSError, RuntimeError):
        return path.absolute()


def first_file(paths: Iterable[Path]) -> Path | None:
    """Return the first path at which there is a file."""
    return next((path for path in paths if is_file(path)), None)
