"""Names at once all that a plain video, images or a camera lack before an object can be found."""

import shlex
from dataclasses import dataclass

from servoid.errors import CaptureError
from servoid.opening import GivenCalibration, Kind, SourceWord, count_uncalibrated_cameras
from servoid.words import counted, digits

_RECORDED = (Kind.VIDEO, Kind.VIDEOS, Kind.IMAGES)
_LIVE = (Kind.CAMERA, Kind.STREAM)  # which know nothing of their lenses
_FOV = (
    "--fov 65",
    "--fov, the angle of view from the left to the right border in degrees, or --calibration FILE",
)
_BASELINE = ("--baseline 0.1", "--baseline, the metres between the two parallel cameras")
_TARGET = (
    "--target box:120,80,420,400",
    "--target, where the object is in the first image, which servoid pick {source} asks for",
)
_DISTANCE = ("--distance 0.6", "--distance, the metres from the camera to the object there")


@dataclass(frozen=True, kw_only=True)
class Given:
    """What is given of objects: their options, and whether all are marked and have a shape.

    `options` are pairs of an option and its value, None if it is not given.
    """

    options: tuple[tuple[str, object], ...]
    distance_m: float | None
    is_marked: bool
    has_shape: bool = False


def check_nothing_lacks(
    command: str, word: SourceWord, known: GivenCalibration, given: Given
) -> None:
    """Check that options supply what cameras, and images and videos without a capture file, lack.

    A single thing that lacks is left to the step that needs it, whose message says more.

    Args:
        command: the command, such as `track`.
        word: the source.
        known: the calibration that was given.
        given: what is given of the objects.

    Raises:
        CaptureError: several things lack; the message names them all, and a command to copy.

    """
    if word.kind in _RECORDED:
        cameras = count_uncalibrated_cameras(word)
    elif word.kind in _LIVE:
        cameras = 2 if word.halves else 1
    else:
        return
    lacking: list[tuple[str, str]] = [] if known.supplies_lens else [_FOV]
    if cameras == 2 and known.baseline_m is None and known.calibration is None:
        lacking.append(_BASELINE)
    if not given.is_marked:
        lacking.append(_TARGET)
    if cameras == 1 and given.distance_m is None and not given.has_shape:
        lacking.append(_DISTANCE)
    if len(lacking) < 2:
        return
    meanings = [meaning.format(source=shlex.quote(word.text)) for _, meaning in lacking]
    words = ["servoid", command, word.text, *_spelled(known, given)]
    line = " ".join([shlex.join(words), *(option for option, _ in lacking)])
    raise CaptureError(
        f"{word}: {counted(len(lacking), 'thing')} must be known that images alone do not tell; "
        f"give {'; '.join(meanings)}; such as: {line}"
        + (
            "; if the camera moves around a static object, servoid scan estimates the calibration"
            if _FOV in lacking
            else ""
        )
    )


def _spelled(known: GivenCalibration, given: Given) -> list[str]:
    """Return the options that were given, as words of a command line."""
    pairs = (
        *given.options,
        ("--distance", given.distance_m),
        ("--fov", known.fov_deg),
        ("--baseline", known.baseline_m),
        ("--calibration", known.calibration),
        ("--rate", known.rate_hz),
    )
    return [
        word
        for option, value in pairs
        if value is not None
        for word in (option, digits(value) if isinstance(value, float) else str(value))
    ]
