"""Drops duplicate and loose parts of a triangle mesh, and joins parts across cracks."""

import numpy as np
from numpy.typing import NDArray

from servoid.exchange.shapes.mesh_repair import (
    Edges,
    Faces,
    Vertices,
    area,
    directed,
    drop,
    labels,
    parts,
    patches,
    place,
    signed_volume,
    size,
)
from servoid.words import counted, measured

_TWIN_FACES = 12  # from which on a duplicate part is no accident
_TWIN = 0.01  # of a part's diagonal, by which its copy may be shifted
_TWIN_REACH = 2.0 * _TWIN  # search radius for a corner of its copy
_WITHIN = 0.5  # of its volume over its area, likewise: fins beside each other are not copies
_RIGID = 1e-4  # of a part's diagonal, tolerance within which all of its corners have the same shift
_SEAM = 5e-4  # of the mesh's diagonal, across which a crack is closed
_SEAM_EDGE = 0.25  # of the shortest open edge there, likewise, so that faces do not collapse
_TRIES = 5  # to exclude corners that would crowd an edge
_SPANS = 0.5  # of the mesh's diagonal: a closed part of this size is the object
# Hardly two vertices of a plane have the same coordinate along this direction.
_OBLIQUE = np.array([0.4923, 0.5943, 0.6359])


def without_twins(vertices: Vertices, faces: Faces, notes: list[str]) -> Faces:
    """Drop each part that is a copy of another, with a small shift for its size and thickness."""
    _, first, part, counts = np.unique(
        parts(vertices, faces), return_index=True, return_inverse=True, return_counts=True
    )
    corners = vertices[faces]
    own = np.split(np.argsort(part, kind="stable"), np.cumsum(counts)[:-1])
    whole = np.flatnonzero(counts >= _TWIN_FACES)
    # In the order of the file: the first copy is kept.
    whole = whole[np.argsort(first[whole])]
    reach = np.array([_TWIN_REACH * size(corners[own[name]]) for name in whole])
    pairs = np.sort(_close_pairs(corners[first[whole], 0], reach), axis=1)
    dropped: set[int] = set()
    for one, other in whole[pairs[np.lexsort((pairs[:, 0], pairs[:, 1]))]].tolist():
        if one in dropped or other in dropped or counts[one] != counts[other]:
            continue
        twin = corners[own[other]].reshape(-1, 3)
        shift = _shift(twin, corners[own[one]].reshape(-1, 3))
        if shift is not None:
            dropped.add(other)
            notes.append(
                f"a part of {counted(int(counts[other]), 'face')} was there twice, "
                f"{measured(shift)} m apart, around {place(twin)}: one was dropped"
            )
    return faces[~np.isin(part, list(dropped))] if dropped else faces


def _shift(corners: Vertices, others: Vertices) -> float | None:
    """Return how far a part is shifted relative to another; None if they differ."""
    diagonal = size(others)
    shifts = corners - others
    shift = shifts.mean(axis=0)
    far = float(np.linalg.norm(shift))
    if far > _TWIN * diagonal or np.abs(shifts - shift).max() > _RIGID * diagonal:
        return None
    own = np.arange(len(others)).reshape(-1, 3)
    volume = abs(signed_volume(others - others.mean(axis=0), own))
    return far if far * area(others, own) <= _WITHIN * volume else None


def join_seams(vertices: Vertices, faces: Faces, notes: list[str]) -> tuple[Vertices, Faces]:
    """Merge vertices at open edges that are separated by a small crack.

    Vertices are not merged if three faces would then meet at an edge.
    """
    links = _seams(vertices, faces)
    if not len(links):
        return vertices, faces
    crowd = _crowd(faces)
    joined, one = faces, np.arange(len(vertices))
    for _ in range(_TRIES):
        one = labels(len(vertices), links)
        joined = drop(one[faces], [])
        if not len(joined):
            return vertices, faces
        wrong = np.setdiff1d(_crowd(joined), one[crowd])
        if not len(wrong):
            break
        links = links[~np.isin(one[links], wrong).any(axis=1)]
    else:
        return vertices, faces
    if not len(links):
        return vertices, faces
    members = np.bincount(one, minlength=len(vertices))[:, None]
    middles = np.zeros_like(vertices)
    np.add.at(middles, one, vertices)
    middles = np.where(members > 0, middles / np.maximum(members, 1), vertices)
    apart = 2.0 * float(np.linalg.norm(vertices - middles[one], axis=1).max())
    notes.append(
        f"{len(np.unique(links))} corners at open edges, up to {apart:.2g} m apart, were joined"
    )
    return middles, joined


def _seams(vertices: Vertices, faces: Faces) -> NDArray[np.int64]:
    """Find the pairs (P, 2) of vertices at open edges that a crack may separate."""
    open_edges = directed(faces)[Edges.of(faces).is_open]
    long = np.linalg.norm(vertices[open_edges[:, 0]] - vertices[open_edges[:, 1]], axis=1)
    reach = np.full(len(vertices), _SEAM * size(vertices))
    for end in (0, 1):
        np.minimum.at(reach, open_edges[:, end], _SEAM_EDGE * long)
    near = np.unique(open_edges)
    return near[_close_pairs(vertices[near], reach[near])]


def _crowd(faces: Faces) -> NDArray[np.int64]:
    """Find the vertices of edges at which three or more faces meet."""
    edges = Edges.of(faces)
    return np.unique(directed(faces)[(edges.users > 2)[edges.edge]])


def _close_pairs(points: Vertices, reach: NDArray[np.float64]) -> NDArray[np.int64]:
    """Find the pairs (P, 2) of points that are within the reach of both."""
    along = points @ _OBLIQUE
    order = np.argsort(along, kind="stable")
    points, along, reach = points[order], along[order], reach[order]
    found = [np.empty((0, 2), dtype=np.int64)]
    left = np.arange(len(points))
    step = 0
    while True:
        step += 1
        left = left[left + step < len(points)]
        left = left[along[left + step] - along[left] <= reach[left]]
        if not len(left):
            return np.concatenate(found)
        apart = np.linalg.norm(points[left + step] - points[left], axis=1)
        near = left[apart <= np.minimum(reach[left], reach[left + step])]
        found.append(np.stack([order[near], order[near + step]], axis=1))


def loose(vertices: Vertices, faces: Faces) -> NDArray[np.bool_]:
    """Return which faces are sheets beside a closed surface, such as fins and walls, (F,).

    Patches with an open edge are removed repeatedly. If the remainder does not span the mesh, none
    is loose: then the object itself is open.
    """
    kept = np.arange(len(faces))
    while len(kept):
        edges = Edges.of(faces[kept])
        is_open = edges.is_open.reshape(3, -1).any(axis=0)
        if not is_open.any():
            break
        patch = patches(faces[kept])
        kept = kept[~np.isin(patch, patch[is_open])]
    gone = np.ones(len(faces), dtype=bool)
    gone[kept] = False
    if not len(kept) or size(vertices[faces[kept]]) < _SPANS * size(vertices):
        return np.zeros(len(faces), dtype=bool)
    return gone
