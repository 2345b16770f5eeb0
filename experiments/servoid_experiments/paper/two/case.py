"""The inputs and the results of the experiment with two ellipsoids."""

from enum import Enum
from typing import Annotated

import msgspec
from msgspec import Meta

from servoid_experiments.paper.eye_pair import EyeMode, PairSettings, Triple

OBJECT_NAME = "two_ellipsoids"


class Procedure(Enum):
    """A way to model: the inputs and the method."""

    PAPER = "paper"
    PAIR = "pair"
    STEREO = "stereo"
    DEPTH = "depth"
    LOOKS = "looks"


class TwoTrial(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the object is seen and modelled."""

    pair: PairSettings = PairSettings(samples=1, background="plain")
    eyes: Annotated[EyeMode, Meta(description="where the eyes look; assumed")] = EyeMode.VERGED
    place: Annotated[
        Triple, Meta(description="of the object in the hand's frame, m; as in Sec. 5.1, assumed")
    ] = (0.0, -0.1, 0.53)
    spread: Annotated[
        float, Meta(ge=0.0, description="how far off it lies at random along each axis, m")
    ] = 0.03
    ellipsoids: Annotated[int, Meta(ge=1, description="of the model; the paper's")] = 3
    points: Annotated[int, Meta(ge=1, description="m, on a surface; assumed")] = 500
    alpha: Annotated[
        float,
        Meta(gt=0.0, description="margin of the envelope, share of the least radius; assumed"),
    ] = 0.3
    population: Annotated[int, Meta(ge=8, description="individuals; assumed")] = 100
    generations: Annotated[int, Meta(ge=1, description="for each ellipsoid; assumed")] = 300
    depth_noise: Annotated[
        float, Meta(ge=0.0, description="of a depth camera, share of the depth; assumed")
    ] = 0.005
    looks_deg: Annotated[
        tuple[tuple[float, float], ...],
        Meta(
            description="further places to look from, turned about the object to the right and up"
        ),
    ] = ((55.0, 0.0), (-55.0, 0.0), (0.0, 45.0))


class TwoCase(msgspec.Struct, frozen=True, kw_only=True):
    """One model of one stereo pair; the seed sets noise, light, position and search."""

    procedure: Procedure
    seed: int
    trial: TwoTrial


class TwoRow(msgspec.Struct, frozen=True, kw_only=True):
    """A model and its errors, in m, in the frame of the hand at its first position.

    `error` is that of the centroid. `part_errors` are those of the centre nearest to each true
    ellipsoid's, and `radius_errors` those of that ellipsoid's radii, the longest first.
    `volume_ratio` is the model's volume divided by the true one. `seen_points` is the number of
    surface points from depth. `centers`, `radii` and `rotations` (w, x, y, z) are the model's.
    Seconds are not reproducible.
    """

    error: list[float]
    volume_iou: float
    silhouette_iou: float
    volume_ratio: float
    part_errors: list[list[float]]
    radius_errors: list[list[float]]
    seen_points: int
    centers: list[list[float]]
    radii: list[list[float]]
    rotations: list[list[float]]
    seconds: float
