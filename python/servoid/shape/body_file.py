"""The file of a body: versioned, indented JSON with a published schema."""

import base64
import json
import math
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from servoid._native import Body, Pose
from servoid.brief import brief, said
from servoid.config import BODY_FILE, check_version, convert, path_of, read_json
from servoid.errors import BodyError, located
from servoid.output import write_whole
from servoid.words import counted

_UNIT_TOLERANCE = 1e-3
_ALL_AROUND = 0.9  # share of the surface that was seen from which on the shape counts as known

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Length = Annotated[float, msgspec.Meta(gt=0)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
Fitness = Annotated[float, msgspec.Meta(ge=-1, le=1)]  # that of the paper may be below 0
Channel = Annotated[int, msgspec.Meta(ge=0, le=255)]


class EllipsoidEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One ellipsoid in the object's frame.

    `center` and `radii` are in metres, `rotation` is object_from_ellipsoid as (w, x, y, z), and
    `color` is (red, green, blue) from 0 to 255, or null where it is not known.
    """

    center: Vector
    radii: tuple[Length, Length, Length]
    rotation: Quaternion
    color: tuple[Channel, Channel, Channel] | None = None


class MadeBy(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a body was modelled, so that it can be modelled again."""

    servoid: str
    seed: int
    max_ellipsoids: int
    delta: float
    views: tuple[str, ...]
    method: str = "region"
    targets: tuple[str, ...] = ()
    seen_points: int = 0

    __repr__ = brief


class SeenEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The share of the surface that was seen, 0 to 1: of the whole, and of each ellipsoid.

    `unseen_toward` is a unit vector, in the object's frame, towards the side that was not seen;
    null if there is none or the unseen parts are on all sides.
    """

    share: Share
    unseen_toward: Vector | None = None
    by_ellipsoid: tuple[Share, ...]

    __repr__ = brief


class BodyFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A rigid set of ellipsoids and its pose.

    `world_from_object` is (x, y, z, qw, qx, qy, qz): the translation in metres and the unit
    quaternion that map the object's frame to the world. `appearance` is the object's learned
    appearance, as bytes in base64, or null where it is not known. Where `units` is "unknown", as
    after a scan without a known length, all lengths are in an unknown unit instead of metres.
    """

    version: Literal[1]
    units: Literal["m", "unknown"]
    world_from_object: tuple[float, float, float, float, float, float, float]
    ellipsoids: Annotated[
        tuple[EllipsoidEntry, ...], msgspec.Meta(min_length=1, max_length=Body.MAX_ELLIPSOIDS)
    ]
    fitness: Fitness | None = None
    made_by: MadeBy | None = None
    seen: SeenEntry | None = None
    appearance: str | None = None

    def __repr__(self) -> str:
        made = self.made_by
        return said(
            BodyFile,
            counted(len(self.ellipsoids), "ellipsoid"),
            None if self.fitness is None else f"fitness {self.fitness:.4f}",
            None if made is None or not made.views else counted(len(made.views), "view"),
            None if self.seen is None else f"{100.0 * self.seen.share:.0f} % of it seen",
            None if self.appearance is None else "with appearance",
        )

    def look(self) -> bytes | None:
        """Return the appearance for `Tracker.recall`; None if it is not known.

        Raises:
            BodyError: the text is not base64.

        """
        if self.appearance is None:
            return None
        try:
            return base64.b64decode(self.appearance, validate=True)
        except ValueError as error:
            raise BodyError(
                f"appearance is damaged ({error}); leave it out or save the body again"
            ) from error

    @property
    def is_metric(self) -> bool:
        """Return whether lengths are in metres, not in an unknown unit."""
        return self.units == "m"

    @property
    def is_known_all_around(self) -> bool:
        """Return whether the body was made from a mesh, or nearly all its surface was seen."""
        if self.seen is not None:
            return self.seen.share >= _ALL_AROUND
        return self.made_by is not None and not self.made_by.views and not self.made_by.targets

    def body(self) -> Body:
        """Return the body itself.

        Raises:
            BodyError, PoseError: the numbers do not describe a body.

        """
        return Body(
            world_from_object=Pose.from_parts(
                self.world_from_object[:3], self.world_from_object[3:]
            ),
            centers=np.array([entry.center for entry in self.ellipsoids], dtype=np.float64),
            radii=np.array([entry.radii for entry in self.ellipsoids], dtype=np.float64),
            rotations=np.array([entry.rotation for entry in self.ellipsoids], dtype=np.float64),
        )

    def colors(self) -> NDArray[np.uint8] | None:
        """Return the colours, (K, 3) uint8 RGB, or None unless every ellipsoid has one."""
        colors = [entry.color for entry in self.ellipsoids if entry.color is not None]
        if len(colors) < len(self.ellipsoids):
            return None
        return np.array(colors, dtype=np.uint8)


def save_body(
    path: str | Path,
    body: Body,
    colors: NDArray[np.uint8] | None = None,
    *,
    fitness: float | None = None,
    made_by: MadeBy | None = None,
    seen: SeenEntry | None = None,
    appearance: bytes | None = None,
    is_metric: bool = True,
) -> None:
    """Write a body to a JSON file atomically; the same body gives the same bytes.

    `colors`: (K, 3) uint8 RGB, one per ellipsoid. `appearance` comes from `Tracker.appearance`.
    `is_metric` is False for lengths in an unknown unit, as after a scan without a known length.

    Raises:
        BodyError: the number of colours differs from that of ellipsoids.
        OutputError: the file cannot be written.

    """
    if not isinstance(body, Body):
        raise BodyError(
            f"save_body takes the path first and then the body, which is a Body, not {body!r:.60}"
        )
    if colors is not None and colors.shape != (len(body), 3):
        raise BodyError(
            f"a body of {counted(len(body), 'ellipsoid')} needs colors of shape "
            f"({len(body)}, 3), not {colors.shape}"
        )
    pose = body.world_from_object
    file = BodyFile(
        version=1,
        units="m" if is_metric else "unknown",
        world_from_object=(*pose.translation, *pose.quaternion),
        ellipsoids=tuple(
            EllipsoidEntry(
                center=tuple(body.centers[index].tolist()),
                radii=tuple(body.radii[index].tolist()),
                rotation=tuple(body.rotations[index].tolist()),
                color=None if colors is None else tuple(colors[index].tolist()),
            )
            for index in range(len(body))
        ),
        fitness=fitness,
        made_by=made_by,
        seen=seen,
        appearance=None if appearance is None else base64.b64encode(appearance).decode("ascii"),
    )
    write_body_file(path, file)


def write_body_file(path: str | Path, file: BodyFile) -> None:
    """Write what `load_body` returned, with the same bytes as `save_body`.

    Raises:
        OutputError: the file cannot be written.

    """
    write_whole(Path(path), _lay_out(msgspec.to_builtins(file)).encode("utf-8"))


def load_body(path: str | Path) -> BodyFile:
    """Read and check the file of a body; the result's `.body()` and `.colors()` return its content.

    Raises:
        BodyError: the file is missing or malformed, or its numbers do not describe a body.

    """
    place = str(path)
    data = read_json(path_of(path, BodyError), BodyError, BODY_FILE)
    check_version(data, place, BodyError, "bodies")
    if data.get("units", "m") not in ("m", "unknown"):
        raise BodyError(
            f'{place}: units is {data["units"]!r}; give lengths in metres and write "units": "m", '
            'or "units": "unknown" if nothing tells how long a unit is'
        )
    _check_count(data.get("ellipsoids"), place)
    file = convert(data, BodyFile, place, BodyError)
    _check_unit(file.world_from_object[3:], f"{place}, world_from_object")
    for index, entry in enumerate(file.ellipsoids):
        _check_unit(entry.rotation, f"{place}, ellipsoids[{index}].rotation")
    if file.seen is not None:
        _check_seen(file.seen, len(file.ellipsoids), place)
    with located(place):
        file.body()
        file.look()
    return file


def body_schema() -> dict[str, Any]:
    """Generate the JSON schema of a body's file from the types that read it."""
    (schema,), parts = msgspec.json.schema_components([BodyFile], ref_template="#/$defs/{name}")
    for part in parts.values():
        # Python versions differ in how they indent docstrings.
        part["description"] = " ".join(part["description"].split())
    whole = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "servoid body, version 1",
        **schema,
        "$defs": parts,
    }
    # Defaults are tuples here; JSON has only lists.
    return msgspec.json.decode(msgspec.json.encode(whole))


def published_schema() -> str:
    """Return the text of the schema that the package ships."""
    return files("servoid.shape").joinpath("body.schema.json").read_text(encoding="utf-8")


def _check_count(ellipsoids: Any, place: str) -> None:
    """Check the number of ellipsoids, before each is examined."""
    if isinstance(ellipsoids, list) and len(ellipsoids) > Body.MAX_ELLIPSOIDS:
        raise BodyError(
            f"{place}: {len(ellipsoids)} ellipsoids were given; a body has 1 to "
            f"{Body.MAX_ELLIPSOIDS}"
        )


def _check_seen(seen: SeenEntry, ellipsoids: int, place: str) -> None:
    given = len(seen.by_ellipsoid)
    if given != ellipsoids:
        raise BodyError(
            f"{place}: seen.by_ellipsoid has {counted(given, 'number')}, but the body has "
            f"{counted(ellipsoids, 'ellipsoid')}; give one number for each, or write null for seen"
        )
    if seen.unseen_toward is not None:
        _check_unit(seen.unseen_toward, f"{place}, seen.unseen_toward", "vector (x, y, z)")


def _check_unit(
    numbers: tuple[float, ...], place: str, what: str = "quaternion (w, x, y, z)"
) -> None:
    norm = math.sqrt(math.fsum(x * x for x in numbers))
    if abs(norm - 1.0) > _UNIT_TOLERANCE:
        raise BodyError(f"{place}: the {what} has length {norm:.6g}; it must be 1")


def _lay_out(data: Any) -> str:
    """Return JSON text that ends in a line break; numbers keep their full precision."""
    return _lines(data, "") + "\n"


def _lines(data: Any, indent: str) -> str:
    deeper = indent + "  "
    if isinstance(data, dict) and data:
        items = [f"{json.dumps(key)}: {_lines(value, deeper)}" for key, value in data.items()]
    elif isinstance(data, (list, tuple)) and any(_nests(item) for item in data):
        items = [_lines(item, deeper) for item in data]
    else:
        return json.dumps(data, allow_nan=False, ensure_ascii=False)
    opening, closing = "{}" if isinstance(data, dict) else "[]"
    body = ",\n".join(deeper + item for item in items)
    return f"{opening}\n{body}\n{indent}{closing}"


def _nests(item: Any) -> bool:
    return isinstance(item, (dict, list, tuple))
