"""Distinguishes invalid options from invalid files; does not import the core."""

from collections.abc import Iterator
from contextlib import contextmanager

from servoid.errors import MissingExtraError, ServoidError


class OptionError(ServoidError, ValueError):
    """Is raised for an option that is invalid for any files; the command exits with 2."""


@contextmanager
def of_options() -> Iterator[None]:
    """Report errors raised inside as a wrong option, not as a wrong file."""
    try:
        yield
    except MissingExtraError:
        raise
    except ServoidError as error:
        raise OptionError(str(error)) from error
