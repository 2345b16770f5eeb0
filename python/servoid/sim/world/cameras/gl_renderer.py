"""Renders a world with MuJoCo's OpenGL renderer, for comparison, if OpenGL is installed.

Only this file converts OpenGL's camera frame, y up and z back, to ours, y down and z forward.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens
from servoid.errors import SimError
from servoid.pose import Floats, exact
from servoid.sim.world.cameras.gl_context import make_context
from servoid.sim.world.cameras.gl_model import build_model
from servoid.sim.world.cameras.renderer import Depth, Image, Shot
from servoid.sim.world.events.motions import rotate
from servoid.sim.world.scene.engine import load_mujoco
from servoid.sim.world.scene.visuals import Visual

_NEAR, _FAR = 0.01, 50.0  # m
_KEY, _AMBIENT = 0.62, 0.48  # of the lamp and of ambient light, at level 1
_MAX_SIDE_PX = 8192


class OpenGl:
    """Renders with MuJoCo's OpenGL renderer; textures and light differ slightly from ours."""

    def __init__(self, visuals: Sequence[Visual]) -> None:
        """Load the visuals into the renderer.

        Raises:
            MissingExtraError: MuJoCo is not installed.
            SimError: OpenGL cannot start, or PyOpenGL is not installed.

        """
        self._mujoco = load_mujoco()
        self._context = make_context()
        self._model = build_model(visuals)
        self._data = self._mujoco.MjData(self._model)
        self._scene = self._mujoco.MjvScene(self._model, len(visuals) + 10)
        self._context.make_current()
        self._graphics = self._mujoco.MjrContext(self._model, _number("mjFONTSCALE_100"))
        self._mujoco.mjr_setBuffer(_number("mjFB_OFFSCREEN"), self._graphics)
        self._graphics.readDepthMap = _number("mjDEPTH_ZEROFAR")
        self._size_px = (0, 0)

    def image(self, shot: Shot) -> Image:
        """Return an image (H, W, 3) uint8 RGB."""
        import cv2

        width, height = shot.lens.size_px
        size_px = (width * shot.samples, height * shot.samples)
        total = np.zeros((height, width, 3))
        for lens_row, visual_rows in zip(
            shot.world_from_lens, shot.world_from_visuals, strict=True
        ):
            self._arrange(shot.lens, lens_row, visual_rows)
            self._light(shot)
            pixels = np.empty((size_px[1], size_px[0], 3), np.uint8)
            self._render(size_px, pixels, None, numbered=False)
            total += cv2.resize(pixels, (width, height), interpolation=cv2.INTER_AREA)
        total /= len(shot.world_from_lens)
        random = np.random.default_rng(shot.seed)
        noisy = total + shot.noise * random.standard_normal(total.shape)
        return np.clip(np.rint(noisy), 0.0, 255.0).astype(np.uint8)

    def depth(self, lens: Lens, world_from_lens: Floats, world_from_visuals: Floats) -> Depth:
        """Return depths (H, W) in metres, NaN without, and visuals' numbers, -1 without."""
        width, height = lens.size_px
        self._arrange(lens, world_from_lens, world_from_visuals)
        colors = np.empty((height, width, 3), np.uint8)
        shares = np.empty((height, width), np.float32)
        self._render(lens.size_px, colors, shares, numbered=True)
        ids = (colors * np.array([1, 1 << 8, 1 << 16], np.int32)).sum(axis=-1, dtype=np.int32) - 1
        # Depth-buffer values are 1 at the near plane and 0 at the far one, linear in 1 / depth.
        nearness = shares.astype(np.float64) * (1.0 / _NEAR - 1.0 / _FAR) + 1.0 / _FAR
        depths = np.where(ids >= 0, 1.0 / nearness, np.nan).astype(np.float32)
        return depths, self._visuals(ids)

    def _visuals(self, ids: NDArray[np.int32]) -> NDArray[np.int32]:
        """Convert OpenGL's segmentation numbers to numbers of visuals."""
        known = np.full(self._scene.ngeom + 1, -1, np.int32)
        for geom in self._scene.geoms[: self._scene.ngeom]:
            if geom.segid >= 0:
                known[geom.segid] = geom.objid
        return known[ids]

    def _arrange(self, lens: Lens, lens_row: Floats, visual_rows: Floats) -> None:
        """Set the poses of visuals and camera."""
        if any(lens.distortion):
            raise SimError(
                "MuJoCo's renderer draws pinhole cameras only; leave cameras.distortion empty, or "
                "choose the renderer raycast"
            )
        self._data.mocap_quat[:] = visual_rows[:, :4]
        self._data.mocap_pos[:] = visual_rows[:, 4:]
        self._mujoco.mj_kinematics(self._model, self._data)
        self._mujoco.mj_camlight(self._model, self._data)
        self._mujoco.mjv_updateScene(
            self._model,
            self._data,
            self._mujoco.MjvOption(),
            None,
            self._mujoco.MjvCamera(),
            _number("mjCAT_ALL"),
            self._scene,
        )
        for camera in self._scene.camera:
            _aim(camera, lens, lens_row)

    def _light(self, shot: Shot) -> None:
        lamp = self._scene.lights[0]
        toward = np.asarray(shot.toward, dtype=np.float64)
        away = -toward / exact.norm(toward)
        lamp.dir[:] = away
        lamp.diffuse[:] = min(_KEY * shot.level, 1.0)
        lamp.ambient[:] = min(_AMBIENT * shot.level, 1.0)

    def _render(
        self,
        size_px: tuple[int, int],
        colors: NDArray[np.uint8],
        depths: NDArray[np.float32] | None,
        numbered: bool,
    ) -> None:
        """Render into arrays, top row first; `numbered`: visuals' numbers instead of colours."""
        self._context.make_current()
        if max(size_px) > _MAX_SIDE_PX:
            raise SimError(
                f"OpenGL would draw {size_px[0]}x{size_px[1]} pixels, samples included, but a "
                f"side has at most {_MAX_SIDE_PX}; lower cameras.size_px or cameras.samples"
            )
        if size_px != self._size_px:
            self._mujoco.mjr_resizeOffscreen(*size_px, self._graphics)
            self._size_px = size_px
        for flag in ("mjRND_SEGMENT", "mjRND_IDCOLOR"):
            self._scene.flags[_number(flag)] = numbered
        area = self._mujoco.MjrRect(0, 0, *size_px)
        self._mujoco.mjr_render(area, self._scene, self._graphics)
        self._mujoco.mjr_readPixels(colors, depths, area, self._graphics)
        colors[:] = colors[::-1].copy()
        if depths is not None:
            depths[:] = depths[::-1].copy()


def _aim(camera: Any, lens: Lens, world_from_lens: Floats) -> None:
    """Set a `mujoco.MjvGLCamera` to the view of a lens."""
    (width, height), (x, y), (fx, fy) = lens.size_px, lens.center_px, lens.focal_px
    camera.pos[:] = world_from_lens[4:]
    camera.forward[:] = rotate(world_from_lens[:4], np.array([0.0, 0.0, 1.0]))
    camera.up[:] = rotate(world_from_lens[:4], np.array([0.0, -1.0, 0.0]))
    camera.frustum_near, camera.frustum_far = _NEAR, _FAR
    camera.frustum_top = _NEAR * (y + 0.5) / fy
    camera.frustum_bottom = -_NEAR * (height - 0.5 - y) / fy
    camera.frustum_width = 0.5 * _NEAR * width / fx
    camera.frustum_center = _NEAR * (0.5 * (width - 1) - x) / fx


def _number(name: str) -> int:
    """Return the number of a name such as mjFB_OFFSCREEN."""
    mujoco = load_mujoco()
    kinds = {
        "mjFONT": mujoco.mjtFontScale,
        "mjFB": mujoco.mjtFramebuffer,
        "mjDEPTH": mujoco.mjtDepthMap,
        "mjCAT": mujoco.mjtCatBit,
        "mjRND": mujoco.mjtRndFlag,
    }
    kind = next(kind for start, kind in kinds.items() if name.startswith(start))
    return int(getattr(kind, name).value)
