"""Removes what an earlier run left in the folder of a run, which so never holds parts of two."""

from contextlib import suppress
from pathlib import Path

from servoid.errors import OutputError
from servoid.output import remove_file
from servoid.sim.trial import LOOKS
from servoid.words import joined

FILM, RECORDING = "servo.mp4", "run.mcap"
PICTURE = "target.png"
"""The candidates for an object that was marked ambiguously."""

RUN_FILES = (
    "log.csv",
    "times.csv",
    "run.toml",
    "body.json",
    "summary.json",
    FILM,
    RECORDING,
    "report.html",
    "hand.png",
    "joints.png",
    "gaze.png",
    PICTURE,
)
"""The files directly in the folder of a run."""

_INSIDE = (
    *(f"model/{name}" for name in ("report.html", "summary.json")),
    *(f"model/{name}.png" for name in ("body", "contact_sheet", "curve")),
    f"{LOOKS}/capture.toml",
    *(f"{LOOKS}/*-[0-9][0-9]{end}/image.png" for end in ("", "-mask")),
)


def check_own(folder: Path) -> None:
    """Check that files of a folder that a run would replace are those of an earlier run.

    Raises:
        OutputError: they are others'.

    """
    if any((folder / name).is_file() for name in ("run.toml", f"{LOOKS}/capture.toml")):
        return
    names = (name for name in (*RUN_FILES, *_INSIDE) if name != PICTURE)
    others = [name for name in names if any(folder.glob(name))]
    if others:
        raise OutputError(
            f"cannot write the run into {folder}: it holds {joined(others)}, but no run.toml, so "
            "that it is probably not of an earlier run, and would be replaced; move it, or name "
            "another folder"
        )


def remove_leftovers(folder: Path) -> bool:
    """Remove all that an earlier run wrote into its folder; return whether there was any.

    Raises:
        OutputError: a file cannot be removed.

    """
    found = [path for name in (*RUN_FILES, *_INSIDE) for path in folder.glob(name)]
    for path in found:
        remove_file(path)
    for inside in {path.parent for path in found} - {folder, folder / LOOKS}:
        with suppress(OSError):  # it holds files of other programs
            inside.rmdir()
    return bool(found)
