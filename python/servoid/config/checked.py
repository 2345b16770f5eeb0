"""Settings that are validated when they are created, in Python as from a file."""

from typing import Any

import msgspec

from servoid.config.plausible import implausible_setting
from servoid.config.strict import explained, is_finite
from servoid.errors import ServoidError


class Checked(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of settings; refuses a value that its field's type does not allow.

    Values that convert to the type are converted: an integer where a float is expected, a list, the
    name of an option, a NumPy number.
    """

    REFUSAL = ServoidError

    def __post_init__(self) -> None:
        """Check each field separately.

        Raises:
            the error `REFUSAL`: a value has the wrong type or range, is NaN, or is a length that is
                not plausible.

        """
        for field in msgspec.structs.fields(type(self)):
            value = _plain(getattr(self, field.name))
            place = f"{type(self).__name__}.{field.encode_name}"
            if not is_finite(value):
                raise self.REFUSAL(f"{place}: {value} is not finite; give finite numbers")
            try:
                checked = msgspec.convert(value, field.type)
            except msgspec.ValidationError as reason:
                raise self.REFUSAL(explained(reason, value, field.type, place)) from reason
            absurd = implausible_setting(field.encode_name, checked, field.type)
            if absurd is not None:
                raise self.REFUSAL(absurd)
            msgspec.structs.force_setattr(self, field.name, checked)


def _plain(value: Any) -> Any:
    """Convert NumPy numbers and arrays, alone or in a list, to Python numbers."""
    import numpy as np  # not above, as what only reads files can do without it

    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    return tuple(_plain(one) for one in value) if isinstance(value, (list, tuple)) else value
