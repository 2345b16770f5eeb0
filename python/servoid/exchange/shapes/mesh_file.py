"""Reads closed triangle meshes from PLY, OBJ, STL, OFF and GLB files."""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.config import SHAPE_FILE, read_bytes
from servoid.errors import MeshError, MissingExtraError, located
from servoid.exchange.shapes.mesh_closing import close_mesh
from servoid.exchange.shapes.mesh_counts import check_counts
from servoid.exchange.shapes.mesh_repair import apart_note
from servoid.exchange.units import check_unit
from servoid.words import are, counted, measured

SUFFIXES = (".ply", ".obj", ".stl", ".off", ".glb")
_LONGEST = 1e6  # metres; squares and cubes of lengths stay far from overflow
_LEAST = 1e-6  # metres; the smallest size that the core distinguishes from a point


@dataclass(frozen=True)
class MeshFile:
    """A closed mesh whose faces point outward, and the notes from reading it.

    `vertices`: (V, 3) float64, metres. `faces`: (F, 3) int64, counter-clockwise from outside.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    notes: tuple[str, ...]


def read_mesh(path: Path, unit_m: float = 1.0) -> MeshFile:
    """Read a mesh, and close it; notes report what was changed.

    Corners at the same position or across a crack are merged. Degenerate and duplicate faces, and
    loose ones beside the rest, are dropped. Faces are oriented outward, and holes are closed. If
    the mesh is still open, its surface is rebuilt where the winding number of its faces is one
    half. `unit_m` is the length in metres of one unit of the file.

    Raises:
        MeshError: the file is missing, damaged or of another format, its header promises more than
            it contains, its mesh encloses no volume that could be determined, or the unit is not
            a positive number.
        MissingExtraError: trimesh is not installed.

    """
    check_unit(path, unit_m, MeshError)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise MeshError(
            f"{path} is not a mesh that can be read: its name ends in '{path.suffix}'; known "
            f"endings are {', '.join(SUFFIXES)}"
        )
    data = read_bytes(path, MeshError, SHAPE_FILE)
    if not data:
        raise MeshError(f"{path} is empty; replace the file")
    check_counts(path, data)
    vertices, faces = _parse(path, data, suffix[1:])
    vertices *= unit_m
    with located(str(path)):
        _check_numbers(vertices, faces)
        vertices, faces, notes = close_mesh(vertices, faces)
    apart = apart_note(vertices, faces)
    return MeshFile(vertices, faces, (*notes, *(() if apart is None else (apart,))))


def _parse(path: Path, data: bytes, kind: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Parse the file's content with trimesh; materials and other files are never opened."""
    try:
        import trimesh
    except ImportError as error:
        raise MissingExtraError.of("meshes", "trimesh", "exchange") from error
    try:
        scene = trimesh.load_scene(
            io.BytesIO(data), file_type=kind, process=False, skip_materials=True
        )
        mesh = scene.to_mesh()
        vertices = np.array(mesh.vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.array(mesh.faces, dtype=np.int64).reshape(-1, 3)
    except Exception as reason:  # a parser may raise anything for a damaged file
        raise MeshError(
            f"{path} cannot be read as {kind.upper()}: {str(reason)[:200] or type(reason).__name__}"
            "; it is damaged or of another format, export it again"
        ) from reason
    return vertices, faces


def _check_numbers(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
    if not len(faces):
        raise MeshError(
            f"the file has {counted(len(vertices), 'point')} and no faces; give a mesh with "
            "faces, or a PLY file as a point cloud"
        )
    low, high = int(faces.min()), int(faces.max())
    if low < 0 or high >= len(vertices):
        raise MeshError(
            f"a face names vertex {low if low < 0 else high}, but there are {len(vertices)}, "
            "counted from 0; the file is damaged, export it again"
        )
    if not np.isfinite(vertices).all():
        bad = int((~np.isfinite(vertices)).any(axis=1).sum())
        raise MeshError(
            f"{bad} of {len(vertices)} vertices {are(bad)} not finite; export the mesh again"
        )
    if np.abs(vertices).max() > _LONGEST:
        raise MeshError(
            f"a vertex is {np.abs(vertices).max():.3g} m from the origin; lengths are metres, "
            f"at most {_LONGEST:.0e}; scale the mesh, or give its unit with --unit"
        )
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if size < _LEAST:
        raise MeshError(
            f"the mesh is {measured(size)} m large; lengths are metres, at least {_LEAST:.0e}; "
            "scale the mesh, or give its unit with --unit"
        )
