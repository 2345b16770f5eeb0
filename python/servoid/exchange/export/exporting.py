"""Writes a body to the files of a format."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from servoid._native import Pose
from servoid.errors import ExportError
from servoid.exchange.export.formats import FORMATS, NAME, plain_stem, stem_beside
from servoid.exchange.export.solid import solid_of
from servoid.exchange.export.surface import DEFAULT_DETAIL, MOST_DETAIL, check_libraries
from servoid.output import check_file, write_together
from servoid.shape import BodyFile
from servoid.words import digits

Frame = Literal["object", "world"]

WATER_KG_M3 = 1000.0
LEAST_DENSITY = 2.0  # in kg/m³; a beach ball of 40 cm and 100 g has 3
MOST_DENSITY = 25_000.0  # in kg/m³; the densest metal has about 22,600
_KG_M3_PER_G_CM3 = 1000.0
_MOST_G_CM3 = 23.0  # no metal is denser; the lightest foams have 10 to 30 kg/m³
_RESERVED = ("world",)  # what MuJoCo and SDFormat call their root


@dataclass(frozen=True)
class Exported:
    """The written files, the requested one first, and the mass of the body."""

    files: tuple[Path, ...]
    volume_m3: float
    mass_kg: float


def export_body(
    file: BodyFile,
    path: str | Path,
    format: str,  # noqa: A002
    *,
    density_kg_m3: float = WATER_KG_M3,
    name: str | None = None,
    frame: Frame = "object",
    detail: int = DEFAULT_DETAIL,
) -> Exported:
    """Write a body in a format of `FORMATS`; all of its files are written, or none.

    `frame` selects the coordinates: the object's own, or the world's, in which the body was
    modelled. `name` names the body inside the file; the default is the file's name. `detail` sets
    the resolution of the meshes: 20 * 4**detail triangles per ellipsoid.

    Raises:
        BodyError, PoseError: the numbers of `file` do not describe a body.
        ExportError: the format, frame, name, density or detail is invalid, the path's ending is not
            the format's, or the body's surface cannot be made.
        MissingExtraError: obj, ply, glb and urdf need `pip install 'servoid[exchange]'`.
        OutputError: a file cannot be written.

    """
    path = Path(path)
    check_options(path, format, density_kg_m3=density_kg_m3, frame=frame, name=name, detail=detail)
    check_export(path, format)
    chosen = FORMATS[format]
    pose = file.body().world_from_object if frame == "world" else Pose.identity()
    solid = solid_of(file, _name(path, name), density_kg_m3, pose)
    made = chosen.make(solid, path, detail)
    files = {path.parent / file_name: data for file_name, data in made.items()}
    write_together(files)
    return Exported(tuple(files), solid.volume_m3, solid.mass_kg)


def check_options(
    path: Path,
    format: str,  # noqa: A002
    *,
    density_kg_m3: float = WATER_KG_M3,
    name: str | None = None,
    frame: str = "object",
    detail: int = DEFAULT_DETAIL,
) -> None:
    """Check the options of `export_body`, whatever the body and the path are.

    Raises:
        ExportError: the format, frame, name, density or detail is invalid, or the path's ending is
            not the format's.

    """
    _check_format(path, format)
    _check_numbers(density_kg_m3, detail)
    if frame not in get_args(Frame):
        raise ExportError(f"there is no frame {frame!r}; choose one of {_list(get_args(Frame))}")
    _name(path, name)


def check_export(path: Path, format: str) -> None:  # noqa: A002
    """Check that `export_body` can write `path` in `format`, without leaving a file behind.

    Raises:
        ExportError: the format does not exist, or its files have another ending.
        MissingExtraError: a library that it needs is not installed.
        OutputError: the file, or one that belongs beside it, cannot be written.

    """
    _check_format(path, format)
    chosen = FORMATS[format]
    if chosen.meshes:
        check_libraries()
    check_file(path)
    for addition in chosen.beside:
        check_file(path.parent / (stem_beside(path.stem) + addition))


def density_note(density_kg_m3: float) -> str | None:
    """Report a density that only light foams have in kg/m³, but metals and stones in g/cm³."""
    if not LEAST_DENSITY <= density_kg_m3 <= _MOST_G_CM3:
        return None
    return (
        f"only light foams have a density of {digits(density_kg_m3)} kg/m³; if g/cm³ was meant, "
        f"write {digits(_KG_M3_PER_G_CM3 * density_kg_m3)}"
    )


def format_of(path: Path) -> str:
    """Return the format for a file's ending; .xml is MuJoCo's, .ply a mesh.

    Raises:
        ExportError: the ending belongs to no format.

    """
    for name, one in FORMATS.items():
        if path.suffix in one.suffixes:
            return name
    known = sorted({suffix for one in FORMATS.values() for suffix in one.suffixes})
    raise ExportError(
        f"the ending of {path} belongs to no format; end the name in {_list(known)}, or choose "
        f"which of {_list(FORMATS)} to write"
    )


def _check_format(path: Path, format: str) -> None:  # noqa: A002
    if format not in FORMATS:
        raise ExportError(f"there is no format {format!r}; choose one of {_list(FORMATS)}")
    suffixes = FORMATS[format].suffixes
    if path.suffix not in suffixes:
        raise ExportError(
            f"cannot write {path} as {format}: such a file ends in {' or '.join(suffixes)}"
        )


def _check_numbers(density_kg_m3: float, detail: int) -> None:
    if not LEAST_DENSITY <= density_kg_m3 <= MOST_DENSITY:
        in_kg_m3 = _KG_M3_PER_G_CM3 * density_kg_m3
        meant = f"; if g/cm³ was meant, write {digits(in_kg_m3)}"
        raise ExportError(
            f"the density is {digits(density_kg_m3)} kg/m³; give a number from "
            f"{digits(LEAST_DENSITY)} to {digits(MOST_DENSITY)} in kg/m³"
            f"{meant if LEAST_DENSITY <= in_kg_m3 <= MOST_DENSITY else ''}"
        )
    if not 0 <= detail <= MOST_DETAIL:
        raise ExportError(f"the detail is {detail}; choose a whole number from 0 to {MOST_DETAIL}")


def _name(path: Path, name: str | None) -> str:
    """Return a name that is valid in every format."""
    if name is None:
        plain = plain_stem(path.stem)
        return f"{plain}_body" if plain in _RESERVED else plain
    if not NAME.fullmatch(name) or name in _RESERVED:
        raise ExportError(
            f"a body cannot be named {name!r}; use a letter, then letters, digits and any of _.-, "
            f"and not {_list(_RESERVED)}"
        )
    return name


def _list(names: Iterable[str]) -> str:
    return ", ".join(names)
