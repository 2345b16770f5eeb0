"""Small steps that close a triangle mesh, with notes on what they did."""

from collections import defaultdict, deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.words import counted, digits

Vertices = NDArray[np.float64]
Faces = NDArray[np.int64]

_WELD = 1e-7  # of the mesh's diagonal
_APART = 0.01  # of the mesh's diagonal: the least gap between parts that are away from each other
_MOST_PARTS = 500  # whose boxes are compared
_LEAST_AROUND = 4  # faces: the minimum with which a part can enclose another


def signed_volume(vertices: Vertices, faces: Faces) -> float:
    """Return the enclosed volume: positive if the faces point outward."""
    # Relative to the centre, so that a far origin costs no digits.
    a, b, c = (vertices[faces[:, corner]] - vertices.mean(axis=0) for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def size(vertices: Vertices) -> float:
    """Return the diagonal of the bounding box of vertices, (..., 3)."""
    return float(np.linalg.norm(np.ptp(vertices.reshape(-1, 3), axis=0)))


def area(vertices: Vertices, faces: Faces) -> float:
    """Return the area of all faces."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def labels(count: int, links: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return for each of `count` items the first item that links (L, 2) connect it to, (count,)."""
    label = np.arange(count)
    while len(links):
        # The first item of a group points to that of a lower group to which it is linked.
        one, other = label[links[:, 0]], label[links[:, 1]]
        low = np.minimum(one, other)
        np.minimum.at(label, one, low)
        np.minimum.at(label, other, low)
        while not np.array_equal(label, following := label[label]):
            label = following
        links = links[label[links[:, 0]] != label[links[:, 1]]]
    return label


def parts(vertices: Vertices, faces: Faces) -> NDArray[np.int64]:
    """Return the connected part to which each face belongs, (F,)."""
    links = np.concatenate([faces[:, :2], faces[:, 1:]])
    return labels(len(vertices), links)[faces[:, 0]]


def apart_note(vertices: Vertices, faces: Faces) -> str | None:
    """Report parts that stay away from each other, by their bounding boxes; None if all meet."""
    _, part = np.unique(parts(vertices, faces), return_inverse=True)
    count = int(part.max()) + 1
    if not 2 <= count <= _MOST_PARTS:
        return None
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, part, vertices[faces].min(axis=1))
    np.maximum.at(high, part, vertices[faces].max(axis=1))
    gap = _APART * size(vertices)
    meet = ((low[:, None] - gap <= high[None]) & (low[None] - gap <= high[:, None])).all(axis=2)
    groups = labels(count, np.argwhere(np.triu(meet, 1)))
    kinds = np.unique(groups)
    if len(kinds) == 1:
        return None
    places = [place(vertices[faces[groups[part] == kind]].reshape(-1, 3)) for kind in kinds[:3]]
    more = "" if len(kinds) <= len(places) else " and elsewhere"
    return (
        f"the mesh has {len(kinds)} parts that are away from each other, around "
        f"{', '.join(places)}{more}; if they are several objects, model each by itself"
    )


def weld(vertices: Vertices, faces: Faces) -> tuple[Vertices, Faces]:
    """Merge vertices at one position, and drop those that no face uses."""
    used, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    low = vertices.min(axis=0)
    cell = max(size(vertices) * _WELD, np.finfo(np.float64).tiny)
    cells = np.rint((vertices - low) / cell).astype(np.int64)
    _, first, place = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    # In the order of the file, so that a mesh that needs no repair is unchanged.
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return vertices[first[order]], rank[place.reshape(-1)][faces].astype(np.int64)


def drop(faces: Faces, notes: list[str]) -> Faces:
    """Drop faces with a repeated corner, and all but one of equal faces."""
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


def directed(faces: Faces) -> NDArray[np.int64]:
    """List the directed edges of all faces, (3 F, 2): first all first edges, then all second."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


@dataclass(frozen=True, eq=False)
class Edges:
    """The undirected edges of faces.

    `edge`: (3 F,) the edge of each directed edge. `users`: the number of faces at each edge.
    `balance`: the number of faces that traverse it one way minus the other.
    """

    edge: NDArray[np.intp]
    users: NDArray[np.intp]
    balance: NDArray[np.int64]

    @classmethod
    def of(cls, faces: Faces) -> "Edges":
        """Index the edges of faces, of which there must be some."""
        edges = directed(faces)
        key = edges.min(axis=1) * (int(faces.max()) + 1) + edges.max(axis=1)
        _, edge, users = np.unique(key, return_inverse=True, return_counts=True)
        way = np.where(edges[:, 0] < edges[:, 1], 1, -1)
        balance = np.zeros(len(users), dtype=np.int64)
        np.add.at(balance, edge, way)
        return cls(edge, users, balance)

    @property
    def is_open(self) -> NDArray[np.bool_]:
        """Whether each directed edge has no other face."""
        return (self.users == 1)[self.edge]

    @property
    def crowded(self) -> NDArray[np.intp]:
        """The edges whose faces cannot belong to a closed surface, even if holes were closed."""
        return np.flatnonzero((self.users >= 2) & (self.balance != 0))

    @property
    def pairs(self) -> NDArray[np.intp]:
        """The directed edges that two faces share, (P, 2)."""
        order, ends = np.argsort(self.edge, kind="stable"), np.cumsum(self.users)
        last = ends[self.users == 2]
        return np.stack([order[last - 2], order[last - 1]], axis=1)


def patches(faces: Faces) -> NDArray[np.int64]:
    """Return the patch of each face, (F,): faces are connected by edges that two faces share."""
    return labels(len(faces), Edges.of(faces).pairs % len(faces))


def wind(faces: Faces) -> Faces:
    """Flip faces so that neighbours have the same orientation; consistent faces are unchanged."""
    counts = Edges.of(faces)
    if not ((counts.users == 2) & (counts.balance != 0)).any():
        return faces
    pairs, edges = counts.pairs, directed(faces)
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
        if 2 * sum(flipped[face] for face in part) > len(
            part
        ):  # keep the orientation of the majority
            flipped.update((face, not flipped[face]) for face in part)
    turn = np.array([flipped[face] for face in range(len(faces))])
    return np.where(turn[:, None], faces[:, ::-1], faces)


def place(vertices: Vertices) -> str:
    """Format the centre of some vertices, in the mesh's own coordinates."""
    middle = vertices.mean(axis=0)
    unit = 1e-6 * max(float(np.abs(vertices).max()), np.finfo(np.float64).tiny)
    middle[np.abs(middle) < unit] = 0.0  # sums of symmetric values are rarely exactly zero
    return f"({', '.join(digits(x) for x in middle.tolist())})"


def outward(vertices: Vertices, faces: Faces, is_known: NDArray[np.bool_] | None = None) -> Faces:
    """Flip each connected part that points inward, unless it is a cavity of another part.

    Parts of which a face `is_known`, (F,), to point outward are unchanged.
    """
    _, part, sizes = np.unique(parts(vertices, faces), return_inverse=True, return_counts=True)
    corners = vertices[faces]
    low, high = (np.full((len(sizes), 3), end) for end in (np.inf, -np.inf))
    np.minimum.at(low, part, corners.min(axis=1))
    np.maximum.at(high, part, corners.max(axis=1))
    # Relative to the centre, so that a far origin costs no digits.
    a, b, c = (corners - vertices.mean(axis=0)).transpose(1, 0, 2)
    inward = np.bincount(part, np.einsum("ij,ij->i", a, np.cross(b, c))) < 0.0
    around_low, around_high = low[sizes >= _LEAST_AROUND], high[sizes >= _LEAST_AROUND]
    for one in np.flatnonzero(inward):
        inside = ((around_low < low[one]) & (around_high > high[one])).all(axis=1)
        inward[one] = not inside.any()
    if is_known is not None:
        inward[part[is_known]] = False
    return np.where(inward[part][:, None], faces[:, ::-1], faces)
