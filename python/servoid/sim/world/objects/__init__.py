"""Objects to meet in a world: x right, y down, z away from the hand that first sees them."""

from collections.abc import Callable

from servoid.errors import SimError
from servoid.sim.world.objects.drill import drill
from servoid.sim.world.objects.shapes import ellipsoid, painted_ellipsoid, two_ellipsoids
from servoid.sim.world.objects.vessels import bottle, mug, plain_bottle, plain_mug
from servoid.sim.world.things import Thing

OBJECTS: dict[str, Callable[[], tuple[Thing, ...]]] = {
    "bottle": bottle,
    "drill": drill,
    "ellipsoid": ellipsoid,
    "mug": mug,
    "painted_ellipsoid": painted_ellipsoid,
    "plain_bottle": plain_bottle,
    "plain_mug": plain_mug,
    "two_ellipsoids": two_ellipsoids,
}
# Objects that look the same however they are spun about an axis through their origin.
SPIN_AXES = {"ellipsoid": (0.0, 1.0, 0.0), "plain_bottle": (0.0, 1.0, 0.0)}


def make_object(name: str) -> tuple[Thing, ...]:
    """Return the parts of an object, the same each time.

    Raises:
        SimError: there is no such object.

    """
    if name not in OBJECTS:
        raise SimError(f"unknown object '{name}'; choose one of {', '.join(OBJECTS)}")
    return OBJECTS[name]()


__all__ = ["OBJECTS", "SPIN_AXES", "make_object"]
