"""Checks that the libraries which a command needs are installed."""

from collections.abc import Mapping
from importlib.util import find_spec

from servoid.errors import MissingExtraError


def check_extras(command: str, extras: Mapping[str, str]) -> None:
    """Check that all libraries are there, so that they do not turn out missing one by one.

    `extras` names the extra of servoid that brings each library.

    Raises:
        MissingExtraError: a library is not installed.

    """
    missing = [library for library in extras if find_spec(library) is None]
    if missing:
        named = ",".join(dict.fromkeys(extras[library] for library in missing))
        raise MissingExtraError(
            f"{command} needs {', '.join(missing)}, not installed yet; "
            f"install with: pip install 'servoid[{named}]'"
        )
