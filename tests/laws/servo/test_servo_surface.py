import numpy as np
import pytest

from conftest import Drawing
from servoid.pose import Pose
from servoid.servo.surface import Surface
from servoid.shape import Body

PLACE = Pose.from_parts((0.4, -0.2, 0.7), (0.8, 0.0, 0.6, 0.0))
WELL_SEEN = 0.35  # least cosine between a normal and the way to the eye
EYES = ((1.0, 0.1, 0.6), (0.3, -0.7, 1.1), (-0.2, 0.2, 0.3), (0.45, -0.1, 0.1))


def one_ellipsoid(*radii: float) -> Body:
    return Body(
        world_from_object=PLACE,
        centers=np.zeros((1, 3)),
        radii=np.array([radii]),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )


def two_parts() -> Body:
    """Return two ellipsoids that overlap, both turned."""
    drawn = Drawing().body()
    return Body(
        world_from_object=PLACE,
        centers=drawn.centers,
        radii=drawn.radii,
        rotations=drawn.rotations,
    )


def levels(body: Body, points: np.ndarray) -> np.ndarray:
    """Return (n, N): below 1 where a point (N, 3) of the world is inside an ellipsoid."""
    local = body.world_from_object.inverse().transform(points)
    found = []
    for center, radii, turn in zip(body.centers, body.radii, body.rotations, strict=True):
        part_from_object = Pose.from_parts(center.tolist(), turn.tolist()).inverse()
        found.append(np.square(part_from_object.transform(local) / radii).sum(axis=1))
    return np.array(found)


def normals(body: Body, points: np.ndarray) -> np.ndarray:
    """Return the gradient of the level of the nearest ellipsoid, by differences, as unit (N, 3)."""
    step = 1e-5 * np.eye(3)
    nearest = np.abs(levels(body, points) - 1.0).argmin(axis=0)
    place = np.arange(len(points))
    slope = np.stack(
        [
            levels(body, points + along)[nearest, place]
            - levels(body, points - along)[nearest, place]
            for along in step
        ],
        axis=1,
    )
    return slope / np.linalg.norm(slope, axis=1, keepdims=True)


def lowest_on_the_way(body: Body, place: np.ndarray, eye: np.ndarray) -> float:
    """Return the lowest level of any ellipsoid on the way from a place to an eye."""
    shares = np.linspace(0.01, 1.0, 1500)[:, None]
    return float(levels(body, place + shares * (eye - place)).min())


def test_places_lie_on_the_surface_and_none_inside_another_ellipsoid() -> None:
    body = two_parts()
    found = levels(body, Surface(body).places)
    assert np.abs(found.min(axis=0) - 1.0).max() < 1e-9
    assert (np.abs(found - 1.0) < 1e-9).sum(axis=1).min() > 50  # on either ellipsoid


def test_normals_point_out_of_the_ellipsoid_on_which_their_place_lies() -> None:
    body = two_parts()
    surface = Surface(body)
    cosines = (surface.normals * normals(body, surface.places)).sum(axis=1)
    assert cosines.min() > 1.0 - 1e-6


def test_places_on_a_ball_lie_evenly() -> None:
    places = Surface(one_ellipsoid(0.1, 0.1, 0.1)).places - np.array(PLACE.translation)
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    even = 0.1 * np.sqrt(4.0 * np.pi / len(places))  # side of the square that each has
    assert apart.min(axis=1).min() > 0.5 * even
    assert apart.min(axis=1).max() < 1.5 * even
    for way in np.eye(3):
        assert np.mean(places @ way > 0.05) == pytest.approx(0.25, abs=0.02)  # Archimedes


def test_each_place_stands_for_about_the_same_area() -> None:
    radii = np.array([0.12, 0.05, 0.03])
    places = PLACE.inverse().transform(Surface(one_ellipsoid(*radii)).places)
    u, v = np.meshgrid(
        np.linspace(0.0, np.pi, 801), np.linspace(0.0, 2.0 * np.pi, 1601), indexing="ij"
    )
    grid = radii * np.stack([np.cos(u), np.sin(u) * np.cos(v), np.sin(u) * np.sin(v)], axis=-1)
    first, second = grid[1:, :-1] - grid[:-1, :-1], grid[:-1, 1:] - grid[:-1, :-1]
    areas = np.linalg.norm(np.cross(first, second), axis=-1)
    middles = grid[:-1, :-1]
    for axis in range(3):
        for share in (-0.6, 0.0, 0.7):
            true = areas[middles[..., axis] > share * radii[axis]].sum() / areas.sum()
            found = np.mean(places[:, axis] > share * radii[axis])
            assert found == pytest.approx(true, abs=0.05), (axis, share)


@pytest.mark.parametrize("eye", EYES)
def test_an_eye_sees_what_steps_along_the_lines_of_sight_find_free(
    eye: tuple[float, float, float],
) -> None:
    body = two_parts()
    surface, there = Surface(body), np.array(eye)
    ways = there - surface.places
    cosines = (ways * normals(body, surface.places)).sum(axis=1) / np.linalg.norm(ways, axis=1)
    lowest = np.array([lowest_on_the_way(body, place, there) for place in surface.places])
    expected = (cosines > WELL_SEEN) & (lowest > 1.0)
    # Where a line grazes, two methods may differ.
    clear = (np.abs(cosines - WELL_SEEN) > 0.001) & ((np.abs(lowest - 1.0) > 0.01) | ~expected)
    clear &= (cosines < WELL_SEEN) | (np.abs(lowest - 1.0) > 0.01)
    assert clear.mean() > 0.9
    assert (surface.seen_from(there) == expected)[clear].all()


def test_one_part_hides_another() -> None:
    body = two_parts()
    surface = Surface(body)
    facing = []
    for eye in EYES:
        ways = np.array(eye) - surface.places
        cosines = (ways * surface.normals).sum(axis=1) / np.linalg.norm(ways, axis=1)
        facing.append(int((cosines > WELL_SEEN).sum() - surface.seen_from(np.array(eye)).sum()))
    assert max(facing) > 10 and min(facing) >= 0
