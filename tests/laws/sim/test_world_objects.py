from pathlib import Path

import numpy as np
import pytest
import trimesh

from servoid.errors import SimError
from servoid.sim.world.events.paths import KINDS
from servoid.sim.world.objects import OBJECTS, SPIN_AXES, make_object, spin_axis
from servoid.sim.world.scene.meshes import as_mesh
from servoid.sim.world.scene.room import BACKGROUNDS
from servoid.sim.world.scene.visuals import (
    OBJECT,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    MeshShape,
    Plane,
    Visual,
)


def parts(name: str) -> list[trimesh.Trimesh]:
    found = []
    for visual in make_object(name):
        mesh = as_mesh(visual.shape)
        solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True, merge_tex=True)
        solid.merge_vertices(merge_tex=True, merge_norm=True)
        solid.update_faces(solid.nondegenerate_faces())
        found.append(solid)
    return found


@pytest.mark.parametrize("name", OBJECTS)
def test_every_part_of_an_object_is_a_closed_surface_that_faces_out(name: str) -> None:
    for solid in parts(name):
        assert solid.is_watertight
        assert solid.volume > 0.0


@pytest.mark.parametrize("name", OBJECTS)
def test_an_object_lies_around_its_origin_and_can_be_held(name: str) -> None:
    corners = np.array([visual.bounds for visual in parts(name)])
    size = corners[:, 1].max(axis=0) - corners[:, 0].min(axis=0)
    assert 0.08 < size.max() < 0.25
    if name != "two_ellipsoids":
        middle = 0.5 * (corners[:, 1].max(axis=0) + corners[:, 0].min(axis=0))
        assert np.abs(middle).max() < 0.03


@pytest.mark.parametrize("name", OBJECTS)
def test_an_object_is_the_same_each_time(name: str) -> None:
    for one, two in zip(make_object(name), make_object(name), strict=True):
        assert one.carrier == two.carrier == OBJECT
        if one.finish.texture is not None:
            assert np.array_equal(one.finish.texture, two.finish.texture)
        if isinstance(one.shape, MeshShape) and isinstance(two.shape, MeshShape):
            assert np.array_equal(one.shape.vertices, two.shape.vertices)


@pytest.mark.parametrize("name", ["ellipsoid", "plain_bottle", "plain_mug", "two_ellipsoids"])
def test_a_plain_object_has_one_colour(name: str) -> None:
    visuals = make_object(name)
    assert {visual.finish.color for visual in visuals} == {visuals[0].finish.color}
    assert [visual.finish.texture for visual in visuals if visual.finish.texture is not None] == []


@pytest.mark.parametrize(("printed", "plain"), [("bottle", "plain_bottle"), ("mug", "plain_mug")])
def test_a_plain_object_has_the_shape_of_the_printed_one(printed: str, plain: str) -> None:
    for one, two in zip(make_object(printed), make_object(plain), strict=True):
        assert np.array_equal(as_mesh(one.shape).vertices, as_mesh(two.shape).vertices)


def test_the_papers_ellipsoid_is_90_mm_long_and_45_mm_thick() -> None:
    (visual,) = make_object("ellipsoid")
    assert isinstance(visual.shape, Ellipsoid)
    assert sorted(2000 * radius for radius in visual.shape.radii) == [45.0, 45.0, 90.0]


def test_an_ellipsoid_may_have_other_radii() -> None:
    (visual,) = make_object("ellipsoid", (0.03, 0.03, 0.06))
    assert visual.shape == Ellipsoid((0.03, 0.03, 0.06))
    assert spin_axis("ellipsoid", (0.03, 0.03, 0.06)) == (0.0, 0.0, 1.0)
    assert spin_axis("ellipsoid", (0.06, 0.03, 0.03)) == (1.0, 0.0, 0.0)
    assert spin_axis("ellipsoid", (0.03, 0.06, 0.03)) == (0.0, 1.0, 0.0)
    assert spin_axis("ellipsoid", (0.03, 0.04, 0.05)) is None


def test_only_the_ellipsoid_has_radii_to_choose() -> None:
    with pytest.raises(SimError, match=r"object\.radii was given, but the object is 'mug'"):
        make_object("mug", (0.1, 0.1, 0.1))


@pytest.mark.parametrize(
    ("shape", "volume"),
    [
        (Ellipsoid((0.03, 0.04, 0.05)), 4 / 3 * np.pi * 0.03 * 0.04 * 0.05),
        (Capsule(0.02, 0.05), np.pi * 0.02**2 * (0.1 + 4 / 3 * 0.02)),
        (Cylinder(0.02, 0.05), np.pi * 0.02**2 * 0.1),
        (Box((0.01, 0.02, 0.03)), 8 * 0.01 * 0.02 * 0.03),
    ],
)
def test_shapes_as_triangles_enclose_their_volume(shape: object, volume: float) -> None:
    mesh = as_mesh(shape)  # pyright: ignore[reportArgumentType]
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).volume == pytest.approx(volume, rel=0.01)


def test_a_plane_is_no_solid() -> None:
    with pytest.raises(SimError, match="a plane encloses nothing"):
        as_mesh(Plane((1.0, 1.0)))


def test_the_page_about_worlds_names_every_object_and_background() -> None:
    page = Path(__file__).parents[3] / "docs" / "howto" / "world.md"
    text = page.read_text(encoding="utf-8")
    assert [name for name in (*OBJECTS, *BACKGROUNDS, *KINDS) if f"`{name}" not in text] == []


def test_an_unknown_object_is_refused_with_the_known_ones() -> None:
    with pytest.raises(SimError) as caught:
        make_object("teapot")
    assert [name for name in OBJECTS if name not in str(caught.value)] == []


@pytest.mark.parametrize("name", OBJECTS)
def test_only_objects_that_look_the_same_all_around_have_a_spin_axis(name: str) -> None:
    round_about_y = all(is_round_about_y(visual) for visual in make_object(name))
    assert SPIN_AXES.get(name) == ((0.0, 1.0, 0.0) if round_about_y else None)


def is_round_about_y(visual: Visual) -> bool:
    """Say if a visual has one colour, and a surface of nothing but rings about y."""
    if visual.finish.texture is not None:
        return False
    if isinstance(visual.shape, Ellipsoid):
        return visual.shape.radii[0] == visual.shape.radii[2]
    vertices = as_mesh(visual.shape).vertices
    rings = np.stack([np.hypot(vertices[:, 0], vertices[:, 2]), vertices[:, 1]], axis=1)
    found, counts = np.unique(np.round(rings, 6), axis=0, return_counts=True)
    return bool(np.all((counts >= 40) | (found[:, 0] == 0.0)))
