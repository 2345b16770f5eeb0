"""The width of a fitness's peak: where it is above a share of its maximum."""

import msgspec
import numpy as np

from servoid.pose.exact import Floats

SHARE = 0.9


class Ridge(msgspec.Struct, frozen=True, kw_only=True):
    """Where the fitness is above 90 % of its peak, in metres.

    `along` are straight lines through the peak, along x, y and z. `crest` is along z, with the best
    x and y at each depth: the ridge itself, which follows the line of sight. `crest_from_floor` is
    the same with the share counted from the lowest value of the whole map instead of from 0. `peak`
    is the position of the maximum relative to the true one. A width is None where the fitness is
    not above 0 or the ridge leaves the evaluated range.
    """

    along: list[float | None]
    crest: float | None
    crest_from_floor: float | None
    peak: list[float]
    height: float


def width_at_share(
    places: Floats, values: Floats, floor: float = 0.0, share: float = SHARE
) -> float | None:
    """Return the length over which values (N,) stay above a share of their peak, in metres.

    The share is counted from `floor`; between positions (N,) the values are interpolated linearly.
    None if the peak is not above the floor, or if the values are still above the share at an end.
    """
    top = int(np.argmax(values))
    least = floor + share * (values[top] - floor)
    if not values[top] > floor:
        return None
    ends = []
    for step in (-1, 1):
        at = top
        while 0 <= at < len(values) and values[at] >= least:
            at += step
        if not 0 <= at < len(values):
            return None
        inner = at - step
        part = (values[inner] - least) / (values[inner] - values[at])
        ends.append(places[inner] + part * (places[at] - places[inner]))
    return float(ends[1] - ends[0])


def peak_of(places: Floats, values: Floats) -> float:
    """Return where the values (N,) over even positions (N,) are highest.

    It is the mean of the positions within 1 % of the peak, so that noise at one hardly moves it.
    """
    best = float(values.max())
    high = values >= best - 0.01 * abs(best)
    top = int(np.argmax(values))
    first, last = top, top
    while first > 0 and high[first - 1]:
        first -= 1
    while last < len(values) - 1 and high[last + 1]:
        last += 1
    return float(0.5 * (places[first] + places[last]))
