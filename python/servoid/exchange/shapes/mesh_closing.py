"""Closes triangle meshes, face by face or by rebuilding them, and reports what was done."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from servoid._native import Soup
from servoid.errors import MeshError
from servoid.exchange.shapes.mesh_holes import MOST_GUESSED, Filled, fill
from servoid.exchange.shapes.mesh_rebuild import Rebuilt, openness, rebuild
from servoid.exchange.shapes.mesh_repair import (
    Edges,
    Faces,
    Vertices,
    drop,
    outward,
    place,
    signed_volume,
    size,
    weld,
    wind,
)
from servoid.exchange.shapes.mesh_seams import join_seams, loose, without_twins
from servoid.words import measured, were

_LEAST_VOLUME = 1e-9  # of the cube of the mesh's diagonal
_LEAST_REBUILT = 1e-4  # likewise, of a rebuilt mesh: a sheet encloses less
_LOOSE_CELLS = 32  # along the longest side, for the test of loose sheets
_SEES = 0.02  # difference of visible sky that decides which side of a patch is outside
_MOST_BACKWARD = 0.02  # of the volume, around which patches of holes may have the wrong winding
_PLACES = 4096  # sample points for that
_REMEDY = "close the mesh in a mesh editor, or give its vertices as a point cloud"


def close_mesh(vertices: Vertices, faces: Faces) -> tuple[Vertices, Faces, tuple[str, ...]]:
    """Close a mesh so that its faces point outward; notes report what was done.

    Small repairs come first: corners at one position, or across a crack, are merged; double, loose
    and degenerate faces are dropped; faces are flipped and holes filled. If these do not close the
    mesh, its surface is rebuilt where the winding number of its faces is one half.

    Raises:
        MeshError: the mesh encloses nothing, or most of the surface around it would be a guess; the
            message says what is wrong with the mesh, and where.

    """
    notes: list[str] = []
    vertices, faces = weld(vertices, faces)
    faces = drop(faces, notes)
    if not len(faces):
        raise MeshError("no face has three different corners; give a mesh with a surface")
    faces = without_twins(vertices, faces, notes)
    vertices, faces = join_seams(vertices, faces, notes)
    faces = _without_loose(vertices, faces, notes)
    wound = wind(faces)
    try:
        filled = _filled(vertices, wound)
    except MeshError as fault:
        new = _rebuilt(vertices, wound, fault)
        return new.vertices, new.faces, (*notes, *_rebuilt_notes(new, wound, fault))
    notes += filled.notes
    turned = int((filled.faces[: len(faces)] != faces).any(axis=1).sum())
    if turned:
        notes.append(_turned_note(turned, len(faces)))
    return filled.vertices, filled.faces, tuple(notes)


def _without_loose(vertices: Vertices, faces: Faces, notes: list[str]) -> Faces:
    """Drop sheets beside a closed surface, unless they enclose a volume themselves."""
    gone = loose(vertices, faces)
    if not gone.any():
        return faces
    alone = rebuild(vertices, wind(faces[gone]), _LOOSE_CELLS)
    if (
        alone is not None
        and alone.guessed <= MOST_GUESSED
        and signed_volume(alone.vertices, alone.faces) >= _LEAST_REBUILT * size(vertices) ** 3
    ):
        return faces
    count = int(gone.sum())
    were = "face of a loose sheet was" if count == 1 else "faces of loose sheets were"
    notes.append(
        f"{count} {were} dropped, around {place(vertices[faces[gone]].reshape(-1, 3))}: they "
        "enclose nothing that the closed surface does not"
    )
    return faces[~gone]


def _filled(vertices: Vertices, faces: Faces) -> Filled:
    """Orient the open parts outward, close their holes, and orient the rest.

    Raises:
        MeshError: the holes cannot be closed, or nothing is enclosed afterwards.

    """
    if not Edges.of(faces).balance.any():
        closed = outward(vertices, faces)
        _check_volume(vertices, closed)
        return Filled(vertices, closed, is_curved=False, notes=())
    seen = openness(vertices, faces)
    faces = np.where((seen < -_SEES)[:, None], faces[:, ::-1], faces)
    filled = _outward(fill(vertices, faces, may_curve=True), np.abs(seen) > _SEES)
    backward = _backward(filled)
    if len(backward) and filled.is_curved:
        filled = _outward(fill(vertices, faces, may_curve=False), np.abs(seen) > _SEES)
        backward = _backward(filled)
    if len(backward):
        raise MeshError(
            "the mesh is open, and patches of its holes would intersect other "
            f"faces, around {place(backward)}"
        )
    return filled


def _outward(filled: Filled, is_known: NDArray[np.bool_]) -> Filled:
    """Orient the parts outward whose orientation is not known.

    Raises:
        MeshError: nothing is enclosed.

    """
    is_new = np.zeros(len(filled.faces) - len(is_known), dtype=bool)
    closed = outward(filled.vertices, filled.faces, np.concatenate([is_known, is_new]))
    _check_volume(filled.vertices, closed)
    return replace(filled, faces=closed)


def _backward(filled: Filled) -> Vertices:
    """Find positions around which the mesh has the wrong winding, if they are more than a trace.

    There, the patch of a hole intersects other faces.
    """
    low, high = filled.vertices.min(axis=0), filled.vertices.max(axis=0)
    places = np.random.default_rng(0).uniform(low, high, (_PLACES, 3))
    winding = Soup(vertices=filled.vertices, faces=filled.faces).windings(places)
    backward = places[winding < -0.5]
    is_trace = len(backward) <= _MOST_BACKWARD * (winding > 0.5).sum()
    return backward[:0] if is_trace else backward


def _check_volume(vertices: Vertices, faces: Faces) -> None:
    diagonal = size(vertices)
    volume = signed_volume(vertices, faces)
    if volume <= _LEAST_VOLUME * diagonal**3:
        raise MeshError(
            f"the mesh is {diagonal:.3g} m large and encloses a volume of {volume:.2g} m3; a body "
            "needs a volume, so give the surface thickness"
        )


def _rebuilt(vertices: Vertices, faces: Faces, fault: MeshError) -> Rebuilt:
    """Rebuild the surface.

    Raises:
        MeshError: nothing is enclosed, or too much of the surface would be a guess.

    """
    new = rebuild(vertices, faces)
    least = _LEAST_REBUILT * size(vertices) ** 3
    if new is None or signed_volume(new.vertices, new.faces) < least:
        raise MeshError(f"{fault}; and its faces enclose nothing: {_REMEDY}") from fault
    if new.guessed > MOST_GUESSED:
        raise MeshError(
            f"{fault}; {100.0 * new.guessed:.0f} % of a closed surface would be a guess, around "
            f"{place(new.guessed_at)}, and at most {100.0 * MOST_GUESSED:.0f} % may be: {_REMEDY}"
        ) from fault
    return new


def _rebuilt_notes(new: Rebuilt, faces: Faces, fault: MeshError) -> list[str]:
    notes = [
        f"{fault}: so the surface was rebuilt by the winding number of its faces, with cells of "
        f"{measured(new.cell)} m; thinner parts may be lost"
    ]
    if new.guessed > 0.005:
        notes.append(
            f"{100.0 * new.guessed:.0f} % of the surface, around {place(new.guessed_at)}, is a "
            "guess: there was no face"
        )
    if new.turned:
        notes.append(_turned_note(new.turned, len(faces)))
    return notes


def _turned_note(turned: int, count: int) -> str:
    return f"{turned} of {count} faces had the wrong orientation and {were(turned)} flipped"
