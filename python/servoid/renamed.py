"""Refuses formerly public names with a message that gives the new name."""

from collections.abc import Callable, Mapping
from typing import NoReturn

from servoid.errors import RenamedError


def refuse_old_names(module: str, new_names: Mapping[str, str]) -> Callable[[str], NoReturn]:
    """Return a `__getattr__` for a module whose names changed; `new_names` is by old name."""

    def refuse(name: str) -> NoReturn:
        if name in new_names:
            raise RenamedError(f"{module}.{name} is called {new_names[name]} now; use that name")
        raise AttributeError(f"module {module!r} has no attribute {name!r}")

    return refuse
