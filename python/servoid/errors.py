"""The exceptions that servoid raises on purpose: every one of them is a `ServoidError`."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class ServoidError(Exception):
    """Says what was given, what is allowed and what to do."""

    def at(self, place: str) -> "ServoidError":
        """Return the same error with a place, such as a file and a line, before its message."""
        return type(self)(f"{place}: {self}")


class BackendError(ServoidError, ValueError):
    """Is raised when a back end is asked for that this machine does not have."""


class PoseError(ServoidError, ValueError):
    """Is raised for numbers that are no rigid motion."""


class CameraError(ServoidError, ValueError):
    """Is raised for a camera that cannot exist or that is not supported."""


class ImageError(ServoidError, ValueError):
    """Is raised for an image that cannot be read or that contradicts its camera."""


class MaskError(ServoidError, ValueError):
    """Is raised for a mask that cannot be read or that says nothing about the object."""


class TargetError(ServoidError, ValueError):
    """Is raised for a target that cannot be read or that finds no object in its image."""


class DoubtError(TargetError):
    """Is raised for a target that may mean several objects: nothing is chosen silently.

    `image`, (H, W, 3) uint8 RGB, is where the object was sought, as it was recorded. `masks`,
    (H, W) uint8 each, are the answers, 255 on the object; the first one is what is used if the
    caller trusts the target all the same.
    """

    def __init__(
        self, message: str, image: "NDArray[np.uint8]", masks: "Sequence[NDArray[np.uint8]]"
    ) -> None:
        super().__init__(message)
        self.image = image
        self.masks: tuple[NDArray[np.uint8], ...] = tuple(masks)

    def __reduce__(self) -> "tuple[object, ...]":
        """Say how to make a copy, in another process too."""
        return DoubtError, (str(self), self.image, self.masks)

    def at(self, place: str) -> "DoubtError":
        """Return this error with a place before its message."""
        return DoubtError(f"{place}: {self}", self.image, self.masks)


class CaptureError(ServoidError, ValueError):
    """Is raised for a capture whose files are missing, malformed or at odds with each other."""


class ScanError(ServoidError, ValueError):
    """Is raised for images from which no poses can be found."""


class MeshError(ServoidError, ValueError):
    """Is raised for a mesh or a point cloud that cannot be read, closed or used."""


class BodyError(ServoidError, ValueError):
    """Is raised for a body, or the file of a body, that is malformed."""


class ModelError(ServoidError, ValueError):
    """Is raised when views or settings cannot lead to a model."""


class TrackError(ServoidError, ValueError):
    """Is raised when observations, a body or settings cannot lead to a track."""


class TrajectoryError(ServoidError, ValueError):
    """Is raised for a file of poses over time that is missing or malformed."""


class ServoError(ServoidError, ValueError):
    """Is raised when an arm, a goal or settings cannot lead to servoing."""


class SimError(ServoidError, ValueError):
    """Is raised for a simulated world that cannot exist."""


class StudyError(ServoidError, ValueError):
    """Is raised for a study whose settings, trials or workers cannot be."""


class ExportError(ServoidError, ValueError):
    """Is raised when a body cannot be written in the way that was asked for."""


class OutputError(ServoidError, OSError):
    """Is raised when a file or folder cannot be written."""


class MissingExtraError(ServoidError, ImportError):
    """Is raised when an optional library is needed that is not installed."""

    @classmethod
    def of(cls, what: str, library: str, extra: str) -> "MissingExtraError":
        """Say what needs which library, and the extra of servoid that brings it."""
        return cls(
            f"{what} need {library}, which is not installed; "
            f"install it with: pip install 'servoid[{extra}]'"
        )


class RenamedError(ServoidError, ImportError):
    """Is raised for a name that was public once, and says what it is called now."""


@contextmanager
def located(place: str) -> Iterator[None]:
    """Put `place`, such as a file and a line, before the message of a ServoidError from inside."""
    try:
        yield
    except ServoidError as error:
        raise error.at(place) from error
