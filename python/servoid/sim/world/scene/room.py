"""The room around the arm: plain grey, or with posters, a bench and other things.

The world's z points up; the arm is at the origin and looks along -x.
"""

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from servoid.errors import SimError
from servoid.pose import Floats, exact
from servoid.sim.world.objects.prints import Sheet, grain
from servoid.sim.world.scene.visuals import (
    Box,
    Capsule,
    Color,
    Cylinder,
    Ellipsoid,
    Finish,
    Plane,
    Texture,
    Visual,
)
from servoid.words import alternatives

_BACK, _FRONT, _SIDE, _HEIGHT = -2.7, 3.4, 2.3, 2.4  # positions of walls and ceiling, in m
_BENCH = 0.24  # height of the bench's top under the object
_PALETTE: tuple[Color, ...] = (
    (0.75, 0.24, 0.18),
    (0.10, 0.42, 0.47),
    (0.93, 0.89, 0.78),
    (0.86, 0.62, 0.20),
    (0.20, 0.28, 0.46),
    (0.28, 0.47, 0.28),
    (0.52, 0.38, 0.30),
    (0.86, 0.86, 0.84),
)
_WORDS = (
    "PARTS",
    "lab 3",
    "FRAGILE",
    "servo",
    "EYES",
    "No. 58",
    "ORANGE",
    "spare",
    "TOOLS",
    "open",
)
_PACKAGES = 6  # number of prints that the things share
_KEPT = 4  # rooms that are kept for other worlds, of 6 MB each


def make_room(background: str, seed: int) -> tuple[Visual, ...]:
    """Return the room; another seed gives other things.

    Raises:
        SimError: there is no such background.

    """
    if background not in BACKGROUNDS:
        raise SimError(f"unknown background '{background}'{alternatives(background, BACKGROUNDS)}")
    return BACKGROUNDS[background](seed)


def _plain(seed: int) -> tuple[Visual, ...]:
    del seed  # without randomness
    wall = Finish(color=(0.62, 0.63, 0.65))
    return _walls(Finish(color=(0.50, 0.50, 0.51)), wall)


@lru_cache(maxsize=_KEPT)
def _cluttered(seed: int) -> tuple[Visual, ...]:
    random = np.random.default_rng([seed, 7])
    floor = Finish(texture=_planks(), repeat=(5.0, 5.0), gloss=0.08)
    paper = Finish(texture=_wallpaper(), repeat=(9.0, 4.0))
    prints = [_package(seed * _PACKAGES + index) for index in range(_PACKAGES)]
    wood = Finish(texture=grain((512, 256), (0.66, 0.50, 0.34), 0.22, 6.0, seed=41), gloss=0.1)
    return (
        *_walls(floor, paper),
        *_posters(random),
        *_furniture(wood),
        *_bench_and_shelf(random, prints),
        *_about(random, prints),
    )


BACKGROUNDS: dict[str, Callable[[int], tuple[Visual, ...]]] = {
    "cluttered": _cluttered,
    "plain": _plain,
}


def _walls(floor: Finish, wall: Finish) -> tuple[Visual, ...]:
    middle, half = 0.5 * (_BACK + _FRONT), 0.5 * (_FRONT - _BACK)
    up = 0.5 * _HEIGHT
    side = Plane((half, up))
    end = Plane((_SIDE, up))
    return (
        Visual(Plane((half, _SIDE)), floor, carrier_from_visual=_placed((middle, 0.0, 0.0))),
        Visual(end, wall, carrier_from_visual=_facing((_BACK, 0.0, up), 0.0)),
        Visual(end, wall, carrier_from_visual=_facing((_FRONT, 0.0, up), 180.0)),
        Visual(side, wall, carrier_from_visual=_facing((middle, -_SIDE, up), 90.0)),
        Visual(side, wall, carrier_from_visual=_facing((middle, _SIDE, up), -90.0)),
    )


def _posters(random: np.random.Generator) -> list[Visual]:
    """Add posters on the wall that the arm looks at, and beside it."""
    visuals = []
    for index in range(9):
        half = (random.uniform(0.20, 0.27), random.uniform(0.22, 0.32))
        y = -1.9 + 0.47 * index + random.uniform(-0.04, 0.04)
        place = (_BACK + 0.004 + 0.002 * index, y, 0.95 + random.uniform(-0.2, 0.35))
        finish = Finish(texture=_poster(int(random.integers(1 << 30))))
        visuals.append(Visual(Plane(half), finish, carrier_from_visual=_facing(place, 0.0)))
    for index in range(8):
        side = -1.0 if index % 2 else 1.0
        place = (
            -2.3 + 0.45 * (index // 2),
            side * (_SIDE - 0.004 - 0.002 * index),
            random.uniform(0.8, 1.3),
        )
        half = (random.uniform(0.14, 0.2), random.uniform(0.18, 0.28))
        finish = Finish(texture=_poster(int(random.integers(1 << 30))))
        visuals.append(
            Visual(Plane(half), finish, carrier_from_visual=_facing(place, -90.0 * side))
        )
    return visuals


def _furniture(wood: Finish) -> list[Visual]:
    """Add a low bench under the object, and a shelf at the wall behind."""
    metal = Finish(color=(0.25, 0.27, 0.30), gloss=0.3)
    visuals = [
        Visual(Box((0.62, 1.25, 0.018)), wood, carrier_from_visual=_placed((-1.85, 0.0, _BENCH))),
        Visual(Box((0.16, 1.9, 0.015)), wood, carrier_from_visual=_placed((-2.52, 0.0, 0.62))),
    ]
    for x, y in ((-2.40, -1.18), (-1.30, -1.18), (-2.40, 1.18), (-1.30, 1.18)):
        leg = Box((0.025, 0.025, 0.5 * _BENCH - 0.009))
        place = _placed((x, y, 0.5 * _BENCH - 0.009))
        visuals.append(Visual(leg, metal, carrier_from_visual=place))
    for y in (-1.85, -0.7, 0.7, 1.85):
        post = Box((0.15, 0.012, 0.31))
        visuals.append(Visual(post, metal, carrier_from_visual=_placed((-2.52, y, 0.31))))
    return visuals


def _bench_and_shelf(random: np.random.Generator, prints: list[Texture]) -> list[Visual]:
    """Add things on the bench, low ones near the object, and on the shelf."""
    visuals = []
    for x, tall in ((-1.42, 0.05), (-1.75, 0.08), (-2.12, 0.16)):
        for place in np.arange(-1.08, 1.09, 0.27):
            y = float(place + random.uniform(-0.05, 0.05))
            spot = (x + float(random.uniform(-0.05, 0.05)), y, _BENCH + 0.018)
            visuals.append(_item(random, prints, spot, tall))
    for place in np.arange(-1.7, 1.71, 0.34):
        y = float(place + random.uniform(-0.05, 0.05))
        visuals.append(_item(random, prints, (-2.48, y, 0.635), 0.14))
    return visuals


def _about(random: np.random.Generator, prints: list[Texture]) -> list[Visual]:
    """Add boxes along the walls."""
    visuals = []
    for x, y in ((-1.9, 1.75), (-0.9, 1.8), (0.4, 1.85), (-2.0, -1.8), (-0.6, -1.85), (0.9, -1.7)):
        visuals.append(_item(random, prints, (x, y, 0.0), 0.24))
    return visuals


def _item(
    random: np.random.Generator,
    prints: list[Texture],
    foot: tuple[float, float, float],
    tall: float,
) -> Visual:
    """Return a thing at a position; `tall` is about half its height."""
    half = tall * float(random.uniform(0.75, 1.2))
    wide = float(random.uniform(0.05, 0.085)) * (1.0 + 1.2 * tall)
    texture = prints[int(random.integers(len(prints)))]
    tint = _PALETTE[int(random.integers(len(_PALETTE)))]
    color = tuple(0.6 + 0.4 * part for part in tint)
    finish = Finish(color=(color[0], color[1], color[2]), texture=texture, gloss=0.15)
    kind, yaw = int(random.integers(5)), float(random.uniform(-50.0, 50.0))
    x, y, z = foot
    if kind == 0:
        ball = min(half, 0.09)
        shape = Ellipsoid((ball, ball, ball * 0.9))
        return Visual(shape, finish, carrier_from_visual=_placed((x, y, z + 0.9 * ball), yaw))
    if kind == 1:
        place = _placed((x, y, z + half), yaw)
        return Visual(Cylinder(0.75 * wide, half), finish, carrier_from_visual=place)
    if kind == 2:
        radius = min(0.6 * wide, 0.8 * half)
        place = _placed((x, y, z + half), yaw)
        return Visual(Capsule(radius, half - radius), finish, carrier_from_visual=place)
    deep = float(random.uniform(0.6, 1.0)) * wide
    return Visual(
        Box((deep, wide, half)), finish, carrier_from_visual=_placed((x, y, z + half), yaw)
    )


def _package(seed: int) -> Texture:
    """Return the print of a package: words, bands and small print."""
    random = np.random.default_rng([seed, 8])
    picks = random.permutation(len(_PALETTE))
    paper, first, second = (_PALETTE[pick] for pick in picks[:3])
    sheet = Sheet((256, 256), paper, seed)
    band = float(random.uniform(0.1, 0.5))
    sheet.patch((0.0, band), (1.0, 0.28), first)
    word = _WORDS[int(random.integers(len(_WORDS)))]
    for start in (0.05, 0.55):
        sheet.words(word, (start, band + 0.19), 0.12, second, width=0.4)
    sheet.lines((0.06, (band + 0.34) % 1.0), (0.85, 0.14), 4, second)
    for _ in range(5):
        place = (float(random.random()), float(random.random()))
        sheet.spot(place, float(random.uniform(0.02, 0.06)), _PALETTE[picks[3]])
    sheet.stain(0.12, 0.15)
    return sheet.finish()


def _poster(seed: int) -> Texture:
    """Return a poster: blocks of colour, a word and small print."""
    random = np.random.default_rng([seed, 9])
    picks = random.permutation(len(_PALETTE))
    sheet = Sheet((240, 300), _PALETTE[picks[0]], seed)
    for index in range(6):
        corners = random.uniform(0.08, 0.92, (int(random.integers(3, 6)), 2)) * [1.0, 0.75]
        sheet.shape(corners, _PALETTE[picks[1 + index % 4]])
    for _ in range(4):
        place = (float(random.uniform(0.1, 0.9)), float(random.uniform(0.1, 0.7)))
        sheet.spot(place, float(random.uniform(0.02, 0.09)), _PALETTE[picks[5]])
    sheet.words(_WORDS[int(random.integers(len(_WORDS)))], (0.08, 0.87), 0.08, _PALETTE[picks[6]])
    sheet.lines((0.08, 0.90), (0.8, 0.06), 2, _PALETTE[picks[6]])
    sheet.stain(0.1, 0.08)
    return sheet.finish()


def _planks() -> Texture:
    """Return floorboards: four per texture, each with its own shade."""
    boards = []
    for index, shade in enumerate((0.92, 1.05, 0.98, 1.1)):
        color = (0.52 * shade, 0.42 * shade, 0.33 * shade)
        board = grain((512, 64), color, 0.2, 8.0, seed=50 + index)
        board[:2] = board[:2] // 2
        boards.append(np.roll(board, 128 * index, axis=1))
    return np.ascontiguousarray(np.concatenate(boards))


def _wallpaper() -> Texture:
    sheet = Sheet((192, 192), (0.74, 0.76, 0.74), seed=61)
    for index in range(4):
        sheet.patch((0.25 * index, 0.0), (0.05, 1.0), (0.66, 0.71, 0.71))
    for index in range(8):
        place = (0.15 + 0.25 * (index % 4), 0.25 + 0.5 * (index // 4))
        sheet.spot(place, 0.03, (0.60, 0.58, 0.50))
    sheet.stain(0.2, 0.06)
    return sheet.finish()


def _placed(place: tuple[float, float, float], yaw_deg: float = 0.0) -> tuple[float, ...]:
    half = math.radians(0.5 * yaw_deg)
    return (exact.cos(half), 0.0, 0.0, exact.sin(half), *place)


def _facing(place: tuple[float, float, float], yaw_deg: float) -> Floats:
    """Return a vertical plane with x horizontal and y up; it faces +x, rotated about z."""
    half = math.radians(0.5 * yaw_deg)
    turn = np.array([exact.cos(half), 0.0, 0.0, exact.sin(half)])
    # Its own z along the world's x, its x along y, its y along z.
    upright = np.array([0.5, 0.5, 0.5, 0.5])
    w = turn[0] * upright[0] - turn[3] * upright[3]
    z = turn[0] * upright[3] + turn[3] * upright[0]
    x = turn[0] * upright[1] - turn[3] * upright[2]
    y = turn[0] * upright[2] + turn[3] * upright[1]
    return np.array([w, x, y, z, *place])
