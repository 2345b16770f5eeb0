"""Tells options that cannot be from files that are at fault; needs nothing of the core."""

from collections.abc import Iterator
from contextlib import contextmanager

from servoid.errors import MissingExtraError, ServoidError


class OptionError(ServoidError, ValueError):
    """Is raised for an option that cannot be, whatever the files hold: the command ends with 2."""


@contextmanager
def of_options() -> Iterator[None]:
    """Take what is refused inside for a wrong option, not for a wrong file."""
    try:
        yield
    except MissingExtraError:
        raise
    except ServoidError as error:
        raise OptionError(str(error)) from error
