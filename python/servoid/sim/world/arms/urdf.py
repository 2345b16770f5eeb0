"""Converts an arm's URDF for MuJoCo: with the paths of its meshes on this machine."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from servoid.config import ARM_FILE, read_bytes
from servoid.errors import SimError
from servoid.sim.world.arms.urdf_faults import check_elements
from servoid.words import in_one_line

_READABLE = (".stl", ".obj", ".msh")
_LEAST_MASS, _LEAST_INERTIA = "0.01", "0.0001"  # of a link without mass and inertia in the file
_PACKAGE = "package://"
_FILE = "file://"


@dataclass(frozen=True)
class Urdf:
    """A URDF with absolute paths, and its content that MuJoCo ignores.

    `speeds` are the speed limits of joints in rad/s; `effortless` joints have no effort, or 0, and
    `endless` ones no limits. `leaders` has the joints that mimic another, with its name.
    """

    text: str
    speeds: dict[str, float]
    effortless: frozenset[str]
    endless: frozenset[str]
    leaders: dict[str, str]


def read_urdf(path: Path) -> Urdf:
    """Read a URDF; keep the collision shapes of each link, or its visual shapes without any.

    Visual shapes often have a format that MuJoCo does not support. A link without mass gets a
    small one, as MuJoCo requires it.

    `package://NAME/REST` is searched where ROS packages are: REST in a folder above the file, or
    NAME/REST in one; other names beside the file, or in the `meshdir` of its MuJoCo element.

    Raises:
        SimError: the file is not XML, a mesh is not found, or an element is wrong.

    """
    try:
        root = ElementTree.fromstring(read_bytes(path, SimError, ARM_FILE))
    except ElementTree.ParseError as error:
        raise SimError(f"{path} cannot be read as an arm: {in_one_line(error)}") from error
    check_elements(path, root)
    for link in root.iter("link"):
        _keep_solid(link)
    compiler = _compiler(root)
    meshes = path.resolve().parent / compiler.get("meshdir", "")
    for mesh in root.iter("mesh"):
        mesh.set("filename", str(_found(path, meshes, mesh.get("filename", ""))))
    compiler.set("strippath", "false")
    compiler.set("boundmass", _LEAST_MASS)
    compiler.set("boundinertia", _LEAST_INERTIA)
    endless = _of_type(root, "continuous")
    return Urdf(
        text=ElementTree.tostring(root, encoding="unicode"),
        speeds=dict(_limits(root, "velocity")),
        effortless=(_of_type(root, "revolute") | endless) - dict(_limits(root, "effort")).keys(),
        endless=endless,
        leaders={
            joint.get("name", ""): mimic.get("joint", "")
            for joint in root.findall("joint")
            if (mimic := joint.find("mimic")) is not None
        },
    )


def _of_type(root: ElementTree.Element, kind: str) -> frozenset[str]:
    """Return the names of the joints of a type."""
    return frozenset(
        joint.get("name", "") for joint in root.findall("joint") if joint.get("type") == kind
    )


def _keep_solid(link: ElementTree.Element) -> None:
    """Remove a link's visual shapes, or use them in place of missing collision shapes."""
    bare = link.find("collision") is None
    for visual in link.findall("visual"):
        mesh = visual.find("geometry/mesh")
        name = "" if mesh is None else mesh.get("filename", "")
        if bare and (mesh is None or name.lower().endswith(_READABLE)):
            visual.tag = "collision"
        else:
            link.remove(visual)


def _found(path: Path, meshes: Path, name: str) -> Path:
    """Return the file of a mesh's name in a URDF, whose meshes may be in a folder."""
    if name.startswith(_PACKAGE):
        package, _, rest = name.removeprefix(_PACKAGE).partition("/")
        above = path.resolve().parents
        tried = [folder / part for folder in above for part in (f"{package}/{rest}", rest)]
    else:
        plain = name.removeprefix(_FILE)
        tried = [path.resolve().parent / plain, meshes / plain, meshes / Path(plain).name]
    for file in tried:
        if file.is_file():
            return file
    raise SimError(
        f"{path}: the mesh {name} was not found; put it at that path, relative to a folder "
        "above the URDF, or change its name in the file"
    )


def _compiler(root: ElementTree.Element) -> ElementTree.Element:
    """Return a URDF's element with options for MuJoCo."""
    extension = root.find("mujoco")
    if extension is None:
        extension = ElementTree.SubElement(root, "mujoco")
    compiler = extension.find("compiler")
    return ElementTree.SubElement(extension, "compiler") if compiler is None else compiler


def _limits(root: ElementTree.Element, kind: str) -> Iterator[tuple[str, float]]:
    """Yield the joints that have a positive limit of a kind, with that limit."""
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        try:
            most = 0.0 if limit is None else float(limit.get(kind, "0"))
        except ValueError:
            most = 0.0
        if most > 0.0:
            yield joint.get("name", ""), most
