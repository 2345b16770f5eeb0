"""The surface of the union of a body's ellipsoids, as one closed mesh."""

from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from servoid._native import Pose
from servoid.errors import ExportError, MissingExtraError
from servoid.exchange.export.solid import Piece

if TYPE_CHECKING:
    from manifold3d import Mesh64

DEFAULT_DETAIL = 4
MOST_DETAIL = 6
_MERGED_M = 2e-8  # readers take vertices that are nearer than 1e-8 m for one
_ATTEMPTS, _TURN_RAD = 8, 0.1  # of which the first suffices but for one body in a hundred or fewer

Points = NDArray[np.float64]
Faces = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Surface:
    """A closed mesh, its faces counterclockwise from outside.

    `vertices` (V, 3) float64 in metres, `faces` (F, 3) int64, `owners` (F,) int64: the ellipsoid of
    each face, in ascending order.
    """

    vertices: Points
    faces: Faces
    owners: NDArray[np.int64]

    def shortest_edge(self) -> float:
        """Return the length of the shortest edge, in metres."""
        corners = self.vertices[self.faces]
        return float(np.sqrt(((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).min()))

    def vertex_colors(self, pieces: tuple[Piece, ...]) -> NDArray[np.float64]:
        """Return colours (V, 3) from 0 to 255; on a seam, the mean of the adjacent faces."""
        colors = np.array([piece.color for piece in pieces], np.float64)[self.owners]
        sums = np.zeros_like(self.vertices)
        counts = np.zeros(len(self.vertices))
        for corner in self.faces.T:
            np.add.at(sums, corner, colors)
            np.add.at(counts, corner, 1.0)
        return sums / counts[:, None]

    def vertex_normals(self) -> NDArray[np.float64]:
        """Return outward unit normals (V, 3), the area-weighted mean of the faces' normals."""
        first, second, third = (self.vertices[corner] for corner in self.faces.T)
        areas = np.cross(second - first, third - first)
        sums = np.zeros_like(self.vertices)
        for corner in self.faces.T:
            np.add.at(sums, corner, areas)
        lengths = np.linalg.norm(sums, axis=1, keepdims=True)
        return np.where(lengths > 0.0, sums / np.where(lengths > 0.0, lengths, 1.0), [0, 0, 1.0])


def check_libraries() -> None:
    """Check that the libraries behind meshes are installed.

    Raises:
        MissingExtraError: one is not.

    """
    for library in ("trimesh", "manifold3d"):
        if find_spec(library) is None:
            raise MissingExtraError.of("meshes", library, "exchange")


@lru_cache
def ball(detail: int) -> tuple[Points, Faces]:
    """Return vertices and faces of a polyhedron near the unit ball, with the ball's volume."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=detail)
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    corners = vertices[faces]
    volume = np.linalg.det(corners).sum() / 6.0
    return vertices * (4.0 / 3.0 * np.pi / volume) ** (1.0 / 3.0), faces


def union_surface(pieces: tuple[Piece, ...], detail: int) -> Surface:
    """Join the ellipsoids, each a polyhedron of its volume and 20 * 4**detail faces.

    Where two polyhedra meet within nanometres of a vertex, readers merge the ends of that edge, and
    the surface is closed no more; then the polyhedra are turned within their ellipsoids.

    Raises:
        ExportError: the polyhedra cannot be joined.

    """
    best = _union(pieces, detail, 0.0)
    for attempt in range(1, _ATTEMPTS):
        if best.shortest_edge() >= _MERGED_M:
            break
        turned = _union(pieces, detail, _TURN_RAD * attempt)
        best = max(best, turned, key=Surface.shortest_edge)
    return best


def _union(pieces: tuple[Piece, ...], detail: int, turn_rad: float) -> Surface:
    import manifold3d

    vertices, faces = ball(detail)
    vertices = Pose.from_rvec_tvec((turn_rad,) * 3, (0.0,) * 3).transform(vertices)
    centers = np.array([piece.center for piece in pieces])
    middle = centers.mean(axis=0)
    reach = max(float(np.abs(centers - middle).max()), *(piece.radii.max() for piece in pieces))
    first_id = manifold3d.Manifold.reserve_ids(len(pieces))
    solids = []
    for index, piece in enumerate(pieces):
        # Scaled to about 1, the size for which the library's tolerances are designed.
        points = (vertices @ piece.factor.T + piece.center - middle) / reach
        mesh = manifold3d.Mesh64(
            vert_properties=np.ascontiguousarray(points),
            tri_verts=faces.astype(np.uint64),
            run_index=np.array([0, faces.size], np.uint64),
            run_original_id=np.array([first_id + index], np.uint32),
        )
        solids.append(manifold3d.Manifold(mesh))
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    if union.status() != manifold3d.Error.NoError or union.is_empty():
        raise ExportError(
            f"the surfaces of the ellipsoids cannot be joined ({union.status()}); are some of "
            "their radii a tiny share of the others?"
        )
    return _read(union.to_mesh64(), first_id, middle, reach)


def _read(mesh: "Mesh64", first_id: int, middle: Points, reach: float) -> Surface:
    faces = np.asarray(mesh.tri_verts, np.int64)
    lengths = np.diff(np.asarray(mesh.run_index, np.int64)) // 3
    ids = np.asarray(mesh.run_original_id, np.int64) - first_id
    owners = np.repeat(ids, lengths)
    order = np.argsort(owners, kind="stable")
    vertices = np.asarray(mesh.vert_properties, np.float64)[:, :3] * reach + middle
    return Surface(vertices, faces[order], owners[order])
