"""Which tests are quick and which are extended, and which begin first."""

from collections.abc import Iterable
from typing import Any

import pytest


def tiered(values: Iterable[Any], quick: int = 1) -> list[Any]:
    """Return parameters of which only the first ones are run by `make test`."""
    values = [value if isinstance(value, tuple) else (value,) for value in values]
    late = [pytest.param(*value, marks=pytest.mark.extended) for value in values[quick:]]
    return [*(pytest.param(*value) for value in values[:quick]), *late]


# Files of tests that take longest, the longest first: begun last, they would leave workers idle.
LONGEST = (
    "test_readme.py",
    "test_track_report.py",
    "test_replays.py",
    "test_trust.py",
    "test_study_paper_servoing.py",
    "test_tracking_scenes.py",
    "test_servo_run.py",
    "test_servo_trial.py",
    "test_servo_run_faults.py",
    "test_doubts.py",
    "test_cli_servo.py",
    "test_cli_verbs.py",
    "test_targets.py",
)


def longest_first(items: list[pytest.Item]) -> None:
    """Bring the files that take longest to the front; tests of a file stay together."""
    order = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path.name, len(order)))
