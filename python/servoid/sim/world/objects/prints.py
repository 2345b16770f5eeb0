"""Prints for textures: words, stripes, bar codes, stains and grain, as (H, W, 3) uint8 sRGB."""

import numpy as np
from numpy.typing import NDArray

from servoid.sim.world.scene.visuals import Color, Texture

_FINE = 3  # supersampling of prints
_INK = (0.05, 0.05, 0.05)
_FONT = 2  # cv2.FONT_HERSHEY_DUPLEX, without a slow import that help texts do not need


class Sheet:
    """A sheet to print on; positions and sizes are shares of its width and height."""

    def __init__(self, size_px: tuple[int, int], paper: Color, seed: int) -> None:
        width, height = size_px
        self._size_px = size_px
        self._pixels = np.full((height * _FINE, width * _FINE, 3), _bytes(paper), np.uint8)
        self._random = np.random.default_rng(seed)
        self._shade: np.ndarray | None = None

    def words(
        self,
        text: str,
        place: tuple[float, float],
        height: float,
        color: Color,
        width: float = 1.0,
    ) -> None:
        """Print a line of text with its lower left corner at `place`, within a height and width."""
        import cv2

        x, y = self._at(*place)
        wide, high = cv2.getTextSize(text, _FONT, 1.0, 1)[0]
        scale = min(height * self._pixels.shape[0] / high, width * self._pixels.shape[1] / wide)
        thick = max(1, round(2.2 * scale))
        cv2.putText(self._pixels, text, (x, y), _FONT, scale, _bytes(color), thick, cv2.LINE_AA)

    def lines(
        self, corner: tuple[float, float], size: tuple[float, float], rows: int, color: Color
    ) -> None:
        """Print lines of small made-up words, as on the back of a package."""
        pitch = size[1] / rows
        for row in range(rows):
            start = corner[0]
            while start < corner[0] + size[0]:
                length = size[0] * self._random.uniform(0.08, 0.26)
                end = min(start + length, corner[0] + size[0])
                top = corner[1] + row * pitch
                self.patch((start, top), (end - start, 0.55 * pitch), color)
                start = end + 0.035 * size[0]

    def patch(self, corner: tuple[float, float], size: tuple[float, float], color: Color) -> None:
        """Print a rectangle."""
        import cv2

        low, high = self._at(*corner), self._at(corner[0] + size[0], corner[1] + size[1])
        cv2.rectangle(self._pixels, low, high, _bytes(color), -1)

    def spot(self, center: tuple[float, float], radius: float, color: Color) -> None:
        """Print a disc; its radius is a share of the height."""
        import cv2

        size = round(radius * self._pixels.shape[0])
        cv2.circle(self._pixels, self._at(*center), size, _bytes(color), -1, cv2.LINE_AA)

    def shape(self, corners: NDArray[np.float64], color: Color) -> None:
        """Print a polygon with corners (N, 2)."""
        import cv2

        points = np.array([self._at(*corner) for corner in corners], np.int32)
        cv2.fillPoly(self._pixels, [points], _bytes(color), cv2.LINE_AA)

    def bar_code(self, corner: tuple[float, float], size: tuple[float, float]) -> None:
        """Print a bar code, black on white."""
        self.patch(corner, size, (1.0, 1.0, 1.0))
        x, end = corner[0] + 0.06 * size[0], corner[0] + 0.94 * size[0]
        while x < end:
            wide = size[0] * float(self._random.choice([0.02, 0.04, 0.06]))
            self.patch((x, corner[1] + 0.08 * size[1]), (wide, 0.84 * size[1]), _INK)
            x += wide + size[0] * float(self._random.choice([0.02, 0.03, 0.05]))

    def stain(self, size: float, strength: float) -> None:
        """Add blotches of varying brightness; `size` is a share of the height."""
        width, height = self._size_px
        self._shade = 1.0 + strength * _lumps((height, width), size, self._random)

    def finish(self) -> Texture:
        """Return the sheet as a read-only texture."""
        import cv2

        small = cv2.resize(self._pixels, self._size_px, interpolation=cv2.INTER_AREA)
        if self._shade is not None:
            small = np.clip(small * self._shade[..., None], 0.0, 255.0)
        texture = np.ascontiguousarray(small, dtype=np.uint8)
        texture.setflags(write=False)
        return texture

    def _at(self, x: float, y: float) -> tuple[int, int]:
        return round(x * self._pixels.shape[1]), round(y * self._pixels.shape[0])


def grain(
    size_px: tuple[int, int], color: Color, strength: float, stretch: float, seed: int
) -> Texture:
    """Return a surface with grain that is `stretch` times as long as high, as wood has."""
    import cv2

    random = np.random.default_rng(seed)
    width, height = size_px
    lumps = _lumps((height, max(round(width / stretch), 8)), 0.05, random)
    lumps = cv2.resize(lumps, size_px, interpolation=cv2.INTER_CUBIC)
    fine = random.standard_normal((height, width)).astype(np.float32) * 0.25
    shade = 1.0 + strength * (lumps + fine)
    return np.clip(np.array(_bytes(color)) * shade[..., None], 0.0, 255.0).astype(np.uint8)


def _lumps(shape: tuple[int, int], size: float, random: np.random.Generator) -> np.ndarray:
    """Return tileable smooth noise of two scales (H, W) float32, about -1 to 1."""
    import cv2

    total = np.zeros(shape, np.float32)
    for share, weight in ((1.0, 0.65), (0.35, 0.35)):
        cells = max(2, round(1.0 / (size * share)))
        grid = random.uniform(-1.0, 1.0, (cells, max(2, round(cells * shape[1] / shape[0]))))
        grid = np.pad(grid, ((0, 1), (0, 1)), mode="wrap").astype(np.float32)
        total += weight * cv2.resize(grid, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return total


def _bytes(color: Color) -> tuple[int, int, int]:
    red, green, blue = (round(255.0 * part) for part in color)
    return red, green, blue
