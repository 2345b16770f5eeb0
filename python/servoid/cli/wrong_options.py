"""Distinguishes invalid options from invalid files; does not import the core."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from servoid.errors import MissingExtraError, ServoidError

# The core refuses a value with `name must be allowed, but it is given`.
_SETTING = re.compile(r"^\w+(?<!_s)(?= must be .+, but it is )")  # options have other units


class OptionError(ServoidError, ValueError):
    """Is raised for an option that is invalid for any files; the command exits with 2."""


@contextmanager
def of_options() -> Iterator[None]:
    """Report errors raised inside as a wrong option, not as a wrong file.

    A setting of the core is named by its option: `--max-ellipsoids`, not `max_ellipsoids`.
    """
    try:
        yield
    except MissingExtraError:
        raise
    except ServoidError as error:
        raise OptionError(_SETTING.sub(_option, str(error))) from error


def _option(setting: re.Match[str]) -> str:
    return f"--{setting[0].replace('_', '-')}"
