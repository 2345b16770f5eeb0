"""Things before a lens, and what the tests of the ray-caster know of lenses and colours."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from servoid._native import Lens, Lighting, Paint, Stage

Floats = NDArray[np.float64]
SIZE_PX = (160, 120)
FLAT = {"size_px": SIZE_PX, "focal_px": (150.0, 152.0), "center_px": (81.0, 58.5)}
PINHOLE = Lens(model="pinhole", **FLAT)
BENT = Lens(model="brown_conrady", distortion=(-0.25, 0.06, 2e-3, -1e-3), **FLAT)
FISHEYE = Lens(
    model="kannala_brandt",
    distortion=(0.03, 0.01, -0.002, 0.0003),
    size_px=SIZE_PX,
    focal_px=(60.0, 60.0),
    center_px=(79.0, 60.0),
)
LENSES = (PINHOLE, BENT, FISHEYE)
HERE = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
RADII = (0.09, 0.06, 0.04)
WHITE = Paint(color=(1.0, 1.0, 1.0))
# The tests' lens stands at the origin and looks straight up.
BEHIND_LENS = (0.4, -0.4, -0.8)


def posed(turn_deg: tuple[float, float, float], place: tuple[float, float, float]) -> Floats:
    """Return a pose, (7,), from turns about x, y and z."""
    x, y, z, w = Rotation.from_euler("xyz", turn_deg, degrees=True).as_quat()
    return np.array([w, x, y, z, *place])


SKEW = posed((25.0, -40.0, 70.0), (0.02, -0.03, 0.5))


def image_of(stage: Stage, things: object, lens: Lens = PINHOLE, **changes: object) -> Floats:
    """Draw things at one moment, seen from the world's origin."""
    things = np.array([things], dtype=np.float64).reshape(1, stage.count, 7)
    known = {
        "world_from_lens": np.array([HERE]),
        "lighting": Lighting(toward=BEHIND_LENS),
        "samples": 1,
    }
    drawn = stage.render(lens=lens, world_from_thing=things, **{**known, **changes})
    return drawn.astype(np.float64)


def depth_of(
    stage: Stage, things: object, lens: Lens = PINHOLE
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    things = np.array(things, dtype=np.float64).reshape(stage.count, 7)
    return stage.depth(lens=lens, world_from_lens=np.array(HERE), world_from_thing=things)


def rays_of(lens: Lens) -> Floats:
    """Return the directions of all pixels, (H * W, 3), NaN where the lens sees nothing."""
    u, v = np.meshgrid(np.arange(lens.size_px[0]), np.arange(lens.size_px[1]))
    return lens.rays(np.stack([u.ravel(), v.ravel()], axis=1).astype(np.float64))


def linear(levels: Floats) -> Floats:
    share = levels / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def sphere_mesh(rings: int) -> tuple[Floats, NDArray[np.int64]]:
    """Return corners of a ball of radius 1 and triangles between them."""
    down, turn = np.meshgrid(
        np.linspace(0.0, np.pi, rings + 1), np.linspace(0.0, 2.0 * np.pi, 2 * rings, endpoint=False)
    )
    corners = np.stack([np.sin(down) * np.cos(turn), np.sin(down) * np.sin(turn), np.cos(down)], 2)
    index = np.arange(corners[..., 0].size).reshape(2 * rings, rings + 1)
    a, b = index[:, :-1].ravel(), index[:, 1:].ravel()
    beside = np.roll(index, -1, axis=0)
    c, d = beside[:, :-1].ravel(), beside[:, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    return corners.reshape(-1, 3), faces


def cluttered() -> tuple[Stage, Floats]:
    """Return one thing of each kind, and their poses before a lens at the origin."""
    rng = np.random.default_rng(9)
    texture = rng.integers(0, 256, (32, 48, 3), dtype=np.uint8)
    painted = Paint(texture=texture, repeat=(2.0, 1.5), gloss=0.5)
    stage = Stage()
    stage.add_plane((0.8, 0.8), Paint(texture=texture, repeat=(5.0, 5.0)))
    stage.add_ellipsoid(RADII, painted)
    stage.add_capsule(0.03, 0.05, Paint(color=(0.8, 0.2, 0.1), gloss=0.2))
    stage.add_cylinder(0.04, 0.05, painted)
    stage.add_box((0.04, 0.05, 0.03), painted)
    corners, faces = sphere_mesh(12)
    colors = rng.integers(0, 256, (len(corners), 3), dtype=np.uint8)
    stage.add_mesh(corners * 0.05, faces, WHITE, colors=colors)
    poses = [
        posed((60.0, 10.0, 0.0), (0.0, 0.0, 0.9)),
        posed((10.0, 40.0, 0.0), (-0.12, -0.1, 0.55)),
        posed((70.0, 0.0, 20.0), (0.1, -0.1, 0.5)),
        posed((50.0, 30.0, 0.0), (0.12, 0.08, 0.5)),
        posed((20.0, 30.0, 40.0), (-0.1, 0.08, 0.5)),
        posed((0.0, 0.0, 0.0), (0.0, 0.0, 0.45)),
    ]
    return stage, np.array(poses)


def grey_wall() -> tuple[Stage, Floats]:
    stage = Stage()
    stage.add_plane((9.0, 9.0), Paint(color=(0.5, 0.5, 0.5)))
    return stage, np.array([[*HERE[:4], 0.0, 0.0, 1.0]])
