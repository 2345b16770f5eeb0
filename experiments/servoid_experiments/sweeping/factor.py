"""Factors of a sweep, the cases that result from them, and checks of its settings."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

import msgspec

from servoid.errors import StudyError

CaseT = TypeVar("CaseT", bound=msgspec.Struct)

Value = float | int | str | Enum


@dataclass(frozen=True)
class Factor:
    """One quantity that is varied while all others stay at the centre.

    `key` names the field of a case, dotted if it is in a struct of the case. `log` requests a
    logarithmic axis; values that are not numbers are drawn side by side.
    """

    key: str
    title: str
    unit: str
    values: tuple[Value, ...]
    log: bool = False

    def at(self, case: msgspec.Struct) -> Value:
        """Return a case's value of the factor."""
        found: msgspec.Struct | Value = case
        for name in self.key.split("."):
            found = getattr(found, name)
        assert not isinstance(found, msgspec.Struct)
        return found

    def values_with(self, center: Value) -> tuple[Value, ...]:
        """Return the centre's value and the others, numbers in ascending order."""
        every = list(dict.fromkeys((center, *self.values)))
        numbers = [value for value in every if isinstance(value, float | int)]
        return tuple(sorted(numbers)) if len(numbers) == len(every) else tuple(every)


def varied(case: CaseT, key: str, value: Value) -> CaseT:
    """Return a case in which the field with a dotted name has another value."""
    name, _, rest = key.partition(".")
    inner = varied(getattr(case, name), rest, value) if rest else value
    return msgspec.structs.replace(case, **{name: inner})


def cases_around(centers: Iterable[CaseT], factors: Sequence[Factor]) -> list[CaseT]:
    """Return each centre and its variations, one factor at a time, without duplicates."""
    found: dict[CaseT, None] = {}
    for center in centers:
        found[center] = None
        for factor in factors:
            for value in factor.values:
                found[varied(center, factor.key, value)] = None
    return list(found)


def check_varied(sweep: msgspec.Struct) -> None:
    """Check that some factor has values to try.

    Raises:
        StudyError: none has; msgspec adds the position in the file.

    """
    names = [field.name for field in msgspec.structs.fields(sweep)]
    if not any(getattr(sweep, name) for name in names):
        raise StudyError(f"nothing is varied; give values to one of {', '.join(names)}")


def check_names(given: Iterable[str], known: Iterable[str], kind: str = "object") -> None:
    """Check that objects, or things of another kind, exist.

    Raises:
        StudyError: one does not; msgspec adds the position in the file.

    """
    every = list(known)
    for name in given:
        if name not in every:
            raise StudyError(f"unknown {kind} '{name}'; choose one of {', '.join(every)}")
