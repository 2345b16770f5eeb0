"""Keeps what the tests draw from one run of them to the next, while what draws it stays the same.

What is kept lies where pytest has its cache. A change of anything that can draw, the binding
included, changes the key, so that the next run draws anew.
"""

import hashlib
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from functools import cached_property, wraps
from pathlib import Path
from typing import Concatenate, ParamSpec, TypeVar

import cv2
import numpy as np

import servoid
from servoid import _native

PACKAGE = Path(servoid.__file__).parent
ABOVE = {"batch", "cli", "view"}  # the floors above, which drawing does not know
KEPT_S = 7 * 24 * 3600.0
Self = TypeVar("Self")
Options = ParamSpec("Options")
Write = Callable[Concatenate[Self, Path, Options], Path]


def sources() -> list[Path]:
    """Return the files that decide what is drawn."""
    files = [path for path in PACKAGE.rglob("*") if path.suffix in (".py", ".toml", ".csv")]
    low = [path for path in files if path.relative_to(PACKAGE).parts[0] not in ABOVE]
    return [*sorted(low), Path(_native.__file__)]


def digest(files: Iterable[Path]) -> str:
    """Return a hash of the files' names and contents, and of the libraries that take part."""
    found = hashlib.sha256(repr((sys.version, np.__version__, cv2.__version__)).encode())
    for path in files:
        content = path.read_bytes()
        found.update(repr((path.as_posix(), len(content))).encode() + content)
    return found.hexdigest()


class Drawn:
    """Draws folders, or copies what was drawn before; without a shelf it draws each time."""

    def __init__(self, shelf: Path | None, files: Iterable[Path] | None = None) -> None:
        self._shelf = shelf
        self._files = sources() if files is None else list(files)

    def __call__(
        self, folder: Path, name: str, settings: object, draw: Callable[[Path], object]
    ) -> Path:
        """Make a folder that does not exist yet, by `draw` or as it was drawn; return it.

        The same `name` and `settings`, as they are printed, must mean the same drawing.
        """
        if self._shelf is None:
            draw(folder)
            return folder
        key = hashlib.sha256(repr((self._sources, name, settings)).encode()).hexdigest()
        kept = self._shelf / f"{name}-{key[:32]}"
        if not kept.is_dir():
            self._forget()
            self._keep(kept, draw)
        shutil.copytree(kept, folder)  # a test that spoils its own spoils no other's
        return folder

    @cached_property
    def _sources(self) -> str:
        return digest(self._files)

    def _keep(self, kept: Path, draw: Callable[[Path], object]) -> None:
        with tempfile.TemporaryDirectory(dir=kept.parent, prefix="unfinished-") as beside:
            new = Path(beside) / "drawn"
            draw(new)
            try:
                new.rename(kept)
            except OSError:
                if not kept.is_dir():  # else another run of the tests was faster
                    raise

    def _forget(self) -> None:
        """Remove what was drawn long ago."""
        assert self._shelf is not None
        for one in self._shelf.iterdir():
            if one.stat().st_mtime < time.time() - KEPT_S:
                shutil.rmtree(one, ignore_errors=True)


def once(write: Write[Self, Options]) -> Write[Self, Options]:
    """Let a method that writes a folder draw each thing once in this process, and copy it then."""
    kept: dict[object, dict[Path, bytes | None]] = {}

    @wraps(write)
    def written(
        drawing: Self, folder: Path, *args: Options.args, **options: Options.kwargs
    ) -> Path:
        key = (drawing, args, tuple(options.items()))
        if key not in kept:
            with tempfile.TemporaryDirectory() as beside:
                new = write(drawing, Path(beside) / "drawn", *args, **options)
                kept[key] = {
                    path.relative_to(new): path.read_bytes() if path.is_file() else None
                    for path in sorted(new.rglob("*"))
                }
        folder.mkdir(parents=True, exist_ok=True)
        for path, content in kept[key].items():
            if content is None:
                (folder / path).mkdir()
            else:
                (folder / path).write_bytes(content)
        return folder

    return written
