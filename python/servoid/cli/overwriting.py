"""Refuses outputs that a command would write over its own inputs, or over each other."""

from collections.abc import Iterable
from pathlib import Path

from servoid.cli.wrong_options import OptionError
from servoid.config import followed, is_same
from servoid.opening import SourceWord, belongs_to_source
from servoid.segment import BackgroundTarget, MaskTarget, Target

Output = tuple[str, Path | None]
"""An option, such as --out, and where it writes."""


def check_inputs_kept(
    outputs: Iterable[Output], source: SourceWord | None, inputs: Iterable[Path | None] = ()
) -> None:
    """Check that no output is an input of the same command, or another output, also through links.

    Raises:
        OptionError: one is.

    """
    files = [path for path in inputs if path is not None]
    written: list[tuple[str, Path]] = []
    for option, path in outputs:
        if path is None:
            continue
        for other, there in written:
            if is_same(path, there):
                raise OptionError(
                    f"{other} and {option} would both write {path}; give {option} another path"
                )
        written.append((option, path))
        if source is not None and belongs_to_source(path, source):
            is_all = any(is_same(path, place) for place in source.places)
            raise _refusal(option, path, "is SOURCE" if is_all else f"belongs to SOURCE '{source}'")
        for file in files:
            if is_same(path, file):
                raise _refusal(option, path, f"is {file}" if path != file else "is an input")


def check_inputs_outside(output: Output, inputs: Iterable[Path | None]) -> None:
    """Check that a folder that is replaced as a whole holds no input of the same command.

    Raises:
        OptionError: it does.

    """
    option, folder = output
    if folder is None:
        return
    for path in inputs:
        if path is not None and followed(path).is_relative_to(followed(folder)):
            raise _refusal(option, folder, "is replaced as a whole")


def files_of(targets: Iterable[Target]) -> list[Path]:
    """Return the files that targets are read from."""
    return [target.path for target in targets if isinstance(target, (MaskTarget, BackgroundTarget))]


def _refusal(option: str, path: Path, why: str) -> OptionError:
    return OptionError(
        f"{option} would write over what this command reads: {path} {why}; give {option} another "
        "path"
    )
