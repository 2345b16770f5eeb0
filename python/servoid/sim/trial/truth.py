"""The ground truth of the object of a simulated world, as far as it is observable."""

import numpy as np

from servoid._native import Body
from servoid.pose import Pose
from servoid.servo import TrueGoal, body_places, spun_like
from servoid.sim.world import World


class Truth:
    """Computes the true pose of a body that was modelled from the object of a world.

    `object_from_body` is the pose of the body's frame in the object's true one. The rotation of an
    object about its axis of symmetry is unobservable: of all equivalent poses, the one nearest to
    the estimate counts as true.
    """

    def __init__(self, world: World, object_from_body: Pose) -> None:
        self._world = world
        self.object_from_body: Pose = object_from_body

    def at(self, time_s: float, believed: Pose | None) -> Pose:
        """Return `world_from_body` at a time, with the estimate's unobservable rotation.

        Without an estimate it has the rotation of the simulation.
        """
        world_from_object = self._world.world_from_object_at(time_s)
        axis = self._world.spin_axis
        if axis is not None and believed is not None:
            seen = believed @ self.object_from_body.inverse()
            world_from_object = spun_like(world_from_object, seen, np.array(axis))
        return world_from_object @ self.object_from_body


def true_goal(world: World, body: Body, goal: Pose, hand_from_object: Pose) -> TrueGoal:
    """Return the desired pose of the true object of a world in the hand.

    Its desired middle is that of the body at the goal, hand_from_body, and its desired rotation
    is the initial true one, `hand_from_object`.
    """
    true, axis = world.true_object(), world.spin_axis
    middle = np.array(body.mass_properties()[1])
    turn = Pose.from_parts([0.0, 0.0, 0.0], hand_from_object.quaternion)
    place = goal.transform(middle[None])[0] - turn.transform(true.middle[None])[0]
    return TrueGoal(
        hand_from_object=Pose.from_parts(place.tolist(), turn.quaternion),
        middle=true.middle,
        points=true.points,
        normals=true.normals,
        body_middle=middle,
        body_points=body_places(body),
        spin_axis=None if axis is None else np.array(axis),
    )
