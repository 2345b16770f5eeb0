"""Writes the surface of the union as OBJ, PLY and GLB."""

import json
import struct

import numpy as np
from numpy.typing import NDArray

from servoid.camera import linear_light
from servoid.exchange.export.solid import Piece
from servoid.exchange.export.surface import Surface

_FLOAT, _UINT, _USHORT = 5126, 5125, 5123
_VERTICES, _INDICES = 34962, 34963


def obj_text(surface: Surface, pieces: tuple[Piece, ...], name: str, materials: str) -> bytes:
    """Return an OBJ file whose faces have the materials `ellipsoid_N` of the file `materials`."""
    lines = [f"mtllib {materials}"] if materials else []
    lines += [f"o {name}"]
    lines += [f"v {x:.10g} {y:.10g} {z:.10g}" for x, y, z in surface.vertices.tolist()]
    for index in range(len(pieces)):
        own = surface.faces[surface.owners == index] + 1
        if materials and len(own):
            lines.append(f"usemtl ellipsoid_{index}")
        lines += [f"f {a} {b} {c}" for a, b, c in own.tolist()]
    return ("\n".join(lines) + "\n").encode()


def mtl_text(pieces: tuple[Piece, ...]) -> bytes:
    """Return the materials for `obj_text`: a matt one per ellipsoid."""
    lines = []
    for index, piece in enumerate(pieces):
        color = " ".join(f"{channel:.6f}" for channel in piece.rgb)
        lines += [f"newmtl ellipsoid_{index}", f"Ka {color}", f"Kd {color}", "Ks 0 0 0", "d 1"]
        lines += ["illum 1", ""]
    return "\n".join(lines).encode()


def ply_bytes(surface: Surface, pieces: tuple[Piece, ...]) -> bytes:
    """Return a binary PLY file with a colour at each vertex."""
    vertices = np.zeros(len(surface.vertices), [("at", "<f8", 3), ("color", "u1", 3)])
    vertices["at"] = surface.vertices
    vertices["color"] = np.rint(surface.vertex_colors(pieces))
    faces = np.zeros(len(surface.faces), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"] = 3
    faces["corners"] = surface.faces
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        *(f"property uchar {channel}" for channel in ("red", "green", "blue")),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    return "\n".join(header).encode() + vertices.tobytes() + faces.tobytes()


def glb_bytes(surface: Surface, pieces: tuple[Piece, ...], name: str) -> bytes:
    """Return a GLB file: y up, as glTF requires, so that (x, y, z) is written as (x, z, -y)."""
    vertices = _y_up(surface.vertices)
    # GLB vertices are float32; the position, which needs more digits, is the node's.
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    places = (vertices - middle).astype("<f4")
    colors = np.ones((len(places), 4))
    # glTF requires linear light at vertices.
    colors[:, :3] = linear_light(surface.vertex_colors(pieces) / 255.0)
    blocks = [
        places.tobytes(),
        _y_up(surface.vertex_normals()).astype("<f4").tobytes(),
        np.rint(65535.0 * colors).astype("<u2").tobytes(),
        surface.faces.astype("<u4").tobytes(),
    ]
    lows_and_highs = {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
    count = len(places)
    accessors = [
        {"componentType": _FLOAT, "type": "VEC3", "count": count, **lows_and_highs},
        {"componentType": _FLOAT, "type": "VEC3", "count": count},
        {"componentType": _USHORT, "type": "VEC4", "count": count, "normalized": True},
        {"componentType": _UINT, "type": "SCALAR", "count": surface.faces.size},
    ]
    starts = np.cumsum([0, *(len(block) for block in blocks)]).tolist()
    attributes = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2}
    material = {"metallicFactor": 0.0, "roughnessFactor": 0.8}
    scene = {
        "asset": {"version": "2.0", "generator": "servoid"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "mesh": 0, "translation": middle.tolist()}],
        "meshes": [
            {"name": name, "primitives": [{"attributes": attributes, "indices": 3, "material": 0}]}
        ],
        "materials": [{"pbrMetallicRoughness": material}],
        "accessors": [{"bufferView": view, **one} for view, one in enumerate(accessors)],
        "bufferViews": [
            {
                "buffer": 0,
                "byteOffset": starts[view],
                "byteLength": len(block),
                "target": _INDICES if view == 3 else _VERTICES,
            }
            for view, block in enumerate(blocks)
        ],
        "buffers": [{"byteLength": starts[-1]}],
    }
    return _glb(json.dumps(scene).encode(), b"".join(blocks))


def _glb(text: bytes, data: bytes) -> bytes:
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(data))
    return (
        head
        + struct.pack("<I4s", len(text), b"JSON")
        + text
        + (struct.pack("<I4s", len(data), b"BIN\0") + data)
    )


def _y_up(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)
