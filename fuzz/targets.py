"""What is fuzzed: all that reads files, commands, and the core."""

import io
import json
import struct
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from fuzz.calls import call_the_core
from fuzz.recordings import RECORDINGS
from fuzz.target import Target, corpus, from_file
from servoid.camera import Camera, read_depth, read_image, read_mask
from servoid.capture import Capture, PosedImage, capture_of
from servoid.cli import main
from servoid.exchange import open_any
from servoid.exchange.bags.writing import raw_observations, write_mcap_recording
from servoid.exchange.shapes.cloud_file import read_cloud
from servoid.exchange.shapes.mesh_file import read_mesh
from servoid.opening import GivenCalibration
from servoid.pose import Pose
from servoid.record import read_trajectory
from servoid.segment import parse_target
from servoid.servo import read_settings
from servoid.shape import load_body
from servoid.source import read_rig

SIZE_PX = (24, 16)


def _in_capture(name: str) -> Callable[[bytes, Path], object]:
    """Return what puts data into a whole capture in place of one of its files, and reads all."""

    def run(data: bytes, folder: Path) -> object:
        for other, content in _CAPTURE.items():
            (folder / other).write_bytes(content)
        (folder / name).write_bytes(data)
        return _read_all(open_any(folder))

    return run


def _other_capture(name: str, *beside: str) -> Callable[[bytes, Path], object]:
    def run(data: bytes, folder: Path) -> object:
        for path in ("images/a.png", "rgb/000001.png"):
            (folder / path).parent.mkdir(exist_ok=True)
            (folder / path).write_bytes(_CAPTURE["0.png"])
        for other in beside:
            (folder / other).write_bytes(corpus(other))
        (folder / name).write_bytes(data)
        return _read_all(open_any(folder))

    return run


def _command(data: bytes, folder: Path) -> None:
    """Model a capture whose capture.toml is damaged, by the command, which must not call it a bug.

    Raises:
        RuntimeError: it did, or it said more than a line.

    """
    for other, content in _CAPTURE.items():
        (folder / other).write_bytes(content)
    (folder / "capture.toml").write_bytes(data)
    out, messages, code = io.StringIO(), io.StringIO(), None
    with redirect_stdout(out), redirect_stderr(messages):
        try:
            main(["model", str(folder), "--out", str(folder / "b.json"), "--max-ellipsoids", "1"])
        except SystemExit as end:
            code = end.code
    if code not in (0, 1) or messages.getvalue().count("\n") > 1:
        raise RuntimeError(f"the command ended with {code} and said {messages.getvalue()!r}")


def _read_calibration(path: Path) -> object:
    """Read a calibration of another program; of ROS, with that of the other camera."""
    given = path
    if path.name == "right.yaml":
        (path.parent / "left.yaml").write_bytes(corpus("left.yaml"))
        given = path.parent
    return GivenCalibration(calibration=given).rig("a", ("left", "right"), [(640, 480)] * 2)


def _read_bag(path: Path) -> object:
    return _read_all(open_any(path))


def _read_all(capture: Capture) -> object:
    views = capture.all_views()[:4]
    return [(view.image(), view.view() if view.has_mask else None) for view in views]


def _png(pixels: np.ndarray, kind: str = ".png") -> bytes:
    return cv2.imencode(kind, pixels)[1].tobytes()


def _npy(values: np.ndarray, folder: Path = Path()) -> bytes:
    del folder
    header = repr({"descr": values.dtype.str, "fortran_order": False, "shape": values.shape})
    text = header.encode() + b" " * (117 - len(header)) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + values.tobytes()


def _binary_ply() -> bytes:
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 20\n"
        "property float x\nproperty float y\nproperty float z\nproperty uchar red\nend_header\n"
    )
    rows = b"".join(struct.pack("<fffB", i, -i, 0.5 * i, i) for i in range(20))
    return head.encode() + rows


def _stl() -> bytes:
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    rows = b"".join(
        struct.pack("<12fH", 0, 0, 0, *(x for corner in face for x in corners[corner]), 0)
        for face in faces
    )
    return bytes(80) + struct.pack("<I", len(faces)) + rows


def _glb() -> bytes:
    points = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1)
    faces = struct.pack("<12H", 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3)
    scene = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        ],
        "buffers": [{"byteLength": 72}],
    }
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    body += struct.pack("<I4s", 72, b"BIN\0") + points + faces
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def _mcap() -> bytes:
    """Record two small images."""
    camera = Camera.from_fov(SIZE_PX, 60.0)
    one = PosedImage(camera=camera, world_from_camera=Pose.identity(), image=_PIXELS)
    capture = capture_of([one, one], times_s=[0.0, 0.1], rate_hz=10.0)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        write_mcap_recording(path, capture.cameras, raw_observations(capture))
        return path.read_bytes()


_RNG = np.random.default_rng(0)
_PIXELS = _RNG.integers(0, 256, (SIZE_PX[1], SIZE_PX[0], 3), np.uint8)
_DEPTH = (500 * np.ones((SIZE_PX[1], SIZE_PX[0]))).astype(np.uint16)
_OBJECT = np.zeros((SIZE_PX[1], SIZE_PX[0]), np.uint8)
_OBJECT[4:10, 6:18] = 255
_CAPTURE = {
    "capture.toml": corpus("capture.toml"),
    "poses.csv": corpus("poses.csv"),
    "0.png": _png(_PIXELS),
    "1.png": _png(_PIXELS),
    "0.mask.png": _png(_OBJECT),
}

TARGETS: dict[str, Target] = {
    **{name: Target((content,), _in_capture(name), 2) for name, content in _CAPTURE.items()},
    "transforms.json": Target((corpus("transforms.json"),), _other_capture("transforms.json"), 4),
    "scene_camera.json": Target(
        (corpus("scene_camera.json"),), _other_capture("scene_camera.json", "scene_gt.json"), 4
    ),
    "scene_gt.json": Target(
        (corpus("scene_gt.json"),), _other_capture("scene_gt.json", "scene_camera.json"), 4
    ),
    "run.mcap": Target((_mcap(),), from_file("run.mcap", _read_bag), 2),
    "cameras.txt": Target((corpus("cameras.txt"),), _other_capture("cameras.txt", "images.txt"), 4),
    "images.txt": Target((corpus("images.txt"),), _other_capture("images.txt", "cameras.txt"), 4),
    **{
        name: Target((corpus(name),), from_file(name, _read_calibration))
        for name in ("camchain.yaml", "right.yaml", "stereo.yml")
    },
    "body.json": Target((corpus("body.json"),), from_file("body.json", load_body)),
    "rig.toml": Target((corpus("rig.toml"),), from_file("rig.toml", read_rig)),
    "servo.toml": Target((corpus("servo.toml"),), from_file("servo.toml", read_settings)),
    "track.csv": Target((corpus("track.csv"),), from_file("track.csv", read_trajectory)),
    "track.tum": Target((corpus("track.tum"),), from_file("track.tum", read_trajectory)),
    "image.jpg": Target(
        (_png(_PIXELS, ".jpg"),), from_file("image.jpg", lambda path: read_image(path, SIZE_PX, 2))
    ),
    "mask.png": Target((_png(_OBJECT),), from_file("m.png", lambda path: read_mask(path, SIZE_PX))),
    "depth.png": Target(
        (_png(_DEPTH),), from_file("d.png", lambda path: read_depth(path, SIZE_PX, 1e-3))
    ),
    "depth.npy": Target(
        (_npy(_DEPTH.astype(np.float32)),),
        from_file("d.npy", lambda path: read_depth(path, SIZE_PX, 1.0)),
    ),
    "cloud.ply": Target((corpus("cloud.ply"), _binary_ply()), from_file("c.ply", read_cloud)),
    "mesh.obj": Target((corpus("mesh.obj"),), from_file("mesh.obj", read_mesh)),
    "mesh.off": Target((corpus("mesh.off"),), from_file("mesh.off", read_mesh), 4),
    "mesh.stl": Target((_stl(),), from_file("mesh.stl", read_mesh), 4),
    "mesh.glb": Target((_glb(),), from_file("mesh.glb", read_mesh)),
    "calls": Target((b"core", b"numbers"), call_the_core),
    "command": Target((corpus("capture.toml"),), _command, 1),
    "target": Target(
        (b"box:1,2,3,4@eye/0", b"hue:10..20", b"click:1,2", b"mask:a.png"),
        lambda data, _: parse_target(data.decode("utf-8", "replace")),
    ),
    **RECORDINGS,
}
