"""Places bodies at other poses, and reports those of sizes that hardly any object has."""

import numpy as np

from servoid._native import Body, Pose
from servoid.config import size_note
from servoid.pose import Floats, exact


def placed(body: Body, world_from_object: Pose) -> Body:
    """Return a body at another pose."""
    return Body(
        world_from_object=world_from_object,
        centers=body.centers,
        radii=body.radii,
        rotations=body.rotations,
    )


NO_UNIT = (
    "the lengths of the body are in an unknown unit, not in metres, so that its distance, size, "
    "volume and mass are wrong by an unknown factor; model it from a capture whose scale is known, "
    "such as a scan with a length, a board or a baseline"
)
"""What is wrong with a body whose file says that its unit is unknown."""


def body_sides(body: Body) -> Floats:
    """Return the size of a body along the axes of its frame, (3,) float64 in its unit."""
    reach = np.array(
        [
            exact.lengths(Pose.from_parts([0.0, 0.0, 0.0], turn).matrix()[:3, :3] * radii)
            for turn, radii in zip(body.rotations, body.radii, strict=True)
        ]
    )
    return (body.centers + reach).max(axis=0) - (body.centers - reach).min(axis=0)


def body_size_note(body: Body) -> str | None:
    """Report a body that is implausibly large or small for one in metres, else return None."""
    return size_note("the body", body_sides(body))
