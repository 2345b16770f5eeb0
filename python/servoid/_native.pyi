"""The Rust core, as Python sees it: C-contiguous arrays, lengths in metres, angles in radians."""

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self

__all__ = ["Body", "Camera", "Estimate", "Lens", "Mesh", "ModelInput", "ModelSettings"]
__all__ += ["OneStepSettings", "OneStepTracker", "PaperSettings", "Pose", "Step", "TrackSettings"]
__all__ += ["taken_depth", "taken_image", "taken_mask"]
__all__ += ["Tracker", "View", "__version__", "backend", "backends", "ellipsoid_colors"]
__all__ += ["fit_body", "fit_paper", "force_backend"]
__all__ += ["Lighting", "Paint", "Scene", "Soup", "paper_scores", "pose_from_masks"]
__all__ += ["initial_body", "silhouette_ious", "surface_coverage"]
__all__ += ["exact_arccos", "exact_arcsin", "exact_arctan", "exact_arctan2"]
__all__ += ["exact_cos", "exact_eigh", "exact_exp", "exact_expm1"]
__all__ += ["exact_log", "exact_norm", "exact_power", "exact_product"]
__all__ += ["exact_sin", "exact_solve", "exact_tan"]

__version__: str

def backend() -> str:
    """Names the back end that this process uses."""

def backends() -> list[str]:
    """Names all back ends that this machine has, the fastest last."""

def force_backend(name: str) -> None:
    """Lets this process use the back end of a name from now on."""

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
def exact_arctan2(y: float, x: float) -> float:
    """Gives atan2(y, x) of numbers."""

def exact_power(x: float, y: float) -> float:
    """Gives x to the power y, for numbers."""

def exact_product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Multiplies two matrices, sums taken in the order of the inner index."""

def exact_solve(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solves a x = b for the columns of b."""

def exact_eigh(a: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gives the eigenvalues (N) of a symmetric matrix, the least first, and the eigenvectors as
    columns.
    """

def exact_norm(x: NDArray[np.float64]) -> float:
    """Gives the length of a vector."""

# One camera's may be given without a list. What arrays and lists hold is known at run time only.
_Cameras: TypeAlias = Sequence[Camera] | Camera
_Poses: TypeAlias = Sequence[Pose] | Pose
_Images: TypeAlias = Sequence[NDArray[np.uint8] | None] | NDArray[np.uint8]
_Masks: TypeAlias = Sequence[NDArray[Any] | None] | NDArray[Any]
_Depths: TypeAlias = Sequence[NDArray[np.floating] | None] | NDArray[np.floating]
_Points: TypeAlias = NDArray[np.float64]
_Colors: TypeAlias = NDArray[np.uint8]
_Progress: TypeAlias = Callable[[int, float, float], None]

@final
class Pose:
    """
    A rigid motion, an element of SE(3): `a_from_b` maps coordinates in `b` to coordinates in `a`.

    It is made of a homogeneous matrix, (4, 4); PoseError is raised if that is no rigid motion.
    `a_from_b @ b_from_c` is `a_from_c`.
    """

    __array_ufunc__: ClassVar[None]
    """Says that arrays leave `@` to poses."""

    def __new__(cls, matrix: ArrayLike) -> Self: ...
    @staticmethod
    def identity() -> Pose:
        """Gives the motion that moves nothing."""
    @staticmethod
    def from_parts(translation: ArrayLike, quaternion: ArrayLike) -> Pose:
        """Joins a translation (x, y, z) in metres and a unit quaternion (w, x, y, z). Raises
        PoseError.
        """
    @staticmethod
    def from_xyzw(translation: ArrayLike, xyzw: ArrayLike) -> Pose:
        """
        Joins a translation (x, y, z) in metres and a unit quaternion (x, y, z, w), as ROS and SciPy
        order it. Raises PoseError.
        """
    @staticmethod
    def from_rvec_tvec(rvec: ArrayLike, tvec: ArrayLike) -> Pose:
        """
        Joins OpenCV's rotation vector and translation, 3 numbers each, as `solvePnP` gives them: of
        a camera's they are camera_from_object. Raises PoseError.
        """
    @staticmethod
    def from_euler(sequence: str, angles: ArrayLike, translation: ArrayLike | None = None) -> Pose:
        """
        Joins a turn by angles in radians and a translation (x, y, z) in metres. The sequence names
        one to three axes as SciPy does: "xyz" in lower case turns about axes that stay where they
        are, x first; "XYZ" in upper case about axes that turn along. Raises PoseError.
        """
    @staticmethod
    def exp(twist: ArrayLike) -> Pose:
        """Follows a twist (linear, angular), 6 numbers, for unit time. Raises PoseError."""
    def log(self) -> NDArray[np.float64]:
        """Gives the twist (linear, angular), (6,) float64, whose exponential this is."""
    def adjoint(self) -> NDArray[np.float64]:
        """Gives the adjoint, (6, 6) float64, that carries twists (linear, angular) along."""
    def inverse(self) -> Pose:
        """Gives the motion back."""
    def matrix(self) -> NDArray[np.float64]:
        """Gives the homogeneous matrix, (4, 4) float64."""
    def rvec_tvec(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """
        Gives OpenCV's rotation vector and translation, (3,) float64 each, in radians and metres.
        """
    def euler(self, sequence: str) -> NDArray[np.float64]:
        """Gives the three angles in radians about the axes of a sequence, as `from_euler` names it:
        (3,) float64. The second is in -π/2 to π/2, or in 0 to π if the first and the last axis are
        the same; where it leaves only the sum of the others known, the last one is 0. Raises
        PoseError.
        """
    @property
    def translation(self) -> tuple[float, float, float]:
        """Translation (x, y, z) in metres."""
    @property
    def quaternion(self) -> tuple[float, float, float, float]:
        """Unit quaternion (w, x, y, z) with w >= 0."""
    @property
    def xyzw(self) -> tuple[float, float, float, float]:
        """The same unit quaternion as (x, y, z, w), as ROS and SciPy order it."""
    def transform(self, points: ArrayLike) -> NDArray[np.float64]:
        """Moves points, (N, 3), or one point, (3,), in metres: float64 of the same shape. Raises
        PoseError.
        """
    def __matmul__(self, value: Pose, /) -> Pose: ...
    def __rmatmul__(self, value: Pose, /) -> Pose: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Camera:
    """A pinhole camera: pixel (0, 0) is the centre of the top-left pixel.

    It is made of (width, height), (fx, fy) and (cx, cy), all in pixels; CameraError is raised if
    there is no such camera. `Camera.from_matrix` takes OpenCV's K, `Camera.from_fov` an angle of
    view.
    """

    MAX_SIDE_PX: ClassVar[int]
    """Most pixels along a side."""

    def __new__(cls, *, size_px: ArrayLike, focal_px: ArrayLike, center_px: ArrayLike) -> Self: ...
    @staticmethod
    def from_matrix(
        matrix: ArrayLike, size_px: ArrayLike, distortion: ArrayLike | None = None
    ) -> Camera:
        """
        Makes a camera of OpenCV's matrix K, (3, 3), and (width, height) in pixels. A camera has no
        distortion: of `distortion` only zeros are taken, and `Lens.from_matrix` takes others.
        Raises CameraError.
        """
    @staticmethod
    def from_fov(size_px: ArrayLike, fov_deg: float) -> Camera:
        """
        Makes a camera of (width, height) in pixels and its angle of view from the left to the right
        border in degrees, more than 0 and less than 180: its pixels are square and its centre is
        the image's. An angle of view from a data sheet is good to some per cent, and so are then
        all lengths. Raises CameraError.
        """
    def matrix(self) -> NDArray[np.float64]:
        """Gives OpenCV's matrix K, (3, 3) float64."""
    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height) in pixels."""
    @property
    def focal_px(self) -> tuple[float, float]:
        """(fx, fy) in pixels."""
    @property
    def center_px(self) -> tuple[float, float]:
        """Principal point (cx, cy) in pixels."""
    def project(self, points_in_camera: ArrayLike) -> NDArray[np.float64]:
        """Projects points in the camera's frame, (N, 3) float64, to pixels, (N, 2) float64; NaN for
        points that are not in front. Raises CameraError.
        """
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Lens:
    """A camera with a lens that may bend straight lines: pinhole, brown_conrady or kannala_brandt.

    It is made of (width, height), (fx, fy) and (cx, cy), all in pixels, and the coefficients of its
    model in OpenCV's order; CameraError is raised if there is no such lens. `Lens.from_matrix`
    takes OpenCV's K.

    x points right, y down, z forward along the axis; pixel (0, 0) is the centre of the top-left
    pixel.
    """

    def __new__(
        cls,
        *,
        model: str,
        size_px: ArrayLike,
        focal_px: ArrayLike,
        center_px: ArrayLike,
        distortion: ArrayLike | None = None,
    ) -> Self: ...
    @staticmethod
    def from_matrix(
        matrix: ArrayLike,
        size_px: ArrayLike,
        distortion: ArrayLike | None = None,
        *,
        fisheye: bool = False,
    ) -> Lens:
        """Makes a lens of OpenCV's matrix K, (3, 3), (width, height) in pixels and what
        `cv2.calibrateCamera` gives as distortion: none, 4, 5 or 8 coefficients, or more of which
        the rest are zeros; with `fisheye` the 4 of `cv2.fisheye.calibrate`. Raises CameraError.
        """
    def matrix(self) -> NDArray[np.float64]:
        """Gives OpenCV's matrix K, (3, 3) float64."""
    @property
    def model(self) -> str:
        """Name of the model."""
    @property
    def size_px(self) -> tuple[int, int]:
        """(width, height) in pixels."""
    @property
    def focal_px(self) -> tuple[float, float]:
        """(fx, fy) in pixels."""
    @property
    def center_px(self) -> tuple[float, float]:
        """Principal point (cx, cy) in pixels."""
    @property
    def distortion(self) -> tuple[float, ...]:
        """Coefficients of the model: none, 8 or 4."""
    @property
    def limit(self) -> float:
        """Angle off the axis below which the lens sees."""
    def project(self, points_in_lens: ArrayLike) -> NDArray[np.float64]:
        """Projects points in the lens's frame, (N, 3) float64, to pixels, (N, 2) float64; NaN for
        points beyond the limit.
        """
    def rays(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """
        Gives the directions in which pixels, (N, 2) float64, are seen: (N, 3) float64 of length 1;
        NaN where the lens sees nothing.
        """
    def map_to(self, camera: Camera, lens_from_camera: Pose) -> NDArray[np.float32]:
        """Gives where the lens's image holds what each pixel of an ideal camera at the same place
        sees: (H, W, 2) float32 as (u, v), -10000 twice where it does not hold it; raises
        CameraError if lens_from_camera is more than a rotation.
        """
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Body:
    """A rigid set of ellipsoids in the object's frame, and where that frame is in the world.

    It is made of centers (K, 3) and radii (K, 3) in metres and rotations (K, 4) as (w, x, y, z),
    all in the object's frame; BodyError is raised if they make no body.
    """

    MAX_ELLIPSOIDS: ClassVar[int]
    """Most ellipsoids of a body."""

    def __new__(
        cls,
        *,
        world_from_object: Pose,
        centers: ArrayLike,
        radii: ArrayLike,
        rotations: ArrayLike,
    ) -> Self: ...
    @property
    def world_from_object(self) -> Pose:
        """Pose of the object in the world."""
    @property
    def centers(self) -> NDArray[np.float64]:
        """Centres in the object's frame, (K, 3) float64, in metres."""
    @property
    def radii(self) -> NDArray[np.float64]:
        """Radii, (K, 3) float64, in metres."""
    @property
    def rotations(self) -> NDArray[np.float64]:
        """Orientations in the object's frame, (K, 4) float64, as (w, x, y, z)."""
    def __len__(self) -> int: ...
    def outlines(
        self, camera: Camera, world_from_camera: Pose
    ) -> list[tuple[NDArray[np.float64], NDArray[np.float64]] | None]:
        """Gives each ellipsoid's outline as centre (2,) and matrix S (2, 2) of the ellipse (x - c)ᵀ
        S⁻¹ (x - c) = 1, in pixels; None for one not wholly in front of the camera.
        """
    def mass_properties(self) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """
        Gives volume, centroid (3,) and inertia about it (3, 3) of the union at unit density, in the
        object's frame: m³, m and m⁵.
        """
    def silhouette(self, camera: Camera, world_from_camera: Pose) -> NDArray[np.uint8]:
        """Draws the silhouette, (H, W) uint8: 255 where an ellipsoid covers the pixel's centre."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class View:
    """One picture that says where the object is: a camera, its pose, and a mask.

    The mask is (H, W) of bool or whole numbers, not zero on the object. MaskError is raised if none
    or all of its pixels are, ImageError if it has not the camera's size.
    """

    def __new__(cls, *, camera: Camera, world_from_camera: Pose, mask: NDArray[Any]) -> Self: ...
    @property
    def camera(self) -> Camera:
        """The camera."""
    @property
    def world_from_camera(self) -> Pose:
        """Its pose."""
    @property
    def mask(self) -> NDArray[np.uint8]:
        """The mask, (H, W) uint8: 255 on the object and 0 elsewhere."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Mesh:
    """A closed surface of triangles.

    It is made of corners (V, 3) in metres, and triangles (F, 3) of whole numbers that name them,
    counted from 0, counter-clockwise seen from outside; BodyError is raised if it is not closed.
    """

    def __new__(cls, *, vertices: ArrayLike, faces: ArrayLike) -> Self: ...
    @property
    def volume(self) -> float:
        """The volume in cubic metres."""

@final
class Soup:
    """Triangles that need not be closed, nor agree on what is outside.

    It is made of corners (V, 3) in metres, and triangles (F, 3) of whole numbers that name them,
    counted from 0; BodyError is raised if one names a corner that is not there.
    """

    def __new__(cls, *, vertices: ArrayLike, faces: ArrayLike) -> Self: ...
    def windings(self, points: ArrayLike) -> NDArray[np.float64]:
        """Say how often the triangles wind around points (N, 3) in metres, (N,) float64.

        It is 1 inside of a closed surface, 0 outside, and something between where it has holes.
        """

    def openness(self, faces: ArrayLike) -> float:
        """Say, from -1 to 1, how much more of the sky the fronts of some triangles (F, 3) see than
        their backs.

        Raises: BodyError: a triangle names a corner that is not there.
        """

    def rebuilt(
        self, cells: int
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], float] | None:
        """Rebuild a closed surface where the winding number is a half, on a grid with so many cells
        along the longest side; None where nothing is wound around.

        Return corners (V, 3) in metres, triangles (F, 3), how far the winding number leaps across
        the surface at each corner, (V,), about 1 where the surface was given and less where it is
        guessed, and the side of a cell in metres.
        """

@final
class Paint:
    """What a surface looks like.

    Takes a colour in linear RGB, 0 to 1, which multiplies a texture, (H, W, 3) uint8 sRGB, that
    repeats so often over u and v; gloss lies from 0 to 1. Raises SimError.
    """

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
    """A far lamp, and light from above and below.

    Takes the direction towards the lamp in the world, and strengths in linear RGB of the lamp, of
    the light from above and of that from below; raises SimError.
    """

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
class Scene:
    """Visuals, which are shapes with paint, drawn by casting rays.

    Makes an empty scene.
    """

    def __new__(cls) -> Self: ...
    def add_ellipsoid(self, radii: Sequence[float], paint: Paint) -> int:
        """Adds an ellipsoid by its radii in metres and returns its number; raises SimError."""
    def add_capsule(self, radius: float, half_length: float, paint: Paint) -> int:
        """Adds a capsule along z, in metres, and returns its number; raises SimError."""
    def add_cylinder(self, radius: float, half_length: float, paint: Paint) -> int:
        """
        Adds a cylinder with flat ends along z, in metres, and returns its number; raises SimError.
        """
    def add_box(self, half_size: Sequence[float], paint: Paint) -> int:
        """Adds a box by half its sides in metres and returns its number; raises SimError."""
    def add_plane(self, half_size: Sequence[float], paint: Paint) -> int:
        """
        Adds a rectangle in x and y by half its sides in metres, seen from both sides, and returns
        its number; raises SimError.
        """
    def add_mesh(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        paint: Paint,
        texture_coordinates: NDArray[np.float64] | None = None,
        colors: NDArray[np.uint8] | None = None,
    ) -> int:
        """
        Adds triangles, (M, 3) int64, between vertices, (N, 3) float64 in metres, with places in the
        texture, (N, 2) float64 from its first pixel's corner, and colours, (N, 3) uint8 sRGB;
        returns its number and raises SimError.
        """
    @property
    def count(self) -> int:
        """How many visuals there are."""
    def render(
        self,
        *,
        lens: Lens,
        world_from_lens: NDArray[np.float64],
        world_from_visual: NDArray[np.float64],
        lighting: Lighting,
        samples: int | None = None,
        noise: float | None = None,
        seed: int | None = None,
        threads: int | None = None,
    ) -> NDArray[np.uint8]:
        """
        Draws an image, (H, W, 3) uint8 sRGB: poses of the lens, (M, 7), and of all visuals, (M, T,
        7), float64 as (w, x, y, z, tx, ty, tz), at the moments that the samples x samples rays of a
        pixel take in turn; noise in grey levels. Raises SimError.
        """
    def depth(
        self,
        *,
        lens: Lens,
        world_from_lens: NDArray[np.float64],
        world_from_visual: NDArray[np.float64],
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Gives depth along the lens's z through each pixel's centre, (H, W) float32 in metres, NaN
        where nothing is, and the numbers of the visuals, (H, W) int32, -1 where nothing is: for one
        pose of the lens, (7,), and of all visuals, (T, 7), float64. Raises SimError.
        """

@final
class ModelInput:
    """What modelling starts from: views, a closed mesh, and seen points of the surface.

    Joins views; a mesh; seen points (N, 3) in metres with the directions (N, 3) in which they were
    seen, float64, as long as the eye is away or short where only the side is known; and how often
    each kind counts, None being the core's default. Raises BodyError.
    """

    def __new__(
        cls,
        *,
        views: Sequence[View] | None = None,
        mesh: Mesh | None = None,
        points: ArrayLike | None = None,
        directions: ArrayLike | None = None,
        silhouette_weight: float | None = None,
        volume_weight: float | None = None,
        depth_weight: float | None = None,
    ) -> Self: ...

@final
class ModelSettings:
    """How modelling proceeds; every default is written in the core.

    Takes the defaults, except where a value is given; `quick` searches less, for a body that is
    only a step to another.
    """

    MAX_THREADS: ClassVar[int]
    """Most worker threads."""

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
    def max_ellipsoids(self) -> int:
        """Most ellipsoids."""
    @property
    def delta(self) -> float:
        """Least gain in F for which another ellipsoid is added; 0 goes on to the maximum."""
    @property
    def held_out(self) -> bool:
        """Whether a part of the evidence is held out to choose the count by."""
    @property
    def seed(self) -> int:
        """Seed of every search."""
    @property
    def threads(self) -> int:
        """Worker threads; 0 takes as many as the machine has. The result does not depend on it."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class PaperSettings:
    """How the paper's own method proceeds; every default is written in the core.

    Takes the defaults, except where a value is given.
    """

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
    def max_ellipsoids(self) -> int:
        """Most ellipsoids."""
    @property
    def delta(self) -> float:
        """Least gain in F for which another ellipsoid is kept."""
    @property
    def seed(self) -> int:
        """Seed of every search."""
    @property
    def threads(self) -> int:
        """Worker threads; 0 takes as many as the machine has. The result does not depend on it."""
    @property
    def points(self) -> int:
        """Points on each surface, and on each envelope."""
    @property
    def alpha(self) -> float | None:
        """Margin of the envelopes as a share of each ellipsoid's smallest radius; None if it is a
        length.
        """
    @property
    def alpha_m(self) -> float | None:
        """Margin of the envelopes in metres, one for all ellipsoids; None if it is a share."""
    @property
    def population(self) -> int:
        """Individuals a generation."""
    @property
    def generations(self) -> int:
        """Generations for each ellipsoid."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Step:
    """What modelling had reached with one count of ellipsoids."""

    @property
    def count(self) -> int:
        """Ellipsoids."""
    @property
    def fitness(self) -> float:
        """F: the agreement with all that was given, at the resolution of the fit; of the paper's
        method its own.
        """
    @property
    def body(self) -> Body:
        """The body."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class TrackSettings:
    """How tracking proceeds; every default is written in the core.

    Takes the defaults, except where a value is given.
    """

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
        depth_from_motion: bool | None = None,
    ) -> Self: ...
    @property
    def seed(self) -> int:
        """Seed of every search."""
    @property
    def population(self) -> int:
        """Hypotheses a generation."""
    @property
    def generations(self) -> int:
        """Generations an image."""
    @property
    def budget_s(self) -> float | None:
        """Seconds after which no further generation is begun; None leaves it to the counts."""
    @property
    def surface(self) -> bool:
        """Whether surface points are learned and scored."""
    @property
    def region(self) -> bool:
        """Whether colours are learned and scored."""
    @property
    def local_colors(self) -> bool:
        """Whether the background's colours are told apart by where they lie."""
    @property
    def adjust(self) -> bool:
        """Whether keyframes and surface points are adjusted together, in a thread of its own."""
    @property
    def depth_from_motion(self) -> bool:
        """Whether motion tells the distances of points that one camera sees alone."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Estimate:
    """Where the object is, and how well that is known.

    Two estimates are equal if they say the same, whatever time they took.
    """

    @property
    def time_s(self) -> float:
        """When, in seconds."""
    @property
    def world_from_object(self) -> Pose:
        """
        Pose of the object in the world; while it is not tracked, where it was last or is supposed.
        """
    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of a small motion (linear, angular) of the object in its own frame, (6, 6)
        float64, in metres and radians.
        """
    @property
    def unobservable(self) -> NDArray[np.float64]:
        """
        Unit motions that the images leave open, (K, 6) float64: linear in object sizes, angular in
        radians, in the object's frame.
        """
    @property
    def confidence(self) -> float:
        """
        Probability that the pose is right, 0 to 1: not more than 20 mm, or a tenth of the object's
        diameter if that is more, and 15 degrees off.
        """
    @property
    def evidence(self) -> dict[str, float] | None:
        """
        What speaks for the pose, where the object is followed, else None: `share` of what should be
        seen that is; `recognised`, surface points a camera, `textured`, those with the contrast of
        a pattern, and `reference_textured`; `proved`, 1 if the object was never lost or is proved
        to be the one that was; `turn_rad`, `jitter_rad` and `drift_rad`, standard deviations of the
        turn by the images' noise, by what poses differ from image to image without any motion, and
        since the first image.
        """
    @property
    def status(self) -> str:
        """What the tracker believes: "tracking", "searching" or "lost"."""
    @property
    def located(self) -> bool:
        """
        Whether the images confirm where the object is; its turn, too, if the status is "tracking".
        """
    @property
    def keyframes(self) -> list[tuple[int, Pose]]:
        """
        Number and pose, world_from_object, of the keyframe that the pose belongs to, if the object
        is followed, and of the one that the last pose belonged to if that was another one: as its
        keyframe is corrected later, so is the pose.
        """
    @property
    def evolved(self) -> bool:
        """Whether the body changed since the last estimate, as it evolved in the worker."""
    @property
    def notices(self) -> list[str]:
        """What was wrong with the observation, in words."""
    @property
    def evaluations(self) -> int:
        """Hypotheses that were scored."""
    @property
    def seconds(self) -> dict[str, float]:
        """Seconds that each stage took: prepare, search, refine, verify, update."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class OneStepSettings:
    """How the 1-step genetic algorithm tracks; every default is written in the core.

    Takes the defaults, except where a value is given.
    """

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
    def seed(self) -> int:
        """Seed of the search."""
    @property
    def turns(self) -> bool:
        """Whether the orientation is sought, too, and not only the place."""
    @property
    def region(self) -> bool:
        """Whether whole areas are scored, and not the paper's points."""
    @property
    def points(self) -> int | None:
        """Points on each surface, and on each envelope; None if whole areas are scored."""
    @property
    def alpha(self) -> float | None:
        """
        Margin of the envelopes as a share of each ellipsoid's smallest radius; None if whole areas
        are scored.
        """
    @property
    def reach(self) -> float:
        """How far from the last place the next one is sought, along each axis, in object sizes."""
    @property
    def turn(self) -> float:
        """How far the next orientation is sought from the last, about each axis, in radians."""
    @property
    def population(self) -> int:
        """Individuals a generation."""
    @property
    def elites(self) -> int:
        """Best individuals that live on unchanged."""
    @property
    def mutation_rate(self) -> float:
        """Share of genes that mutate."""
    @property
    def mutation_width(self) -> float:
        """
        Standard deviation of a mutation in the first generation, as a share of the gene's range.
        """
    @property
    def least_width(self) -> float:
        """Standard deviation below which success never narrows a mutation, as the same share."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class OneStepTracker:
    """Tracks a body by one generation of a genetic algorithm an image, as the paper does.

    Joins the cameras, the body that is followed, and how; raises TrackError, ImageError.
    """

    def __new__(
        cls, cameras: _Cameras, body: Body, settings: OneStepSettings | None = None
    ) -> Self: ...
    def start(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        world_from_object: Pose,
        masks: _Masks | None = None,
    ) -> Estimate:
        """
        Starts with the object at a known pose, and learns its colours from masks, (H, W) uint8, or
        from the body's outline where there is none. Images are (H, W) or (H, W, 3) uint8, None
        where a camera delivered nothing. Raises TrackError, ImageError, MaskError.
        """
    def step(self, time_s: float, world_from_camera: _Poses, images: _Images) -> Estimate:
        """
        Says where the object is in the next images, None where a camera delivered nothing. Raises
        TrackError, ImageError.
        """
    def set_orientation(self, world_from_object: ArrayLike) -> None:
        """
        Tells the orientation of the object in the world, a unit quaternion (w, x, y, z), where it
        is known. Raises TrackError before the start, PoseError.
        """

@final
class Tracker:
    """Follows a body in six degrees of freedom from observation to observation.

    Makes a tracker for cameras and a body; raises TrackError.
    """

    TAKES_DEPTHS: ClassVar[bool]

    def __new__(
        cls, cameras: _Cameras, body: Body, settings: TrackSettings | None = None
    ) -> Self: ...
    def start(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        world_from_object: Pose,
        masks: _Masks | None = None,
        depths: _Depths | None = None,
    ) -> Estimate:
        """Learns colours and surface points from images in which the object's pose is known; masks,
        (H, W) uint8 and None where there is none, tell its pixels. Raises TrackError.
        """
    def find(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        near: Pose | None = None,
        depths: _Depths | None = None,
    ) -> Estimate:
        """
        Seeks the object with all that is known of it, near a pose if one is given, and goes on from
        there. Raises TrackError.
        """
    def step(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        depths: _Depths | None = None,
    ) -> Estimate:
        """
        Says where the object is in the next images, None where a camera delivered nothing; `depths`
        are depth images in their pixels, (H, W) float32, metres along z. Raises TrackError.
        """
    def score_terms(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        poses: ArrayLike,
        *,
        resolution: int = 0,
        threads: int = 0,
    ) -> _Points:
        """
        Scores poses in images, by what was learned so far: poses (N, 7) float64, world_from_object
        as (w, x, y, z, tx, ty, tz); (N, 2) float64, by regions and by surface points, whose sum is
        the whole. Surface points are compared at a `resolution`, 0 the image's own, 2 the coarsest.
        Nothing is learned. Raises TrackError, PoseError.
        """
    def appearance(self) -> bytes:
        """What the object looks like, as far as it was learned, as bytes."""
    def recall(self, appearance: bytes) -> None:
        """Takes over what the object looks like, as `appearance` gave it. Raises TrackError."""
    def begin_evolving(self) -> bool:
        """Begins to let the body evolve by the sides that were seen, in a thread of its own; says
        whether there is anything new. An estimate says when it has `evolved`: the fifth from now
        on.
        """
    def evolve(self) -> bool:
        """Lets the body evolve by the sides that were seen, between images, and waits for it; says
        whether it changed. Raises TrackError, ModelError.
        """
    def keyframe_pose(self, number: int) -> Pose | None:
        """
        Where the object stood at a keyframe, by its number in `Estimate.keyframes`, as far as that
        is known by now; None if there was none.
        """
    @property
    def body(self) -> Body:
        """The body, at its newest pose."""
    @property
    def surface(self) -> tuple[_Points, _Points, NDArray[np.uint8]]:
        """The surface points: (N, 3) float64 in metres and their normals (N, 3) float64, in the
        object's frame, and their colours (N, 3) uint8.
        """

def fit_body(
    given: ModelInput, settings: ModelSettings, progress: _Progress | None = None
) -> list[Step]:
    """
    Models what is given; gives one step for each count of ellipsoids. `progress` is called with the
    count, F and the share of the work that is done; what it raises ends the work. Raises
    ModelError.
    """

def fit_paper(
    views: Sequence[View], settings: PaperSettings, progress: _Progress | None = None
) -> list[Step]:
    """Models what the views show by the paper's own method, the mask of each being where the hue
    matches; gives one step for each count of ellipsoids. `progress` is called with the count, F and
    the share of the work that is done; what it raises ends the work. Raises ModelError.
    """

def paper_scores(
    views: Sequence[View], body: Body, poses: ArrayLike, settings: PaperSettings
) -> _Points:
    """Scores a body at poses by the paper's fitness, the mask of each view being where the hue
    matches: poses (N, 7) float64, world_from_object as (w, x, y, z, tx, ty, tz), scores (N,)
    float64. Of the settings only points, alpha and threads count. Raises ModelError, PoseError.
    """

def initial_body(
    views: Sequence[View],
    images: Sequence[NDArray[np.uint8]],
    pictures: Sequence[tuple[Camera, Pose, NDArray[np.uint8]]],
    settings: ModelSettings,
    points: ArrayLike | None = None,
    directions: ArrayLike | None = None,
) -> Body:
    """Models the object roughly from views with their images, which teach its colours, and pictures
    that do not say where it is: (camera, world_from_camera, image). Points (N, 3) of its surface
    and the directions (N, 3) in which they were seen say where to look, if given. Raises
    ModelError.
    """

def surface_coverage(
    body: Body,
    views: Sequence[View],
    points: ArrayLike | None = None,
    directions: ArrayLike | None = None,
) -> tuple[_Points, float, tuple[float, float, float] | None]:
    """Says which share of each ellipsoid's surface (K,) float64 the views or the seen points show,
    which share of the whole, and the direction in the object's frame to the side that they do not
    show, None if there is none or it lies all around.
    """

def silhouette_ious(body: Body, views: Sequence[View]) -> _Points:
    """Gives the intersection over union of the body's silhouette and the mask in each view, (V,)
    float64.
    """

def pose_from_masks(
    body: Body,
    views: Sequence[View],
    images: Sequence[_Colors] | None = None,
    colors: _Colors | None = None,
    seed: int = 0,
) -> tuple[Pose, float]:
    """Finds the pose at which a body's outlines agree with masks, and how well they do there. Turns
    that look alike are told apart by the colours of its ellipsoids, (K, 3) uint8, in images, one a
    view. Raises TrackError.
    """

def ellipsoid_colors(body: Body, views: Sequence[View], images: Sequence[_Colors]) -> _Colors:
    """
    Gives each ellipsoid's median colour over the images in which it is foremost, (K, 3) uint8.
    """

def taken_image(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Takes an image, (H, W) or (H, W, 3) uint8, and gives it as (H, W, 3); raises ImageError."""

def taken_mask(mask: NDArray[Any]) -> NDArray[np.uint8]:
    """
    Takes a mask, (H, W) of bool or whole numbers, and gives it as uint8: 255 where it is not zero.
    Raises MaskError.
    """

def taken_depth(depth: NDArray[np.floating]) -> NDArray[np.float32]:
    """Takes a depth image, (H, W) of floats, metres along z, and gives it as float32; raises
    ImageError.
    """
