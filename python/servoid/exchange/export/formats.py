"""The export formats: the files of each, and how they are made."""

import hashlib
import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from servoid.exchange.export.meshes import glb_bytes, mtl_text, obj_text, ply_bytes
from servoid.exchange.export.mjcf import mjcf_text
from servoid.exchange.export.sdf import sdf_text
from servoid.exchange.export.solid import Solid
from servoid.exchange.export.splat import splat_bytes
from servoid.exchange.export.surface import Surface, ball, union_surface
from servoid.exchange.export.urdf import urdf_text

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.-]*")
_BALL_DETAIL = 2

Files = dict[str, bytes]


@dataclass(frozen=True)
class Format:
    """A format: the endings of its files, the usual one first, and the function that makes them.

    `beside` returns the names of the files that belong beside the requested one, from its stem.
    """

    suffixes: tuple[str, ...]
    make: Callable[[Solid, Path, int], Files]
    meshes: bool = False
    beside: tuple[str, ...] = ()


def plain_stem(stem: str) -> str:
    """Return a file's stem without characters that are invalid in names inside a file."""
    stem = re.sub(r"[^A-Za-z0-9_.-]", "_", stem).lstrip("_.-")
    return stem if NAME.fullmatch(stem) else f"body_{stem}".rstrip("_")


def stem_beside(stem: str) -> str:
    """Return how the names of files beside an exported one begin, from the stem of that.

    Where `plain_stem` replaces anything, eight digits of a digest of the original keep apart what
    would have the same name, such as files in a script without Latin letters.
    """
    plain = plain_stem(stem)
    if plain == stem:
        return stem
    original = unicodedata.normalize("NFC", stem).encode(errors="surrogateescape")
    return f"{plain}_{hashlib.sha256(original).hexdigest()[:8]}"


def _surface(solid: Solid, detail: int) -> tuple[Solid, Surface]:
    moved = solid.moved()
    return moved, union_surface(moved.pieces, detail)


def _make_obj(solid: Solid, path: Path, detail: int) -> Files:
    solid, surface = _surface(solid, detail)
    materials = stem_beside(path.stem) + ".mtl"
    return {
        path.name: obj_text(surface, solid.pieces, solid.name, materials),
        materials: mtl_text(solid.pieces),
    }


def _make_ply(solid: Solid, path: Path, detail: int) -> Files:
    solid, surface = _surface(solid, detail)
    return {path.name: ply_bytes(surface, solid.pieces)}


def _make_glb(solid: Solid, path: Path, detail: int) -> Files:
    solid, surface = _surface(solid, detail)
    return {path.name: glb_bytes(surface, solid.pieces, solid.name)}


def _make_urdf(solid: Solid, path: Path, detail: int) -> Files:
    solid, surface = _surface(solid, detail)
    mesh, materials, unit = (stem_beside(path.stem) + end for end in FORMATS["urdf"].beside)
    vertices, faces = ball(_BALL_DETAIL)
    round_ball = Surface(vertices, faces, faces[:, 0] * 0)
    return {
        path.name: urdf_text(solid, mesh, unit),
        mesh: obj_text(surface, solid.pieces, solid.name, materials),
        materials: mtl_text(solid.pieces),
        unit: obj_text(round_ball, solid.pieces[:1], "unit_ball", ""),
    }


FORMATS: dict[str, Format] = {
    "obj": Format((".obj",), _make_obj, meshes=True, beside=(".mtl",)),
    "ply": Format((".ply",), _make_ply, meshes=True),
    "glb": Format((".glb",), _make_glb, meshes=True),
    "mjcf": Format((".xml", ".mjcf"), lambda solid, path, _: {path.name: mjcf_text(solid)}),
    "urdf": Format(
        (".urdf",),
        _make_urdf,
        meshes=True,
        beside=("_visual.obj", "_visual.mtl", "_unit_ball.obj"),
    ),
    "sdf": Format((".sdf",), lambda solid, path, _: {path.name: sdf_text(solid)}),
    "splat": Format((".ply",), lambda solid, path, _: {path.name: splat_bytes(solid.moved())}),
}
