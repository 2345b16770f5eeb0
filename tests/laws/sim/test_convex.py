"""Solids that rays meet at once, and the layers that are seen through them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from servoid.sim.samples import room, snail
from servoid.sim.samples.drawing import layers
from servoid.sim.samples.drawing.convex import Convex, box, ellipsoid, tube
from servoid.sim.samples.drawing.layers import Drawable, Pinhole, see
from servoid.sim.samples.studio import look_at
from servoid.sim.samples.surface import obj_text, outer_mesh

Array = NDArray[np.float64]
SOLIDS = {
    "ellipsoid": ellipsoid((0.02, -0.01, 0.03), (0.05, 0.03, 0.08), (20.0, -30.0, 50.0)),
    "box": box((0.0, 0.02, -0.01), (0.06, 0.03, 0.04), (10.0, 40.0, -20.0)),
    "tube": tube((-0.01, 0.0, 0.02), 0.03, 0.07, (70.0, 20.0, 10.0)),
}
solids = st.sampled_from(sorted(SOLIDS))
angle = st.floats(-3.0, 3.0)


def inside(name: str, points: Array) -> NDArray[np.bool_]:
    """Say which points (3, N) are in a solid, written down once more for each kind."""
    solid = SOLIDS[name]
    x, y, z = solid.axes @ (points - solid.center[:, None])
    if name == "ellipsoid":
        return (x / 0.05) ** 2 + (y / 0.03) ** 2 + (z / 0.08) ** 2 < 1.0
    if name == "box":
        return (np.abs(x) < 0.06) & (np.abs(y) < 0.03) & (np.abs(z) < 0.04)
    return (np.hypot(x, y) < 0.03) & (np.abs(z) < 0.07)


def camera_at(azimuth: float, rise: float) -> Array:
    place = 0.5 * np.array([np.cos(azimuth), np.sin(azimuth), np.tan(0.4 * np.sin(rise))])
    return look_at(place, np.array([0.01, 0.0, 0.02]))


@given(solids, angle, angle)
def test_a_ray_is_inside_between_where_it_enters_and_leaves_and_nowhere_else(
    name: str, azimuth: float, rise: float
) -> None:
    pose = camera_at(azimuth, rise)
    x, y = np.linspace(-0.2, 0.2, 9), np.linspace(-0.15, 0.15, 7)
    enter, leave = SOLIDS[name].crossing(pose, x, y)
    depths = np.linspace(0.2, 0.8, 61)
    grid = np.stack(np.broadcast_arrays(x, y[:, None], 1.0)).reshape(3, -1, 1) * depths
    points = pose[:3, :3] @ grid.reshape(3, -1) + pose[:3, 3:]
    found = inside(name, points).reshape(7, 9, 61)
    between = (depths > enter[:, :, None]) & (depths < leave[:, :, None])
    near = np.minimum(np.abs(depths - enter[:, :, None]), np.abs(depths - leave[:, :, None]))
    assert (found == between)[near > 1e-9].all()


@given(solids, angle, st.floats(-1.0, 1.0))
def test_a_surface_point_lies_on_the_surface_and_its_normal_points_away(
    name: str, azimuth: float, height: float
) -> None:
    level = np.sqrt(1.0 - height**2)
    way = np.array([[level * np.cos(azimuth)], [level * np.sin(azimuth)], [height]])
    solid = SOLIDS[name]
    point = solid.surface(way)
    normal = solid.normals(solid.to_local(point))
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    assert inside(name, point - 1e-6 * normal).all()
    assert not inside(name, point + 1e-6 * normal).any()
    assert np.linalg.norm(point[:, 0] - solid.center) <= solid.bound + 1e-12


@given(solids, angle, st.floats(-0.15, 0.15), st.floats(-0.15, 0.15), st.floats(0.0, 0.4))
def test_a_point_is_in_the_shade_if_its_way_to_the_light_meets_the_solid(
    name: str, azimuth: float, aside: float, above: float, along: float
) -> None:
    light = np.array([np.cos(azimuth), np.sin(azimuth), 0.5])
    light /= np.linalg.norm(light)
    point = np.array([[-light[1] * aside], [light[0] * aside], [above]]) - along * light[:, None]
    way = point + np.linspace(0.0, 0.8, 2001) * light[:, None]
    met = int(inside(name, way).sum())
    if met == 0 or met > 2:
        assert SOLIDS[name].shades(point, light)[0] == (met > 0)


@pytest.mark.parametrize("azimuth", [0.0, 1.1, 2.7, 4.0])
def test_no_part_of_a_thing_is_cut_by_the_window_it_is_looked_for_in(azimuth: float) -> None:
    camera = Pinhole((80, 60), 70.0, (39.5, 29.5), 1)
    drawable = Drawable(snail.PARTS, snail.paint_plain)
    pose = camera_at(azimuth, 1.0)
    x: Array = (np.arange(80.0) - 39.5) / 70.0
    y: Array = (np.arange(60.0) - 29.5) / 70.0
    spans = [part.crossing(pose, x, y) for part in snail.PARTS]
    expected = np.any([enter < leave for enter, leave in spans], axis=0)
    np.testing.assert_array_equal(see(drawable, camera, pose, room.LAMP).cover, expected)


def test_a_finer_camera_sees_the_same_light_on_average() -> None:
    drawable = Drawable(snail.PARTS, snail.paint)
    camera = Pinhole((64, 48), 55.0, (31.5, 23.5), 8)
    pose = camera_at(2.0, 1.0)
    fine, coarse = (
        see(drawable, one, pose, room.LAMP) for one in (camera, replace(camera, subpixels=2))
    )
    seen = fine.cover > 0.0
    assert np.abs(fine.cover - coarse.cover)[seen].mean() < 0.03
    assert np.abs(fine.light - coarse.light)[seen].mean() < 0.03


def test_nothing_behind_the_camera_is_seen() -> None:
    pose = camera_at(0.3, 0.0)
    pose[:3, :3] = pose[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
    camera = Pinhole((40, 30), 30.0, (19.5, 14.5), 1)
    assert not see(Drawable(snail.PARTS, snail.paint), camera, pose, room.LAMP).cover.any()


def test_a_floor_throws_no_shade_and_what_stands_on_it_does() -> None:
    floor = box((0.0, 0.0, -0.05), (1.0, 1.0, 0.05))
    ball = ellipsoid((0.0, 0.0, 0.1), (0.05, 0.05, 0.05))
    drawable = Drawable((floor, ball), snail.paint_plain, backdrops=1)
    overhead = layers.Lamp(np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0]))
    points = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]).T
    up = np.array([[0.0, 0.0, 1.0]] * 2).T
    np.testing.assert_allclose(layers.key_light(drawable, points, up, overhead), [0.0, 1.0])


def test_the_mesh_is_what_can_be_seen_from_outside_and_faces_outwards() -> None:
    vertices, faces = outer_mesh(snail.PARTS)
    for part in snail.PARTS:
        shrunk = Convex(part.center, part.axes, part.radii - 1e-6)
        assert not shrunk.holds(vertices.T).any()
    assert 0.18 < np.ptp(vertices, axis=0).max() < 0.21
    assert np.abs(vertices.mean(axis=0)).max() < 0.02
    corners = vertices[faces]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middles = corners.mean(axis=1)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
    within = [part.holds((middles - 2e-3 * outward).T) for part in snail.PARTS]
    assert np.any(within, axis=0).mean() > 0.99


def test_the_text_of_a_mesh_counts_vertices_from_one() -> None:
    text = obj_text(np.array([[0.0, 0.5, 1.0]] * 3), np.array([[0, 1, 2]]))
    assert text == "v 0.000000 0.500000 1.000000\n" * 3 + "f 1 2 3\n"
