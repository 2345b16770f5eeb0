"""The paper's servoing method, and replacements for its parts."""

from collections.abc import Sequence
from enum import Enum
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from msgspec.structs import replace

from servoid._native import (
    Body,
    Estimate,
    OneStepSettings,
    OneStepTracker,
    Tracker,
    TrackSettings,
)
from servoid.pose import Pose
from servoid.servo import GazeMode, ServoSettings, as_the_paper
from servoid.servo.settings import GazeSettings, HandSettings, JointSettings
from servoid.sim.world import World
from servoid.sim.world.objects import make_object
from servoid.sim.world.scene.visuals import Ellipsoid
from servoid.track.follower import Follower, Images
from servoid_experiments.paper.servoing.reading import Frame, Reading, hand_of, in_world, placed
from servoid_experiments.paper.servoing.settings import Constants, Search, Triple


class TrackerKind(Enum):
    """The kinds of tracker."""

    POINTS = "points"
    REGION = "region"
    SERVOID = "servoid"


class Method(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The paper's method, with options to replace parts by servoid's."""

    tracker: Annotated[
        TrackerKind,
        Meta(
            description="points or region for the 1-step genetic algorithm, or servoid's own "
            "tracker, which finds out for itself how the object is turned"
        ),
    ] = TrackerKind.POINTS
    surface: Annotated[
        bool,
        Meta(description="let servoid's tracker use the look of the surface, beside outlines"),
    ] = False
    in_hand: Annotated[
        bool,
        Meta(
            description="let the genetic algorithm's population live in the hand's frame, in "
            "which the paper's equation 9 has the object, or in the world"
        ),
    ] = True
    stamped: Annotated[
        bool,
        Meta(
            description="take the object for where it was when its image was taken, or for now "
            "as far before the hand as it was then: the paper does not speak of time stamps"
        ),
    ] = False
    filtered: Annotated[
        bool, Meta(description="filter estimates and move them ahead by their age")
    ] = False
    feed_forward: Annotated[
        bool, Meta(description="add the target's velocity to that of hand and eyes")
    ] = False
    turn_told: Annotated[
        bool, Meta(description="give servoing the object's true orientation, as the paper does")
    ] = True
    qp: Annotated[bool, Meta(description="joint speeds by a QP, not by the paper's law")] = False


_ANY = 1e3  # m/s and rad/s
_BEGINS_AFTER = 5  # estimates: the object has been modelled and has not moved


def servo_settings(method: Method, given: Constants) -> ServoSettings:
    """Return the servo settings of a method, with the paper's gains."""
    law, eyes = given.law, given.eyes
    ours = ServoSettings(
        hand=HandSettings(
            position_gain=law.position_gain,
            position_rate_gain=law.position_rate_gain,
            turn_gain=law.turn_gain,
            turn_rate_gain=law.turn_rate_gain,
            linear_speed=law.speed,
            linear_acceleration=law.acceleration,
        ),
        joints=JointSettings(feedback_gain=law.joint_gain),
        gaze=GazeSettings(
            mode=GazeMode.FIXATE if eyes.verging else GazeMode.PARALLEL,
            gain=eyes.gaze_gain,
            rate_gain=eyes.gaze_rate_gain,
        ),
    )
    theirs = as_the_paper(ours)
    moving = ours if method.feed_forward else theirs
    hand = moving.hand
    if method.feed_forward and not method.filtered:
        # Estimated speeds are fed forward unchanged.
        hand = replace(hand, sure_speed=_ANY, sure_turning=_ANY)
    return ServoSettings(
        target=(ours if method.filtered else theirs).target,
        hand=hand,
        joints=(ours if method.qp else theirs).joints,
        gaze=moving.gaze,
        safety=replace(theirs.safety, resume_after=_BEGINS_AFTER),
    )


def body_of(name: str, radii: Triple | None) -> Body:
    """Return an object that consists of ellipsoids as a body in the object's frame."""
    centers, sizes, turns = [], [], []
    for thing in make_object(name, radii):
        assert isinstance(thing.shape, Ellipsoid), f"{name} is not made of ellipsoids"
        sizes.append(thing.shape.radii)
        turns.append(thing.carrier_from_visual[:4])
        centers.append(thing.carrier_from_visual[4:])
    return Body(
        world_from_object=Pose.identity(),
        centers=np.array(centers, float),
        radii=np.array(sizes, float),
        rotations=np.array(turns, float),
    )


def make_follower(world: World, body: Body, method: Method, search: Search, seed: int) -> Reading:
    """Make the tracker of a method for the object of a world."""
    if method.tracker is TrackerKind.SERVOID:
        tracker = Tracker(world.cameras, body, TrackSettings(seed=seed, surface=method.surface))
        follower = TrueTurnTracker(world, tracker) if method.turn_told else tracker
        return Reading(world, follower, in_hand=False, stamped=method.stamped)
    region = method.tracker is TrackerKind.REGION
    settings = OneStepSettings(
        seed=seed,
        turns=False,
        region=region or None,
        points=None if region else search.points,
        alpha=None if region else search.alpha,
        reach=search.reach,
        population=search.population,
        elites=min(search.elites, search.population - 1),
        mutation_rate=search.mutation_rate,
        mutation_width=search.mutation_width,
        least_width=min(search.least_width, search.mutation_width),
    )
    frame = hand_of(world) if method.in_hand else in_world
    bred = TrueTurnSearch(
        world, frame, OneStepTracker(world.cameras, body, settings), search.generations
    )
    return Reading(world, bred, in_hand=method.in_hand, stamped=method.stamped)


class TrueTurnTracker:
    """A tracker of all six degrees of freedom, of which only the position is used."""

    def __init__(self, world: World, tracker: Follower) -> None:
        self._world, self._tracker = world, tracker

    def start(
        self,
        time_s: float,
        world_from_camera: Sequence[Pose],
        images: Images,
        world_from_object: Pose,
        masks: Images | None = None,
    ) -> Estimate:
        """Learn the object's appearance, with the object at a known pose."""
        return self._with_true_turn(
            self._tracker.start(time_s, world_from_camera, images, world_from_object, masks)
        )

    def step(self, time_s: float, world_from_camera: Sequence[Pose], images: Images) -> Estimate:
        """Find the object in the next observation."""
        return self._with_true_turn(self._tracker.step(time_s, world_from_camera, images))

    def _with_true_turn(self, estimate: Estimate) -> Estimate:
        found, truth = estimate.world_from_object, self._world.world_from_object_at(estimate.time_s)
        turn = (truth.inverse() @ found).matrix()[:3, :3]
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = turn @ estimate.covariance[:3, :3] @ turn.T
        there = Pose.from_parts(found.translation, truth.quaternion)
        return placed(estimate, there, covariance, np.zeros((0, 6)))


class TrueTurnSearch:
    """The 1-step genetic algorithm on x, y and z, with the true rotation as an input.

    With several generations per image, all of them use the same image.
    """

    def __init__(
        self, world: World, frame: Frame, tracker: OneStepTracker, generations: int
    ) -> None:
        self._world, self._frame = world, frame
        self._tracker, self._generations = tracker, generations

    def start(
        self,
        time_s: float,
        world_from_camera: Sequence[Pose],
        images: Images,
        world_from_object: Pose,
        masks: Images | None = None,
    ) -> Estimate:
        """Learn the object's appearance, with the object at a known pose."""
        return self._tracker.start(time_s, world_from_camera, images, world_from_object, masks)

    def step(self, time_s: float, world_from_camera: Sequence[Pose], images: Images) -> Estimate:
        """Find the object in the next observation."""
        truth = self._frame().inverse() @ self._world.world_from_object_at(time_s)
        self._tracker.set_orientation(truth.quaternion)
        for _ in range(self._generations - 1):
            self._tracker.step(time_s, world_from_camera, images)
        return self._tracker.step(time_s, world_from_camera, images)
