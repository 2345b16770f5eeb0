"""The objects of one or two ellipsoids, as in the paper."""

import math

from servoid.pose import exact
from servoid.sim.world.objects.prints import Sheet
from servoid.sim.world.scene.visuals import OBJECT, Ellipsoid, Finish, Visual

# Major axis 90 mm, minor 45 mm; the paper does not state which one is vertical.
_PAPER = (0.0225, 0.045, 0.0225)
_HUE = (0.86, 0.16, 0.11)


def ellipsoid(radii: tuple[float, float, float] = _PAPER) -> tuple[Visual, ...]:
    """Return the paper's ellipsoid of one hue, its long axis upright, or one with other radii."""
    return (Visual(Ellipsoid(radii), Finish(color=_HUE, gloss=0.15), OBJECT),)


def two_ellipsoids() -> tuple[Visual, ...]:
    """Return the paper's second object: a lying ellipsoid on a standing one."""
    half = math.radians(15.0)
    upper = (exact.cos(half), 0.0, 0.0, exact.sin(half), 0.006, -0.034, 0.0)
    lower = (1.0, 0.0, 0.0, 0.0, 0.0, 0.026, 0.0)
    finish = Finish(color=_HUE, gloss=0.15)
    return (
        Visual(Ellipsoid((0.060, 0.032, 0.034)), finish, OBJECT, upper),
        Visual(Ellipsoid((0.026, 0.052, 0.026)), finish, OBJECT, lower),
    )


def painted_ellipsoid() -> tuple[Visual, ...]:
    """Return an egg of 160 mm with stripes, spots and words, so that its rotation is visible."""
    sheet = Sheet((512, 256), (0.95, 0.88, 0.72), seed=3)
    for index in range(12):
        sheet.patch((index / 12, 0.30), (1 / 24, 0.07), (0.12, 0.32, 0.52))
        sheet.spot(((index + 0.5) / 12, 0.74 + 0.03 * (index % 3)), 0.035, (0.80, 0.24, 0.16))
        sheet.spot(((index + 0.2) / 12, 0.22 - 0.04 * (index % 2)), 0.025, (0.16, 0.46, 0.32))
    for index, word in enumerate(("EGG", "servo", "8020", "OVAL", "six", "DOF")):
        sheet.words(word, (index / 6 + 0.01, 0.58), 0.11, (0.14, 0.15, 0.20), width=0.14)
    sheet.lines((0.0, 0.62), (1.0, 0.06), 2, (0.45, 0.25, 0.16))
    sheet.stain(0.12, 0.10)
    # The texture's poles are on the shape's z axis, which is vertical here.
    upright = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0, 0.0, 0.0, 0.0)
    finish = Finish(texture=sheet.finish(), gloss=0.1)
    return (Visual(Ellipsoid((0.050, 0.055, 0.080)), finish, OBJECT, upright),)
