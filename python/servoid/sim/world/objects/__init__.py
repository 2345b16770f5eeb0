"""The objects of a world: x right, y down, z away from the hand at the start."""

from collections.abc import Callable

from servoid.errors import SimError
from servoid.sim.world.objects.drill import drill
from servoid.sim.world.objects.shapes import ellipsoid, painted_ellipsoid, two_ellipsoids
from servoid.sim.world.objects.vessels import bottle, mug, plain_bottle, plain_mug
from servoid.sim.world.scene.visuals import Visual
from servoid.words import alternatives

Triple = tuple[float, float, float]

OBJECTS: dict[str, Callable[[], tuple[Visual, ...]]] = {
    "bottle": bottle,
    "drill": drill,
    "ellipsoid": ellipsoid,
    "mug": mug,
    "painted_ellipsoid": painted_ellipsoid,
    "plain_bottle": plain_bottle,
    "plain_mug": plain_mug,
    "two_ellipsoids": two_ellipsoids,
}
# Objects with rotational symmetry about an axis through their origin.
SPIN_AXES = {"ellipsoid": (0.0, 1.0, 0.0), "plain_bottle": (0.0, 1.0, 0.0)}
_ELLIPSOID = "ellipsoid"
_AXES: tuple[Triple, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def make_object(name: str, radii: Triple | None = None) -> tuple[Visual, ...]:
    """Return the parts of an object, the same each time.

    `radii` in metres are those of the object `ellipsoid`, by default the paper's.

    Raises:
        SimError: there is no such object, or its radii cannot be chosen.

    """
    if name not in OBJECTS:
        raise SimError(f"unknown object '{name}'{alternatives(name, OBJECTS)}")
    if radii is None:
        return OBJECTS[name]()
    if name != _ELLIPSOID:
        raise SimError(
            f"object.radii was given, but the object is '{name}'; leave radii out, or choose the "
            f"object '{_ELLIPSOID}'"
        )
    return ellipsoid(radii)


def spin_axis(name: str, radii: Triple | None = None) -> Triple | None:
    """Return the unit axis of an object's rotational symmetry, in its frame, if there is one."""
    if radii is not None and radii[0] != radii[2]:
        pairs = [radii[place - 1] == radii[place - 2] for place in range(3)]
        return _AXES[pairs.index(True)] if any(pairs) else None
    return SPIN_AXES.get(name)


__all__ = ["OBJECTS", "SPIN_AXES", "make_object", "spin_axis"]
