"""Checks that a mesh file can contain what its header promises, before memory is allocated."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from servoid.errors import MeshError
from servoid.exchange.shapes.ply_header import read_ply_header
from servoid.words import counted

_STL_HEAD, _STL_FACE = 84, 50
_GLB_HEAD, _CHUNK_HEAD = 12, 8
_WIDTHS = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_PARTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_MOST_ROWS = 100_000_000
_PIECE = 1 << 24
_CUT_SHORT = "it is cut short or damaged, copy it again"


def check_counts(path: Path, data: bytes) -> None:
    """Check the first bytes and the counts of a file by the ending of its name.

    Raises:
        MeshError: it has another format, or promises more than it contains.

    """
    suffix = path.suffix.lower()
    if suffix == ".ply":
        read_ply_header(path, data)
    elif suffix == ".stl":
        _check_stl(path, data)
    elif suffix == ".off":
        _check_off(path, data)
    elif suffix == ".glb":
        _check_glb(path, data)
    elif b"\0" in data[:1024]:
        raise MeshError(f"{path} is not an OBJ file: it is not text; export it again")


def _check_stl(path: Path, data: bytes) -> None:
    text = data[:5].lower() == b"solid" and b"facet" in data[:1024].lower()
    if text:
        if b"endsolid" not in data[-256:].lower():
            raise MeshError(f"{path} has no line 'endsolid' at its end; {_CUT_SHORT}")
        return
    if len(data) < _STL_HEAD:
        raise MeshError(
            f"{path} is not an STL file: {len(data)} bytes are too few; export it again"
        )
    (count,) = struct.unpack_from("<I", data, 80)
    if _STL_HEAD + _STL_FACE * count > len(data):
        raise MeshError(
            f"{path}: the header promises {counted(count, 'face')}, which take "
            f"{_STL_FACE * count} bytes, but {len(data) - _STL_HEAD} follow; {_CUT_SHORT}"
        )


def _check_off(path: Path, data: bytes) -> None:
    words: list[bytes] = []
    for line in data[: 1 << 16].splitlines():
        words += line.partition(b"#")[0].split()
        if len(words) >= 4:
            break
    if not words or not words[0].upper().startswith(b"OFF"):
        raise MeshError(f"{path} is not an OFF file: it does not begin with the word 'OFF'")
    words = ([words[0][3:]] if words[0][3:] else []) + words[1:]
    counts = words[:2]
    if len(counts) < 2 or not all(word.isdigit() and len(word) < 19 for word in counts):
        raise MeshError(f"{path}: the numbers of vertices and faces must follow the word 'OFF'")
    vertices, faces = (int(word) for word in counts)
    need = 6 * vertices + 8 * faces
    if need > len(data) + 1:
        raise MeshError(
            f"{path}: the header promises {vertices} vertices and {faces} faces, at least {need} "
            f"bytes, but the file has {len(data)}; {_CUT_SHORT}"
        )
    need, given = 3 + 3 * vertices + 4 * faces, _count_numbers(data)
    if need > given:
        raise MeshError(
            f"{path}: the header promises {vertices} vertices and {faces} faces, at least {need} "
            f"numbers, but the file has {given}; {_CUT_SHORT}"
        )


def _count_numbers(data: bytes) -> int:
    """Count words, including those in comments, in chunks, as files may be large."""
    count, blank_before = 0, True
    for first in range(0, len(data), _PIECE):
        blank = np.frombuffer(data, np.uint8, min(_PIECE, len(data) - first), first) <= ord(" ")
        count += int((blank[:-1] & ~blank[1:]).sum()) + int(blank_before and not blank[0])
        blank_before = bool(blank[-1])
    return count


def _check_glb(path: Path, data: bytes) -> None:
    if len(data) < _GLB_HEAD + _CHUNK_HEAD or data[:4] != b"glTF":
        raise MeshError(
            f"{path} is not a GLB file: it does not begin with 'glTF'; export it as GLB"
        )
    version, total = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise MeshError(f"{path} is GLB of version {version}; version 2 can be read")
    length, kind = struct.unpack_from("<I4s", data, _GLB_HEAD)
    start = _GLB_HEAD + _CHUNK_HEAD
    if total > len(data) or start + length > len(data) or kind != b"JSON":
        raise MeshError(f"{path} has {len(data)} bytes and promises {total}; {_CUT_SHORT}")
    try:
        tree = json.loads(data[start : start + length])
    except (ValueError, RecursionError) as reason:
        raise MeshError(f"{path}: its JSON cannot be read ({reason}); export it again") from reason
    after = start + length
    room = 0
    if len(data) >= after + _CHUNK_HEAD:
        (room,) = struct.unpack_from("<I", data, after)
        if after + _CHUNK_HEAD + room > len(data):
            raise MeshError(f"{path}: its binary part promises {room} bytes; {_CUT_SHORT}")
    try:
        _check_gltf(path, tree, room)
    except (TypeError, KeyError, IndexError, AttributeError) as reason:
        raise MeshError(f"{path}: its JSON is not glTF ({reason}); export it again") from reason


def _check_gltf(path: Path, tree: dict[str, Any], room: int) -> None:
    for buffer in [*tree.get("buffers", []), *tree.get("images", [])]:
        if buffer.get("uri") is not None:
            raise MeshError(
                f"{path} names the file '{str(buffer['uri'])[:40]}'; a GLB file must contain all "
                "of its data, so export it without external files"
            )
    _check_views(path, tree, room)
    # Many nodes may use one mesh, each with faces of its own.
    rows = [one["count"] for one in tree.get("accessors", [])]
    sizes = [
        sum(rows[one.get("indices", one["attributes"]["POSITION"])] for one in mesh["primitives"])
        for mesh in tree.get("meshes", [])
    ]
    total = sum(sizes[node["mesh"]] for node in tree.get("nodes", []) if "mesh" in node)
    if total > _MOST_ROWS:
        raise MeshError(
            f"{path}: its nodes have {total} corners of faces, at most {_MOST_ROWS} are read; "
            "simplify the scene first"
        )


def _check_views(path: Path, tree: dict[str, Any], room: int) -> None:
    views = tree.get("bufferViews", [])
    for view in views:
        begin, length = view.get("byteOffset", 0), view["byteLength"]
        if begin < 0 or length < 0 or begin + length > room:
            raise MeshError(
                f"{path}: a part of {length} bytes at {begin} lies outside the {room} bytes of "
                f"its binary part; {_CUT_SHORT}"
            )
    for accessor in tree.get("accessors", []):
        count = accessor["count"]
        row = _WIDTHS[accessor["componentType"]] * _PARTS[accessor["type"]]
        source = accessor.get("bufferView")
        if "sparse" in accessor or source is None:
            raise MeshError(
                f"{path}: a sparse or compressed accessor is not supported; export plain triangles"
            )
        if not 0 <= count * row <= views[source]["byteLength"]:
            raise MeshError(
                f"{path}: an accessor promises {count} rows of {row} bytes, but its part has "
                f"{views[source]['byteLength']}; {_CUT_SHORT}"
            )
