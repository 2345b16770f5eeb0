"""Exported bodies, read back by libraries that did not write them."""

import json
import struct
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
import yourdfpy
from exported_bodies import Array, Truth, bodies, random_body, rotation_of, truth
from hypothesis import HealthCheck, given, settings
from plyfile import PlyData
from scipy.spatial.transform import Rotation
from tiers import tiered

from servoid.exchange.export import FORMATS, export_body
from servoid.exchange.export.splat import SIGMA, SPLATS
from servoid.exchange.export.surface import DEFAULT_DETAIL, ball
from servoid.shape import BodyFile, EllipsoidEntry

DENSITY = 730.0
FRAMES = pytest.mark.parametrize("frame", tiered(["world", "object"]))
few = settings(
    max_examples=4, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def write(file: BodyFile, path: Path, format_: str, frame: Any = "object", **more: Any) -> Path:
    done = export_body(file, path, format_, density_kg_m3=DENSITY, frame=frame, **more)
    assert done.files[0] == path
    assert done.mass_kg == pytest.approx(DENSITY * truth(file).volume)
    return path


def read_obj(path: Path) -> tuple[trimesh.Trimesh, list[str]]:
    """Read vertices, triangles and the material of each triangle, and nothing else."""
    vertices, faces, owners, material = [], [], [], ""
    for line in path.read_text().splitlines():
        word, *rest = line.split()
        if word == "v":
            vertices.append([float(number) for number in rest])
        elif word == "f":
            faces.append([int(number) - 1 for number in rest])
            owners.append(material)
        elif word == "usemtl":
            (material,) = rest
    return trimesh.Trimesh(vertices, faces, process=False), owners


def check_mesh(mesh: trimesh.Trimesh, true: Truth, share: float = 2e-3) -> None:
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(true.volume, rel=share)
    reach = np.sqrt(np.trace(true.inertia) / true.volume)
    assert np.linalg.norm(mesh.center_mass - true.centroid) < share * reach
    inertia = mesh.moment_inertia
    assert np.linalg.norm(inertia - true.inertia) < 3 * share * np.linalg.norm(true.inertia)
    # All on the surface of the union: on some ellipsoid, and inside none.
    np.testing.assert_allclose(true.levels(mesh.vertices).min(axis=0), 1.0, atol=5e-3)


@few
@FRAMES
@given(file=bodies)
def test_a_ply_is_the_closed_surface_of_the_union(
    tmp_path: Path, frame: str, file: BodyFile
) -> None:
    path = write(file, tmp_path / "body.ply", "ply", frame)
    mesh = trimesh.load_mesh(path, process=False)
    true = truth(file, frame)
    check_mesh(mesh, true)
    known = np.array([entry.color for entry in file.ellipsoids])
    levels = np.abs(true.levels(mesh.vertices) - 1.0)
    alone = (levels < 0.02).sum(axis=0) == 1
    shown = np.asarray(mesh.visual.vertex_colors)[:, :3]
    assert (shown[alone] == known[levels.argmin(axis=0)[alone]]).mean() > 0.99


@few
@given(file=bodies)
def test_an_obj_is_the_closed_surface_of_the_union_in_its_colours(
    tmp_path: Path, file: BodyFile
) -> None:
    path = write(file, tmp_path / "my body.obj", "obj", "world")
    mesh, owners = read_obj(path)
    true = truth(file, "world")
    check_mesh(mesh, true)
    index = np.array([int(owner.removeprefix("ellipsoid_")) for owner in owners])
    middles = true.levels(mesh.triangles_center)[index, np.arange(len(index))]
    np.testing.assert_allclose(middles, 1.0, atol=5e-3)
    # trimesh finds the materials by itself.
    parts = {part.visual.material.name: part for part in trimesh.load_scene(path).geometry.values()}
    assert set(parts) == set(owners)
    for number in set(index.tolist()):
        part = parts[f"ellipsoid_{number}"]
        color = file.ellipsoids[number].color
        assert part.visual.material.main_color[:3].tolist() == pytest.approx(color, abs=1)


@few
@FRAMES
@given(file=bodies)
def test_a_glb_stands_upright_where_y_is_up(tmp_path: Path, frame: str, file: BodyFile) -> None:
    path = write(file, tmp_path / "body.glb", "glb", frame)
    mesh = trimesh.load_scene(path, process=False).to_mesh()
    z_up_from_y_up = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)
    mesh.apply_transform(z_up_from_y_up)
    check_mesh(mesh, truth(file, frame))


def test_colours_in_a_glb_are_linear_light(tmp_path: Path) -> None:
    file = random_body(3, 1)
    entry = replace_color(file, (188, 0, 255))
    data = write(entry, tmp_path / "body.glb", "glb").read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    scene = json.loads(data[20 : 20 + length])
    view = scene["bufferViews"][scene["accessors"][2]["bufferView"]]
    color = struct.unpack_from("<4H", data, 28 + length + view["byteOffset"])
    # 188 of 255 in sRGB is half of full light.
    np.testing.assert_allclose(np.array(color) / 65535, [0.5, 0.0, 1.0, 1.0], atol=0.005)


def mujoco_library() -> Any:
    return pytest.importorskip("mujoco", reason="mujoco-core needs Python 3.11 or newer")


def replace_color(file: BodyFile, color: tuple[int, int, int] | None) -> BodyFile:
    entries = (
        type(entry)(center=entry.center, radii=entry.radii, rotation=entry.rotation, color=color)
        for entry in file.ellipsoids
    )
    return BodyFile(
        version=1,
        units="m",
        world_from_object=file.world_from_object,
        ellipsoids=tuple(entries),
    )


def test_more_detail_is_closer_to_the_body(tmp_path: Path) -> None:
    file = random_body(1, 4)
    errors = []
    for detail in (2, 3, 4, 5):
        mesh = trimesh.load_mesh(write(file, tmp_path / "b.ply", "ply", detail=detail))
        errors.append(np.abs(truth(file).levels(mesh.vertices).min(axis=0) - 1.0).max())
    assert errors == sorted(errors, reverse=True)


def test_ellipsoids_that_are_apart_or_the_same_still_make_a_closed_mesh(tmp_path: Path) -> None:
    first, second = random_body(2, 2).ellipsoids
    far = type(first)(center=(1.0, 0.0, 0.0), radii=(0.02, 0.02, 0.02), rotation=(1, 0, 0, 0))
    for entries in ((first, far), (first, first), (first, second, second, first)):
        file = BodyFile(
            version=1,
            units="m",
            world_from_object=(0, 0, 0, 1, 0, 0, 0),
            ellipsoids=entries,
        )
        mesh = trimesh.load_mesh(write(file, tmp_path / "b.ply", "ply"), process=False)
        check_mesh(mesh, truth(file))


def test_no_edge_is_so_short_that_a_reader_takes_its_ends_for_one_vertex(tmp_path: Path) -> None:
    # Two polyhedra that meet 4e-9 m from a vertex of both.
    radius = 0.05
    apart = (2.0 - 4e-7) * radius * ball(DEFAULT_DETAIL)[0][500]
    first, second = (
        EllipsoidEntry(center=center, radii=(radius,) * 3, rotation=(1, 0, 0, 0))
        for center in ((0.0, 0.0, 0.0), (float(apart[0]), float(apart[1]), float(apart[2])))
    )
    still = (0, 0, 0, 1, 0, 0, 0)
    file = BodyFile(version=1, units="m", world_from_object=still, ellipsoids=(first, second))
    for format_ in ("ply", "obj"):
        path = write(file, tmp_path / f"b.{format_}", format_)
        mesh = trimesh.load_mesh(path)  # merges what is nearer than 1e-8 m
        check_mesh(mesh, truth(file))


@few
@FRAMES
@given(file=bodies)
def test_mujoco_loads_the_ellipsoids_and_the_inertia_of_the_union(
    tmp_path: Path, frame: str, file: BodyFile
) -> None:
    mujoco = mujoco_library()
    path = write(file, tmp_path / "body.xml", "mjcf", frame, name="thing")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    true = truth(file, frame)
    assert model.body("thing").mass[0] == pytest.approx(DENSITY * true.volume)
    np.testing.assert_allclose(data.xipos[1], true.centroid, atol=1e-9)
    axes = data.ximat[1].reshape(3, 3)
    inertia = axes @ np.diag(model.body_inertia[1]) @ axes.T
    assert close(inertia, DENSITY * true.inertia, 1e-7)
    np.testing.assert_allclose(model.geom_size, true.radii, rtol=1e-9)
    np.testing.assert_allclose(data.geom_xpos, true.centers, atol=1e-9)
    turns = data.geom_xmat.reshape(-1, 3, 3)
    assert close((turns * model.geom_size[:, None] ** 2) @ turns.swapaxes(1, 2), true.shapes, 1e-8)
    assert set(model.geom_type.tolist()) == {int(mujoco.mjtGeom.mjGEOM_ELLIPSOID)}
    colors = np.array([entry.color for entry in file.ellipsoids]) / 255
    np.testing.assert_allclose(model.geom_rgba[:, :3], colors, atol=1e-6)
    assert model.jnt_type.tolist() == [int(mujoco.mjtJoint.mjJNT_FREE)]


def close(one: Array, two: Array, share: float) -> bool:
    return bool(np.linalg.norm(one - two) <= share * np.linalg.norm(two))


def pose_of(element: ElementTree.Element) -> tuple[Array, Array]:
    """Read <pose>x y z roll pitch yaw</pose>: turns about the fixed axes x, then y, then z."""
    numbers = [float(number) for number in (element.findtext("pose") or "").split()]
    assert len(numbers) == 6
    return np.array(numbers[:3]), Rotation.from_euler("xyz", numbers[3:]).as_matrix()


@few
@FRAMES
@given(file=bodies)
def test_an_sdf_has_the_ellipsoids_and_the_inertia_of_the_union(
    tmp_path: Path, frame: str, file: BodyFile
) -> None:
    root = ElementTree.parse(write(file, tmp_path / "body.sdf", "sdf", frame)).getroot()
    assert root.tag == "sdf"
    assert float(root.attrib["version"]) >= 1.8  # since then there is <ellipsoid>
    (model,) = root
    (link,) = model.findall("link")
    assert model.attrib == {"name": "body"}
    shift, turn = pose_of(model)
    true = truth(file, frame)
    for kind in ("collision", "visual"):
        for index, shape in enumerate(link.findall(kind)):
            at, axes = pose_of(shape)
            radii = np.array((shape.findtext("geometry/ellipsoid/radii") or "").split(), float)
            np.testing.assert_allclose(turn @ at + shift, true.centers[index], atol=1e-9)
            found = turn @ axes @ np.diag(radii**2) @ axes.T @ turn.T
            assert close(found, true.shapes[index], 1e-8)
        assert index == len(true.radii) - 1
    at, axes = pose_of(link.find("inertial"))  # type: ignore[arg-type]
    np.testing.assert_allclose(turn @ at + shift, true.centroid, atol=1e-9)
    assert np.array_equal(axes, np.eye(3))
    assert float(link.findtext("inertial/mass") or 0) == pytest.approx(DENSITY * true.volume)
    inertia = np.zeros((3, 3))
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        entry = float(link.findtext(f"inertial/inertia/i{'xyz'[i]}{'xyz'[j]}") or 0)
        inertia[i, j] = inertia[j, i] = entry
    assert close(turn @ inertia @ turn.T, DENSITY * true.inertia, 1e-9)


@few
@FRAMES
@given(file=bodies)
def test_yourdfpy_loads_the_surface_the_pieces_and_the_inertia(
    tmp_path: Path, frame: str, file: BodyFile
) -> None:
    path = write(file, tmp_path / "body.urdf", "urdf", frame)
    robot = yourdfpy.URDF.load(str(path))
    (link,) = robot.robot.links
    true = truth(file, frame)
    assert link.inertial.mass == pytest.approx(DENSITY * true.volume)
    np.testing.assert_allclose(link.inertial.origin[:3, 3], true.centroid, atol=1e-9)
    assert close(link.inertial.inertia, DENSITY * true.inertia, 1e-9)
    assert robot.scene.to_mesh().volume == pytest.approx(true.volume, rel=2e-3)
    assert len(link.collisions) == len(true.radii)
    for collision, center, shape, radii in zip(
        link.collisions, true.centers, true.shapes, true.radii, strict=True
    ):
        mesh, _ = read_obj(tmp_path / collision.geometry.mesh.filename)
        assert mesh.is_watertight
        assert mesh.is_convex
        mesh.apply_scale(collision.geometry.mesh.scale)
        mesh.apply_transform(collision.origin)
        assert mesh.volume == pytest.approx(4 / 3 * np.pi * radii.prod(), rel=1e-6)
        np.testing.assert_allclose(mesh.center_mass, center, atol=1e-6)
        # The inertia of a solid ellipsoid is that of its shape matrix: an account of its turn.
        spread = shape * mesh.volume / 5
        assert close(mesh.moment_inertia, np.eye(3) * np.trace(spread) - spread, 0.02)


def test_a_urdf_names_its_meshes_relative_to_itself(tmp_path: Path) -> None:
    path = write(random_body(0, 2), tmp_path / "a_b.urdf", "urdf")
    names = {mesh.attrib["filename"] for mesh in ElementTree.parse(path).iter("mesh")}
    assert names == {"a_b_visual.obj", "a_b_unit_ball.obj"}
    assert {one.name for one in tmp_path.iterdir()} == {"a_b.urdf", "a_b_visual.mtl", *names}


@pytest.mark.parametrize("name", ["urdf", "obj"])
def test_files_beside_exports_of_other_names_have_other_names(tmp_path: Path, name: str) -> None:
    stems = ["杯", "瓶", "a b", "a_b", "a-b", "a+b", "1", "_1", "body_1", "body"]
    each = [
        len(export_body(random_body(0, 1), tmp_path / f"{stem}.{name}", name, detail=1).files)
        for stem in stems
    ]
    assert len(list(tmp_path.iterdir())) == sum(each)
    assert all(path.name.isascii() for path in tmp_path.iterdir() if path.suffix == ".mtl")


@few
@FRAMES
@given(file=bodies)
def test_splats_cover_the_surface_of_the_union(tmp_path: Path, frame: str, file: BodyFile) -> None:
    table = PlyData.read(write(file, tmp_path / "body.ply", "splat", frame))["vertex"]
    points = np.stack([table[axis] for axis in "xyz"], 1).astype(float)
    normals = np.stack([table[f"n{axis}"] for axis in "xyz"], 1).astype(float)
    sigmas = np.exp(np.stack([table[f"scale_{i}"] for i in range(3)], 1).astype(float))
    turns = rotation_of(np.stack([table[f"rot_{i}"] for i in range(4)], 1)).as_matrix()
    true = truth(file, frame)
    levels = true.levels(points)
    np.testing.assert_allclose(levels.min(axis=0), 1.0, atol=1e-4)
    # A splat stands for 4 pi / SPLATS of its ball, on which its sigma is SIGMA times the root.
    areas = sigmas[:, 1] * sigmas[:, 2] / SIGMA**2
    volume = (areas * ((points - true.centroid) * normals).sum(axis=1)).sum() / 3
    assert volume == pytest.approx(true.volume, rel=0.02)
    thin = np.einsum("nij,ni->nj", turns, normals)
    assert np.abs(thin[:, 0]).min() > 0.95  # the first axis, the shortest, is the normal
    assert (sigmas[:, 0] < 0.3 * sigmas[:, 1]).mean() > 0.9
    spots = trimesh.load_mesh(write(file, tmp_path / "m.ply", "ply", frame, detail=3)).vertices
    away = np.einsum("nij,mni->mnj", turns, spots[::7, None] - points[None]) / sigmas
    reach = np.linalg.norm(away[:, :, 1:], axis=2)
    reach[np.abs(away[:, :, 0]) > 20] = np.inf
    assert (reach.min(axis=1) < 2.0).mean() > 0.98
    known = np.array([entry.color for entry in file.ellipsoids])[np.abs(levels - 1).argmin(axis=0)]
    shown = 255 * (np.stack([table[f"f_dc_{i}"] for i in range(3)], 1) / (2 * np.pi**0.5) + 0.5)
    assert (np.abs(shown - known).max(axis=1) < 0.1).mean() > 0.98
    assert 1 / (1 + np.exp(-table["opacity"])) == pytest.approx(0.99)
    assert len(points) <= SPLATS * len(true.radii)


def test_ellipsoids_without_a_colour_are_grey(tmp_path: Path) -> None:
    file = replace_color(random_body(0, 2), None)
    for name, one in FORMATS.items():
        write(file, tmp_path / f"b{one.suffixes[0]}", name)
    for geom in ElementTree.parse(tmp_path / "b.xml").iter("geom"):
        red, green, blue, _ = geom.attrib["rgba"].split()
        assert red == green == blue


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_body_gives_the_same_files(tmp_path: Path, name: str) -> None:
    file = random_body(5, 4)
    found = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        write(file, folder / f"body{FORMATS[name].suffixes[0]}", name)
        found.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert found[0] == found[1]
    assert len(found[0]) == 1 + len(FORMATS[name].beside)


def test_one_ellipsoid_weighs_what_the_textbook_says() -> None:
    file = random_body(8, 1)
    true = truth(file)
    spread = true.shapes[0] * true.volume / 5
    assert true.volume == pytest.approx(4 / 3 * np.pi * true.radii.prod())
    assert close(true.inertia, np.eye(3) * np.trace(spread) - spread, 1e-8)
