"""Fuzzes bags, binary models, streams, what is learned of looks, and requests to a page."""

import socket
import struct
import sys
from collections.abc import Callable
from email.message import Message
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from fuzz.calls import AHEAD, learned_looks, small_tracker
from fuzz.target import Target, corpus, from_file
from servoid.errors import ServoidError
from servoid.exchange import open_any
from servoid.exchange.captures.colmap_binary import read_cameras_binary, read_images_binary
from servoid.opening import GivenCalibration
from servoid.pick import PickServer, Question
from servoid.pick.server import _Handler
from servoid.pose import Pose
from servoid.segment import find_with_doubts
from servoid.source.streams.mjpeg import MjpegVideo

sys.path.append(str(Path(__file__).parents[1] / "tests" / "fixtures"))

from bag_writing import START_NS, compressed, image, info, tf, write_bag

_SIZE_PX = (24, 16)
_K = (20.0, 0.0, 11.5, 0.0, 20.0, 7.5, 0.0, 0.0, 1.0)
_PIXELS = np.random.default_rng(1).integers(0, 256, (_SIZE_PX[1], _SIZE_PX[0], 3), np.uint8)
_DEPTH = np.full((_SIZE_PX[1], _SIZE_PX[0]), 500, np.uint16)
_JPEG = cv2.imencode(".jpg", _PIXELS)[1].tobytes()
_MOST_READ = 4


def _bag(name: str) -> bytes:
    """Record a camera that moves, its depth, and one whose images are JPEG files."""
    entries = []
    for index in range(2):
        stamp = START_NS + index * 100_000_000
        entries += [
            image("/eye/image", stamp, "eye", _PIXELS),
            info("/eye/camera_info", stamp, "eye", _SIZE_PX, _K),
            image("/eye/depth/image", stamp, "eye", _DEPTH, "16UC1"),
            compressed("/side/image/compressed", stamp, "side", _JPEG, "jpeg"),
            info("/side/camera_info", stamp, "side", _SIZE_PX, _K),
            tf(stamp, [("world", "eye", (0.1 * index, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))]),
        ]
    with TemporaryDirectory() as folder:
        path = write_bag(Path(folder) / name, entries)
        return (path if path.is_file() else next(path.glob("*.db3"))).read_bytes()


def _read_bag(path: Path) -> None:
    for topics in ((), ("/side/image/compressed",), ("/eye/depth/image", "/eye/image")):
        try:
            views = open_any(path, topics=topics).all_views()
        except ServoidError:
            continue
        for view in views[:_MOST_READ]:
            _read_or_refused(view.image)
            _read_or_refused(view.depth)


def _read_or_refused(read: Callable[[], object]) -> None:
    """Read, or be refused, so that what comes after is read, too."""
    try:
        read()
    except ServoidError as error:
        if "\n" in str(error):
            raise


def _cameras_bin() -> bytes:
    return struct.pack("<QIiQQ4d", 1, 1, 1, *_SIZE_PX, 20, 20, 11.5, 7.5)


def _images_bin() -> bytes:
    pose = struct.pack("<QI7dI", 1, 5, 1, 0, 0, 0, 1, 2, 3, 1)
    return pose + b"a.png\0" + struct.pack("<Q", 2) + struct.pack("<ddq", 1, 2, -1) * 2


def _calibrated(path: Path) -> object:
    return GivenCalibration(calibration=path).rig("a bag", ["left"], [(640, 480)])


def _stream(data: bytes, _: Path) -> None:
    """Read a stream to its end, which is told by an error."""
    answer = BytesIO(data)
    heads = Message()
    heads["Content-Type"] = 'multipart/x-mixed-replace; boundary="b"'
    answer.headers = heads  # type: ignore[attr-defined]
    video = MjpegVideo(answer)  # type: ignore[arg-type]

    def read_all() -> None:
        while video.grab():
            video.retrieve()

    _read_or_refused(read_all)


def _recall(data: bytes, _: Path) -> None:
    """Let a tracker take over looks, seek by them and go on.

    Raises:
        TrackError: they are none, or are of something else.

    """
    tracker, pose = small_tracker(), [Pose.identity()]
    tracker.recall(data)
    pixels = np.random.default_rng(0).integers(0, 256, (24, 33, 3), np.uint8)
    tracker.start(0.0, pose, [pixels], AHEAD)
    for index in range(1, 4):
        tracker.step(index / 30.0, pose, [pixels])
    tracker.appearance()


def _request(data: bytes, _: Path) -> None:
    """Send a request to the page in which a person marks the object.

    Raises:
        RuntimeError: the page takes it for a bug of its own.

    """
    server = _page()
    text = data.replace(b"TOKEN", server.guard.token.encode())
    text = text.replace(b"PORT", str(server.address.rsplit(":", 1)[1].split("/")[0]).encode())
    here, there = socket.socketpair()
    with here, there:
        here.settimeout(5.0)
        here.sendall(text[:60_000])
        here.shutdown(socket.SHUT_WR)
        try:
            _Handler(there, ("127.0.0.1", 1), server._http)
        except Exception:
            server._http.handle_error(there, None)
    server.wait(0.0)


def _page() -> PickServer:
    if not _PAGES:
        pixels = cv2.resize(_PIXELS, (96, 64), interpolation=cv2.INTER_NEAREST)
        question = Question("eye/0000", pixels, lambda mark: find_with_doubts(mark, pixels, None))
        _PAGES.append(PickServer(question))
    server = _PAGES[0]
    server.end(None)
    return server


_PAGES: list[PickServer] = []


def _http_post(route: str, body: bytes) -> bytes:
    heads = (
        f"POST /TOKEN/{route} HTTP/1.1",
        "Host: 127.0.0.1:PORT",
        "Origin: http://127.0.0.1:PORT",
        "Content-Type: application/json",
        f"Content-Length: {len(body)}",
    )
    return "\r\n".join(heads).encode() + b"\r\n\r\n" + body


_PARTS = b"".join(
    b"--b\r\nContent-Type: image/jpeg\r\n%sX-Timestamp: 12.5\r\n\r\n%s\r\n" % (length, _JPEG)
    for length in (b"Content-Length: %d\r\n" % len(_JPEG), b"")
)

RECORDINGS: dict[str, Target] = {
    "run.bag": Target((_bag("run.bag"),), from_file("run.bag", _read_bag), 2),
    "run.db3": Target((_bag("run"),), from_file("run.db3", _read_bag), 2),
    "pair.mcap": Target((_bag("pair.mcap"),), from_file("pair.mcap", _read_bag), 2),
    "cameras.bin": Target((_cameras_bin(),), from_file("cameras.bin", read_cameras_binary)),
    "images.bin": Target((_images_bin(),), from_file("images.bin", read_images_binary)),
    "calibration": Target((corpus("rig.toml"),), from_file("rig.toml", _calibrated)),
    "stream": Target((_PARTS + b"--b--\r\n",), _stream),
    "looks": Target((learned_looks(),), _recall, 4),
    "request": Target(
        (
            _http_post("seek", b'{"target": "click:40,30"}'),
            _http_post("choose", b'{"target": "box:10,12,60,50"}'),
        ),
        _request,
        4,
    ),
}
