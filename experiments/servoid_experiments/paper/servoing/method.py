"""The paper's servoing method, and replacements for its parts.

Among these are other readings of the paper: the frame of the population, and the time to which
estimates belong. The paper's equation 9 has the object in the hand's frame; the paper does not
mention timestamps.
"""

from collections.abc import Sequence
from enum import Enum
from typing import Annotated, cast

import msgspec
import numpy as np
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
from servoid.track.follower import Follower, Images
from servoid_experiments.bode.late_sight import MadeEstimate
from servoid_experiments.design import about
from servoid_experiments.paper.servoing.settings import Constants, Search


class TrackerKind(Enum):
    """The kinds of tracker."""

    POINTS = "points"
    REGION = "region"
    SERVOID = "servoid"


class Method(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The paper's method, with options to replace parts by servoid's."""

    tracker: Annotated[
        TrackerKind,
        about(
            "points or region for the 1-step genetic algorithm, or servoid's own "
            "tracker, which finds out for itself how the object is turned"
        ),
    ] = TrackerKind.POINTS
    surface: Annotated[
        bool,
        about("let servoid's tracker use the look of the surface, beside outlines"),
    ] = False
    in_hand: Annotated[
        bool,
        about(
            "let the genetic algorithm's population live in the hand's frame, in "
            "which the paper's equation 9 has the object, or in the world"
        ),
    ] = True
    stamped: Annotated[
        bool,
        about(
            "take the object for where it was when its image was taken, or for now "
            "as far before the hand as it was then: the paper does not speak of time stamps"
        ),
    ] = False
    filtered: Annotated[bool, about("filter estimates and move them ahead by their age")] = False
    feed_forward: Annotated[bool, about("add the target's velocity to that of hand and eyes")] = (
        False
    )
    turn_told: Annotated[
        bool, about("give servoing the object's true orientation, as the paper does")
    ] = True
    qp: Annotated[bool, about("joint speeds by a QP, not by the paper's law")] = False


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


class Reading:
    """Runs a tracker in a frame of its own, and defines the time to which its estimates belong.

    With `stamped`, an estimate is the object's pose when the image was taken. Without, the object
    is assumed to be relative to the hand now as it was when the image was taken.

    The 1-step genetic algorithm searches x, y and z, with the true rotation as an input, in so many
    `generations` on each image. With `turn_told`, another tracker's rotation is replaced by the
    true one.
    """

    def __init__(
        self,
        world: World,
        tracker: Follower,
        *,
        in_hand: bool,
        stamped: bool,
        turn_told: bool = False,
        generations: int = 1,
    ) -> None:
        self._world, self._tracker, self._stamped = world, tracker, stamped
        self._turn_told, self._generations = turn_told, generations
        self._in_hand = in_hand
        self._seen = Pose.identity()

    @property
    def world_from_seen(self) -> Pose:
        """Return the recognised pose of the object when the last image was taken."""
        return self._seen

    def start(
        self,
        time_s: float,
        world_from_camera: Sequence[Pose],
        images: Images,
        world_from_object: Pose,
        masks: Images | None = None,
    ) -> Estimate:
        """Learn the object's appearance, with the object at a known pose."""
        frame_from_world = self._world_from_frame().inverse()
        cameras = [frame_from_world @ pose for pose in world_from_camera]
        there = frame_from_world @ world_from_object
        return self._read(self._tracker.start(time_s, cameras, images, there, masks))

    def step(self, time_s: float, world_from_camera: Sequence[Pose], images: Images) -> Estimate:
        """Find the object in the next observation."""
        frame_from_world = self._world_from_frame().inverse()
        cameras = [frame_from_world @ pose for pose in world_from_camera]
        if isinstance(self._tracker, OneStepTracker):
            truth = frame_from_world @ self._world.world_from_object_at(time_s)
            self._tracker.set_orientation(truth.quaternion)
            for _ in range(self._generations - 1):
                self._tracker.step(time_s, cameras, images)
        return self._read(self._tracker.step(time_s, cameras, images))

    def _world_from_hand(self) -> Pose:
        """Return the hand's pose when the last images were taken."""
        exposure = self._world.source.handed_out
        assert exposure is not None, "nothing is tracked before an image was handed out"
        return self._world.arm.world_from_hand(exposure.positions_at_time)

    def _world_from_frame(self) -> Pose:
        """Return the pose of the tracker's frame when the last images were taken."""
        return self._world_from_hand() if self._in_hand else Pose.identity()

    def _read(self, estimate: Estimate) -> Estimate:
        found, covariance = estimate.world_from_object, estimate.covariance
        unobservable = estimate.unobservable
        if self._turn_told:
            truth = self._world.world_from_object_at(estimate.time_s)
            turn = (truth.inverse() @ found).matrix()[:3, :3]
            covariance, unobservable = np.zeros((6, 6)), np.zeros((0, 6))
            covariance[:3, :3] = turn @ estimate.covariance[:3, :3] @ turn.T
            found = Pose.from_parts(found.translation, truth.quaternion)
        self._seen = self._world_from_frame() @ found
        then = self._seen
        if not self._stamped:
            now = self._world.arm.world_from_hand(self._world.arm.state().positions)
            then = now @ self._world_from_hand().inverse() @ self._seen
        made = MadeEstimate(
            time_s=estimate.time_s,
            world_from_object=then,
            covariance=covariance,
            unobservable=unobservable,
            confidence=estimate.confidence,
            status=estimate.status,
            located=estimate.located,
            evaluations=estimate.evaluations,
        )
        return cast("Estimate", made)


def make_follower(world: World, body: Body, method: Method, search: Search, seed: int) -> Reading:
    """Make the tracker of a method for the object of a world."""
    if method.tracker is TrackerKind.SERVOID:
        tracker = Tracker(world.cameras, body, TrackSettings(seed=seed, surface=method.surface))
        return Reading(
            world, tracker, in_hand=False, stamped=method.stamped, turn_told=method.turn_told
        )
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
    return Reading(
        world,
        OneStepTracker(world.cameras, body, settings),
        in_hand=method.in_hand,
        stamped=method.stamped,
        generations=search.generations,
    )
