"""Checks that the libraries that a command needs are installed."""

from collections.abc import Mapping
from importlib.util import find_spec

from servoid.errors import MissingExtraError


def check_extras(command: str, extras: Mapping[str, str]) -> None:
    """Check that all libraries are installed, so that one error names all missing ones.

    `extras` names the extra of servoid that installs each library.

    Raises:
        MissingExtraError: a library is not installed.

    """
    missing = [library for library in extras if find_spec(library) is None]
    if missing:
        named = ",".join(dict.fromkeys(extras[library] for library in missing))
        are = "is" if len(missing) == 1 else "are"
        raise MissingExtraError(
            f"{command} needs {', '.join(missing)}, which {are} not installed; "
            f"install with: pip install 'servoid[{named}]'"
        )
