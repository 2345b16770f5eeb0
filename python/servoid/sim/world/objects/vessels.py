"""A bottle and a mug, as surfaces of revolution, with labels or in one colour."""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from servoid.pose import exact
from servoid.sim.world.events.motions import rotate
from servoid.sim.world.objects.loft import lathe, tube
from servoid.sim.world.objects.prints import Sheet
from servoid.sim.world.scene.visuals import OBJECT, Finish, MeshShape, Texture, Visual

_TEAL, _CREAM, _CORAL = (0.07, 0.40, 0.44), (0.96, 0.92, 0.82), (0.88, 0.32, 0.22)
_INK, _OCHRE, _NAVY = (0.10, 0.12, 0.16), (0.92, 0.68, 0.18), (0.13, 0.20, 0.40)
# The surface's z, up, is opposite to the object's y, which points down.
_UPRIGHT = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)

_BOTTLE = (
    (0.030, -0.110), (0.0345, -0.107), (0.0365, -0.101), (0.0365, -0.060),
    (0.0350, -0.052), (0.0350, 0.020), (0.0365, 0.028), (0.0365, 0.038), (0.0345, 0.052),
    (0.0280, 0.067), (0.0190, 0.079), (0.0145, 0.086), (0.0145, 0.092),
)  # fmt: skip
_CAP = (
    (0.0165, 0.086), (0.0170, 0.088), (0.0170, 0.108), (0.0155, 0.110),
)  # fmt: skip
_MUG = (
    (0.034, -0.054), (0.0385, -0.050), (0.0400, -0.040), (0.0415, 0.050),
    (0.0405, 0.054), (0.0385, 0.054), (0.0375, 0.050), (0.0360, -0.042), (0.0330, -0.049),
)  # fmt: skip


def bottle() -> tuple[Visual, ...]:
    """Return a bottle of 220 mm with a printed label."""
    return _bottle(Finish(texture=_bottle_label(), gloss=0.35), Finish(color=_CORAL, gloss=0.3))


def plain_bottle() -> tuple[Visual, ...]:
    """Return the bottle without a label, in one colour."""
    finish = Finish(color=_TEAL, gloss=0.25)
    return _bottle(finish, finish)


def mug() -> tuple[Visual, ...]:
    """Return a mug of 108 mm with a handle and a print around it."""
    return _mug(Finish(texture=_mug_print(), gloss=0.35), Finish(color=_CORAL, gloss=0.35))


def plain_mug() -> tuple[Visual, ...]:
    """Return the mug without a print, in one colour."""
    finish = Finish(color=_OCHRE, gloss=0.25)
    return _mug(finish, finish)


def upright(mesh: MeshShape) -> MeshShape:
    """Convert a mesh with z up to one with y down."""
    return replace(mesh, vertices=rotate(np.array(_UPRIGHT), mesh.vertices))


def _bottle(glass: Finish, cap: Finish) -> tuple[Visual, ...]:
    return (
        Visual(upright(lathe(_BOTTLE)), glass, OBJECT),
        Visual(upright(lathe(_CAP, around=40)), cap, OBJECT),
    )


def _mug(clay: Finish, handle: Finish) -> tuple[Visual, ...]:
    angles = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 25)
    out, up = 0.0392 + 0.030 * exact.cos(angles), 0.030 * exact.sin(angles)
    bow = np.stack([out, np.zeros(25), up], axis=1)
    return (
        Visual(upright(lathe(_MUG)), clay, OBJECT),
        Visual(upright(tube(bow, 0.0062)), handle, OBJECT),
    )


@cache
def _bottle_label() -> Texture:
    """Return the bottle's texture, from the neck at the top to the middle of its bottom."""
    sheet = Sheet((720, 800), _TEAL, seed=21)
    sheet.patch((0.0, 0.362), (1.0, 0.282), _CREAM)  # where the wall is straight
    sheet.patch((0.0, 0.362), (1.0, 0.018), _CORAL)
    sheet.patch((0.0, 0.622), (1.0, 0.022), _CORAL)
    front = ("ORCHARD", "apple juice", "0.5 l", _NAVY, _CORAL)
    back = ("PRESSED", "from six trees", "enjoy cold", _CORAL, _OCHRE)
    for start, (name, kind, more, ink, fruit) in ((0.09, back), (0.59, front)):
        sheet.words(name, (start, 0.445), 0.040, ink, width=0.25)
        sheet.words(kind, (start + 0.01, 0.492), 0.026, _CORAL, width=0.25)
        sheet.words(more, (start, 0.605), 0.032, _INK, width=0.15)
        sheet.lines((start, 0.51), (0.14, 0.05), 4, _INK)
        sheet.spot((start + 0.20, 0.560), 0.028, fruit)
        sheet.spot((start + 0.26, 0.572), 0.022, _OCHRE)
        sheet.patch((start + 0.195, 0.515), (0.008, 0.022), (0.16, 0.36, 0.16))
    sheet.bar_code((0.45, 0.40), (0.10, 0.09))
    sheet.lines((0.45, 0.515), (0.11, 0.09), 6, _INK)
    sheet.lines((0.93, 0.40), (0.06, 0.20), 12, _INK)
    for index in range(16):  # around the shoulder, and on the foot
        sheet.spot(((index + 0.5) / 16, 0.235), 0.011, _OCHRE if index % 3 else _CREAM)
        low = 0.70 + 0.02 * (index % 4)
        sheet.patch((index / 16, low), (0.035, 0.03), (0.35, 0.68, 0.66))
    sheet.stain(0.05, 0.07)
    return sheet.finish()


@cache
def _mug_print() -> Texture:
    """Return the mug's texture, from the middle of its inside over the rim to its bottom."""
    sheet = Sheet((760, 800), (0.95, 0.94, 0.90), seed=22)
    sheet.patch((0.0, 0.508), (1.0, 0.018), _NAVY)
    sheet.patch((0.0, 0.785), (1.0, 0.035), _NAVY)
    for index, word in enumerate(("LOOK", "model", "TRACK", "servo")):
        start = 0.25 * index + 0.02
        sheet.words(word, (start, 0.605), 0.055, _CORAL if index % 2 else _NAVY, width=0.2)
        sheet.lines((start, 0.622), (0.2, 0.035), 2, _INK)
        sheet.spot((start + 0.04, 0.715), 0.032, _OCHRE)
        sheet.patch((start + 0.085, 0.685), (0.05, 0.06), (0.16, 0.46, 0.32))
        corners = np.array([[0.15, 0.75], [0.18, 0.68], [0.21, 0.75]])
        sheet.shape(corners + np.array([start, 0.0]), _CORAL)
    sheet.stain(0.06, 0.06)
    return sheet.finish()
