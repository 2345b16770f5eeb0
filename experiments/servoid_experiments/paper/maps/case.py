"""The inputs and the results of a fitness map."""

from enum import Enum
from typing import Annotated

import msgspec

from servoid_experiments.design import about
from servoid_experiments.paper.eye_pair import PairSettings, Triple
from servoid_experiments.stage import EyeMode


class Fitness(Enum):
    """A fitness function for a pose."""

    POINTS = "points"
    REGION = "region"
    SURFACE = "surface"
    FULL = "full"
    COARSE = "sought"


class MapTrial(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of a map."""

    pair: PairSettings = PairSettings()
    place: Annotated[
        Triple, about("of the object in the hand's frame, m; the paper's, Sec. 5.1")
    ] = (0.0, -0.1, 0.53)
    middle: Annotated[Triple, about("of the box of poses in the hand's frame, m; the paper's")] = (
        0.0,
        -0.09,
        0.545,
    )
    half: Annotated[float, about("half the box's side, m; the paper's", gt=0.0)] = 0.1
    count: Annotated[
        int, about("of poses along each side; the paper's: every 5 mm", ge=3, le=101)
    ] = 41
    points: Annotated[int, about("m, on a surface; assumed", ge=1)] = 500
    alpha: Annotated[
        float,
        about("margin of the envelope, share of the least radius; assumed", gt=0.0),
    ] = 0.3
    taught_shift: Annotated[
        float, about("how far off the object was when its look was learned, m", ge=0.0)
    ] = 0.03
    taught_turn_deg: Annotated[float, about("how far it was turned then, degrees", ge=0.0)] = 6.0


class MapCase(msgspec.Struct, frozen=True, kw_only=True):
    """An object before the eyes; `whole` requests the map of the box, too."""

    object_name: str
    eyes: EyeMode
    seed: int
    whole: bool
    trial: MapTrial

    @property
    def title(self) -> str:
        """Describe the object and the eyes in words."""
        return f"{self.object_name.replace('_', ' ')}, {self.eyes.value} eyes"


class Ridge(msgspec.Struct, frozen=True, kw_only=True):
    """Where the fitness is above 90 % of its peak, in metres.

    `along` are straight lines through the peak, along x, y and z. `crest` is along z, with the best
    x and y at each depth: the ridge itself, which follows the line of sight. `crest_from_floor` is
    the same with the share counted from the lowest value of the whole map instead of from 0. `peak`
    is the position of the maximum relative to the true one. A width is None where the fitness is
    not above 0 or the ridge leaves the evaluated range.
    """

    along: list[float | None]
    crest: float | None
    crest_from_floor: float | None
    peak: list[float]
    height: float


class FitnessRow(msgspec.Struct, frozen=True, kw_only=True):
    """The results for one fitness.

    `xy`, `yz` and `xz` are the maxima over the third axis; in them the first axis varies fastest.
    `crest` is the maximum at each depth along the ridge. All three and the floor are None or empty
    where the box was not requested.
    """

    fitness: Fitness
    ridge: Ridge
    floor: float | None = None
    map_peak: list[float] = []
    xy: list[list[float]] = []
    yz: list[list[float]] = []
    xz: list[list[float]] = []
    along_z: list[float] = []
    crest: list[float] = []


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """The estimate of servoid's tracker with one kind of evidence or both.

    `error` is that of its position in the hand's frame in m, None where it does not find the
    object; `sigma_z` is its reported standard deviation of z in m for a known rotation, as in the
    map.
    """

    fitness: Fitness
    error: list[float] | None = None
    sigma_z: float | None = None


class MapRow(msgspec.Struct, frozen=True, kw_only=True):
    """The results for one stereo pair.

    `depths` are those of the profiles, relative to the true one in m; `crest_depths` those of the
    crests. `answers` are by region, by surface and by both. Seconds are not reproducible.
    """

    fitnesses: list[FitnessRow]
    answers: list[Answer]
    depths: list[float]
    crest_depths: list[float]
    surface_points: int
    points_seconds: float | None
    region_seconds: float | None
