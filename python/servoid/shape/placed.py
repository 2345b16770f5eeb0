"""Places bodies at other poses."""

from servoid._native import Body, Pose


def placed(body: Body, world_from_object: Pose) -> Body:
    """Return a body at another pose."""
    return Body(
        world_from_object=world_from_object,
        centers=body.centers,
        radii=body.radii,
        rotations=body.rotations,
    )
