"""A cordless drill: a housing with a print, a chuck, a grip and a battery."""

import numpy as np

from servoid.pose import exact
from servoid.sim.world.objects.loft import Section, loft, top_first
from servoid.sim.world.objects.prints import Sheet, grain
from servoid.sim.world.objects.vessels import upright
from servoid.sim.world.scene.visuals import OBJECT, Finish, MeshShape, Texture, Visual

_YELLOW, _BLACK, _STEEL = (0.95, 0.72, 0.12), (0.11, 0.12, 0.13), (0.55, 0.56, 0.58)
_RED, _WHITE = (0.78, 0.14, 0.12), (0.95, 0.95, 0.93)
_ALONG_X = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
_TOP = 0.058  # height of the housing's axis over the object's centre


def drill() -> tuple[Visual, ...]:
    """Return a drill of 195 mm that points along the object's x."""
    parts: list[tuple[MeshShape, Finish]] = [
        (_housing(), Finish(texture=_housing_print(), gloss=0.25)),
        (_chuck(), Finish(color=_BLACK, gloss=0.4)),
        (_bit(), Finish(color=_STEEL, gloss=0.6)),
        (_grip(), Finish(texture=_grip_rubber(), gloss=0.1)),
        (_battery(), Finish(texture=_battery_print(), gloss=0.2)),
    ]
    return tuple(Visual(upright(mesh), finish, OBJECT) for mesh, finish in parts)


def _along_x(profile: list[tuple[float, float]], corner: float = 2.0) -> MeshShape:
    """Revolve a profile of (radius, position) about the drill's axis."""
    sections = [Section((x, 0.0, _TOP), (radius, radius), corner) for radius, x in profile]
    return loft(sections, axes=_ALONG_X, around=56)


def _housing() -> MeshShape:
    return _along_x(
        [(0.018, -0.088), (0.025, -0.084), (0.030, -0.074), (0.032, -0.055), (0.032, 0.015),
         (0.029, 0.034), (0.024, 0.044), (0.022, 0.046)],
        corner=2.6,
    )  # fmt: skip


def _chuck() -> MeshShape:
    return _along_x(
        [(0.020, 0.044), (0.0205, 0.050), (0.0205, 0.068), (0.017, 0.080), (0.010, 0.088)]
    )


def _bit() -> MeshShape:
    return _along_x([(0.0042, 0.086), (0.0042, 0.106), (0.0015, 0.110)])


def _grip() -> MeshShape:
    heights = np.linspace(_TOP - 0.018, -0.055, 9)
    sections = []
    for height in heights:
        share = (_TOP - 0.018 - height) / (_TOP + 0.037)
        x = -0.032 - 0.020 * share
        wide = 0.021 - 0.004 * exact.sin(np.pi * share)
        sections.append(Section((x, 0.0, float(height)), (float(wide) + 0.003, 0.0165), 2.6))
    return top_first(loft(sections[::-1], around=48))


def _battery() -> MeshShape:
    center = -0.042
    sizes = [(-0.092, 0.90), (-0.090, 1.0), (-0.060, 1.0), (-0.054, 0.86), (-0.050, 0.62)]
    sections = [
        Section((center, 0.0, height), (0.046 * share, 0.031 * share), 5.0)
        for height, share in sizes
    ]
    return top_first(loft(sections, around=64))


def _housing_print() -> Texture:
    """Return the housing's texture: v along the axis, u around from one side over the top."""
    sheet = Sheet((400, 240), _YELLOW, seed=31)
    sheet.patch((0.0, 0.0), (0.17, 1.0), _BLACK)
    sheet.patch((0.80, 0.0), (0.2, 1.0), _BLACK)
    for slot in range(6):
        sheet.patch((0.20 + 0.016 * slot, 0.30), (0.008, 0.26), _BLACK)
        sheet.patch((0.70, 0.22 + 0.06 * slot), (0.06, 0.03), _BLACK)
    sheet.words("18V", (0.33, 0.45), 0.15, _RED, width=0.22)
    sheet.words("SV-8", (0.33, 0.64), 0.12, _BLACK, width=0.2)
    sheet.lines((0.33, 0.68), (0.2, 0.1), 3, _BLACK)
    sheet.spot((0.62, 0.32), 0.07, _RED)
    sheet.spot((0.62, 0.52), 0.05, _WHITE)
    sheet.patch((0.56, 0.62), (0.1, 0.2), _WHITE)
    sheet.lines((0.57, 0.64), (0.08, 0.16), 5, _BLACK)
    sheet.spot((0.45, 0.15), 0.05, _BLACK)
    sheet.stain(0.15, 0.08)
    near = sheet.finish()
    around = np.concatenate([near, near[::-1, ::-1]])  # mirrored on the far side
    around = np.roll(around, near.shape[0] // 2, axis=0)
    return np.ascontiguousarray(around.transpose(1, 0, 2))


def _grip_rubber() -> Texture:
    rubber = grain((256, 320), (0.20, 0.21, 0.23), 0.25, 1.0, seed=32)
    rubber[:, ::16] //= 2
    rubber[40::32] = (150, 110, 30)
    return rubber


def _battery_print() -> Texture:
    """Return the battery's texture; its front is at three quarters of u."""
    sheet = Sheet((640, 400), _BLACK, seed=33)
    for middle in (0.25, 0.75):
        sheet.patch((middle - 0.13, 0.42), (0.13, 0.20), _RED)
        sheet.words("Li-ion", (middle - 0.125, 0.52), 0.06, _WHITE, width=0.11)
        sheet.lines((middle - 0.12, 0.55), (0.11, 0.05), 2, _WHITE)
        sheet.patch((middle + 0.01, 0.42), (0.12, 0.20), _WHITE)
        sheet.bar_code((middle + 0.015, 0.43), (0.11, 0.10))
        sheet.lines((middle + 0.015, 0.55), (0.11, 0.06), 2, _BLACK)
    for side in (0.0, 0.5, 1.0):
        sheet.patch((side - 0.05, 0.45), (0.1, 0.05), _YELLOW)
        sheet.spot((side, 0.58), 0.04, _RED)
    sheet.stain(0.1, 0.1)
    return sheet.finish()
