"""Closes triangle meshes, face by face or by building them anew, and says what it did."""

import numpy as np

from servoid.errors import MeshError
from servoid.exchange.shapes.mesh_rebuild import Rebuilt, rebuild
from servoid.exchange.shapes.mesh_repair import (
    Faces,
    Vertices,
    drop,
    fill,
    outward,
    place,
    signed_volume,
    weld,
    wind,
)
from servoid.words import digits

_LEAST_VOLUME = 1e-9  # of the cube of the mesh's diagonal
_LEAST_REBUILT = 1e-4  # likewise, of what was built anew: less lies between the sides of a sheet
_MOST_GUESSED = 0.4  # of the surface: half a ball lacks a third of it, a sheet a half
_REMEDY = "close the mesh in a mesh editor, or give its vertices as a point cloud"


def close_mesh(vertices: Vertices, faces: Faces) -> tuple[Vertices, Faces, tuple[str, ...]]:
    """Close a mesh so that it looks outward; notes say what was done.

    Corners at one place are joined, faces dropped, turned and small holes filled. Where that does
    not close it, its surface is built anew around what its faces wind around.

    Raises:
        MeshError: it encloses nothing, or most of what would enclose it is a guess; the message
            says what is wrong with it, and where.

    """
    notes: list[str] = []
    vertices, faces = weld(vertices, faces)
    faces = drop(faces, notes)
    if not len(faces):
        raise MeshError("no face has three different corners; give a mesh with a surface")
    wound = wind(faces)
    filled_notes: list[str] = []
    try:
        corners, closed = fill(vertices, wound, filled_notes)
        closed = outward(corners, closed)
        _check_volume(corners, closed)
    except MeshError as fault:
        new = _rebuilt(vertices, wound, fault)
        return new.vertices, new.faces, (*notes, *_rebuilt_notes(new, wound, fault))
    turned = int((closed[: len(faces)] != faces).any(axis=1).sum())
    if turned:
        filled_notes.append(f"{turned} of {len(faces)} faces looked the wrong way and were turned")
    return corners, closed, (*notes, *filled_notes)


def _check_volume(vertices: Vertices, faces: Faces) -> None:
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    volume = signed_volume(vertices, faces)
    if volume <= _LEAST_VOLUME * size**3:
        raise MeshError(
            f"the mesh is {size:.3g} m large and encloses a volume of {volume:.2g} m3; a body "
            "needs a volume, so give the surface thickness"
        )


def _rebuilt(vertices: Vertices, faces: Faces, fault: MeshError) -> Rebuilt:
    """Build the surface anew.

    Raises:
        MeshError: nothing is enclosed, or too much of the surface would be a guess.

    """
    new = rebuild(vertices, faces)
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if new is None or signed_volume(new.vertices, new.faces) < _LEAST_REBUILT * size**3:
        raise MeshError(f"{fault}; and its faces enclose nothing: {_REMEDY}") from fault
    if new.guessed > _MOST_GUESSED:
        raise MeshError(
            f"{fault}; {100.0 * new.guessed:.0f} % of a closed surface would be a guess, around "
            f"{place(new.guessed_at)}, and at most {100.0 * _MOST_GUESSED:.0f} % may be: {_REMEDY}"
        ) from fault
    return new


def _rebuilt_notes(new: Rebuilt, faces: Faces, fault: MeshError) -> list[str]:
    notes = [
        f"{fault}: so the surface was built anew around what its faces wind around, of cells of "
        f"{digits(new.cell)} m; what is thinner may be lost"
    ]
    if new.guessed > 0.005:
        notes.append(
            f"{100.0 * new.guessed:.0f} % of the surface, around {place(new.guessed_at)}, is a "
            "guess: there was no face"
        )
    if new.turned:
        notes.append(f"{new.turned} of {len(faces)} faces looked the wrong way and were turned")
    return notes
