"""Parses SOURCE, the argument of every command, and finds out what kind of source it names."""

import glob
import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from servoid.brief import brief
from servoid.camera import IMAGE_SUFFIXES, VIDEO_SUFFIXES
from servoid.config import SETTINGS_FILE, check_regular, exists, is_file, is_folder, read_text
from servoid.errors import CaptureError
from servoid.exchange import holds_bag, is_capture
from servoid.source import shown

_ADDRESS = re.compile(r"(?P<scheme>[a-z][a-z0-9+.]*)://", re.IGNORECASE)
_SCHEMES = ("http", "https", "rtsp", "rtsps", "rtmp", "udp", "tcp", "srt")
_JOINED = "+"
_HALVES = "side-by-side:"
_PIPELINE = " ! "  # joins the parts of a GStreamer pipeline
_DEVICES = "/dev/"
BAG_SUFFIXES = (".mcap", ".bag", ".db3")
BAG_FOLDER = "metadata.yaml"
_WILD = re.compile(r"[*?\[]")
_DEVICE_KEY = re.compile(r"^\s*device\s*=", re.MULTILINE)
_CAMERA_TABLE = re.compile(r"^\s*\[\[\s*camera\s*\]\]", re.MULTILINE)
# Of a capture.toml alone, also mistyped; `rate_hz` is a setting of a rig's cameras as well.
_CAPTURE_KEY = re.compile(
    r"""^\s*["']?(?:i\w*|ma\w*|me\w*|dep\w*|poses)["']?\s*=|^\s*\[rig\]""",
    re.MULTILINE,
)
_CAPTURE_FILE = "capture.toml"


class Kind(Enum):
    """The kinds of SOURCE; the value is the name in messages."""

    CAPTURE = "capture"
    VIDEO = "video"
    VIDEOS = "videos"
    IMAGES = "images"
    BAG = "bag"
    CAMERA = "camera"
    STREAM = "stream"
    REALSENSE = "realsense"
    GENICAM = "genicam"
    SIM = "sim"
    RIG = "rig"

    @property
    def is_live(self) -> bool:
        """Return whether images arrive on the source's own clock, not when they are requested."""
        return self in _LIVE


_HALVED = (Kind.VIDEO, Kind.IMAGES, Kind.CAMERA, Kind.STREAM, Kind.GENICAM)
_LIVE = (Kind.CAMERA, Kind.STREAM, Kind.REALSENSE, Kind.GENICAM, Kind.SIM, Kind.RIG)
_SUFFIXES = {
    Kind.BAG: BAG_SUFFIXES,
    Kind.VIDEO: VIDEO_SUFFIXES,
    Kind.IMAGES: IMAGE_SUFFIXES,
}
_PREFIXES = {f"{kind.value}:": kind for kind in (Kind.REALSENSE, Kind.GENICAM, Kind.SIM)}


@dataclass(frozen=True)
class SourceWord:
    """A SOURCE as it was written, and what it names.

    `places` are the files or folders of a recorded source, or the one file of a rig. `name` is the
    part after the prefix of `realsense:`, `genicam:` or `sim:`, an address, or a camera's number or
    device file. With `halves`, each image contains two, the left camera's on the left.
    """

    text: str
    kind: Kind
    places: tuple[Path, ...] = ()
    name: str = ""
    halves: bool = False

    __repr__ = brief

    def __str__(self) -> str:
        return self.text

    @property
    def is_live(self) -> bool:
        """Return whether images arrive on the source's own clock, not when they are requested."""
        return self.kind.is_live

    @property
    def place(self) -> Path:
        """Return the file or folder of a source that has just one."""
        return self.places[0]


def parse_source(text: str) -> SourceWord:
    """Parse a SOURCE; only the names of files are examined, and the keys of a TOML file.

    A number is always a camera: write `./0` for a folder of that name.

    Raises:
        CaptureError: nothing of that name exists, or servoid cannot open it.

    """
    if not text.strip():
        raise CaptureError(
            "SOURCE is empty, as that of a variable that was not set; name it, or write . for the "
            "present folder"
        )
    if text.startswith(_HALVES):
        inner = parse_source(text.removeprefix(_HALVES))
        if inner.kind not in _HALVED or inner.halves:
            raise CaptureError(
                f"{text}: side-by-side: is for one video, images, a camera or a stream, whose "
                f"images each contain a left and a right half, but {inner} is a {inner.kind.value}"
            )
        return SourceWord(text, inner.kind, inner.places, inner.name, halves=True)
    return _of_device(text) or _of_files(text)


def _of_device(text: str) -> SourceWord | None:
    """Parse a source that is not a file of images; None if it is another."""
    for prefix, kind in _PREFIXES.items():
        if text.startswith(prefix):
            return SourceWord(text, kind, name=text.removeprefix(prefix))
    address = _ADDRESS.match(text)
    if address is not None:
        if address["scheme"].lower() not in _SCHEMES:
            raise CaptureError(
                f"{text}: servoid cannot open {address['scheme']}:// addresses; give one that "
                f"begins with {', '.join(f'{scheme}://' for scheme in _SCHEMES)}, or the path of "
                "a file"
            )
        return SourceWord(shown(text), Kind.STREAM, name=text)
    if _PIPELINE in text:
        return SourceWord(text, Kind.STREAM, name=text)
    if text.isascii() and text.isdigit():
        return SourceWord(text, Kind.CAMERA, name=str(int(text)))
    if text.startswith(_DEVICES):
        return SourceWord(text, Kind.CAMERA, name=text)
    return None


def _of_files(text: str) -> SourceWord:
    path = Path(text)
    if is_file(path) or is_folder(path):
        kind = _kind_of(path)
        listed = kind is Kind.IMAGES and is_folder(path)
        return SourceWord(text, kind, _images(path.iterdir()) if listed else (path,))
    parts = tuple(Path(part) for part in text.split(_JOINED))
    if len(parts) > 1 and all(_ends(part.name, VIDEO_SUFFIXES) for part in parts):
        for part in parts:
            if not is_file(part):
                _refuse_other_kind(part)
                raise CaptureError(f"{text}: there is no video {part}; correct its name")
        return SourceWord(text, Kind.VIDEOS, parts)
    if len(parts) > 1 and all(
        is_file(part) or is_folder(part) or _WILD.search(str(part)) for part in parts
    ):
        raise CaptureError(
            f"{text}: a plus sign joins videos only; of images, write a capture.toml with a "
            "[[camera]] table for each camera, such as one whose images are left/*.png"
        )
    if _WILD.search(text):
        images = _images(map(Path, glob.glob(text)))  # noqa: PTH207
        if not images:
            raise CaptureError(
                f"'{text}' matches no image; images end in {', '.join(IMAGE_SUFFIXES)}"
            )
        return SourceWord(text, Kind.IMAGES, images)
    _refuse_other_kind(path)
    raise CaptureError(
        f"there is no file or folder {text}; correct its name (--help lists what SOURCE may be)"
    )


def _refuse_other_kind(path: Path) -> None:
    """Refuse what exists and is neither a file nor a folder: a pipe, a device or a socket."""
    if exists(path):
        check_regular(path, CaptureError)


def _kind_of(path: Path) -> Kind:
    """Determine from names what a file or folder contains; the default is a capture."""
    if path.is_dir():
        names = {one.name for one in path.iterdir()}
        if BAG_FOLDER in names and any(_ends(name, BAG_SUFFIXES) for name in names):
            return Kind.BAG
        if _images(path.iterdir()) and not is_capture(path):
            return Kind.IMAGES
        return Kind.BAG if holds_bag(path) else Kind.CAPTURE
    for kind, suffixes in _SUFFIXES.items():
        if _ends(path.name, suffixes):
            return kind
    return Kind.RIG if _ends(path.name, (".toml",)) and _names_devices(path) else Kind.CAPTURE


def _images(paths: Iterable[Path]) -> tuple[Path, ...]:
    """List the images sorted by name, without hidden files such as macOS leaves."""
    images = (one for one in paths if _ends(one.name, IMAGE_SUFFIXES))
    return tuple(sorted(one for one in images if not one.name.startswith(".")))


def _names_devices(path: Path) -> bool:
    """Return whether a TOML file names live devices; errors in it are left to its reader.

    Cameras without images have a device whose key is missing or mistyped.
    """
    try:
        text = read_text(path, CaptureError, SETTINGS_FILE)
    except CaptureError:
        return False
    if _DEVICE_KEY.search(text) is not None:
        return True
    is_capture_file = path.name == _CAPTURE_FILE or _CAPTURE_KEY.search(text) is not None
    return not is_capture_file and _CAMERA_TABLE.search(text) is not None


def _ends(name: str, suffixes: Iterable[str]) -> bool:
    return Path(name).suffix.lower() in suffixes
