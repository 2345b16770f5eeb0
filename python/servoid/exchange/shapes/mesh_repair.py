"""The steps that close a triangle mesh where that takes little, and say what they did."""

from collections import defaultdict, deque

import numpy as np
from numpy.typing import NDArray

from servoid.errors import MeshError
from servoid.words import counted, digits

Vertices = NDArray[np.float64]
Faces = NDArray[np.int64]

_WELD = 1e-7  # of the mesh's diagonal
_LARGEST_HOLE = 0.15  # across, of the mesh's diagonal
_LEAST_AROUND = 4  # faces, of which a part can enclose another


def signed_volume(vertices: Vertices, faces: Faces) -> float:
    """Measure the enclosed volume: positive if the faces look outward."""
    # Around the middle, lest a far origin cost digits.
    a, b, c = (vertices[faces[:, corner]] - vertices.mean(axis=0) for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def labels(count: int, links: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return for each of some things the first of those that links (L, 2) join it to, (count,)."""
    label = np.arange(count)
    while True:
        before = label.copy()
        low = label[links].min(axis=1)
        for end in (0, 1):
            np.minimum.at(label, links[:, end], low)
        label = label[label]
        if (label == before).all():
            return label


def parts(vertices: Vertices, faces: Faces) -> NDArray[np.int64]:
    """Return to which connected part each face belongs, (F,)."""
    links = np.concatenate([faces[:, :2], faces[:, 1:]])
    return labels(len(vertices), links)[faces[:, 0]]


def weld(vertices: Vertices, faces: Faces) -> tuple[Vertices, Faces]:
    """Make vertices at one place one vertex, and leave out those that no face uses."""
    used, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    low = vertices.min(axis=0)
    cell = max(float(np.linalg.norm(np.ptp(vertices, axis=0))) * _WELD, np.finfo(np.float64).tiny)
    cells = np.rint((vertices - low) / cell).astype(np.int64)
    _, first, place = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    # In the order of the file, so that a mesh that needs nothing is left as it is.
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return vertices[first[order]], rank[place.reshape(-1)][faces].astype(np.int64)


def drop(faces: Faces, notes: list[str]) -> Faces:
    """Drop faces with a corner that is there twice, and all but one of equal faces."""
    corners = np.sort(faces, axis=1)
    whole = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2])
    faces, corners = faces[whole], corners[whole]
    if not whole.all():
        count = int((~whole).sum())
        dropped = "was dropped" if count == 1 else "were dropped"
        notes.append(f"{counted(count, 'face')} without area {dropped}")
    _, first = np.unique(corners, axis=0, return_index=True)
    if len(first) < len(faces):
        double = len(faces) - len(first)
        notes.append(f"{counted(double, 'double face was', 'double faces were')} dropped")
    return faces[np.sort(first)]


def _directed(faces: Faces) -> NDArray[np.int64]:
    """List the directed edges of all faces, (3 F, 2): first all first edges, then all second."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def _edge_counts(
    faces: Faces,
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.int64]]:
    """Find the undirected edge of each directed one, how many use each, and their balance."""
    edges = _directed(faces)
    key = edges.min(axis=1) * (int(faces.max()) + 1) + edges.max(axis=1)
    _, edge, users = np.unique(key, return_inverse=True, return_counts=True)
    way = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    balance = np.zeros(len(users), dtype=np.int64)
    np.add.at(balance, edge, way)
    return edge, users, balance


def _pairs(edge: NDArray[np.intp], users: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the directed edges that two faces share, (P, 2)."""
    order, ends = np.argsort(edge, kind="stable"), np.cumsum(users)
    return np.stack([order[ends[users == 2] - 2], order[ends[users == 2] - 1]], axis=1)


def patches(faces: Faces) -> NDArray[np.int64]:
    """Return to which patch each face belongs, (F,): faces that are joined by edges of two."""
    edge, users, _ = _edge_counts(faces)
    return labels(len(faces), _pairs(edge, users) % len(faces))


def wind(faces: Faces) -> Faces:
    """Turn faces so that neighbours look to the same side; faces that agree stay as they are."""
    edge, users, balance = _edge_counts(faces)
    if not ((users == 2) & (balance != 0)).any():
        return faces
    pairs = _pairs(edge, users)
    edges = _directed(faces)
    agree = edges[pairs[:, 0], 0] != edges[pairs[:, 1], 0]
    neighbours: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for (one, other), same in zip((pairs % len(faces)).tolist(), agree.tolist(), strict=True):
        neighbours[one].append((other, same))
        neighbours[other].append((one, same))
    flipped: dict[int, bool] = {}
    for start in range(len(faces)):
        if start in flipped:
            continue
        flipped[start] = False
        part, queue = [start], deque([start])
        while queue:
            face = queue.popleft()
            for other, same in neighbours[face]:
                if other not in flipped:
                    flipped[other] = flipped[face] != (not same)
                    part.append(other)
                    queue.append(other)
        if 2 * sum(flipped[face] for face in part) > len(part):  # the majority stays
            flipped.update((face, not flipped[face]) for face in part)
    turn = np.array([flipped[face] for face in range(len(faces))])
    return np.where(turn[:, None], faces[:, ::-1], faces)


def fill(vertices: Vertices, faces: Faces, notes: list[str]) -> tuple[Vertices, Faces]:
    """Close small holes, each with a fan around its middle."""
    edge, users, balance = _edge_counts(faces)
    if not balance.any():
        return vertices, faces
    crowded = np.flatnonzero((users >= 2) & (balance != 0))
    if len(crowded):
        ends = _directed(faces)[edge == crowded[0]][0]
        raise MeshError(
            f"{counted(len(crowded), 'edge has', 'edges have')} faces that no closed surface has "
            f"there: three or more, or two that look to different sides; one is at "
            f"{place(vertices[ends])}"
        )
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    loops = _loops(_directed(faces)[(users == 1)[edge]])
    across = [float(np.linalg.norm(np.ptp(vertices[loop], axis=0))) for loop in loops]
    worst = int(np.argmax(across))
    if across[worst] > _LARGEST_HOLE * size:
        raise MeshError(
            f"the mesh is open: it has {counted(len(loops), 'hole')}, the largest with "
            f"{counted(len(loops[worst]), 'edge')} and {across[worst]:.3g} m across, around "
            f"{place(vertices[loops[worst]])}"
        )
    new_vertices, new_faces = [vertices], [faces]
    for index, loop in enumerate(loops):
        middle = np.full(len(loop), len(vertices) + index)
        new_vertices.append(vertices[loop].mean(axis=0, keepdims=True))
        new_faces.append(np.stack([loop, np.roll(loop, -1), middle], axis=1))
    lengths = ", ".join(str(len(loop)) for loop in loops[:8]) + (", ..." if len(loops) > 8 else "")
    notes.append(
        f"1 hole of {lengths} edges was closed"
        if len(loops) == 1
        else f"{len(loops)} holes of {lengths} edges were closed"
    )
    return np.concatenate(new_vertices), np.concatenate(new_faces)


def place(vertices: Vertices) -> str:
    """Write where the middle of some vertices is, in the mesh's own coordinates."""
    middle = vertices.mean(axis=0)
    unit = 1e-6 * max(float(np.abs(vertices).max()), np.finfo(np.float64).tiny)
    middle[np.abs(middle) < unit] = 0.0  # sums of what is symmetric are hardly ever zero
    return f"({', '.join(digits(x) for x in middle.tolist())})"


def _loops(edges: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Join the open edges, each turned around, to loops that pass no vertex twice."""
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


def outward(vertices: Vertices, faces: Faces) -> Faces:
    """Turn each connected part whose faces look inward, unless it is a cavity of another part."""
    _, part, sizes = np.unique(parts(vertices, faces), return_inverse=True, return_counts=True)
    corners = vertices[faces]
    low, high = (np.full((len(sizes), 3), end) for end in (np.inf, -np.inf))
    np.minimum.at(low, part, corners.min(axis=1))
    np.maximum.at(high, part, corners.max(axis=1))
    # Around the middle, lest a far origin cost digits.
    a, b, c = (corners - vertices.mean(axis=0)).transpose(1, 0, 2)
    inward = np.bincount(part, np.einsum("ij,ij->i", a, np.cross(b, c))) < 0.0
    around_low, around_high = low[sizes >= _LEAST_AROUND], high[sizes >= _LEAST_AROUND]
    for one in np.flatnonzero(inward):
        inside = ((around_low < low[one]) & (around_high > high[one])).all(axis=1)
        inward[one] = not inside.any()
    return np.where(inward[part][:, None], faces[:, ::-1], faces)
