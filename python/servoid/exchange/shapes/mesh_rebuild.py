"""Rebuilds surfaces that cannot be closed face by face, by their winding number."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid._native import Soup
from servoid.exchange.shapes.mesh_repair import Faces, Vertices, parts, patches, signed_volume

_CELLS = 64  # along the longest side: parts thinner than a cell may be lost
_GIVEN = 0.5  # jump of the winding number from which on there was a surface
_SPECK = 1e-3  # of the volume: stray faces leave such crumbs


@dataclass(frozen=True, eq=False)
class Rebuilt:
    """A closed surface that points outward, and how it was made.

    It was built from cells with sides of `cell` metres. `guessed` is the share of it at which the
    mesh had no face, and `guessed_at` (N, 3) are the centres of those triangles. `turned` of the
    mesh's faces had the wrong orientation.
    """

    vertices: Vertices
    faces: Faces
    cell: float
    guessed: float
    guessed_at: Vertices
    turned: int


def rebuild(vertices: Vertices, faces: Faces, cells: int = _CELLS) -> Rebuilt | None:
    """Orient patches outward, and rebuild the surface where the winding number is one half.

    Faces that share an edge must have the same orientation. Return None if nothing is enclosed.
    """
    turned = openness(vertices, faces) < 0.0
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    found = Soup(vertices=vertices, faces=faces).rebuilt(cells)
    if found is None:
        return None
    corners, new, leaps, cell = found
    new = _without_specks(corners, new)
    a, b, c = (corners[new[:, corner]] for corner in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    is_guess = leaps[new].mean(axis=1) < _GIVEN
    return Rebuilt(
        vertices=corners,
        faces=new,
        cell=cell,
        guessed=float(areas[is_guess].sum() / areas.sum()),
        guessed_at=((a + b + c) / 3.0)[is_guess],
        turned=int(turned.sum()),
    )


def openness(vertices: Vertices, faces: Faces) -> NDArray[np.float64]:
    """Return how much more of the sky the front of each face's patch sees than the back, (F,)."""
    soup = Soup(vertices=vertices, faces=faces)
    order = np.argsort(patch := patches(faces), kind="stable")
    found = np.zeros(len(faces))
    for own in np.split(order, np.flatnonzero(np.diff(patch[order])) + 1):
        found[own] = soup.openness(faces[own])
    return found


def _without_specks(vertices: Vertices, faces: Faces) -> Faces:
    part = parts(vertices, faces)
    names, index = np.unique(part, return_inverse=True)
    volumes = np.array([signed_volume(vertices, faces[part == name]) for name in names])
    return faces[(np.abs(volumes) >= _SPECK * np.abs(volumes).max())[index]]
