import os

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="simulated worlds need mujoco")

from servoid._native import Lens
from servoid.errors import SimError
from servoid.pose import looking
from servoid.sim.world import CameraSettings, ObjectSettings, World, WorldSettings
from servoid.sim.world.cameras.gl_context import make_context
from servoid.sim.world.cameras.gl_renderer import OpenGl
from servoid.sim.world.cameras.renderer import Raycaster, Shot
from servoid.sim.world.events.motions import row_of
from servoid.sim.world.scene.visuals import Box, Capsule, Cylinder, Ellipsoid, Finish, Plane, Visual

pytestmark = pytest.mark.extended

REST = np.zeros(10)


@pytest.fixture(scope="module")
def open_gl() -> None:
    try:
        make_context()
    except SimError as error:
        pytest.skip(str(error))


def seen(renderer: str, name: str, background: str) -> tuple[World, tuple[np.ndarray, ...]]:
    cameras = CameraSettings(size_px=(240, 180), samples=2, moments=1, noise=0.0)
    world = World(
        WorldSettings(
            ideal=True,
            object=ObjectSettings(name=name),
            background=background,
            cameras=cameras,
            renderer=renderer,
        )
    )
    for _ in range(12):
        world.arm.command(REST)
    instant = world.source.newest()
    assert instant is not None
    return world, tuple(image.astype(float) for image in instant.images if image is not None)


@pytest.mark.usefixtures("open_gl")
@pytest.mark.parametrize(("name", "background"), [("ellipsoid", "plain"), ("drill", "cluttered")])
def test_both_renderers_show_the_same_world(name: str, background: str) -> None:
    ours, images = seen("raycast", name, background)
    theirs, others = seen("mujoco", name, background)
    for mask, other in zip(ours.masks(), theirs.masks(), strict=True):
        assert (mask > 0).sum() > 200
        assert (mask != other).sum() <= 0.02 * (mask > 0).sum()
    for image, other in zip(images, others, strict=True):
        assert np.corrcoef(image.ravel(), other.ravel())[0, 1] > 0.85


@pytest.mark.usefixtures("open_gl")
def test_both_renderers_agree_on_depths_and_on_what_is_seen() -> None:
    red = Finish(color=(0.8, 0.2, 0.2))
    visuals = [
        Visual(Plane((2.0, 2.0)), red),
        Visual(Ellipsoid((0.1, 0.2, 0.15)), red, carrier_from_visual=(1, 0, 0, 0, 0, 0, 0.3)),
        Visual(Capsule(0.05, 0.1), red, carrier_from_visual=(1, 0, 0, 0, 0.3, 0.1, 0.3)),
        Visual(Cylinder(0.05, 0.1), red, carrier_from_visual=(0.6, 0.8, 0, 0, -0.3, 0, 0.3)),
        Visual(Box((0.05, 0.1, 0.15)), red, carrier_from_visual=(0.6, 0, 0.8, 0, 0, -0.4, 0.3)),
    ]
    rows = np.array([visual.carrier_from_visual for visual in visuals], float)
    # An axis off the middle and unlike focal lengths: the frustum is as crooked as the lens.
    lens = Lens(
        model="pinhole", size_px=(200, 150), focal_px=(220.0, 200.0), center_px=(90.0, 84.0)
    )
    pose = row_of(looking((0.5, -1.2, 1.1), (0.0, 0.0, 0.2)))
    depth, ids = Raycaster(visuals).depth(lens, pose, rows)
    other_depth, other_ids = OpenGl(visuals).depth(lens, pose, rows)
    assert set(np.unique(ids)) >= set(range(5))
    same = ids == other_ids
    assert (~same).mean() < 0.01
    both = same & (ids >= 0)
    assert np.quantile(np.abs(depth - other_depth)[both], 0.98) < 2e-3
    assert np.median(np.abs(depth - other_depth)[both]) < 2e-4
    assert np.array_equal(np.isnan(other_depth), other_ids < 0)


@pytest.mark.usefixtures("open_gl")
def test_a_bent_lens_is_refused_by_open_gl() -> None:
    lens = Lens(
        model="brown_conrady",
        size_px=(64, 48),
        focal_px=(60.0, 60.0),
        center_px=(31.5, 23.5),
        distortion=(-0.1, 0.0, 0.0, 0.0),
    )
    pose = row_of(looking((0.5, -1.2, 1.1), (0.0, 0.0, 0.2)))
    rows = np.array([[1.0, 0, 0, 0, 0, 0, 0]])
    stage = OpenGl([Visual(Box((0.1, 0.1, 0.1)), Finish())])
    shot = Shot(lens, pose[None], rows[None], (0.0, 0.0, 1.0), 1.0, samples=1)
    with pytest.raises(SimError, match="pinhole cameras only"):
        stage.image(shot)


def test_an_open_gl_that_cannot_start_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib

    before = importlib.import_module

    def without(name: str, package: str | None = None) -> object:
        if name in ("mujoco.egl", "mujoco.osmesa"):
            raise ImportError("no such library")
        return before(name, package)

    monkeypatch.setattr(importlib, "import_module", without)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    kept = os.environ.get("PYOPENGL_PLATFORM")
    with pytest.raises(SimError) as caught:
        make_context()
    assert os.environ.get("PYOPENGL_PLATFORM") == kept
    for words in ("egl: no such library", "osmesa: no such", "pip install", "libosmesa6"):
        assert words in str(caught.value)
