"""Declares the request of tracking: which objects to track, and how."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid import _native
from servoid._native import Body, Pose
from servoid.brief import brief
from servoid.config import distance_fault
from servoid.errors import TrackError
from servoid.model import ProgressCallback
from servoid.segment import Target
from servoid.track.follower import Maker, make_one_step_tracker, make_tracker, one_step_settings

_OF_CORE = (
    "seed",
    "population",
    "generations",
    "budget_s",
    "surface",
    "region",
    "local_colors",
    "adjust",
    "adjust_outlines",
    "depth_from_motion",
)


class Method(Enum):
    """Names a tracker: servoid's own, or the paper's genetic algorithm of one step per image."""

    REGION = "region"
    PAPER = "paper"

    @property
    def maker(self) -> Maker:
        """Return the function that makes such a tracker."""
        return {Method.REGION: make_tracker, Method.PAPER: make_one_step_tracker}[self]


@dataclass(frozen=True, kw_only=True, eq=False)
class Subject:
    """One object to track, with its known properties.

    Without `body` it is modelled from the first observation. `start` is world_from_object in the
    first observation. `targets` mark the object there; without targets, the capture's masks do.
    `colors` are the colours of the body's ellipsoids, (K, 3) uint8 RGB, saved with it. `appearance`
    is used to find the object if neither start, target nor mask locates it. `fitness` is that of
    the body to what it was made of, saved with it: a body that fits its mask much worse is doubted,
    and refused if its appearance is not there either. `known_shape` states whether the body has the
    object's shape on all sides, as one made from a mesh has: then its outline outweighs shading,
    which slides along an object without print. `is_metric` is False if the body's lengths are in an
    unknown unit.
    """

    name: str = "object"
    body: Body | None = None
    start: Pose | None = None
    targets: tuple[Target, ...] = ()
    colors: NDArray[np.uint8] | None = None
    appearance: bytes | None = None
    fitness: float | None = None
    known_shape: bool = False
    is_metric: bool = True

    __repr__ = brief

    def __post_init__(self) -> None:
        if self.start is not None and self.body is None:
            raise TrackError(
                f"a start for '{self.name}' is the pose of a body, and no body was given; give "
                "the body too, or leave the start out"
            )
        if self.known_shape and self.body is None:
            raise TrackError(
                f"the shape of '{self.name}' is said to be known, but no body was given; give the "
                "body too"
            )

    @property
    def is_sought(self) -> bool:
        """Return whether neither a start nor a target says where the object is."""
        return self.body is not None and self.start is None and not self.targets


@dataclass(frozen=True, kw_only=True)
class Request:
    """How to track; None keeps the core's default of a setting.

    `observations` and `every` select the observations: every `every`-th of the slice. `evolve` is
    whether bodies evolve; by default only bodies modelled from the first observation do, since they
    lack the sides that it did not show, and `adjust_outlines` adjusts only these; set to False, one
    camera doubts them no more than other bodies. `evolve_every` is
    the number of observations until a body may evolve again. `distance_m` is the distance of an
    object in the first observation, which a single image without depth leaves open. `maker` makes
    the trackers, if not the method's own. With `trust_targets`, a target that may mean several
    objects is used nevertheless; with `trust_poses`, poses of the rig are right even if the images
    contradict them, as most of what its cameras see moves. `progress` is called with the progress
    of the modelling that may come first.
    """

    method: Method = Method.REGION
    seed: int | None = None
    population: int | None = None
    generations: int | None = None
    budget_s: float | None = None
    surface: bool | None = None
    region: bool | None = None
    local_colors: bool | None = None
    adjust: bool | None = None
    adjust_outlines: bool | None = None
    depth_from_motion: bool | None = None
    evolve: bool | None = None
    evolve_every: int = 10
    observations: slice = field(default_factory=lambda: slice(None))
    every: int = 1
    distance_m: float | None = None
    trust_targets: bool = False
    trust_poses: bool = False
    maker: Maker | None = None
    progress: ProgressCallback | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        for name, value in (("every", self.every), ("evolve_every", self.evolve_every)):
            if value < 1:
                raise TrackError(f"{name} is {value}; choose 1 or more")
        if type(self.observations) is not slice:
            raise TrackError(
                f"observations is {self.observations!r:.60}; give a slice, such as slice(0, 20)"
            )

    def check(self) -> None:
        """Check the settings before anything is read.

        Raises:
            TrackError: a setting is out of range, or the method has no such setting.

        """
        if self.method is Method.PAPER:
            one_step_settings(self.options())
        else:
            options: dict[str, Any] = self.options()
            _native.TrackSettings(**options)
        fault = distance_fault("the distance", self.distance_m)
        if fault is not None:
            raise TrackError(fault)

    def evolves(self, subject: Subject) -> bool:
        """Return whether the body of a subject evolves."""
        return subject.body is None if self.evolve is None else self.evolve

    def options(self, subject: Subject | None = None) -> dict[str, int | float | bool | None]:
        """Return the settings of the core for a subject, by their names there."""
        chosen = {name: getattr(self, name) for name in _OF_CORE}
        if subject is None or self.method is not Method.REGION:
            return chosen
        evolves = self.evolves(subject)
        if subject.known_shape and not evolves:
            chosen["known_shape"] = True
        if subject.body is None and self.adjust_outlines is None:
            chosen["adjust_outlines"] = evolves
        return chosen
