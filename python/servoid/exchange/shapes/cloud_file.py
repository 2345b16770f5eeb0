"""Reads point clouds from PLY files."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.config import SHAPE_FILE, read_bytes
from servoid.errors import MeshError
from servoid.exchange.shapes.ply_header import PlyElement, PlyHeader, read_ply_header
from servoid.exchange.units import check_unit
from servoid.words import counted, digits, were

_XYZ = ("x", "y", "z")
_NORMAL = ("nx", "ny", "nz")
_LONGEST_NUMBER = 64
_COLORS = (
    ("red", "green", "blue"),
    ("r", "g", "b"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
)
_SINGLE = 1e-6  # rounding of a coordinate, relative to it, or in metres


@dataclass(frozen=True)
class CloudFile:
    """A point cloud: its finite points, and the notes from reading it.

    `points`: (N, 3) float64, metres. `normals`: (N, 3) float64, of length 1, or zero where the file
    has none; None if it has none at all. `colors`: (N, 3) uint8, RGB, or None.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64] | None
    colors: NDArray[np.uint8] | None
    notes: tuple[str, ...]


def is_cloud(path: Path) -> bool:
    """Return whether a file is a PLY file with points and without faces.

    Raises:
        MeshError: the file cannot be read, or it is a PLY file with a damaged header.

    """
    data = read_bytes(path, MeshError, SHAPE_FILE)
    if not data.startswith(b"ply"):
        return False
    header = read_ply_header(path, data)
    faces = [header.element(name) for name in ("face", "tristrips")]
    return header.element("vertex") is not None and not any(one and one.count for one in faces)


def read_cloud(
    path: Path, viewpoint: Sequence[float] | None = None, unit_m: float = 1.0
) -> CloudFile:
    """Read a point cloud from a PLY file, in text or in either byte order.

    Points that are not finite are dropped, and so are those at the `viewpoint`, (3,) metres, which
    depth cameras write where they measured nothing; notes report it. Faces are ignored. `unit_m` is
    the length in metres of one unit of the file.

    Raises:
        MeshError: the file is missing or damaged, its header promises more than it contains, it has
            no points, more than half of them are not finite or at the viewpoint, its normals
            have no length and there is no viewpoint, or the unit is not a positive number.

    """
    check_unit(path, unit_m, MeshError)
    data = read_bytes(path, MeshError, SHAPE_FILE)
    header = read_ply_header(path, data)
    rows = _vertex_rows(path, data, header)
    missing = [name for name in _XYZ if name not in rows]
    if missing:
        raise MeshError(
            f"{path}: the points have no {', '.join(missing)}; they have {', '.join(rows)}"
        )
    points = unit_m * _columns(rows, _XYZ)
    finite = np.asarray(np.isfinite(points).all(axis=1))
    if 2 * int(finite.sum()) < len(points) or not finite.any():
        raise MeshError(
            f"{path}: {len(points) - int(finite.sum())} of {len(points)} points are not finite; "
            "at least half must be, so export the cloud without invalid points"
        )
    notes = []
    if not finite.all():
        bad = int((~finite).sum())
        notes.append(f"{bad} of {len(points)} points {were(bad)} not finite and dropped")
    kept = finite
    if viewpoint is not None:
        kept = _measured_from(path, points, finite, viewpoint)
        lost = int(finite.sum() - kept.sum())
        notes += [] if lost == 0 else [f"{_lost_note(lost, len(points), viewpoint)}, and dropped"]
    if header.element("face") is not None:
        notes.append("the faces were ignored")
    normals = _read_normals(rows)
    if normals is not None and viewpoint is None and not normals[kept].any():
        raise MeshError(
            f"{path}: the normals of all {counted(int(kept.sum()), 'point')} have no length, so "
            "the outside of the surface is unknown; give the position from which the cloud was "
            "seen with --viewpoint X,Y,Z, or save it with normals"
        )
    colors = _read_colors(rows)
    return CloudFile(
        points=points[kept],
        normals=None if normals is None else normals[kept],
        colors=None if colors is None else colors[kept],
        notes=tuple(notes),
    )


def _measured_from(
    path: Path,
    points: NDArray[np.float64],
    finite: NDArray[np.bool_],
    viewpoint: Sequence[float],
) -> NDArray[np.bool_]:
    """Return which of the finite points are not at the viewpoint, at least half of all."""
    place = np.asarray(viewpoint, np.float64)
    off = np.abs(points - place)
    # A file may have the coordinates in single precision.
    kept = finite & (off > _SINGLE * np.maximum(1.0, np.abs(place))).any(axis=1)
    if 2 * int(kept.sum()) < len(points):
        lost = int(finite.sum() - kept.sum())
        raise MeshError(
            f"{path}: {_lost_note(lost, len(points), viewpoint)}; at least half of all points must "
            "be measurements, so export the cloud without invalid points"
        )
    return kept


def _lost_note(lost: int, count: int, viewpoint: Sequence[float]) -> str:
    place = ", ".join(digits(one) for one in viewpoint)
    return (
        f"{lost} of {count} points {were(lost)} at the viewpoint ({place}), as invalid "
        "measurements are"
    )


def _vertex_rows(path: Path, data: bytes, header: PlyHeader) -> dict[str, NDArray[np.generic]]:
    """Read the values of each scalar property of the points."""
    vertex = header.element("vertex")
    if vertex is None or vertex.count == 0 or not vertex.properties:
        raise MeshError(f"{path} has no points: its header has no element 'vertex' with rows")
    before = header.elements[: header.elements.index(vertex)]
    for element in (*before, vertex):
        for one in element.properties:
            if one.length_code is not None and element.count:
                raise MeshError(
                    f"{path}: the list '{one.name}' of '{element.name}' is before the end of "
                    "the points, which is not supported; export plain points"
                )
    if header.order:
        start = header.size + sum(one.count * _dtype(one, "<").itemsize for one in before)
        table = np.frombuffer(data, _dtype(vertex, header.order), vertex.count, start)
        return {one.name: table[f"{index}"] for index, one in enumerate(vertex.properties)}
    values = _read_text(path, data[header.size :], sum(one.count for one in before), vertex)
    columns: dict[str, NDArray[np.generic]] = {}
    for index, one in enumerate(vertex.properties):
        column = values[:, index]
        whole = one.code[0] in "iu" and np.isfinite(column).all()
        columns[one.name] = (
            np.clip(column, -(2.0**62), 2.0**62).astype(np.int64) if whole else column
        )
    return columns


def _dtype(element: PlyElement, order: str) -> np.dtype[np.void]:
    # Fields are named by number: two properties of a file may have the same name.
    return np.dtype(
        [(f"{index}", f"{order}{one.code}") for index, one in enumerate(element.properties)]
    )


def _read_text(path: Path, body: bytes, skip: int, vertex: PlyElement) -> NDArray[np.float64]:
    lines = [line for line in body.splitlines() if line.strip()][skip : skip + vertex.count]
    if len(lines) < vertex.count:
        raise MeshError(
            f"{path}: the header promises {counted(vertex.count, 'point')}, but "
            f"{counted(len(lines), 'line follows', 'lines follow')}; "
            "the file is cut short, copy it again"
        )
    width = len(vertex.properties)
    rows = [line.split() for line in lines]
    for number, row in enumerate(rows, start=1):
        if len(row) != width:
            raise MeshError(
                f"{path}, point {number}: {counted(len(row), 'value was', 'values were')} given, "
                f"not {width}"
            )
        # A NumPy array of strings is as wide as its longest string.
        if max(map(len, row)) > _LONGEST_NUMBER:
            raise MeshError(f"{path}, point {number}: a value is too long to be a number")
    try:
        return np.array(rows).astype(np.float64)
    except ValueError as reason:
        raise MeshError(f"{path}: a value of a point is not a number ({reason})") from reason


def _columns(rows: dict[str, NDArray[np.generic]], names: tuple[str, ...]) -> NDArray[np.float64]:
    with np.errstate(invalid="ignore"):  # a signalling NaN warns; like any NaN it is not finite
        return np.stack([rows[name].astype(np.float64) for name in names], axis=1)


def _read_normals(rows: dict[str, NDArray[np.generic]]) -> NDArray[np.float64] | None:
    if not all(name in rows for name in _NORMAL):
        return None
    normals = _columns(rows, _NORMAL)
    normals[~np.isfinite(normals).all(axis=1)] = 0.0
    # Divide by the largest component first, so that squares do not overflow.
    largest = np.abs(normals).max(axis=1, keepdims=True)
    normals = np.divide(normals, largest, out=np.zeros_like(normals), where=largest > 0.0)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, length, out=np.zeros_like(normals), where=length > 0.0)


def _read_colors(rows: dict[str, NDArray[np.generic]]) -> NDArray[np.uint8] | None:
    for names in _COLORS:
        if all(name in rows for name in names):
            colors = np.nan_to_num(_columns(rows, names), nan=0.0, posinf=255.0, neginf=0.0)
            whole = all(np.issubdtype(rows[name].dtype, np.integer) for name in names)
            if not whole and colors.max(initial=0.0) <= 1.0:
                colors = colors * 255.0
            return np.clip(np.rint(colors), 0, 255).astype(np.uint8)
    return None
