"""Runs one trial anywhere: takes a case as bytes, and returns its result as bytes."""

import traceback
from typing import Any

import msgspec

from servoid.batch.experiment import Done, Experiment
from servoid.errors import ServoidError, StudyError

_NOTHING = msgspec.Raw(b"null")


class _Entry(msgspec.Struct, frozen=True, omit_defaults=True):
    """What is stored of a trial."""

    case: msgspec.Raw
    row: msgspec.Raw = _NOTHING
    failure: str = ""
    trace: str = ""


def attempt(experiment: Experiment[Any, Any], case: bytes) -> bytes:
    """Run one trial and return its entry, which records an error instead of raising it."""
    try:
        row = experiment.run(msgspec.json.decode(case, type=experiment.case))
        content = msgspec.json.encode(row)
        msgspec.json.decode(content, type=experiment.row)
    except ServoidError as error:
        return failed(case, str(error))
    except (KeyboardInterrupt, SystemExit, GeneratorExit):
        raise
    except BaseException as error:  # a panic of the core is not an Exception
        what = f"{type(error).__name__}: {error}"
        return failed(case, f"this is a bug in servoid: {what}", traceback.format_exc())
    return msgspec.json.encode(_Entry(msgspec.Raw(case), msgspec.Raw(content)))


def failed(case: bytes, why: str, trace: str = "") -> bytes:
    """Return the entry of a trial that failed, with the reason."""
    return msgspec.json.encode(_Entry(msgspec.Raw(case), failure=why, trace=trace))


def read_entry(experiment: Experiment[Any, Any], entry: bytes) -> Done:
    """Decode an entry.

    Raises:
        StudyError: it is not an entry of this experiment.

    """
    try:
        parts = msgspec.json.decode(entry, type=_Entry)
        case = msgspec.json.decode(parts.case, type=experiment.case)
        row = msgspec.json.decode(parts.row, type=experiment.row | None)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise StudyError(
            f"this is not an entry of the experiment {experiment.name}: {error}"
        ) from error
    return Done(case, row, parts.failure)
