"""The viewpoint of the overview of arm, head and object."""

from servoid.pose import Pose, exact, looking

_LEAST = 0.5  # minimum distance in metres from the base to the object
# Shares of the way from the base to the object, and of the object's height.
_AHEAD, _ASIDE, _ABOVE = 1.30, 0.98, 1.80
_AIM_AHEAD, _AIM_ASIDE, _AIM_ABOVE = 0.60, -0.03, 0.84


def overview_from(object_in_world: tuple[float, float, float]) -> Pose:
    """Return the pose of a camera that sees the arm at the origin and an object before it."""
    x, y, z = object_in_world
    reach = exact.hypot(x, y)
    ahead = (x / reach, y / reach) if reach > 1e-6 else (-1.0, 0.0)
    reach, high = max(reach, _LEAST), max(z, 0.5 * _LEAST)

    def at(forward: float, aside: float, up: float) -> tuple[float, float, float]:
        return (
            reach * (forward * ahead[0] - aside * ahead[1]),
            reach * (forward * ahead[1] + aside * ahead[0]),
            up * high,
        )

    return looking(at(_AHEAD, _ASIDE, _ABOVE), at(_AIM_AHEAD, _AIM_ASIDE, _AIM_ABOVE))
