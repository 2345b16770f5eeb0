"""servoid models an unknown object as a few ellipsoids, tracks it and servos to it.

    capture = servoid.capture.open_capture("photos")
    result = servoid.model.fit(capture.views(), max_ellipsoids=6)
    result.save("body.json")

Submodules are imported on first use, so `import servoid` is fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from servoid import errors

if TYPE_CHECKING:
    from servoid import (
        batch,
        camera,
        capture,
        exchange,
        model,
        opening,
        pick,
        pose,
        record,
        scan,
        segment,
        servo,
        shape,
        sim,
        source,
        stereo,
        track,
        view,
    )

    __version__: str

__all__ = [
    "__version__",
    "batch",
    "camera",
    "capture",
    "errors",
    "exchange",
    "model",
    "opening",
    "pick",
    "pose",
    "record",
    "scan",
    "segment",
    "servo",
    "shape",
    "sim",
    "source",
    "stereo",
    "track",
    "view",
]

_OWN = ("__version__", "errors")


def __getattr__(name: str) -> Any:
    if name in __all__ and name not in _OWN:
        return import_module(f"servoid.{name}")
    if name == "__version__":
        return import_module("servoid._native").__version__
    if name == "observe":
        rooms = "camera, capture, config, segment, source and stereo"
        raise errors.RenamedError(f"servoid.observe is six packages now: {rooms}; use those")
    raise AttributeError(f"module 'servoid' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
