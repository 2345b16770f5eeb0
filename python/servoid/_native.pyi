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
__all__ += ["Measurement", "Motion", "MotionModel", "MotionPrior", "Noise", "poses_from_masks"]
__all__ += ["Balls", "Chain", "HandLimits", "JointLimits", "Moving", "QuadraticLaw"]
__all__ += ["VelocityLimits", "Workspace", "change_between", "fixation", "hand_correction"]
__all__ += ["hand_weights", "lost_speed", "newton_turn", "predicted_motion", "quaternion_error"]
__all__ += ["seen_from_head", "shifted_and_turned", "spread_at", "stoppable_speed"]
__all__ += ["certain_twist", "exact_is_finite", "is_between", "twist_shares", "twist_within"]
__all__ += ["initial_body", "silhouette_ious", "surface_coverage"]
__all__ += ["exact_arccos", "exact_arcsin", "exact_arctan", "exact_arctan2"]
__all__ += ["exact_cos", "exact_eigh", "exact_exp", "exact_expm1"]
__all__ += ["exact_log", "exact_norm", "exact_power", "exact_product"]
__all__ += ["exact_sin", "exact_solve", "exact_tan"]

__version__: str

def backend() -> str:
    """Returns the name of the backend that this process uses."""

def backends() -> list[str]:
    """Returns the names of all backends of this machine, the fastest last."""

def force_backend(name: str) -> None:
    """Makes this process use the backend of a name from now on."""

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
    """Returns atan2(y, x) of numbers."""

def exact_power(x: float, y: float) -> float:
    """Returns x to the power y, for numbers."""

def exact_product(*factors: NDArray[np.float64]) -> NDArray[np.float64]:
    """
    Multiplies matrices from the left; the first or the last may be a vector. Sums are in the order
    of the inner index.
    """

def exact_solve(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solves a x = b for each column of b."""

def exact_eigh(a: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Returns the eigenvalues (N) of a symmetric matrix, the least first, and the eigenvectors as
    columns.
    """

def exact_norm(x: NDArray[np.float64]) -> float:
    """Returns the length of a vector."""

def exact_is_finite(x: NDArray[np.float64]) -> bool:
    """Returns whether all numbers of an array are finite."""

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

    It is constructed from a homogeneous matrix, (4, 4); PoseError is raised if that is not a rigid
    motion. `a_from_b @ b_from_c` is `a_from_c`.
    """

    __array_ufunc__: ClassVar[None]
    """Says that arrays leave `@` to poses."""

    def __new__(cls, matrix: ArrayLike) -> Self: ...
    @staticmethod
    def identity() -> Pose:
        """Returns the identity."""
    @staticmethod
    def from_parts(translation: ArrayLike, quaternion: ArrayLike) -> Pose:
        """
        Makes a pose of a translation (x, y, z) in metres and a unit quaternion (w, x, y, z). Raises
        PoseError.
        """
    @staticmethod
    def from_xyzw(translation: ArrayLike, xyzw: ArrayLike) -> Pose:
        """
        Makes a pose of a translation (x, y, z) in metres and a unit quaternion (x, y, z, w), in the
        order of ROS and SciPy. Raises PoseError.
        """
    @staticmethod
    def from_rvec_tvec(rvec: ArrayLike, tvec: ArrayLike) -> Pose:
        """Makes a pose of OpenCV's rotation vector and translation, 3 numbers each, as `solvePnP`
        returns them, in radians and metres: for a camera they are camera_from_object. Raises
        PoseError, also for a rotation of more than two turns, as degrees are.
        """
    @staticmethod
    def from_euler(
        sequence: str,
        angles: ArrayLike,
        translation: ArrayLike | None = None,
        *,
        degrees: bool = False,
    ) -> Pose:
        """Makes a pose of a rotation by angles in radians, or in degrees if so given, and a
        translation (x, y, z) in metres. The sequence names one to three axes as in SciPy: "xyz" in
        lower case rotates about fixed axes, x first; "XYZ" in upper case about axes that rotate
        with the object. Raises PoseError, also for radians of more than two turns, as degrees are.
        """
    @staticmethod
    def exp(twist: ArrayLike) -> Pose:
        """Integrates a twist (linear, angular), 6 numbers, over unit time. Raises PoseError."""
    def log(self) -> NDArray[np.float64]:
        """Returns the twist (linear, angular), (6,) float64, whose exponential is this pose."""
    def adjoint(self) -> NDArray[np.float64]:
        """Returns the adjoint, (6, 6) float64, which transforms twists (linear, angular)."""
    def inverse(self) -> Pose:
        """Returns the inverse motion."""
    def matrix(self) -> NDArray[np.float64]:
        """Returns the homogeneous matrix, (4, 4) float64."""
    def rvec_tvec(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """
        Returns OpenCV's rotation vector and translation, (3,) float64 each, in radians and metres.
        """
    def euler(self, sequence: str, *, degrees: bool = False) -> NDArray[np.float64]:
        """Returns the three angles in radians, or in degrees if so asked, about the axes of a
        sequence, named as in `from_euler`: (3,) float64. The second is in -π/2 to π/2, or in 0 to π
        if the first and the last axis are the same. Where only the sum of the first and the last
        angle is determined, the last one is 0. Raises PoseError.
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
        """
        Transforms points, (N, 3), or one point, (3,), in metres: float64 of the same shape. Raises
        PoseError.
        """
    def __matmul__(self, value: Pose, /) -> Pose: ...
    def __rmatmul__(self, value: Pose, /) -> Pose: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Camera:
    """A pinhole camera: pixel (0, 0) is the centre of the top-left pixel.

    It is constructed from (width, height), (fx, fy) and (cx, cy), all in pixels; CameraError is
    raised if they do not make a camera. `Camera.from_matrix` takes OpenCV's K, `Camera.from_fov` an
    angle of view.
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
        distortion, so `distortion` must be zeros; `Lens.from_matrix` takes other values. Raises
        CameraError.
        """
    @staticmethod
    def from_fov(size_px: ArrayLike, fov_deg: float) -> Camera:
        """
        Makes a camera of (width, height) in pixels and the angle of view from the left to the right
        border of the image in degrees, 3 to 160. Its pixels are square and its principal point is
        the centre of the image. An angle of view from a data sheet is accurate to a few per cent,
        and so are all lengths that follow from it. Raises CameraError.
        """
    def matrix(self) -> NDArray[np.float64]:
        """Returns OpenCV's matrix K, (3, 3) float64."""
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
    """A camera with a lens that may have distortion: pinhole, brown_conrady or kannala_brandt.

    It is constructed from (width, height), (fx, fy) and (cx, cy), all in pixels, and the
    coefficients of its model in OpenCV's order; CameraError is raised if they do not make a lens.
    `Lens.from_matrix` takes OpenCV's K.

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
        """
        Makes a lens of OpenCV's matrix K, (3, 3), (width, height) in pixels and the distortion that
        `cv2.calibrateCamera` returns: none, 4, 5 or 8 coefficients, or more if the rest are zeros;
        with `fisheye` the 4 of `cv2.fisheye.calibrate`. Raises CameraError.
        """
    def matrix(self) -> NDArray[np.float64]:
        """Returns OpenCV's matrix K, (3, 3) float64."""
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
        """Angle off the axis, in radians, up to which the lens sees."""
    def project(self, points_in_lens: ArrayLike) -> NDArray[np.float64]:
        """Projects points in the lens's frame, (N, 3) float64, to pixels, (N, 2) float64; NaN for
        points beyond the limit.
        """
    def rays(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """
        Returns the directions in which pixels, (N, 2) float64, are seen: (N, 3) float64 of length
        1; NaN where the lens sees nothing.
        """
    def map_to(self, camera: Camera, lens_from_camera: Pose) -> NDArray[np.float32]:
        """Returns, for each pixel of an ideal camera at the same position, where the lens's image
        shows the same direction: (H, W, 2) float32 as (u, v), -10000 twice where the image does not
        contain it; raises CameraError if lens_from_camera is more than a rotation.
        """
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Body:
    """A rigid set of ellipsoids in the object's frame, and the pose of that frame in the world.

    It is constructed from centers (K, 3) and radii (K, 3) in metres and rotations (K, 4) as (w, x,
    y, z), all in the object's frame; BodyError is raised if they do not make a body.
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
        """
        Returns each ellipsoid's outline as centre (2,) and matrix S (2, 2) of the ellipse (x - c)ᵀ
        S⁻¹ (x - c) = 1, in pixels; None for an ellipsoid not completely in front of the camera.
        """
    def mass_properties(self) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Returns volume, centroid (3,) and inertia about the centroid (3, 3) of the union at unit
        density, in the object's frame: m³, m and m⁵.
        """
    def shares_place(self, other: Body) -> bool:
        """
        Returns whether two bodies are at one place, as two solid objects never are: each has 0.4 of
        its volume or more inside the other.
        """
    def silhouette(self, camera: Camera, world_from_camera: Pose) -> NDArray[np.uint8]:
        """Draws the silhouette, (H, W) uint8: 255 where an ellipsoid covers the pixel's centre."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class View:
    """An image in which the object is marked: a camera, its pose, and a mask.

    The mask is (H, W) of bool or whole numbers, not zero on the object. MaskError is raised if none
    or all of its pixels are, ImageError if it does not have the camera's size.
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

    It is constructed from vertices (V, 3) in metres, and triangles (F, 3) of whole numbers that
    refer to them, counted from 0, counter-clockwise seen from outside; BodyError is raised if it is
    not closed.
    """

    def __new__(cls, *, vertices: ArrayLike, faces: ArrayLike) -> Self: ...
    @property
    def volume(self) -> float:
        """Volume in cubic metres."""

@final
class Soup:
    """Triangles that need not be closed or consistently oriented.

    It is constructed from vertices (V, 3) in metres, and triangles (F, 3) of whole numbers that
    refer to them, counted from 0; BodyError is raised if one refers to a vertex that does not
    exist.
    """

    def __new__(cls, *, vertices: ArrayLike, faces: ArrayLike) -> Self: ...
    def windings(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the winding numbers of the triangles around points (N, 3) in metres, (N,) float64.

        A winding number is 1 inside a closed surface, 0 outside, and a value in between where it
        has holes.
        """

    def openness(self, faces: ArrayLike) -> float:
        """
        Return, from -1 to 1, how much more of the sky the fronts of some triangles (F, 3) see than
        their backs.

        Raises: BodyError: a triangle refers to a vertex that does not exist.
        """

    def rebuilt(
        self, cells: int
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], float] | None:
        """
        Rebuild a closed surface where the winding number is a half, on a grid with this many cells
        along the longest side; None if the triangles enclose nothing.

        Return vertices (V, 3) in metres, triangles (F, 3), the jump of the winding number across
        the surface at each vertex, (V,), about 1 on the given triangles and less where the surface
        is interpolated, and the side of a cell in metres.

        Raises: BodyError: there are too many cells.
        """

@final
class MotionModel:
    """
    A motion model of one coordinate, driven by white-noise jerk of density `jerk` per s² and root
    s.
    """

    @staticmethod
    def singer(jerk: float, lasting_s: float) -> MotionModel:
        """Makes a model whose acceleration decays with time constant `lasting_s` (Singer model)."""
    @staticmethod
    def oscillation(jerk: float, period_s: float) -> MotionModel:
        """Makes a model of an oscillation about any position, with period `period_s`."""
    def moved(self, span_s: float) -> NDArray[np.float64]:
        """Returns (3, 3): what position, speed and acceleration become in a time."""

@final
class MotionPrior:
    """The expected kinds of motion, and the correlation time of estimation errors.

    At rest, the position is a random walk of `rest` per root s; in motion, it follows one of
    several models. Each mode lasts about `change_s`. Errors that estimates share decay with
    `lasting_s`.
    """

    def __new__(
        cls, rest: float, models: Sequence[MotionModel], change_s: float, lasting_s: float
    ) -> Self: ...

@final
class Noise:
    """The uncertainty of an estimate.

    `fresh` is the covariance (n, n) of errors that are independent in each estimate, `lasting` the
    standard deviation, along any axis, of errors that successive estimates share. Earlier shared
    errors decay within `fading_s`, faster than new ones arise if the estimates have become certain.
    """

    def __new__(cls, fresh: NDArray[np.float64], lasting: float, fading_s: float) -> Self: ...

@final
class Measurement:
    """A measurement of a motion."""

    @staticmethod
    def along(axes: NDArray[np.float64], noise: Noise) -> Measurement:
        """Returns the measurement of an estimate along axes (k, n): position plus shared error."""
    @staticmethod
    def of_place(axes: NDArray[np.float64], spread: NDArray[np.float64]) -> Measurement:
        """
        Returns a measurement of the position along axes (k, n), of covariance `spread` (n, n).
        """
    def and_resting(self, axes: NDArray[np.float64], speed: float) -> Measurement:
        """Adds the pseudo-measurement of zero speed along axes (m, n), of deviation `speed`."""

@final
class Motion:
    """Coordinates (n,), their speed and acceleration, and the shared error of estimates.

    Kalman filters, one for rest and one for each motion model, are weighted by their likelihood:
    interacting multiple models. The state (4 n,) of each is (offset, speed, acceleration, shared
    error of estimates), and offsets are relative to a reference that `settle` moves. It is made of
    an estimate at the reference, and the initial standard deviations of speed and acceleration.
    """

    def __new__(cls, prior: MotionPrior, noise: Noise, spread: tuple[float, float]) -> Self: ...
    @property
    def going(self) -> float:
        """The probability of motion, 0 to 1."""
    def ahead(self, span_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Predicts state (4 n,) and covariance (4 n, 4 n) at a time after the newest estimate."""
    def advance(self, elapsed_s: float, noise: Noise) -> None:
        """
        Advances all filters to the time of an estimate with the given noise; raises ServoError.
        """
    def correct(
        self, measurement: Measurement, offset: NDArray[np.float64], nis_gate: float
    ) -> float:
        """Corrects by a measurement, given as its offset (k,) from the value at the reference.

        Returns the normalised innovation squared (NIS) of the filter that fits better; beyond
        `nis_gate` the measurement is down-weighted. Raises ServoError.
        """
    def inflate(self, unknown: NDArray[np.float64]) -> None:
        """Adds a covariance (n, n) to that of the offset; raises ServoError."""
    def settle(self) -> NDArray[np.float64]:
        """Moves the reference to the estimated position; returns the shift, (n,)."""

def predicted_motion(
    motions: tuple[Motion, Motion],
    hidden: NDArray[np.float64],
    unobservable: NDArray[np.float64],
    span_s: float,
) -> tuple[
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
    NDArray[np.float64],
]:
    """
    Predicts an object by the motions of its position and its rotation, of 3 coordinates each, at a
    time after the newest estimate.

    Returns translation and rotation from the reference (6,), their rates (6,), the rates of these
    (6,), and the covariances (6, 6) of translation and rotation and of their rates, 0 about
    unobservable axes. `hidden` (2, 3, 3) is added to the former, and `unobservable` (3, 3) is the
    projection onto the axes about which the rotation is unobservable. Raises ServoError.
    """

def certain_twist(
    motion: tuple[ArrayLike, ArrayLike, NDArray[np.float64]],
    after_s: float,
    sure: tuple[float, float],
) -> NDArray[np.float64]:
    """Returns the twist (6,) of an object after a time, as far as it is certain.

    `motion` are its twist (6,), its acceleration (6,) and the covariance (6, 6) of the twist. The
    two parts of the twist are shortened if their deviations exceed `sure`, in m/s and rad/s. Raises
    ServoError.
    """

def spread_at(covariance: NDArray[np.float64], lever: ArrayLike) -> float:
    """Returns the standard deviation, in m, of a point fixed to an object, at `lever` (3,) from its
    origin in the world.

    `covariance` (6, 6) is that of a small translation and rotation of the object in the world.
    Raises ServoError.
    """

def shifted_and_turned(pose: Pose, change: ArrayLike) -> Pose:
    """Translates `a_from_b` by change[:3] and rotates it about b's origin by change[3:], in `a`, in
    metres and radians. Raises PoseError.
    """

def change_between(before: Pose, after: Pose) -> NDArray[np.float64]:
    """
    Returns translation and rotation (6,), in `a`, from one `a_from_b` to another. Raises PoseError.
    """

@final
class Moving:
    """A rigid motion `a_from_b` with its derivatives, all (4, 4) float64.

    `first` and `second` are the time derivatives of `matrix`, in 1/s and 1/s². The product of
    `a_from_b` and `b_from_c` is `a_from_c`, by the product rule.
    """

    @staticmethod
    def at_rest(pose: Pose) -> Moving:
        """Returns a constant motion."""
    @staticmethod
    def from_twist(pose: Pose, twist: ArrayLike, acceleration: ArrayLike | None = None) -> Moving:
        """Returns `a_from_b` with the velocity of b's origin and the angular velocity of b, in `a`.

        `twist` is (6,) in m/s and rad/s, `acceleration` its derivative, 0 if left out. Raises
        ServoError.
        """
    @property
    def matrix(self) -> NDArray[np.float64]:
        """The homogeneous matrix of the present pose."""
    @property
    def first(self) -> NDArray[np.float64]:
        """The first derivative of the matrix by time, in 1/s."""
    @property
    def second(self) -> NDArray[np.float64]:
        """The second derivative of the matrix by time, in 1/s²."""
    @property
    def pose(self) -> Pose:
        """The present pose."""
    @property
    def twist(self) -> NDArray[np.float64]:
        """The velocity of b's origin in m/s and of b's rotation in rad/s, (6,), in `a`."""
    def inverse(self) -> Moving:
        """Returns `b_from_a`."""
    def __matmul__(self, value: Moving, /) -> Moving: ...
    def __rmatmul__(self, value: Moving, /) -> Moving: ...

def hand_correction(
    hand_from_goal: Moving, world_from_hand: Pose, gains: tuple[float, float, float, float]
) -> NDArray[np.float64]:
    """Returns the hand's desired velocity (6,), linear and angular in the world, by the paper's PD
    law.

    The gains are of the position, of its rate, of the rotation, and of its rate. Raises PoseError.
    """

def quaternion_error(hand_from_goal: Moving) -> NDArray[np.float64]:
    """Returns the vector part (3,) of the shorter unit quaternion of the rotation to the goal."""

def twist_shares(twist: ArrayLike, linear: float, angular: float) -> NDArray[np.float64]:
    """Returns factors (2,), at most 1, that limit a twist's two parts to the given lengths. Raises
    ServoError.
    """

def twist_within(twist: ArrayLike, linear: float, angular: float) -> NDArray[np.float64]:
    """Returns a twist (6,) whose linear and angular parts have at most the given lengths. Raises
    ServoError.
    """

def fixation(
    half_baseline: float, point: ArrayLike, velocity: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """
    Returns the gaze at a point (3,) that moves at a velocity (3,), in the head's frame: angles (3,)
    of tilt, left and right pan, and their rates (3,). Raises ServoError.
    """

def seen_from_head(
    world_from_hand: Pose,
    hand_from_head: Pose,
    hand_twist: ArrayLike,
    point: ArrayLike,
    velocity: ArrayLike,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Returns position and velocity (3,) in the head of a point (3,) that moves in the world.

    `hand_twist` (6,) is the hand's own motion in the world, which the head shares. Raises
    ServoError.
    """

@final
class Chain:
    """A chain of revolute joints whose base is the world, with a hand at its end.

    Each link, as (twist, along) in radians and metres by modified Denavit-Hartenberg parameters,
    turns the former joint's frame about its x axis and shifts it along the new z axis, about which
    the joint turns. Raises ServoError if there is none.
    """

    def __new__(cls, links: Sequence[tuple[float, float]], flange_from_hand: Pose) -> Self: ...
    def world_from_hand(self, positions: ArrayLike) -> Pose:
        """
        Returns the pose of the hand for angles (N,) in radians, of which those after the chain's do
        not move it. Raises ServoError, or PoseError if an angle is not finite.
        """
    def jacobian(self, positions: ArrayLike) -> NDArray[np.float64]:
        """Returns (6, N) float64: the hand's velocity, linear and angular in the world, by joint.
        Raises ServoError.
        """

@final
class QuadraticLaw:
    """Differential inverse kinematics as a small quadratic program.

    `posture` (n,) are the preferred angles, `posture_gain` is in 1/s, `angular_weight` the metres
    that weigh as much as a radian; directions whose gain is less than `damped_below` are damped by
    up to `damping`, in m/s per rad/s. Raises ServoError.
    """

    def __new__(
        cls,
        posture: ArrayLike,
        posture_gain: float,
        angular_weight: float,
        damping: float,
        damped_below: float,
    ) -> Self: ...
    def setpoint(
        self, jacobian: ArrayLike, positions: ArrayLike, twist: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Returns the best joint speeds (n,) without bounds, in rad/s, and the weights (n, n) of
        deviations from them.

        `jacobian` is (6, n), `positions` (n,) are the joints' angles, and `twist` (6,) is the
        hand's desired velocity in the world. Raises ServoError.
        """

def is_between(numbers: ArrayLike, lower: ArrayLike, upper: ArrayLike) -> bool:
    """Returns whether each of numbers (N,) is from its lower to its upper bound, (N,) each; NaN is
    not. Raises ServoError.
    """

def hand_weights(jacobian: ArrayLike, angular_weight: float) -> NDArray[np.float64]:
    """Returns weights (n, n) that measure deviations of the hand, and hardly null-space motion.

    `jacobian` is (6, n), and `angular_weight` the metres that weigh as much as a radian. Raises
    ServoError.
    """

def lost_speed(
    jacobian: ArrayLike, twist: ArrayLike, angular_weight: float, damped_below: float
) -> float:
    """Returns the part of a hand's velocity (6,) in nearly singular directions of its arm, in m/s.

    `jacobian` is (6, n), `angular_weight` the metres that weigh as much as a radian, and
    `damped_below` the gain below which a direction is nearly singular. Raises ServoError.
    """

def newton_turn(jacobian: ArrayLike, change: ArrayLike) -> NDArray[np.float64]:
    """
    Returns the turns (n,), in rad, of a damped Newton step of n joints that changes the pose of a
    hand by translation and rotation (6,). `jacobian` is (6, n). Raises ServoError.
    """

def stoppable_speed(
    room: ArrayLike, deceleration: ArrayLike, reaction_s: float
) -> NDArray[np.float64]:
    """Returns the greatest speeds that stop within `room`, an array, 0 without any room.

    A speed continues for `reaction_s` before it decreases at `deceleration`, which is a number, or
    an array whose last axes are those of the room; following this curve needs less than that
    deceleration. Raises ServoError.
    """

@final
class JointLimits:
    """The limits of N joints in position, speed, acceleration and jerk.

    `ranges` are five rows (N,): least and greatest angles, greatest speeds, accelerations and
    jerks, in radians and seconds. The first `hand_count` joints move the hand. A joint begins to
    brake after `reaction_s`. Raises ServoError.
    """

    def __new__(
        cls, ranges: Sequence[ArrayLike], hand_count: int, period_s: float, reaction_s: float
    ) -> Self: ...
    def window(
        self, now: Sequence[ArrayLike], braking: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], list[list[int]]]:
        """Returns the least and the greatest speeds (N,) that may follow the last command, and for
        each of both rows the causes: 0 for the jerk, 1 for the acceleration, 2 for the speed, 3 for
        the end of the range.

        `now` are four rows (N,): measured angles and speeds, commanded speeds, and their rate of
        change. Before their stops the first joints brake no harder than `braking` (n,) in rad/s².
        The window is never empty: if limits contradict each other, it contains only the hardest
        braking. Raises ServoError.
        """
    def braked(
        self, previous: ArrayLike, acceleration: ArrayLike, hand_ticks: float
    ) -> NDArray[np.float64]:
        """
        Returns the next command (N,) of joints that come to rest, after commanded speeds (N,) and
        their rate of change (N,).

        The joints of the hand stop together, along their path, and in no fewer periods than
        `hand_ticks`. The other joints also stop together, independently of the hand. Raises
        ServoError.
        """
    def blindly_braked(
        self, previous: ArrayLike, acceleration: ArrayLike, hand_ticks: float
    ) -> NDArray[np.float64]:
        """
        Returns the next command (N,) of joints that come to rest, without knowing their state, as
        `braked` does. Raises ServoError.
        """

@final
class HandLimits:
    """
    The greatest linear and angular speed of a hand, in m/s and rad/s, and how far they may change
    in a control period.

    An acceleration counts as if it continued for `fading` periods before it vanishes.
    """

    def __new__(
        cls, speeds: Sequence[float], steps: Sequence[float], period_s: float, fading: float
    ) -> Self: ...
    def balls(self, jacobian: ArrayLike, last: ArrayLike, speed_scale: float) -> Balls:
        """Returns the bounds on joint speeds after a hand velocity `last` (6,), at a share of the
        hand's speed. `jacobian` is (6, n). Raises ServoError.
        """
    def braking(self, jacobian: ArrayLike) -> NDArray[np.float64]:
        """Returns the joints' decelerations (n,) in rad/s² that the hand's limit allows.

        `jacobian` is (6, n). Each joint leaves a share of the hand's limit to the other joints.
        Raises ServoError.
        """
    def ticks_to_rest(self, twist: ArrayLike) -> float:
        """Returns the number of periods in which the hand can come to rest from a velocity (6,).
        Raises ServoError.
        """

@final
class Balls:
    """The bounds of a hand's velocity on joint speeds (n,): of the linear and then of the angular
    velocity, first that of the speed, then that of the acceleration.
    """

    def hold(self, velocities: ArrayLike) -> bool:
        """Returns whether joint speeds (n,) are inside. Raises ServoError."""
    def cuts(
        self, velocities: ArrayLike
    ) -> tuple[list[int], NDArray[np.float64], NDArray[np.float64]]:
        """Returns the tangent planes nearest to joint speeds (n,) of the k bounds that these are
        outside of: the numbers of the bounds, the planes as rows (k, n), and the greatest products
        (k,) of the rows with joint speeds. Raises ServoError.
        """

@final
class Workspace:
    """Where a hand may be, and how it brakes before the end of it.

    Corners (3,) of the workspace are in the world, `least_distance` in m is that from the object;
    the hand begins to brake, at `braking` in m/s², after `reaction_s`. Raises ServoError.
    """

    def __new__(
        cls,
        corners: Sequence[Sequence[float]],
        *,
        least_distance: float,
        braking: float,
        reaction_s: float,
        period_s: float,
    ) -> Self: ...
    def allowed(self, goal: ArrayLike, target: ArrayLike) -> tuple[float, float, float]:
        """Returns the position of a goal (3,), moved into the workspace and away from an object at
        (3,). Raises ServoError.
        """
    def velocity_limits(
        self, hand: tuple[ArrayLike, ArrayLike], target: tuple[ArrayLike, ArrayLike]
    ) -> VelocityLimits:
        """
        Returns the bounds of a hand's velocity for an object, both as (position, velocity), of (3,)
        each in the world.

        No bound requires a deceleration above `braking` from the hand's velocity. Raises
        ServoError.
        """

@final
class VelocityLimits:
    """Bounds (3,) of the hand's velocity in the world, and of its speed towards the object."""

    @property
    def lower(self) -> NDArray[np.float64]:
        """The least velocity (3,) in m/s."""
    @property
    def upper(self) -> NDArray[np.float64]:
        """The greatest velocity (3,) in m/s."""
    @property
    def toward(self) -> NDArray[np.float64]:
        """The unit direction (3,) to the object, 0 at the object itself."""
    @property
    def closing(self) -> float:
        """The greatest speed towards the object in m/s, which includes the object's velocity."""
    def rows(
        self, jacobian: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """
        Returns rows (4, n) whose products with joint speeds (n,) are bounded, and the least and the
        greatest products, (4,) each. `jacobian` (6, n) is that of the hand. Raises ServoError.
        """

@final
class Paint:
    """Appearance of a surface.

    It has a colour in linear RGB, 0 to 1, which multiplies a texture, (H, W, 3) uint8 sRGB, that is
    repeated a number of times over u and v; gloss is between 0 and 1. Raises SimError.
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
    """A distant lamp, and ambient light from above and below.

    It has the direction towards the lamp in the world, and the strengths in linear RGB of the lamp,
    of the light from above and of the light from below; raises SimError.
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
    """Visuals (shapes with paint) that are drawn by ray casting.

    A new scene is empty.
    """

    def __new__(cls) -> Self: ...
    def add_ellipsoid(self, radii: Sequence[float], paint: Paint) -> int:
        """Adds an ellipsoid by its radii in metres and returns its index; raises SimError."""
    def add_capsule(self, radius: float, half_length: float, paint: Paint) -> int:
        """Adds a capsule along z, in metres, and returns its index; raises SimError."""
    def add_cylinder(self, radius: float, half_length: float, paint: Paint) -> int:
        """
        Adds a cylinder with flat ends along z, in metres, and returns its index; raises SimError.
        """
    def add_box(self, half_size: Sequence[float], paint: Paint) -> int:
        """Adds a box by half its sides in metres and returns its index; raises SimError."""
    def add_plane(self, half_size: Sequence[float], paint: Paint) -> int:
        """
        Adds a rectangle in the xy plane by half its sides in metres, visible from both sides, and
        returns its index; raises SimError.
        """
    def add_mesh(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        paint: Paint,
        texture_coordinates: NDArray[np.float64] | None = None,
        colors: NDArray[np.uint8] | None = None,
    ) -> int:
        """Adds triangles, (M, 3) int64, between vertices, (N, 3) float64 in metres, with texture
        coordinates, (N, 2) float64 from the corner of the first pixel, and colours, (N, 3) uint8
        sRGB; returns its index and raises SimError.
        """
    @property
    def count(self) -> int:
        """Number of visuals."""
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
        """Draws an image, (H, W, 3) uint8 sRGB, with poses of the lens, (M, 7), and of all visuals,
        (M, T, 7), float64 as (w, x, y, z, tx, ty, tz), at the moments that the samples x samples
        rays of a pixel use in turn; noise in grey levels. Raises SimError.
        """
    def depth(
        self,
        *,
        lens: Lens,
        world_from_lens: NDArray[np.float64],
        world_from_visual: NDArray[np.float64],
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """
        Returns the depth along the lens's z at each pixel's centre, (H, W) float32 in metres, NaN
        where there is nothing, and the indices of the visuals, (H, W) int32, -1 where there is
        nothing, for one pose of the lens, (7,), and of all visuals, (T, 7), float64. Raises
        SimError.
        """

@final
class ModelInput:
    """The evidence to model from: views, a closed mesh, and measured points of the surface.

    It combines views; a mesh; measured points (N, 3) in metres with the directions (N, 3) in which
    they were seen, float64, whose length is the distance of the eye, or short if only the direction
    is known; and the weight of each kind, where None is the core's default. Raises BodyError.
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
    """Settings of modelling; their defaults are those of the core.

    Arguments that are None keep their defaults; `quick` searches less, for a body that is only an
    intermediate step.
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
        """Least gain in F for which another ellipsoid is added; with 0 modelling continues to the
        maximum.
        """
    @property
    def held_out(self) -> bool:
        """Whether a part of the evidence is held out to select the number of ellipsoids."""
    @property
    def seed(self) -> int:
        """Seed of every search."""
    @property
    def threads(self) -> int:
        """Worker threads; 0 uses as many as the machine has. The result does not depend on it."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class PaperSettings:
    """Settings of the paper's own method; their defaults are those of the core.

    Arguments that are None keep their defaults.
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
        """Worker threads; 0 uses as many as the machine has. The result does not depend on it."""
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
        """Individuals per generation."""
    @property
    def generations(self) -> int:
        """Generations for each ellipsoid."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Step:
    """The result of modelling with a given number of ellipsoids."""

    @property
    def count(self) -> int:
        """Number of ellipsoids."""
    @property
    def fitness(self) -> float:
        """F: the agreement with all evidence, at the resolution of the fit; for the paper's method,
        its own F.
        """
    @property
    def body(self) -> Body:
        """The body."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class TrackSettings:
    """Settings of tracking; their defaults are those of the core.

    Arguments that are None keep their defaults.
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
        adjust_outlines: bool | None = None,
        depth_from_motion: bool | None = None,
        known_shape: bool | None = None,
    ) -> Self: ...
    @property
    def seed(self) -> int:
        """Seed of every search."""
    @property
    def population(self) -> int:
        """Hypotheses per generation."""
    @property
    def generations(self) -> int:
        """Generations per image."""
    @property
    def budget_s(self) -> float | None:
        """Seconds after which no further generation starts, nor a search beside a proved pose; with
        None only the counts decide.
        """
    @property
    def surface(self) -> bool:
        """Whether surface points are learned and scored."""
    @property
    def region(self) -> bool:
        """Whether colours are learned and scored."""
    @property
    def local_colors(self) -> bool:
        """Whether the background's colours are learned separately for the sides of the object."""
    @property
    def adjust(self) -> bool:
        """Whether keyframes and surface points are adjusted together, in a separate thread."""
    @property
    def adjust_outlines(self) -> bool:
        """Whether the outlines of an object without print adjust its body and its keyframes."""
    @property
    def depth_from_motion(self) -> bool:
        """Whether the distances of points that only one camera sees are estimated from motion."""
    @property
    def known_shape(self) -> bool:
        """Whether the body has the object's shape on all sides, as one made from a mesh has."""
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class Estimate:
    """The pose of the object, with its uncertainty.

    Two estimates are equal if they differ at most in their timing.
    """

    @property
    def time_s(self) -> float:
        """Time stamp in seconds."""
    @property
    def world_from_object(self) -> Pose:
        """
        Pose of the object in the world; while it is not tracked, the last pose or the best guess.
        """
    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of a small motion (linear, angular) of the object in its own frame, (6, 6)
        float64, in metres and radians.
        """
    @property
    def unobservable(self) -> NDArray[np.float64]:
        """Unit motions that the images do not constrain, (K, 6) float64: linear in object sizes,
        angular in radians, in the object's frame.
        """
    @property
    def confidence(self) -> float:
        """
        Probability that the pose is right, 0 to 1. A pose is right if it is not off by more than 20
        mm, or a tenth of the object's diameter if that is more, and 15 degrees.
        """
    @property
    def evidence(self) -> dict[str, float] | None:
        """
        The evidence for the pose if the object is followed, else None: `share`, the share of what
        should be visible that is seen; `recognised`, surface points per camera, `textured`, those
        with the contrast of a pattern, and `reference_textured`, the usual number of those;
        `proved`, 1 if the object was never lost or is proved to be the lost one; `turn_rad`,
        `jitter_rad` and `drift_rad`, standard deviations of the orientation due to image noise,
        from how poses differ from image to image without any motion, and since the first image;
        `by_outline`, 1 if the outline of a known shape alone shows the orientation.
        """
    @property
    def status(self) -> str:
        """Status of the tracker: "tracking", "searching" or "lost"."""
    @property
    def located(self) -> bool:
        """Whether the images confirm the object's position; if the status is "tracking", its
        orientation as well.
        """
    @property
    def keyframes(self) -> list[tuple[int, Pose]]:
        """Number and pose, world_from_object, of the keyframe to which this pose belongs, if the
        object is followed, and of the keyframe of the previous pose if that was another one. A
        later correction of a keyframe applies to its poses as well.
        """
    @property
    def evolved(self) -> bool:
        """Whether the body changed since the last estimate because it evolved in the worker."""
    @property
    def notices(self) -> list[str]:
        """What was wrong with the observation, in words."""
    @property
    def evaluations(self) -> int:
        """Number of hypotheses scored."""
    @property
    def seconds(self) -> dict[str, float]:
        """Seconds spent in each stage: prepare, search, refine, verify, update."""
    def in_doubt(self, located: bool) -> Estimate:
        """Returns the same estimate for a start in doubt: nothing confirms its pose; `located` says
        whether its position is confirmed. What is lost stays lost.
        """
    def __eq__(self, value: object, /) -> bool: ...
    def __hash__(self) -> int: ...

@final
class OneStepSettings:
    """Settings of tracking with the 1-step genetic algorithm; their defaults are those of the core.

    Arguments that are None keep their defaults.
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
        """Whether the orientation is estimated in addition to the position."""
    @property
    def region(self) -> bool:
        """Whether whole areas are scored instead of the paper's points."""
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
        """Search range around the last position, along each axis, in object sizes."""
    @property
    def turn(self) -> float:
        """Search range around the last orientation, about each axis, in radians."""
    @property
    def population(self) -> int:
        """Individuals per generation."""
    @property
    def elites(self) -> int:
        """Best individuals that survive unchanged."""
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
    """Tracks a body by one generation of a genetic algorithm per image, as the paper does.

    It is constructed from the cameras, the body and the settings; raises TrackError, ImageError.
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
        """Estimates the object's pose in the next images, None where a camera delivered nothing.
        Raises TrackError, ImageError.
        """
    def set_orientation(self, world_from_object: ArrayLike) -> None:
        """
        Sets the orientation of the object in the world, a unit quaternion (w, x, y, z), where it is
        known. Raises TrackError before the start, PoseError.
        """

@final
class Tracker:
    """Tracks a body in six degrees of freedom from observation to observation.

    It is constructed from cameras and a body; raises TrackError. It takes one call at a time: while
    one thread calls it, the calls of others raise TrackError.
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
        (H, W) uint8 and None where there is none, mark its pixels. Masks that lie elsewhere are
        reported in `notices` and not used. Raises TrackError.
        """
    def find(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        near: Pose | None = None,
        depths: _Depths | None = None,
    ) -> Estimate:
        """Searches for the object with all that is known of it, near a pose if one is given, and
        continues tracking from there. Raises TrackError.
        """
    def step(
        self,
        time_s: float,
        world_from_camera: _Poses,
        images: _Images,
        depths: _Depths | None = None,
    ) -> Estimate:
        """Estimates the object's pose in the next images, None where a camera delivered nothing;
        `depths` are depth images with the same pixels, (H, W) float32, metres along z. Raises
        TrackError.
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
        Scores poses in images by what was learned so far: poses (N, 7) float64, world_from_object
        as (w, x, y, z, tx, ty, tz). Returns (N, 2) float64, the scores by regions and by surface
        points, whose sum is the total. Surface points are compared at a `resolution`, 0 for the
        image's own, 2 for the coarsest. Nothing is learned. Raises TrackError, PoseError.
        """
    def appearance(self) -> bytes:
        """The object's appearance as far as it was learned, as bytes. Raises TrackError."""
    def recall(self, appearance: bytes) -> None:
        """
        Restores the appearance of an object, as returned by `appearance`. Raises TrackError, also
        for None, which `look` of a body's file is if it was saved without an appearance.
        """
    def avoid(self, others: Sequence[Body]) -> None:
        """Sets where other tracked objects are now, as bodies at their poses: from now on a search
        does not find this one there. Raises TrackError.
        """
    def begin_evolving(self) -> bool:
        """
        Starts to evolve the body by the sides that were seen, in a separate thread; returns whether
        there is anything new. The fifth estimate after this call reports that it has `evolved`.
        Raises TrackError.
        """
    def evolve(self) -> bool:
        """Evolves the body by the sides that were seen, between images, and waits for the result;
        returns whether it changed. Raises TrackError, ModelError.
        """
    def keyframe_pose(self, number: int) -> Pose | None:
        """Returns the pose of the object at a keyframe, by its number in `Estimate.keyframes`, as
        currently estimated; None if there was none. Raises TrackError.
        """
    @property
    def body(self) -> Body:
        """The body at its latest pose."""
    @property
    def surface(self) -> tuple[_Points, _Points, NDArray[np.uint8]]:
        """The surface points, edgels included: (N, 3) float64 in metres and their normals (N, 3)
        float64, in the object's frame, and their colours (N, 3) uint8.
        """

def fit_body(
    given: ModelInput, settings: ModelSettings, progress: _Progress | None = None
) -> list[Step]:
    """Models an object from evidence; returns one step for each number of ellipsoids. `progress` is
    called with the number of ellipsoids, F and the share of the work that is done; an exception
    that it raises ends the work. Raises ModelError.
    """

def fit_paper(
    views: Sequence[View], settings: PaperSettings, progress: _Progress | None = None
) -> list[Step]:
    """
    Models from the views by the paper's own method, with the mask of each as the pixels where the
    hue matches; returns one step for each number of ellipsoids. `progress` is called with the
    number of ellipsoids, F and the share of the work that is done; an exception that it raises ends
    the work. Raises ModelError.
    """

def paper_scores(
    views: Sequence[View], body: Body, poses: ArrayLike, settings: PaperSettings
) -> _Points:
    """Scores a body at poses by the paper's fitness, with the mask of each view as the pixels where
    the hue matches: poses (N, 7) float64, world_from_object as (w, x, y, z, tx, ty, tz), scores
    (N,) float64. Of the settings only points, alpha and threads matter. Raises ModelError,
    PoseError.
    """

def initial_body(
    views: Sequence[View],
    images: Sequence[NDArray[np.uint8]],
    pictures: Sequence[tuple[Camera, Pose, NDArray[np.uint8]]],
    settings: ModelSettings,
    points: ArrayLike | None = None,
    directions: ArrayLike | None = None,
) -> Body:
    """Computes an initial model from views with their images, which teach the object's colours, and
    images in which the object is not marked: (camera, world_from_camera, image). Points (N, 3) of
    its surface and the directions (N, 3) in which they were seen give its position, if present.
    Raises ModelError.
    """

def surface_coverage(
    body: Body,
    views: Sequence[View],
    points: ArrayLike | None = None,
    directions: ArrayLike | None = None,
) -> tuple[_Points, float, tuple[float, float, float] | None]:
    """
    Returns the share of each ellipsoid's surface (K,) float64 that the views or the measured points
    show, the share of the whole, and the direction in the object's frame to the side that they do
    not show, None if there is none or it lies all around.
    """

def silhouette_ious(body: Body, views: Sequence[View]) -> _Points:
    """Returns the intersection over union of the body's silhouette and the mask in each view, (V,)
    float64.
    """

def pose_from_masks(
    body: Body,
    views: Sequence[View],
    images: Sequence[_Colors] | None = None,
    colors: _Colors | None = None,
    seed: int = 0,
) -> tuple[Pose, float]:
    """Finds the pose at which a body's outlines agree with masks, and their overlap there.
    Orientations that look alike are distinguished by the colours of its ellipsoids, (K, 3) uint8,
    in images, one per view. Raises TrackError.
    """

def poses_from_masks(
    body: Body,
    views: Sequence[View],
    images: Sequence[_Colors] | None = None,
    colors: _Colors | None = None,
    seed: int = 0,
) -> list[tuple[Pose, float]]:
    """Finds all poses at which a body's outlines agree with masks about as well as at the best one,
    which comes first, each with their overlap there. They are turned from each other by 20 degrees
    or more: masks often do not distinguish two sides of a box, and never how a body of revolution
    is turned. Arguments are those of `pose_from_masks`. Raises TrackError.
    """

def ellipsoid_colors(body: Body, views: Sequence[View], images: Sequence[_Colors]) -> _Colors:
    """
    Returns each ellipsoid's median colour over the images in which it is foremost, (K, 3) uint8.
    """

def taken_image(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Converts an image, (H, W) or (H, W, 3) uint8, to (H, W, 3); raises ImageError."""

def taken_mask(mask: NDArray[Any]) -> NDArray[np.uint8]:
    """Converts a mask, (H, W) of bool or whole numbers, to uint8: 255 where it is not zero. Raises
    MaskError.
    """

def taken_depth(depth: NDArray[np.floating]) -> NDArray[np.float32]:
    """Converts a depth image, (H, W) of floats, metres along z, to float32; raises ImageError."""
