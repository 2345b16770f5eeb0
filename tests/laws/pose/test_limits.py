"""Whatever numbers a pose and a body are made of, they are refused or can be computed with."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from servoid.errors import BodyError, PoseError
from servoid.pose import Pose
from servoid.shape import Body

UNIT = [1.0, 0.0, 0.0, 0.0]
SIZE = st.integers(-320, 308).map(lambda power: float(f"1e{power}"))
NUMBER = st.tuples(SIZE, st.sampled_from([-1.0, 0.0, 1.0])).map(lambda two: two[0] * two[1])
THREE = st.lists(NUMBER, min_size=3, max_size=3)


def has_numbers(pose: Pose) -> bool:
    parts = (pose.matrix(), pose.log(), pose.adjoint(), *pose.rvec_tvec(), pose.inverse().matrix())
    return all(np.isfinite(part).all() for part in parts)


@given(linear=THREE, angular=THREE)
def test_a_pose_of_any_numbers_is_refused_or_finite(
    linear: list[float], angular: list[float]
) -> None:
    makers = [
        lambda: Pose.exp([*linear, *angular]),
        lambda: Pose.from_rvec_tvec(angular, linear),
        lambda: Pose.from_euler("xyz", angular, linear),
        lambda: Pose.from_euler("xyz", angular, linear, degrees=True),
        lambda: Pose.from_parts(linear, UNIT),
        lambda: Pose(np.block([[np.eye(3), np.array(linear)[:, None]], [np.eye(4)[3]]])),
    ]
    for make in makers:
        try:
            pose = make()
        except PoseError as error:
            is_turned_twice = "two turns" in str(error) and max(map(abs, angular)) > 2.0 * np.pi
            assert is_turned_twice or max(map(abs, linear + angular)) > 9e99, error
        else:
            assert has_numbers(pose)


def test_a_product_of_poses_is_finite_or_refused() -> None:
    pose = Pose.from_parts([1e99, 0.0, 0.0], UNIT)
    with pytest.raises(PoseError, match=r"at most 1e100 metres or radians"):
        for _ in range(4000):
            pose @= pose
            assert has_numbers(pose)


@given(center=THREE, radii=st.lists(SIZE, min_size=3, max_size=3))
def test_a_body_of_any_size_is_refused_or_has_a_mass(
    center: list[float], radii: list[float]
) -> None:
    try:
        body = Body(
            world_from_object=Pose.identity(), centers=[center], radii=[radii], rotations=[UNIT]
        )
    except BodyError as error:
        assert max(map(abs, center + radii)) > 1e50 or min(radii) < 1e-50, error
    else:
        assert all(np.isfinite(part).all() for part in body.mass_properties())
