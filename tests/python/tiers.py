"""Parameters of which some belong to the quick tests, and the others to the extended ones."""

from collections.abc import Iterable
from typing import Any

import pytest


def tiered(values: Iterable[Any], quick: int = 1) -> list[Any]:
    """Return parameters of which only the first ones are run by `make test`."""
    values = [value if isinstance(value, tuple) else (value,) for value in values]
    late = [pytest.param(*value, marks=pytest.mark.extended) for value in values[quick:]]
    return [*(pytest.param(*value) for value in values[:quick]), *late]
