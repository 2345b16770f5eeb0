"""Converts shapes to triangles."""

import numpy as np

from servoid.errors import SimError
from servoid.pose import exact
from servoid.sim.world.objects.loft import lathe
from servoid.sim.world.scene.visuals import Box, Capsule, Cylinder, Ellipsoid, MeshShape, Shape

_RINGS = 33


def as_mesh(shape: Shape) -> MeshShape:
    """Return a shape as triangles, curved ones to about a thousandth of their size.

    Raises:
        SimError: the shape encloses nothing.

    """
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _RINGS)[1:-1]
    match shape:
        case MeshShape():
            return shape
        case Ellipsoid(radii):
            ball = lathe([(exact.cos(float(one)), exact.sin(float(one))) for one in angles])
            return MeshShape(ball.vertices * radii, ball.faces, ball.texture_coordinates)
        case Capsule(radius, half):
            bend = [(radius * exact.cos(float(a)), radius * exact.sin(float(a))) for a in angles]
            ends = [(r, z + float(np.copysign(half, z))) for r, z in bend if abs(z) > 1e-9]
            return lathe(ends)
        case Cylinder(radius, half):
            return lathe([(radius, -half), (radius, half)])
        case Box(half_size):
            corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            return MeshShape(corners * half_size, _BOX_FACES)
    raise SimError(f"a {type(shape).__name__.lower()} encloses nothing; make objects of solids")


_BOX_FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ],
    np.int64,
)  # fmt: skip
