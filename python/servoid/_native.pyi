"""The Rust core, as Python sees it: C-contiguous arrays, lengths in metres, angles in radians."""

from collections.abc import Callable, Sequence
from typing import ClassVar, final, overload

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

__all__ = ["Body", "Camera", "Estimate", "Given", "Lens", "Mesh", "ModelSettings"]
__all__ += ["OneStepSettings", "OneStepTracker", "PaperSettings", "Pose", "Step", "TrackSettings"]
__all__ += ["Tracker", "View", "__version__", "backend", "backends", "ellipsoid_colors"]
__all__ += ["fit_body", "fit_paper", "force_backend"]
__all__ += ["Lighting", "Paint", "Stage", "paper_scores", "place_body"]
__all__ += ["rough_body", "seen_surface", "silhouette_ious"]
__all__ += ["exact_arccos", "exact_arcsin", "exact_arctan", "exact_arctan2"]
__all__ += ["exact_cos", "exact_eigh", "exact_exp", "exact_expm1"]
__all__ += ["exact_log", "exact_norm", "exact_power", "exact_product"]
__all__ += ["exact_sin", "exact_solve", "exact_tan"]

__version__: str

def backend() -> str: ...
def backends() -> list[str]: ...
def force_backend(name: str) -> None: ...
@overload
def exact_sin(x: float) -> float: ...
@overload
def exact_sin(x: NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def exact_cos(x: float) -> float: ...
@overload
def exact_cos(x: NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def exact_tan(x: float) -> float: ...
@overload
def exact_tan(x: NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def exact_arcsin(x: float) -> float: ...
@overload
def exact_arcsin(x: NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def exact_arccos(x: float) -> float: ...
@overload
def exact_arccos(x: NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def exact_arctan(x: float) -> float: ...
@overload
def exact_arctan(x: NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def exact_exp(x: float) -> float: ...
@overload
def exact_exp(x: NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def exact_expm1(x: float) -> float: ...
@overload
def exact_expm1(x: NDArray[np.float64]) -> NDArray[np.float64]: ...
@overload
def exact_log(x: float) -> float: ...
@overload
def exact_log(x: NDArray[np.float64]) -> NDArray[np.float64]: ...
def exact_arctan2(y: float, x: float) -> float: ...
def exact_power(x: float, y: float) -> float: ...
def exact_product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]: ...
def exact_solve(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]: ...
def exact_eigh(a: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def exact_norm(x: NDArray[np.float64]) -> float: ...

_Poses = Sequence[Pose]
_Images = Sequence[NDArray[np.uint8] | None]
_Depths = Sequence[NDArray[np.float32] | None]
_Points = NDArray[np.float64]
_Colors = NDArray[np.uint8]
_Progress = Callable[[int, float, float], None]

@final
class Pose:
    """A rigid motion, an element of SE(3)."""

    def __new__(cls, matrix: NDArray[np.float64]) -> Self: ...
    @staticmethod
    def identity() -> Pose: ...
    @staticmethod
    def from_parts(translation: Sequence[float], quaternion: Sequence[float]) -> Pose: ...
    @staticmethod
    def exp(twist: Sequence[float]) -> Pose: ...
    def log(self) -> NDArray[np.float64]: ...
    def adjoint(self) -> NDArray[np.float64]: ...
    def inverse(self) -> Pose: ...
    def matrix(self) -> NDArray[np.float64]: ...
    @property
    def translation(self) -> tuple[float, float, float]: ...
    @property
    def quaternion(self) -> tuple[float, float, float, float]: ...
    def transform(self, points: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def __matmul__(self, value: Pose, /) -> Pose: ...
    def __rmatmul__(self, value: Pose, /) -> Pose: ...

@final
class Camera:
    """A pinhole camera: pixel (0, 0) is the centre of the top-left pixel."""

    MAX_SIDE_PX: ClassVar[int]
    """Most pixels along a side."""

    def __new__(
        cls,
        *,
        size_px: tuple[int, int],
        focal_px: tuple[float, float],
        center_px: tuple[float, float],
    ) -> Self: ...
    @property
    def size_px(self) -> tuple[int, int]: ...
    @property
    def focal_px(self) -> tuple[float, float]: ...
    @property
    def center_px(self) -> tuple[float, float]: ...
    def project(self, points_in_camera: NDArray[np.float64]) -> NDArray[np.float64]: ...

@final
class Lens:
    """A camera with a lens that may bend straight lines: pinhole, brown_conrady or kannala_brandt.

    x points right, y down, z forward along the axis; pixel (0, 0) is the centre of the top-left
    pixel.
    """

    def __new__(
        cls,
        *,
        model: str,
        size_px: tuple[int, int],
        focal_px: tuple[float, float],
        center_px: tuple[float, float],
        distortion: Sequence[float] = ...,
    ) -> Self: ...
    @property
    def model(self) -> str: ...
    @property
    def size_px(self) -> tuple[int, int]: ...
    @property
    def focal_px(self) -> tuple[float, float]: ...
    @property
    def center_px(self) -> tuple[float, float]: ...
    @property
    def distortion(self) -> tuple[float, ...]: ...
    @property
    def limit(self) -> float: ...
    def project(self, points_in_lens: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def rays(self, pixels: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def map_to(self, camera: Camera, lens_from_camera: Pose) -> NDArray[np.float32]: ...

@final
class Body:
    """A rigid set of ellipsoids in the object's frame, and where that frame is in the world."""

    def __new__(
        cls,
        *,
        world_from_object: Pose,
        centers: NDArray[np.float64],
        radii: NDArray[np.float64],
        rotations: NDArray[np.float64],
    ) -> Self: ...
    @property
    def world_from_object(self) -> Pose: ...
    @property
    def centers(self) -> NDArray[np.float64]: ...
    @property
    def radii(self) -> NDArray[np.float64]: ...
    @property
    def rotations(self) -> NDArray[np.float64]: ...
    def __len__(self) -> int: ...
    def outlines(
        self, camera: Camera, world_from_camera: Pose
    ) -> list[tuple[NDArray[np.float64], NDArray[np.float64]] | None]: ...
    def mass_properties(self) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]: ...
    def silhouette(self, camera: Camera, world_from_camera: Pose) -> NDArray[np.uint8]: ...

@final
class View:
    """One picture that says where the object is: a camera, its pose, and a mask."""

    def __new__(
        cls, *, camera: Camera, world_from_camera: Pose, mask: NDArray[np.uint8]
    ) -> Self: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def world_from_camera(self) -> Pose: ...

@final
class Mesh:
    """A closed surface of triangles."""

    def __new__(cls, *, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Self: ...
    @property
    def volume(self) -> float: ...

@final
class Paint:
    """What a surface looks like."""

    def __new__(
        cls,
        *,
        color: Sequence[float] | None = None,
        texture: NDArray[np.uint8] | None = None,
        repeat: tuple[float, float] | None = None,
        gloss: float | None = None,
    ) -> Self: ...

@final
class Lighting:
    """A far lamp, and light from above and below."""

    def __new__(
        cls,
        *,
        toward: Sequence[float] | None = None,
        key: Sequence[float] | None = None,
        sky: Sequence[float] | None = None,
        bounce: Sequence[float] | None = None,
        exposure: float | None = None,
    ) -> Self: ...

@final
class Stage:
    """Things of simple shapes, drawn by casting rays."""

    def __new__(cls) -> Self: ...
    def add_ellipsoid(self, radii: Sequence[float], paint: Paint) -> int: ...
    def add_capsule(self, radius: float, half_length: float, paint: Paint) -> int: ...
    def add_cylinder(self, radius: float, half_length: float, paint: Paint) -> int: ...
    def add_box(self, half_size: Sequence[float], paint: Paint) -> int: ...
    def add_plane(self, half_size: Sequence[float], paint: Paint) -> int: ...
    def add_mesh(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        paint: Paint,
        texture_coordinates: NDArray[np.float64] | None = None,
        colors: NDArray[np.uint8] | None = None,
    ) -> int: ...
    @property
    def count(self) -> int: ...
    def render(
        self,
        *,
        lens: Lens,
        world_from_lens: NDArray[np.float64],
        world_from_thing: NDArray[np.float64],
        lighting: Lighting,
        samples: int | None = None,
        noise: float | None = None,
        seed: int | None = None,
        threads: int | None = None,
    ) -> NDArray[np.uint8]: ...
    def depth(
        self,
        *,
        lens: Lens,
        world_from_lens: NDArray[np.float64],
        world_from_thing: NDArray[np.float64],
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]: ...

@final
class Given:
    """What modelling starts from: views, a closed mesh, and seen points of the surface."""

    def __new__(
        cls,
        *,
        views: Sequence[View] | None = None,
        mesh: Mesh | None = None,
        points: _Points | None = None,
        directions: _Points | None = None,
        silhouette_weight: float | None = None,
        volume_weight: float | None = None,
        depth_weight: float | None = None,
    ) -> Self: ...

@final
class ModelSettings:
    """How modelling proceeds; every default is written in the core."""

    def __new__(
        cls,
        *,
        max_ellipsoids: int | None = None,
        delta: float | None = None,
        held_out: bool | None = None,
        seed: int | None = None,
        threads: int | None = None,
        quick: bool = False,
    ) -> Self: ...
    @property
    def max_ellipsoids(self) -> int: ...
    @property
    def delta(self) -> float: ...
    @property
    def held_out(self) -> bool: ...
    @property
    def seed(self) -> int: ...
    @property
    def threads(self) -> int: ...

@final
class PaperSettings:
    """How the paper's own method proceeds; every default is written in the core."""

    def __new__(
        cls,
        *,
        max_ellipsoids: int | None = None,
        delta: float | None = None,
        seed: int | None = None,
        threads: int | None = None,
        points: int | None = None,
        alpha: float | None = None,
        alpha_m: float | None = None,
        population: int | None = None,
        generations: int | None = None,
    ) -> Self: ...
    @property
    def max_ellipsoids(self) -> int: ...
    @property
    def delta(self) -> float: ...
    @property
    def seed(self) -> int: ...
    @property
    def threads(self) -> int: ...
    @property
    def points(self) -> int: ...
    @property
    def alpha(self) -> float | None: ...
    @property
    def alpha_m(self) -> float | None: ...
    @property
    def population(self) -> int: ...
    @property
    def generations(self) -> int: ...

@final
class Step:
    """What modelling had reached with one count of ellipsoids."""

    @property
    def count(self) -> int: ...
    @property
    def fitness(self) -> float: ...
    @property
    def body(self) -> Body: ...

@final
class TrackSettings:
    """How tracking proceeds; every default is written in the core."""

    def __new__(
        cls,
        *,
        seed: int | None = None,
        population: int | None = None,
        generations: int | None = None,
        budget_s: float | None = None,
        surface: bool | None = None,
        region: bool | None = None,
        local_colors: bool | None = None,
        adjust: bool | None = None,
    ) -> Self: ...
    @property
    def seed(self) -> int: ...
    @property
    def population(self) -> int: ...
    @property
    def generations(self) -> int: ...
    @property
    def budget_s(self) -> float | None: ...
    @property
    def surface(self) -> bool: ...
    @property
    def region(self) -> bool: ...
    @property
    def local_colors(self) -> bool: ...
    @property
    def adjust(self) -> bool: ...

@final
class Estimate:
    """Where an object is at one instant, and how well that is known."""

    @property
    def time_s(self) -> float: ...
    @property
    def world_from_object(self) -> Pose: ...
    @property
    def covariance(self) -> NDArray[np.float64]: ...
    @property
    def unobservable(self) -> NDArray[np.float64]: ...
    @property
    def confidence(self) -> float: ...
    @property
    def evidence(self) -> dict[str, float] | None: ...
    @property
    def status(self) -> str: ...
    @property
    def located(self) -> bool: ...
    @property
    def keyframes(self) -> list[tuple[int, Pose]]: ...
    @property
    def evolved(self) -> bool: ...
    @property
    def notices(self) -> list[str]: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def seconds(self) -> dict[str, float]: ...

@final
class OneStepSettings:
    """How the 1-step genetic algorithm tracks; every default is written in the core."""

    def __new__(
        cls,
        *,
        seed: int | None = None,
        turns: bool | None = None,
        region: bool | None = None,
        points: int | None = None,
        alpha: float | None = None,
        reach: float | None = None,
        turn: float | None = None,
        population: int | None = None,
        elites: int | None = None,
        mutation_rate: float | None = None,
        mutation_width: float | None = None,
        least_width: float | None = None,
    ) -> Self: ...
    @property
    def seed(self) -> int: ...
    @property
    def turns(self) -> bool: ...
    @property
    def region(self) -> bool: ...
    @property
    def points(self) -> int | None: ...
    @property
    def alpha(self) -> float | None: ...
    @property
    def reach(self) -> float: ...
    @property
    def turn(self) -> float: ...
    @property
    def population(self) -> int: ...
    @property
    def elites(self) -> int: ...
    @property
    def mutation_rate(self) -> float: ...
    @property
    def mutation_width(self) -> float: ...
    @property
    def least_width(self) -> float: ...

@final
class OneStepTracker:
    """Tracks a body by one generation of a genetic algorithm an image, as the paper does."""

    def __new__(
        cls, cameras: Sequence[Camera], body: Body, settings: OneStepSettings | None = None
    ) -> Self: ...
    def start(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        world_from_object: Pose,
        masks: _Images | None = None,
    ) -> Estimate: ...
    def step(self, time_s: float, world_from_camera: _Poses, images: _Images) -> Estimate: ...
    def set_orientation(self, world_from_object: Sequence[float]) -> None: ...

@final
class Tracker:
    """Follows one body from observation to observation."""

    TAKES_DEPTHS: ClassVar[bool]

    def __new__(
        cls, cameras: Sequence[Camera], body: Body, settings: TrackSettings | None = None
    ) -> Self: ...
    def start(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        world_from_object: Pose,
        masks: _Images | None = None,
        depths: _Depths | None = None,
    ) -> Estimate: ...
    def find(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        near: Pose | None = None,
        depths: _Depths | None = None,
    ) -> Estimate: ...
    def step(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        depths: _Depths | None = None,
    ) -> Estimate: ...
    def worths(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        poses: _Points,
        *,
        resolution: int = 0,
        threads: int = 0,
    ) -> _Points: ...
    def appearance(self) -> bytes: ...
    def recall(self, appearance: bytes) -> None: ...
    def begin_evolving(self) -> bool: ...
    def evolve(self) -> bool: ...
    def keyframe_pose(self, number: int) -> Pose | None: ...
    @property
    def body(self) -> Body: ...
    @property
    def surface(self) -> tuple[_Points, _Points, NDArray[np.uint8]]: ...

def fit_body(
    given: Given, settings: ModelSettings, progress: _Progress | None = None
) -> list[Step]: ...
def fit_paper(
    views: Sequence[View], settings: PaperSettings, progress: _Progress | None = None
) -> list[Step]: ...
def paper_scores(
    views: Sequence[View], body: Body, poses: _Points, settings: PaperSettings
) -> _Points: ...
def rough_body(
    views: Sequence[View],
    images: Sequence[NDArray[np.uint8]],
    pictures: Sequence[tuple[Camera, Pose, NDArray[np.uint8]]],
    settings: ModelSettings,
    points: _Points | None = None,
    directions: _Points | None = None,
) -> Body: ...
def seen_surface(
    body: Body,
    views: Sequence[View],
    points: _Points | None = None,
    directions: _Points | None = None,
) -> tuple[_Points, float, tuple[float, float, float] | None]: ...
def silhouette_ious(body: Body, views: Sequence[View]) -> _Points: ...
def place_body(
    body: Body,
    views: Sequence[View],
    images: Sequence[_Colors] | None = None,
    colors: _Colors | None = None,
    seed: int = 0,
) -> tuple[Pose, float]: ...
def ellipsoid_colors(body: Body, views: Sequence[View], images: Sequence[_Colors]) -> _Colors: ...
