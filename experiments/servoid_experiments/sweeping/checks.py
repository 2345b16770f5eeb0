"""What settings of a sweep must fulfil, told where they are read."""

from collections.abc import Iterable

import msgspec

from servoid.errors import StudyError


def check_varied(sweep: msgspec.Struct) -> None:
    """Check that some factor has values to try.

    Raises:
        StudyError: none has, which msgspec tells with the place in the file.

    """
    names = [field.name for field in msgspec.structs.fields(sweep)]
    if not any(getattr(sweep, name) for name in names):
        raise StudyError(f"nothing is varied; give values to one of {', '.join(names)}")


def check_names(given: Iterable[str], known: Iterable[str], kind: str = "object") -> None:
    """Check that objects, or things of another kind, exist.

    Raises:
        StudyError: one does not, which msgspec tells with the place in the file.

    """
    every = list(known)
    for name in given:
        if name not in every:
            raise StudyError(f"unknown {kind} '{name}'; choose one of {', '.join(every)}")
