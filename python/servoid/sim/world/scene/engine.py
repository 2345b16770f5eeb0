"""Imports MuJoCo, which only simulated worlds need."""

import importlib
from typing import Any

from servoid.errors import MissingExtraError


def load_mujoco() -> Any:
    """Return MuJoCo's module.

    Raises:
        MissingExtraError: it is not installed.

    """
    try:
        return importlib.import_module("mujoco")
    except ImportError as error:
        raise MissingExtraError.of("simulated worlds", "mujoco", "sim") from error
