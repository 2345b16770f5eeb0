"""Closes one hole of a triangle mesh with a patch, flat or curved like the surrounding surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.exchange.shapes.mesh_repair import Faces, Vertices, signed_volume, size

_SAMPLES = 256  # of a rim
_WAVES = 6  # around a rim, the maximum for its slope: finer ones are noise of the triangles
_CURVED_FROM = 12  # edges of a rim: fewer do not determine the slope
_ROUND = 0.2  # ratio of the area to that of a circle of the same length: less is a slit
_EDGES_A_RING = 6  # of the rim, per ring of new vertices between it and the centre
_MOST_RINGS = 16
# A rim is a cut if its vertices are in a plane: with an RMS distance of at most the first share of
# its width, as in drawn meshes, or of the second, as in scans, if the surface is within 30 degrees
# of perpendicular to the plane.
_DRAWN = 1e-3
_IN_PLANE = 0.04
_UPRIGHT = float(np.cos(np.radians(30.0)))


@dataclass(frozen=True, eq=False)
class Patch:
    """The patch of a hole: new vertices, and faces that number them from a given index.

    `apart` is the volume, in cubic metres, by which a curved patch encloses more than a flat one,
    and `is_curved` states which kind it is.
    """

    vertices: Vertices
    faces: Faces
    apart: float
    is_curved: bool


def patch(
    rim: Vertices, slopes: Vertices, loop: NDArray[np.int64], first: int, *, curved: bool
) -> Patch:
    """Close the hole in a rim (N, 3) with the vertex indices `loop`; new ones start at `first`.

    `slopes` (N, 3) are unit vectors, one for each edge from a vertex of the rim to the next: from
    the edge away from the hole, along the surface. The harmonic function on the disc with the rim's
    positions is a flat patch. The biharmonic one with its positions and slopes continues the
    surrounding surface. Rims of few edges, and slits, always get a flat patch.
    """
    places, ways, angles, length = _sampled(rim, slopes)
    waves = np.abs(_wave_numbers())
    flat = np.fft.fft(places, axis=0) / _SAMPLES
    # On the unit circle, steps outward and along it have the same scale.
    slope = np.fft.fft(_smooth(ways) * (length / (2.0 * np.pi)), axis=0) / _SAMPLES
    bent = np.where(waves <= _WAVES, 0.5 * (slope - waves * flat), 0.0)
    rings = int(np.clip(len(rim) // _EDGES_A_RING, 1, _MOST_RINGS))
    faces = _disc(len(rim), rings)
    level = _inside(flat, np.zeros_like(bent), angles, rings)
    name = np.concatenate([loop, first + np.arange(len(level))])
    if len(rim) < _CURVED_FROM or not _is_round(rim, length):
        return Patch(level, name[faces], 0.0, is_curved=False)
    domed = _inside(flat, bent, angles, rings)
    apart = _more(rim, domed, level, faces)
    return Patch(domed if curved else level, name[faces], apart, is_curved=curved)


def are_cuts(rims: list[Vertices], slopes: list[Vertices]) -> list[bool]:
    """Return which rims were cut by a plane: where the object stood, was cut off or is open.

    Such a rim is in a plane, and the surface is perpendicular to it there, or at another rim in
    that plane.
    """
    cuts = [_is_cut(rim, ways) for rim, ways in zip(rims, slopes, strict=True)]
    planes = [rim for rim, cut in zip(rims, cuts, strict=True) if cut]
    return [
        cut or any(_off_plane(rim, of) <= _IN_PLANE * size(of) for of in planes)
        for rim, cut in zip(rims, cuts, strict=True)
    ]


def _is_cut(rim: Vertices, slopes: Vertices) -> bool:
    up = normal(rim)
    off = _off_plane(rim, rim)
    if len(rim) < _CURVED_FROM or not up.any() or off > _IN_PLANE * size(rim):
        return False
    if off <= _DRAWN * size(rim):
        return True
    ways = _smooth(_sampled(rim, slopes)[1])
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    return bool(abs((ways @ up).mean()) >= _UPRIGHT * np.linalg.norm(up))


def _off_plane(rim: Vertices, of: Vertices) -> float:
    """Return the RMS distance of a rim from the plane of another."""
    up = normal(of)
    length = max(float(np.linalg.norm(up)), float(np.finfo(np.float64).tiny))
    return float(np.sqrt((((rim - of.mean(axis=0)) @ (up / length)) ** 2).mean()))


def _sampled(
    rim: Vertices, slopes: Vertices
) -> tuple[Vertices, Vertices, NDArray[np.float64], float]:
    """Sample the rim at even steps.

    Return the positions and slopes there, the angle of each vertex and the rim's length.
    """
    steps = np.linalg.norm(np.roll(rim, -1, axis=0) - rim, axis=1)
    ends = np.cumsum(steps)
    length = max(float(ends[-1]), float(np.finfo(np.float64).tiny))
    along = np.linspace(0.0, length, _SAMPLES, endpoint=False)
    around = np.concatenate([[0.0], ends])
    closed = np.concatenate([rim, rim[:1]])
    places = np.column_stack([np.interp(along, around, closed[:, axis]) for axis in range(3)])
    edge = np.minimum(np.searchsorted(ends, along, side="right"), len(rim) - 1)
    return places, slopes[edge], 2.0 * np.pi * around[:-1] / length, length


def _wave_numbers() -> NDArray[np.float64]:
    """Return the wave number of each term of a Fourier series on a rim, (S, 1)."""
    return np.fft.fftfreq(_SAMPLES, 1.0 / _SAMPLES).astype(np.float64)[:, None]


def _smooth(ways: Vertices) -> Vertices:
    """Filter out what varies faster along a rim than its slopes may."""
    series = np.fft.fft(ways, axis=0)
    series[np.abs(_wave_numbers())[:, 0] > _WAVES] = 0.0
    return np.fft.ifft(series, axis=0).real


def _inside(
    flat: NDArray[np.complex128],
    bent: NDArray[np.complex128],
    angles: NDArray[np.float64],
    rings: int,
) -> Vertices:
    """Return the vertices of all inner rings, from outside to inside, and the centre.

    Wave m of the rim's positions decays to the radius r as r^m, and that of its slopes as r^m -
    r^(m + 2): these are the harmonic and biharmonic functions of the disc.
    """
    turned = np.exp(1j * np.outer(angles, _wave_numbers()))
    order = np.abs(_wave_numbers())
    radii = 1.0 - np.arange(1, rings) / rings
    layers = [(turned @ ((flat - bent) * r**order + bent * r ** (order + 2.0))).real for r in radii]
    return np.concatenate([*layers, (flat - bent)[:1].real])


def _disc(edges: int, rings: int) -> Faces:
    """Connect rings of vertices, and the centre, which comes last, by triangles."""
    ring, here = np.meshgrid(np.arange(rings - 1), np.arange(edges), indexing="ij")
    beside = (here + 1) % edges
    a, b = (ring * edges + here).ravel(), (ring * edges + beside).ravel()
    c, d = a + edges, b + edges
    last = (rings - 1) * edges + np.arange(edges)
    fan = np.stack([last, np.roll(last, -1), np.full(edges, rings * edges)], axis=1)
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1), fan])


def _more(rim: Vertices, one: Vertices, other: Vertices, faces: Faces) -> float:
    """Return the volume by which one patch of a rim encloses more than another."""
    second = np.where(faces < len(rim), faces, faces + len(one))
    both = np.concatenate([faces, second[:, ::-1]])
    return signed_volume(np.concatenate([rim, one, other]), both)


def normal(rim: Vertices) -> NDArray[np.float64]:
    """Return the normal of a rim's best-fitting plane; its length is the enclosed area."""
    spokes = rim - rim.mean(axis=0)
    return 0.5 * np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0)


def _is_round(rim: Vertices, length: float) -> bool:
    return 4.0 * np.pi * float(np.linalg.norm(normal(rim))) >= _ROUND * length**2
