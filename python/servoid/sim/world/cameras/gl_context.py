"""Starts OpenGL without a window, with EGL or otherwise with OSMesa."""

import importlib
import os
import sys
from typing import Any

from servoid.errors import SimError
from servoid.sim.world.scene.engine import load_mujoco

_WAYS = ("egl", "osmesa")
_NEEDS = (
    "install PyOpenGL with: pip install 'servoid[gl]', and OpenGL itself, on Debian and Ubuntu "
    "with: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri libgl1 libopengl0, or with: "
    "apt-get install libosmesa6; or choose the renderer raycast, which needs nothing"
)


def make_context() -> Any:
    """Return an OpenGL context of MuJoCo; MUJOCO_GL selects egl or osmesa.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        SimError: OpenGL cannot start.

    """
    load_mujoco()
    chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
    reasons = []
    for way in (chosen,) if chosen in _WAYS else _WAYS:
        platform = os.environ.get("PYOPENGL_PLATFORM")
        try:
            context = importlib.import_module(f"mujoco.{way}").GLContext(16, 16)
            context.make_current()
        except Exception as error:
            reason = str(error).partition("\n")[0] or type(error).__name__
            reasons.append(f"{way}: {reason}")
            _forget(platform)
        else:
            return context
    raise SimError(f"MuJoCo's renderer cannot start OpenGL ({'; '.join(reasons)}): {_NEEDS}")


def _forget(platform: str | None) -> None:
    """Undo the choice of a platform that failed, so that another one can be tried."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "OpenGL"]:
        del sys.modules[name]
    for way in _WAYS:
        sys.modules.pop(f"mujoco.{way}", None)
    os.environ.pop("PYOPENGL_PLATFORM", None)
    if platform is not None:
        os.environ["PYOPENGL_PLATFORM"] = platform
