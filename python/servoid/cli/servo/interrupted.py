"""Describes what an interrupted run leaves in its folder, and removes empty folders."""

from dataclasses import dataclass
from pathlib import Path

from servoid.sim.trial import LOOKS


@dataclass(frozen=True)
class FolderBefore:
    """The folder of a run as it was before: which folders were missing, and which looks it held."""

    folder: Path
    missing: tuple[Path, ...]
    looks: tuple[int, int] | None

    @classmethod
    def of(cls, folder: Path) -> "FolderBefore":
        """Look at the folder of a run, and at the folders above it."""
        missing = tuple(path for path in (folder, *folder.parents) if not path.exists())
        return cls(folder, missing, _version(folder / LOOKS))

    def after_no_servoing(self, *, replaces: bool) -> str:
        """Return what a run left before it servoed; `replaces`: it removed an earlier one's files.

        Nothing else is left of either.
        """
        looks = self.folder / LOOKS
        removed = "; the files of an earlier run are removed" if replaces else ""
        if _version(looks) not in (None, self.looks):
            return (
                f"interrupted before servoing began; {looks} holds the images so far, of which "
                f"servoid model makes a body; nothing else was written{removed}"
            )
        return f"interrupted before servoing began; nothing was written{removed}"

    def remove_empty(self) -> None:
        """Remove the folders that were made in vain."""
        for path in self.missing:
            try:
                path.rmdir()
            except OSError:  # it was not made, it holds files, or another program uses it
                break


def after_servoing(folder: Path) -> str:
    """Return what a run leaves that was interrupted while it wrote its results."""
    return (
        f"interrupted while the results were written; {folder} holds a part of them; run again, or "
        "delete it"
    )


def _version(looks: Path) -> tuple[int, int] | None:
    """Return what changes when the capture of looks is replaced by another one."""
    try:
        status = (looks / "capture.toml").stat()
    except OSError:
        return None
    return status.st_ino, status.st_mtime_ns
