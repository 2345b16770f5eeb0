"""Draws the map of sides: the camera directions, and when each side was first seen."""

from typing import TYPE_CHECKING, Any

import numpy as np

from servoid.pose import Floats
from servoid.view.axes import DISTINCT, new_figure, png
from servoid.view.page import INK, QUIET_INK
from servoid.view.track.sides import SEEN_WITHIN, Sides

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROWS, _COLUMNS = 180, 360
_UNSEEN = "#e4e0d8"
_MARKERS = ("o", "^", "s", "D")
_MOST_DOTS = 400  # of one camera
_NAMES = {
    "front": (0.0, 0.0),
    "right": (90.0, 0.0),
    "left": (-90.0, 0.0),
    "back": (180.0, 0.0),
    "top": (0.0, 90.0),
    "bottom": (0.0, -90.0),
}


def draw_sides(sides: Sides, names: tuple[str, ...]) -> bytes:
    """Draw the directions to the cameras in an equal-area map; return the PNG file's bytes.

    `names` are those of the cameras. The middle of the map is the side that the first camera saw
    first.
    """
    figure = new_figure(9.6, 4.9)
    axes = figure.add_subplot(projection="mollweide")
    axes.set_facecolor(_UNSEEN)
    _shade(figure, axes, sides)
    for camera, name in enumerate(names):
        _dots(axes, sides, camera, name)
    _name_sides(axes)
    _legend(axes, sides)
    return png(figure)


def map_places(directions: Floats) -> tuple[Floats, Floats]:
    """Return longitudes and latitudes (M,), in radians, of directions (M, 3)."""
    x, y, z = directions.T
    return np.arctan2(x, z), np.arcsin(np.clip(y, -1.0, 1.0))


def _shade(figure: Any, axes: "Axes", sides: Sides) -> None:
    """Colour each side by the time when it was first seen."""
    east, north = (np.linspace(-1.0, 1.0, count + 1) for count in (_COLUMNS, _ROWS))
    lon, lat = np.meshgrid(
        np.pi * (east[1:] + east[:-1]) / 2.0, np.pi * (north[1:] + north[:-1]) / 4.0
    )
    faces = np.stack([np.sin(lon) * np.cos(lat), np.sin(lat), np.cos(lon) * np.cos(lat)], axis=-1)
    when = sides.first_seen(faces.reshape(-1, 3)).reshape(lon.shape)
    if not np.isfinite(when).any():
        return
    drawn = axes.pcolormesh(
        np.pi * east,
        np.pi * north / 2.0,
        np.ma.masked_invalid(when),
        cmap="cividis",
        rasterized=True,
    )
    bar = figure.colorbar(drawn, ax=axes, shrink=0.72, pad=0.02)
    bar.set_label("first seen [s]", color=INK, fontsize=10)
    bar.ax.tick_params(colors=QUIET_INK, labelcolor=INK, labelsize=9)
    bar.outline.set_visible(False)


def _dots(axes: "Axes", sides: Sides, camera: int, name: str) -> None:
    """Mark the directions from which a camera saw the object."""
    own = sides.directions[sides.cameras == camera]
    if not len(own):
        return
    own = own[:: -(-len(own) // _MOST_DOTS)]
    lon, lat = map_places(own)
    axes.scatter(
        lon,
        lat,
        s=11,
        marker=_MARKERS[camera % len(_MARKERS)],
        facecolor="white",
        edgecolor=DISTINCT[(camera + 1) % len(DISTINCT)],
        linewidth=0.7,
        label="from the camera" if name == "camera" else f"from camera {name}",
        zorder=3,
    )


def _name_sides(axes: "Axes") -> None:
    import matplotlib.patheffects as effects

    halo = [effects.withStroke(linewidth=2.5, foreground="white")]
    for name, (lon, lat) in _NAMES.items():
        for east in (lon, -lon) if lon == 180.0 else (lon,):
            inward = 0.88 if lon == 180.0 else 1.0
            axes.text(
                np.radians(east) * inward,
                np.radians(lat) * 0.93,
                name,
                ha="center",
                va="center",
                color=INK,
                fontsize=11,
                path_effects=halo,
                zorder=4,
            )


def _legend(axes: "Axes", sides: Sides) -> None:
    from matplotlib.patches import Patch

    handles, labels = axes.get_legend_handles_labels()
    handles.append(Patch(facecolor=_UNSEEN, edgecolor="#aaaaaa"))
    labels.append(f"not seen: no camera within {np.degrees(SEEN_WITHIN):.0f}°")
    axes.legend(
        handles,
        labels,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.07),
        ncols=min(3, len(labels)),
        frameon=False,
        fontsize=9.5,
    )
    axes.set_xlabel(f"{100.0 * sides.share:.0f} % of all sides were seen", color=INK, fontsize=11)
    axes.grid(color="#ffffff", linewidth=0.5, alpha=0.7)
    axes.set_xticklabels([])
    axes.set_yticklabels([])
    axes.spines["geo"].set_color("#aaaaaa")
