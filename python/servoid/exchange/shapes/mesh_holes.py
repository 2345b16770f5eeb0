"""Finds and closes the holes of a triangle mesh, and reports how much of it is a guess."""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.errors import MeshError
from servoid.exchange.shapes.mesh_patch import Patch, are_cuts, normal, patch
from servoid.exchange.shapes.mesh_repair import (
    Edges,
    Faces,
    Vertices,
    area,
    directed,
    parts,
    place,
    signed_volume,
    size,
)
from servoid.words import counted

MOST_GUESSED = 0.4  # of the surface: half a ball lacks a third of it, a sheet a half
_LARGE = 0.1  # across, of the mesh's diagonal: patches of larger holes are reported as a guess,
_REPORTED_SHARE = 0.005  # if their share of the surface is larger than this
_APART = 0.02  # of the volume: a larger difference between flat and curved patches is reported
_INNER = 0.02  # of the mesh's diagonal, by which the inner of two walls may protrude
_FACING = float(np.cos(np.radians(40.0)))  # of the directions of two holes that face each other
_ALIKE = 0.6  # smallest ratio of the widths of two matching holes
_GAP = 2.5  # largest distance between two facing holes, in widths
_TINY = float(np.finfo(np.float64).tiny)


@dataclass(frozen=True, eq=False)
class Filled:
    """A mesh without holes: its own vertices and faces, followed by the new ones.

    `is_curved` is true if a patch is not flat; `notes` report what was done.
    """

    vertices: Vertices
    faces: Faces
    is_curved: bool
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Hole:
    loop: NDArray[np.int64]
    rim: Vertices
    across: float
    patch: Patch


def fill(vertices: Vertices, faces: Faces, *, may_curve: bool) -> Filled:
    """Close all holes of a mesh whose faces have consistent orientations at shared edges.

    Raises:
        MeshError: three faces meet at an edge, or the patches cover too much of the surface; the
            message gives the position.

    """
    edges = Edges.of(faces)
    if not edges.balance.any():
        return Filled(vertices, faces, is_curved=False, notes=())
    _check_crowd(vertices, faces, edges)
    holes = _patched(vertices, faces, edges, may_curve=may_curve)
    corners = np.concatenate([vertices, *(hole.patch.vertices for hole in holes)])
    closed = np.concatenate([faces, *(hole.patch.faces for hole in holes)])
    guessed = 1.0 - area(vertices, faces) / max(area(corners, closed), _TINY)
    worst = max(holes, key=lambda hole: hole.across)
    at = place(worst.rim)
    if guessed > MOST_GUESSED:
        raise MeshError(
            f"the mesh is open: it has {counted(len(holes), 'hole')}, the largest with "
            f"{counted(len(worst.rim), 'edge')} and {worst.across:.3g} m across, around {at}"
        )
    notes = [_closed_note(holes)]
    if worst.across > _LARGE * size(vertices) and guessed > _REPORTED_SHARE:
        volume = max(abs(signed_volume(corners, closed)), _TINY)
        more = abs(sum(hole.patch.apart for hole in holes)) / volume
        notes.append(_guess_note(guessed, at, more))
        notes += _facing_notes(holes) or _apart_notes(vertices, faces, holes)
    return Filled(corners, closed, any(hole.patch.is_curved for hole in holes), tuple(notes))


def _patched(vertices: Vertices, faces: Faces, edges: Edges, *, may_curve: bool) -> list[_Hole]:
    slopes = _slopes(vertices, faces, edges)
    loops = _loops(directed(faces)[edges.is_open])
    rims = [vertices[loop] for loop in loops]
    ways = [
        np.array([slopes[ends] for ends in zip(loop, np.roll(loop, -1).tolist(), strict=True)])
        for loop in (loop.tolist() for loop in loops)
    ]
    holes: list[_Hole] = []
    count = len(vertices)
    for loop, rim, way, cut in zip(loops, rims, ways, are_cuts(rims, ways), strict=True):
        closing = patch(rim, way, loop, count, curved=may_curve and not cut)
        holes.append(_Hole(loop, rim, size(rim), closing))
        count += len(closing.vertices)
    return holes


def _check_crowd(vertices: Vertices, faces: Faces, edges: Edges) -> None:
    crowded = edges.crowded
    if not len(crowded):
        return
    ends = directed(faces)[edges.edge == crowded[0]][0]
    raise MeshError(
        f"{counted(len(crowded), 'edge has', 'edges have')} faces that no closed surface has "
        f"there: three or more, or two of opposite orientation; one is at "
        f"{place(vertices[ends])}"
    )


def _closed_note(holes: list[_Hole]) -> str:
    lengths = ", ".join(str(len(hole.rim)) for hole in holes[:8])
    if len(holes) == 1:
        return f"1 hole of {lengths} edges was closed"
    return f"{len(holes)} holes of {lengths}{', ...' if len(holes) > 8 else ''} edges were closed"


def _guess_note(guessed: float, at: str, apart: float) -> str:
    """Report the guessed share of a surface, and how much the volume depends on it."""
    share = max(100.0 * guessed, 1.0)
    note = f"{share:.0f} % of the surface, most around {at}, is a guess: there was no face"
    if apart <= _APART:
        return note
    return f"{note}; closed flat or curved, the volume differs by {100.0 * apart:.0f} %"


def _facing_notes(holes: list[_Hole]) -> list[str]:
    """Report pairs of holes that face each other like the ends of a broken handle."""
    most = max(hole.across for hole in holes)
    large = [hole for hole in holes if hole.across > _ALIKE * most]
    for index, one in enumerate(large):
        for other in large[:index]:
            apart = other.rim.mean(axis=0) - one.rim.mean(axis=0)
            far = max(float(np.linalg.norm(apart)), _TINY)
            widest, least = (pick(one.across, other.across) for pick in (max, min))
            looks = (_looking(one) @ apart / far, -(_looking(other) @ apart) / far)
            if min(looks) > _FACING and least > _ALIKE * widest and far < _GAP * widest:
                return [
                    f"the holes around {place(one.rim)} and {place(other.rim)} face each other and "
                    "were closed separately; if the object continues between them, join them in "
                    "a mesh editor"
                ]
    return []


def _apart_notes(vertices: Vertices, faces: Faces, holes: list[_Hole]) -> list[str]:
    """Report parts with holes that are beside each other."""
    part = parts(vertices, faces)
    large = [hole for hole in holes if hole.across > _LARGE * size(vertices)]
    of_vertex = np.zeros(len(vertices), dtype=np.int64)
    of_vertex[faces] = part[:, None]
    names = np.unique(of_vertex[[hole.loop[0] for hole in large]])
    boxes = [vertices[faces[part == name]].reshape(-1, 3) for name in names]
    lows, highs = ([pick(box, axis=0) for box in boxes] for pick in (np.min, np.max))
    slack = _INNER * size(vertices)
    beside = [
        not any(
            (low >= lows[other] - slack).all() and (high <= highs[other] + slack).all()
            for other in range(len(boxes))
            if other != index
        )
        for index, (low, high) in enumerate(zip(lows, highs, strict=True))
    ]
    if sum(beside) < 2:
        return []
    return [
        f"{sum(beside)} parts with holes were closed separately; if they belong together, "
        "join them in a mesh editor"
    ]


def _looking(hole: _Hole) -> NDArray[np.float64]:
    """Return the direction that points out of a hole."""
    out = normal(hole.rim)
    return out / max(float(np.linalg.norm(out)), _TINY)


def _slopes(
    vertices: Vertices, faces: Faces, edges: Edges
) -> dict[tuple[int, int], NDArray[np.float64]]:
    """Return, for each reversed open edge, the direction from it into its face."""
    at = np.flatnonzero(edges.is_open)
    ends = directed(faces)[at]
    third = faces[at % len(faces), (at // len(faces) + 2) % 3]
    along = vertices[ends[:, 1]] - vertices[ends[:, 0]]
    into = vertices[third] - vertices[ends[:, 0]]
    square = np.maximum((along**2).sum(axis=1, keepdims=True), _TINY)
    into -= along * ((along * into).sum(axis=1, keepdims=True) / square)
    into /= np.maximum(np.linalg.norm(into, axis=1, keepdims=True), _TINY)
    return {(b, a): way for (a, b), way in zip(ends.tolist(), into, strict=True)}


def _loops(edges: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Join the reversed open edges to loops that visit no vertex twice."""
    following: dict[int, list[int]] = defaultdict(list)
    for start, end in edges.tolist():
        following[end].append(start)
    loops = []
    for first in sorted(following):
        while following[first]:
            path, place = [first], {first: 0}
            while path:
                following_here = following[path[-1]]
                if not following_here:
                    break
                vertex = following_here.pop()
                if vertex in place:
                    loops.append(np.array(path[place[vertex] :], dtype=np.int64))
                    for left in path[place[vertex] + 1 :]:
                        del place[left]
                    del path[place[vertex] + 1 :]
                else:
                    place[vertex] = len(path)
                    path.append(vertex)
    return loops
