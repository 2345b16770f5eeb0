"""Imports MuJoCo, which only simulated worlds need."""

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
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


@contextmanager
def without_warnings() -> Iterator[None]:
    """Keep MuJoCo from printing its warnings, and from writing them to a file in this folder."""
    mujoco = load_mujoco()
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
