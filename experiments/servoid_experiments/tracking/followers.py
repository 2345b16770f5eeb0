"""Runs both trackers through a scene in the same way."""

from dataclasses import dataclass

from servoid._native import Body, OneStepSettings, OneStepTracker
from servoid.pose import Pose
from servoid.track import Estimate, Method, Tracker, TrackSettings
from servoid_experiments.tracking.cases import TrackCase
from servoid_experiments.tracking.footage import RATE_HZ, Footage


@dataclass(frozen=True, eq=False)
class Led:
    """A tracker that was started with the first images of a scene.

    The paper's is given the rotation before each image, as in the paper's experiments.
    """

    tracker: Tracker | OneStepTracker
    footage: Footage
    object_from_body: Pose

    def step(self, index: int) -> Estimate:
        """Pass the images with an index to the tracker, and return its estimate."""
        if isinstance(self.tracker, OneStepTracker):
            true_pose = self.footage.world_from_objects[index] @ self.object_from_body
            self.tracker.set_orientation(true_pose.quaternion)
        return self.tracker.step(
            index / RATE_HZ, self.footage.world_from_cameras, self.footage.images[index]
        )


def start_follower(case: TrackCase, footage: Footage, body: Body) -> Led:
    """Start the tracker of a case at the object's true pose; `body` is in the object's frame.

    Raises:
        TrackError: the first images do not show the object, or a setting is out of range.

    """
    seed, object_from_body = case.scene.seed, body.world_from_object
    tracker: Tracker | OneStepTracker
    if case.method is Method.PAPER:
        one_step = OneStepSettings(seed=seed, population=case.population, turns=False)
        tracker = OneStepTracker(footage.cameras, body, one_step)
    else:
        settings = TrackSettings(
            seed=seed, population=case.population, generations=case.generations
        )
        tracker = Tracker(footage.cameras, body, settings)
    tracker.start(
        0.0,
        footage.world_from_cameras,
        footage.images[0],
        footage.world_from_objects[0] @ object_from_body,
        footage.masks,
    )
    return Led(tracker, footage, object_from_body)
