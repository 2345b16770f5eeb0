"""Settings that are checked when they are made, in Python as in a file."""

from typing import Any

import msgspec
import numpy as np

from servoid.config.strict import explained, is_finite
from servoid.errors import ServoidError


class Checked(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Is the base of settings; a value outside of what its field's type allows is refused.

    What can be taken for the type is made it: a whole number where any is allowed, a list, the name
    of a choice, a number of NumPy.
    """

    def refusal(self, message: str) -> ServoidError:
        """Return the error that refuses a value."""
        return ServoidError(message)

    def __post_init__(self) -> None:
        """Check each field by itself.

        Raises:
            what `refusal` returns: a value has the wrong type or range, or is NaN.

        """
        for field in msgspec.structs.fields(type(self)):
            value = _plain(getattr(self, field.name))
            place = f"{type(self).__name__}.{field.encode_name}"
            if not is_finite(value):
                raise self.refusal(f"{place}: {value} is not finite; give finite numbers")
            try:
                checked = msgspec.convert(value, field.type)
            except msgspec.ValidationError as reason:
                raise self.refusal(explained(reason, value, field.type, place)) from reason
            msgspec.structs.force_setattr(self, field.name, checked)


def _plain(value: Any) -> Any:
    """Return numbers of NumPy, alone or in a list, as Python's own."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    return tuple(_plain(one) for one in value) if isinstance(value, (list, tuple)) else value
