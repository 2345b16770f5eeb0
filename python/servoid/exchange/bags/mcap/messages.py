"""Encodes servoid's data as standard ROS 2 messages."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Lens
from servoid.errors import MissingExtraError
from servoid.exchange.bags.stored.header import NS_PER_S
from servoid.exchange.bags.stored.pixels import COMPRESSED, IMAGE
from servoid.pose import Pose, parts_of

CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
JOINTS = "sensor_msgs/msg/JointState"
MARKERS = "visualization_msgs/msg/MarkerArray"
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
NUMBER = "std_msgs/msg/Float64"

_SPHERE, _ADD, _DELETE_ALL = 2, 0, 3  # of visualization_msgs/Marker
_GREY = (180, 180, 180)
_UNKNOWN = 1e6  # the variance of an unknown component

Link = tuple[str, str, Pose]
"""A parent frame, a child frame, and parent_from_child."""

Entry = tuple[str, int, str, Mapping[str, str]]
"""One entry of diagnostics: its name, a level from 0 to 2, a message, and values."""


class Messages:
    """Encodes messages as bytes; the constants of this module name their types.

    Raises:
        MissingExtraError: the library with the message types is missing.

    """

    def __init__(self) -> None:
        try:
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise MissingExtraError.of("bags", "rosbags", "bags") from error
        self.store: Any = get_typestore(Stores.ROS2_JAZZY)

    def image(self, stamp_ns: int, frame: str, pixels: NDArray[np.generic], encoding: str) -> bytes:
        """Return an Image of pixels (H, W) or (H, W, C) in a ROS encoding."""
        pixels = np.ascontiguousarray(pixels).astype(pixels.dtype.newbyteorder("<"), copy=False)
        height, width = pixels.shape[:2]
        return self._bytes(
            IMAGE,
            header=self._header(stamp_ns, frame),
            height=height,
            width=width,
            encoding=encoding,
            is_bigendian=0,
            step=pixels.nbytes // height,
            data=pixels.reshape(-1).view(np.uint8),
        )

    def image_like(self, stamp_ns: int, frame: str, image: Any) -> bytes:
        """Return an Image with the unchanged data of one that was read."""
        names = ("height", "width", "encoding", "is_bigendian", "step", "data")
        fields = {name: getattr(image, name) for name in names}
        return self._bytes(IMAGE, header=self._header(stamp_ns, frame), **fields)

    def compressed(self, stamp_ns: int, frame: str, data: bytes, form: str) -> bytes:
        """Return a CompressedImage of the bytes of an image file."""
        return self._bytes(
            COMPRESSED,
            header=self._header(stamp_ns, frame),
            format=form,
            data=np.frombuffer(data, np.uint8),
        )

    def camera_info(self, stamp_ns: int, frame: str, lens: Lens) -> bytes:
        """Return the CameraInfo for raw images of a lens."""
        matrix = lens.matrix()
        projection = np.zeros((3, 4))
        projection[:, :3] = matrix
        model, distortion = _distortion(lens)
        width, height = lens.size_px
        region = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
        return self._bytes(
            CAMERA_INFO,
            header=self._header(stamp_ns, frame),
            height=height,
            width=width,
            distortion_model=model,
            d=np.array(distortion, np.float64),
            k=matrix.ravel(),
            r=np.eye(3).ravel(),
            p=projection.ravel(),
            binning_x=0,
            binning_y=0,
            roi=self._make("sensor_msgs/msg/RegionOfInterest", **region),
        )

    def transforms(self, stamp_ns: int, links: Sequence[Link]) -> bytes:
        """Return a TFMessage."""
        stamped = [
            self._make(
                "geometry_msgs/msg/TransformStamped",
                header=self._header(stamp_ns, parent),
                child_frame_id=child,
                transform=self._make(
                    "geometry_msgs/msg/Transform",
                    translation=self._vector(parts_of(pose)[0]),
                    rotation=self._quaternion(pose),
                ),
            )
            for parent, child, pose in links
        ]
        return self._bytes(TRANSFORMS, transforms=stamped)

    def pose(self, stamp_ns: int, frame: str, pose: Pose, covariance: NDArray[np.float64]) -> bytes:
        """Return a PoseWithCovarianceStamped; the covariance is that of `Estimate`."""
        message = self._make(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=self._pose(pose),
            covariance=ros_covariance(pose, covariance).ravel(),
        )
        return self._bytes(POSE, header=self._header(stamp_ns, frame), pose=message)

    def joints(
        self,
        stamp_ns: int,
        names: Sequence[str],
        positions: NDArray[np.float64],
        velocities: NDArray[np.float64],
    ) -> bytes:
        """Return a JointState in radians and radians per second."""
        return self._bytes(
            JOINTS,
            header=self._header(stamp_ns, ""),
            name=list(names),
            position=np.asarray(positions, np.float64),
            velocity=np.asarray(velocities, np.float64),
            effort=np.empty(0),
        )

    def markers(
        self, stamp_ns: int, frame: str, body: Body, colors: NDArray[np.uint8] | None
    ) -> bytes:
        """Return a MarkerArray with the ellipsoids of a body, in its own frame.

        It replaces all earlier markers on the topic.
        """
        marks = [self._marker(stamp_ns, frame, 0, Pose.identity(), (0.0,) * 3, _GREY, _DELETE_ALL)]
        painted = colors if colors is not None and len(colors) == len(body) else [_GREY] * len(body)
        for index in range(len(body)):
            pose = Pose.from_parts(body.centers[index], body.rotations[index])
            radii, color = body.radii[index], painted[index]
            sides = 2.0 * float(radii[0]), 2.0 * float(radii[1]), 2.0 * float(radii[2])
            marks.append(self._marker(stamp_ns, frame, index, pose, sides, tuple(color), _ADD))
        return self._bytes(MARKERS, markers=marks)

    def diagnostics(self, stamp_ns: int, entries: Sequence[Entry]) -> bytes:
        """Return a DiagnosticArray."""
        status = [
            self._make(
                "diagnostic_msgs/msg/DiagnosticStatus",
                level=level,
                name=name,
                message=words,
                hardware_id="",
                values=[
                    self._make("diagnostic_msgs/msg/KeyValue", key=key, value=value)
                    for key, value in values.items()
                ],
            )
            for name, level, words, values in entries
        ]
        return self._bytes(DIAGNOSTICS, header=self._header(stamp_ns, ""), status=status)

    def number(self, value: float) -> bytes:
        """Return a Float64."""
        return self._bytes(NUMBER, data=value)

    def _marker(
        self,
        stamp_ns: int,
        frame: str,
        index: int,
        pose: Pose,
        sides: tuple[float, ...],
        color: tuple[int, ...],
        action: int,
    ) -> Any:
        red, green, blue = (float(one) / 255.0 for one in color)
        return self._make(
            "visualization_msgs/msg/Marker",
            header=self._header(stamp_ns, frame),
            ns="body",
            id=index,
            type=_SPHERE,
            action=action,
            pose=self._pose(pose),
            scale=self._vector(sides),
            color=self._make("std_msgs/msg/ColorRGBA", r=red, g=green, b=blue, a=1.0),
            lifetime=self._make("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
            frame_locked=True,
            points=[],
            colors=[],
            texture_resource="",
            texture=self._make(
                COMPRESSED,
                header=self._header(0, ""),
                format="",
                data=np.empty(0, np.uint8),
            ),
            uv_coordinates=[],
            text="",
            mesh_resource="",
            mesh_file=self._make(
                "visualization_msgs/msg/MeshFile", filename="", data=np.empty(0, np.uint8)
            ),
            mesh_use_embedded_materials=False,
        )

    def _header(self, stamp_ns: int, frame: str) -> Any:
        seconds, nanoseconds = divmod(stamp_ns, NS_PER_S)
        stamp = self._make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
        return self._make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)

    def _pose(self, pose: Pose) -> Any:
        return self._make(
            "geometry_msgs/msg/Pose",
            position=self._make("geometry_msgs/msg/Point", **_xyz(parts_of(pose)[0])),
            orientation=self._quaternion(pose),
        )

    def _vector(self, values: Sequence[float]) -> Any:
        return self._make("geometry_msgs/msg/Vector3", **_xyz(values))

    def _quaternion(self, pose: Pose) -> Any:
        w, x, y, z = parts_of(pose)[1]
        return self._make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def _make(self, kind: str, **fields: Any) -> Any:
        return self.store.types[kind](**fields)

    def _bytes(self, kind: str, **fields: Any) -> bytes:
        return bytes(self.store.serialize_cdr(self._make(kind, **fields), kind))


def ros_covariance(pose: Pose, covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert a covariance of servoid to that of ROS, (6, 6) float64 each.

    Servoid's is that of a small motion (linear, angular) of the object in its own frame. ROS's is
    that of the origin's error along x, y and z of the frame of the pose, and of the rotation error
    about these fixed axes. Unknown components get very large variances.
    """
    if not np.isfinite(covariance).all():
        return np.eye(6) * _UNKNOWN
    turn = pose.matrix()[:3, :3]
    both = np.zeros((6, 6))
    both[:3, :3] = both[3:, 3:] = turn
    return both @ covariance @ both.T


def _distortion(lens: Lens) -> tuple[str, tuple[float, ...]]:
    """Return ROS's name of a lens model, and its coefficients."""
    if lens.model == "kannala_brandt":
        return "equidistant", lens.distortion
    if any(lens.distortion[5:]):
        return "rational_polynomial", lens.distortion
    return "plumb_bob", lens.distortion[:5] or (0.0,) * 5


def _xyz(values: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyz", map(float, values), strict=True))
