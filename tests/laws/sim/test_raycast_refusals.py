"""What the ray-caster refuses, and in which words."""

import numpy as np
import pytest
from numpy.typing import NDArray
from ray_scenes import HERE, PINHOLE, RADII, WHITE

from servoid._native import Lighting, Paint, Scene
from servoid.errors import PoseError, ServoidError, SimError
from servoid.pose.exact import Floats


def one_visual() -> Scene:
    scene = Scene()
    scene.add_ellipsoid(RADII, WHITE)
    return scene


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf"), 1e9])
def test_a_size_that_is_no_length_is_refused(bad: float) -> None:
    scene = Scene()
    for call in (
        lambda: scene.add_ellipsoid((0.1, bad, 0.1), WHITE),
        lambda: scene.add_capsule(bad, 0.1, WHITE),
        lambda: scene.add_cylinder(0.1, bad, WHITE),
        lambda: scene.add_box((0.1, 0.1, bad), WHITE),
        lambda: scene.add_plane((bad, 0.1), WHITE),
    ):
        with pytest.raises(SimError, match="must be a number of metres from"):
            call()
    assert scene.count == 0


CORNERS = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]])
FACE = np.array([[0, 1, 2]])


@pytest.mark.parametrize(
    ("vertices", "faces", "more", "words"),
    [
        (CORNERS, np.array([[0, 1, 3]]), {}, "names the vertices 0, 1, 3, but there are 3"),
        (CORNERS, np.array([[0, 1, -1]]), {}, "a negative one"),
        (CORNERS, np.zeros((0, 3), np.int64), {}, "0 were given"),
        (CORNERS * np.nan, FACE, {}, "vertex 0"),
        (CORNERS[:, :2], FACE, {}, r"vertices must have shape \(N, 3\)"),
        (CORNERS, FACE[0], {}, r"faces must have shape \(N, 3\)"),
        (CORNERS, FACE, {"colors": np.zeros((2, 3), np.uint8)}, "colors has 2 rows"),
        (CORNERS, FACE, {"texture_coordinates": np.zeros((4, 2))}, "has 4 rows"),
        (CORNERS, FACE, {"texture_coordinates": np.full((3, 2), np.nan)}, "has NaN"),
    ],
)
def test_a_mesh_that_cannot_be_is_refused(
    vertices: Floats, faces: NDArray[np.int64], more: dict[str, NDArray[np.uint8]], words: str
) -> None:
    with pytest.raises(ServoidError, match=words):
        Scene().add_mesh(vertices, faces, WHITE, **more)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"color": (0.5, 0.5, 1.5)}, "color is"),
        ({"color": (0.5, float("nan"), 0.5)}, "color is"),
        ({"gloss": -0.1}, "gloss is -0.1"),
        ({"repeat": (0.0, 1.0)}, "repeat is 0"),
        ({"texture": np.zeros((4, 4), np.uint8)}, r"texture must have shape \(H, W, 3\)"),
        ({"texture": np.zeros((4, 4, 4), np.uint8)}, r"texture must have shape \(H, W, 3\)"),
        ({"texture": np.zeros((0, 4, 3), np.uint8)}, "from 1 to"),
    ],
)
def test_a_paint_that_cannot_be_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(SimError, match=words):
        Paint(**changes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"toward": (0.0, 0.0, 0.0)}, "toward is"),
        ({"toward": (float("nan"), 0.0, 1.0)}, "toward is"),
        ({"key": (-0.1, 0.0, 0.0)}, "key is"),
        ({"sky": (0.1, float("inf"), 0.0)}, "sky is"),
        ({"exposure": -1.0}, "exposure is -1"),
    ],
)
def test_a_light_that_cannot_be_is_refused(changes: dict[str, object], words: str) -> None:
    with pytest.raises(SimError, match=words):
        Lighting(**changes)


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"samples": 0}, SimError, "samples is 0"),
        ({"samples": 9}, SimError, "samples is 9"),
        ({"samples": -2}, SimError, "samples is 0"),
        ({"noise": -1.0}, SimError, "noise is -1"),
        ({"noise": float("nan")}, SimError, "noise is NaN"),
        ({"world_from_lens": np.array(HERE)}, SimError, r"must have shape \(N, 7\)"),
        ({"world_from_lens": np.tile(HERE, (2, 1))}, SimError, "2 poses and the visuals have 1"),
        ({"world_from_lens": np.full((1, 7), np.nan)}, PoseError, "NaN"),
        ({"world_from_visual": np.array([HERE])}, SimError, r"shape \(M, T, 7\)"),
        (
            {"world_from_visual": np.array([[HERE, HERE]])},
            SimError,
            "2 poses of visuals, but th",
        ),
        ({"world_from_visual": np.full((1, 1, 7), np.nan)}, PoseError, "NaN"),
        ({"world_from_visual": np.zeros((1, 1, 7))}, PoseError, "length 1"),
        (
            {"world_from_visual": np.array([[[*HERE[:4], 0, 0, 1e6]]])},
            SimError,
            "visual 0 is 1000000 m",
        ),
    ],
)
def test_an_image_that_cannot_be_is_refused(
    changes: dict[str, object], error: type[Exception], words: str
) -> None:
    known = {
        "lens": PINHOLE,
        "world_from_lens": np.array([HERE]),
        "world_from_visual": np.array([[HERE]]),
        "lighting": Lighting(),
    }
    with pytest.raises(error, match=words):
        one_visual().render(**{**known, **changes})


def test_more_moments_than_rays_are_refused() -> None:
    with pytest.raises(SimError, match="5 moments were given, but a pixel has only 4 rays"):
        one_visual().render(
            lens=PINHOLE,
            world_from_lens=np.tile(HERE, (5, 1)),
            world_from_visual=np.tile(HERE, (5, 1, 1)),
            lighting=Lighting(),
            samples=2,
        )


def test_depth_refuses_poses_of_the_wrong_shape() -> None:
    with pytest.raises(SimError, match=r"world_from_lens must have shape \(7,\)"):
        one_visual().depth(
            lens=PINHOLE, world_from_lens=np.array([HERE]), world_from_visual=np.array([HERE])
        )
    with pytest.raises(SimError, match="0 poses of visuals"):
        one_visual().depth(
            lens=PINHOLE, world_from_lens=np.array(HERE), world_from_visual=np.zeros((0, 7))
        )
