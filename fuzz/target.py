"""What a target is: whole input to begin from, and what reads it out of a folder."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

_CORPUS = Path(__file__).parent / "corpus"


@dataclass(frozen=True)
class Target:
    """Something that reads, and may raise only a ServoidError.

    `often` is how many inputs of it a round takes: what is read in less than a millisecond eight,
    what takes longer fewer.
    """

    seeds: tuple[bytes, ...]
    run: Callable[[bytes, Path], object]
    often: int = 8


def from_file(name: str, read: Callable[[Path], object]) -> Callable[[bytes, Path], object]:
    """Return what writes data to a file of this name, and reads it."""

    def run(data: bytes, folder: Path) -> object:
        path = folder / name
        path.write_bytes(data)
        return read(path)

    return run


def corpus(name: str) -> bytes:
    """Return a whole input that is kept."""
    return (_CORPUS / name).read_bytes()
