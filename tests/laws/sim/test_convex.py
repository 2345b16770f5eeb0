"""Convex solids, their surfaces, and how they look in paint that is a function of place."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from servoid._native import Lens
from servoid.pose import looking
from servoid.sim.samples import snail
from servoid.sim.samples.drawing.convex import Convex, box, ellipsoid, tube
from servoid.sim.samples.drawing.painting import painted
from servoid.sim.samples.drawing.stage import Stage
from servoid.sim.samples.surface import obj_text, outer_mesh
from servoid.sim.world.scene.visuals import OBJECT

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


LENS = Lens(model="pinhole", size_px=(80, 60), focal_px=(90.0, 90.0), center_px=(39.5, 29.5))


def camera_at(azimuth: float, rise: float) -> Array:
    place = 0.5 * np.array([np.cos(azimuth), np.sin(azimuth), np.tan(rise)])
    return looking(place, np.array([0.01, 0.0, 0.02])).matrix()


def by_place(points: Array) -> Array:
    """Paint red what is to the right, green what is far and blue what is high."""
    return np.clip(0.5 + 4.0 * points, 0.05, 0.95)


@given(solids, angle, st.floats(-1.0, 1.0))
def test_a_surface_point_lies_on_the_surface(name: str, azimuth: float, height: float) -> None:
    level = np.sqrt(1.0 - height**2)
    way = np.array([[level * np.cos(azimuth)], [level * np.sin(azimuth)], [height]])
    solid = SOLIDS[name]
    point = solid.surface(way)
    outward = point - solid.center[:, None]
    assert inside(name, point - 1e-6 * outward).all()
    assert not inside(name, point + 1e-6 * outward).any()
    assert np.linalg.norm(outward) <= solid.bound + 1e-12


@pytest.mark.parametrize("name", sorted(SOLIDS))
@pytest.mark.parametrize("azimuth", [0.3, 1.9, 3.6, 5.1])
def test_a_solid_is_seen_where_it_is_and_its_paint_where_it_was_put(
    name: str, azimuth: float
) -> None:
    # Under light from everywhere a surface has the colour of its paint.
    visuals = painted(SOLIDS[name], by_place, texel=1e-3, carrier=OBJECT)
    stage = Stage(visuals, (0.0, 0.0, 1.0), 1.0)
    for rise in (-0.8, 0.5):
        pose = camera_at(azimuth, rise)
        seen = stage.shows(OBJECT, LENS, pose, {})
        rows, columns = np.nonzero(seen)
        rays = np.stack([(columns - 39.5) / 90.0, (rows - 29.5) / 90.0, np.ones(len(rows))])
        depths = np.linspace(0.2, 0.9, 1401)
        ways = pose[:3, :3] @ rays
        first = np.full(len(rows), np.nan)
        for depth in depths[::-1]:
            first[inside(name, pose[:3, 3:] + depth * ways)] = depth
        assert np.isnan(first).mean() < 0.02  # rays that graze it between two steps
        is_hit = ~np.isnan(first)
        points = pose[:3, 3:] + first[is_hit] * ways[:, is_hit]
        image = stage.image(LENS, pose, {}, samples=1, noise=0.0, seed=0)[rows, columns][is_hit]
        measured = (image / 255.0) ** 2.2
        wanted = by_place(points).T
        # How bright a place is depends on how it lies; its hue does not.
        share = measured / measured.sum(axis=1, keepdims=True)
        expected = wanted / wanted.sum(axis=1, keepdims=True)
        apart = np.abs(share - expected)
        assert np.median(apart) < 0.03
        assert np.quantile(apart, 0.95) < 0.1


def test_nothing_behind_the_camera_is_seen() -> None:
    pose = camera_at(0.3, 0.0)
    pose[:3, :3] = pose[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
    visuals = painted(SOLIDS["box"], by_place, texel=0.01, carrier=OBJECT)
    assert not Stage(visuals, (0.0, 0.0, 1.0), 1.0).shows(OBJECT, LENS, pose, {}).any()


def test_a_carrier_takes_what_it_carries_along_and_nothing_else() -> None:
    ball = ellipsoid((0.0, 0.0, 0.0), (0.04, 0.04, 0.04))
    visuals = painted(ball, by_place, texel=0.01, carrier=OBJECT)
    still = painted(ball, by_place, texel=0.01, carrier="room")
    stage = Stage([*visuals, *still], (0.0, 0.0, 1.0), 1.0)
    pose, moved = looking((0.5, 0.0, 0.0), (0.0, 0.0, 0.0)).matrix(), np.eye(4)
    moved[:3, 3] = (0.0, 0.1, 0.0)
    poses = {OBJECT: moved}
    there, here = (stage.shows(one, LENS, pose, poses) for one in (OBJECT, "room"))
    # Seen from +x with z up, +y lies to the right.
    assert np.nonzero(there)[1].mean() - np.nonzero(here)[1].mean() == pytest.approx(18.0, abs=0.5)


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
