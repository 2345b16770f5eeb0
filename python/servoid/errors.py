"""The exceptions that servoid raises on purpose; each is a `ServoidError`."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class ServoidError(Exception):
    """The base of all errors; its message names the input, what is allowed and what to do."""

    def at(self, place: str) -> "ServoidError":
        """Return the same error with a location, such as a file and a line, before its message."""
        return type(self)(f"{place}: {self}")


class BackendError(ServoidError, ValueError):
    """Is raised for a backend that this machine does not have."""


class PoseError(ServoidError, ValueError):
    """Is raised for numbers that do not form a rigid motion."""


class CameraError(ServoidError, ValueError):
    """Is raised for a camera that cannot exist or that is not supported."""


class ImageError(ServoidError, ValueError):
    """Is raised for an image that cannot be read or that contradicts its camera."""


class MaskError(ServoidError, ValueError):
    """Is raised for a mask that cannot be read or that carries no information on the object."""


class TargetError(ServoidError, ValueError):
    """Is raised for a target that cannot be parsed or that finds no object in its image."""


class DoubtError(TargetError):
    """Is raised for a target that may mean several objects, rather than choosing one silently.

    `image`, (H, W, 3) uint8 RGB, is the image that was searched, as it was recorded. `masks`,
    (H, W) uint8 each, are the candidates, 255 on the object; the first one is used if the caller
    trusts the target.
    """

    def __init__(
        self, message: str, image: "NDArray[np.uint8]", masks: "Sequence[NDArray[np.uint8]]"
    ) -> None:
        super().__init__(message)
        self.image = image
        self.masks: tuple[NDArray[np.uint8], ...] = tuple(masks)

    def __reduce__(self) -> "tuple[object, ...]":
        """Support pickling, with all attributes."""
        return DoubtError, (str(self), self.image, self.masks)

    def at(self, place: str) -> "DoubtError":
        """Return this error with a location before its message."""
        return DoubtError(f"{place}: {self}", self.image, self.masks)


class CaptureError(ServoidError, ValueError):
    """Is raised for a capture whose files are missing, malformed or inconsistent."""


class ScanError(ServoidError, ValueError):
    """Is raised for images from which no camera poses can be estimated."""


class MeshError(ServoidError, ValueError):
    """Is raised for a mesh or a point cloud that cannot be read, closed or used."""


class BodyError(ServoidError, ValueError):
    """Is raised for a malformed body or body file."""


class ModelError(ServoidError, ValueError):
    """Is raised when no model can be made from the views or settings."""


class TrackError(ServoidError, ValueError):
    """Is raised when observations, a body or settings do not allow tracking."""


class TrajectoryError(ServoidError, ValueError):
    """Is raised for a trajectory file that is missing or malformed."""


class ServoError(ServoidError, ValueError):
    """Is raised when an arm, a goal or settings do not allow servoing."""


class SimError(ServoidError, ValueError):
    """Is raised for invalid settings of a simulated world."""


class StudyError(ServoidError, ValueError):
    """Is raised for invalid settings, trials or workers of a study."""


class ExportError(ServoidError, ValueError):
    """Is raised when a body cannot be exported as requested."""


class OutputError(ServoidError, OSError):
    """Is raised when a file or folder cannot be written."""


class MissingExtraError(ServoidError, ImportError):
    """Is raised when a required optional library is not installed."""

    @classmethod
    def of(cls, what: str, library: str, extra: str) -> "MissingExtraError":
        """Take what needs the library, and the extra of servoid that installs it."""
        return cls(
            f"{what} need {library}, which is not installed; "
            f"install it with: pip install 'servoid[{extra}]'"
        )


class RenamedError(ServoidError, ImportError):
    """Is raised for a formerly public name; the message gives the new one."""


@contextmanager
def located(place: str) -> Iterator[None]:
    """Prefix the message of a ServoidError raised inside with `place`, such as file and line."""
    try:
        yield
    except ServoidError as error:
        raise error.at(place) from error
