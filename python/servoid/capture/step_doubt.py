"""Checks whether the cameras of a recording took the images of an observation at the same time.

What moves across the epipolar lines shows it, and what moves along them says nothing. The instants
at which most moves across are compared first, until the lag is known.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from servoid.capture.capture import Capture, CaptureCamera
from servoid.capture.frozen_depth import doubt_depth
from servoid.capture.lag_fit import Lag, MovingFeatures, fit_lag
from servoid.capture.matched_features import (
    FIRST_OF_VIDEO,
    LONG_PX,
    PosedPicture,
    alike_features,
    unit_px,
    unit_rays,
)
from servoid.capture.neighbours import Album, evenly, in_both, is_video, second_from_first
from servoid.pose import Floats, exact
from servoid.words import are, camera_called, counted

_CANDIDATES = 24  # instants whose motion is measured
_INSTANTS = 12  # that are compared, of these
_SETTLED = 4  # instants from which on few errors are enough
_LEAST_COMMON = 2  # of those that are compared, in the later half
_LEAST_INSTANTS = 6  # that show a lag, or all
_LEAST_MOVING = 10  # features
_LEAST_LAG = 0.4  # images; of a recorded pair, of unknown step, 0.33 is measured
_ERRORS = 6.0  # of a lag that is reported
_SETTLED_ERRORS = 4.0  # added to the lag of cameras in step
_SUSPECT_ERRORS = 2.0  # of a lag that is worth a look at larger images
_SHIFTS = 3
_MOST_LEFT = 0.75  # images, after one camera is shifted by whole ones
_CORNERS = 200
_APART_PX = 4
_SPEED = 0.4  # thousandths of the diagonal an image: less is noise
_MOST_LAG = 3.0  # images: what is farther off is matched wrongly
_OFF = 2.0  # thousandths of the diagonal
_UNEVEN = (0.3, 0.4)  # share of the speed, and thousandths of the diagonal
_BACK_PX = 0.3  # off the start, of what is followed there and back
_WINDOW_PX = (15, 15)

_STILL_OFF = 0.2  # share of what rests off its lines, as of a camera that was moved
_LEAST_STILL = 0.5  # features, per one that moves: fewer are matched wrongly, as all moves
_LEAST_OF_INSTANT = 3  # features that move, by which an instant is late or not
_LATE = 0.5  # of the lag, from which on it is

Between = tuple[PosedPicture, PosedPicture, PosedPicture]


@dataclass(frozen=True, eq=False)
class _Compared:
    """The features of an instant: those that move, and the number of others, and of those off."""

    moving: MovingFeatures
    still: int
    still_off: int


@dataclass(frozen=True, eq=False)
class _Pair:
    """Two cameras of a rig by their indices, and the epipolar lines of the first in the second.

    `known` keeps what was compared, by instant and shift.
    """

    album: Album
    cameras: tuple[int, int]
    known: dict[tuple[int, int], _Compared | None] = field(default_factory=dict)

    @property
    def both(self) -> tuple[CaptureCamera, CaptureCamera]:
        first, second = (self.album.capture.cameras[at] for at in self.cameras)
        return first, second

    @property
    def unit(self) -> float:
        """Return the unit of lengths in the second image, as an angle."""
        lens = self.both[1].lens
        return unit_px(lens) / lens.focal_px[0]

    def far(self, pixels: Floats) -> Floats:
        """Return the directions of pixels of the first camera, (N, 3), in the second's frame."""
        matrix = second_from_first(*self.both).matrix()
        return exact.product(
            unit_rays(self.both[0].lens, pixels), np.ascontiguousarray(matrix[:3, :3].T)
        )

    def off(self, pixels: Floats, rays: Floats) -> Floats:
        """Return how far `rays` of the second camera are off the lines of `pixels`, in units."""
        shift = second_from_first(*self.both).matrix()[:3, 3]
        normals = np.cross(shift, self.far(pixels))
        with np.errstate(divide="ignore", invalid="ignore"):
            return (normals * rays).sum(axis=1) / (exact.lengths(normals) * self.unit)

    def between(self, index: int) -> Between | None:
        """Return the first camera's images before, at and after an instant."""
        count = len(self.album.capture)
        near = (index - 1, index, index + 1)
        images = [self.album.posed(self.cameras[0], at) for at in near if 0 <= at < count]
        before, here, after = images if len(images) == 3 else (None, None, None)
        return None if before is None or here is None or after is None else (before, here, after)


def doubt_step(capture: Capture, *, among: Sequence[int] | None = None) -> str | None:
    """Return a message if images of an observation are of different times, else None.

    Each camera is compared with the first one that sees the same things, and its depth images with
    each other. Observations `among` these indices are compared; without, among all.
    """
    if not capture.is_recording:
        return None
    coarse, fine = Album(capture, long_px=LONG_PX // 2), Album(capture)
    frozen = doubt_depth(coarse, among=among)
    if frozen is not None:
        return frozen
    for second in range(1, len(capture.cameras)):
        for first in range(second):
            pair = _Pair(coarse, (first, second))
            order = _most_moving(pair, _instants(pair, among))
            if any(_alike(pair, index, 0) is not None for index in order[:_SETTLED]):
                large = _Pair(fine, pair.cameras)
                for some in (order, _later_half(order)):
                    lag = None if _is_settled(pair, some) else _lag_of(pair, large, some)
                    if lag is not None:
                        return _note(pair, lag, _since(pair, lag, sorted(order)))
                break
    return None


def _instants(pair: _Pair, among: Sequence[int] | None) -> list[int]:
    """Choose instants whose motion is measured, evenly."""
    first, second = pair.both
    apart = second_from_first(first, second).translation
    if not exact.norm(np.asarray(apart)) > 0.0:
        return []
    count = len(pair.album.capture)
    there = [at for at in in_both(first, second) if 0 < at < count - 1]
    if is_video(first) or is_video(second):
        there = [at for at in there if at < FIRST_OF_VIDEO]
    if among is not None:
        compared = set(among)
        there = [at for at in there if at in compared]
    return [there[place] for place in evenly(len(there), _CANDIDATES)]


def _most_moving(pair: _Pair, instants: Sequence[int]) -> list[int]:
    """Order instants by how much moves across the lines; leave those out where nothing does."""
    moves = {index: _motion(pair, index) for index in instants}
    kept = [index for index in instants if moves[index] > 0.0]
    return sorted(kept, key=lambda index: -moves[index])


def _later_half(order: Sequence[int]) -> list[int]:
    """Return the later half of some instants in the same order, since an image may be dropped."""
    middle = sorted(order)[len(order) // 2]
    return [index for index in order if index >= middle]


def _is_settled(pair: _Pair, instants: Sequence[int]) -> bool:
    """Return whether what was compared shows cameras to be in step, at some of these instants too.

    If they were not in step there, all together would not be, either.
    """
    there = [index for index in instants if pair.known.get((index, 0)) is not None]
    seen = [one.moving for one in pair.known.values() if one is not None and len(one.moving.off)]
    if len(there) < _LEAST_COMMON or len(seen) < _SETTLED:
        return False
    lag = fit_lag(seen)
    return _is_known(lag) and _is_in(lag)


def _motion(pair: _Pair, index: int) -> float:
    """Measure how much corners move across their lines, in half the size."""
    import cv2

    here = pair.album.posed(pair.cameras[0], index)
    after = pair.album.posed(pair.cameras[0], index + 1)
    image = None if here is None else here.grey(LONG_PX // 2)
    if here is None or after is None or image is None:
        return 0.0
    corners = cv2.goodFeaturesToTrack(image[0], _CORNERS, 0.01, _APART_PX)
    if corners is None:
        return 0.0
    pixels = (corners[:, 0].astype(np.float64) + 0.5) * image[1] - 0.5
    followed = _followed(here, after, pixels, LONG_PX // 2)
    if followed is None:
        return 0.0
    later, found = followed
    speeds = np.abs(pair.off(later, pair.far(pixels)))[found]
    squares = np.square(speeds[speeds > _SPEED])  # those that are not finite are left out
    return float((squares / (1.0 + 0.1 * squares)).sum())


def _followed(
    one: PosedPicture, other: PosedPicture, pixels: Floats, long_px: int
) -> tuple[Floats, NDArray[np.bool_]] | None:
    """Follow features from one image to another and back; return where they are, and which are."""
    import cv2

    here, later = one.grey(long_px), other.grey(long_px)
    if here is None or later is None:
        return None
    (start, by), (end, _) = here, later
    given = ((pixels + 0.5) / by - 0.5).astype(np.float32)[:, None]
    there, found, _ = cv2.calcOpticalFlowPyrLK(start, end, given, None, winSize=_WINDOW_PX)  # pyright: ignore[reportCallIssue, reportArgumentType]
    back, again, _ = cv2.calcOpticalFlowPyrLK(end, start, there, None, winSize=_WINDOW_PX)  # pyright: ignore[reportCallIssue, reportArgumentType]
    near = np.abs(back - given).max(axis=(1, 2)) < _BACK_PX
    kept = (found[:, 0] > 0) & (again[:, 0] > 0) & near
    return (there[:, 0].astype(np.float64) + 0.5) * by - 0.5, kept


def _alike(pair: _Pair, index: int, shift: int) -> tuple[Floats, Floats] | None:
    """Return features of the first camera `shift` images before an instant, and in the second."""
    first, second = pair.cameras
    if not 0 <= index - shift < len(pair.album.capture):
        return None
    images = pair.album.posed(first, index - shift), pair.album.posed(second, index)
    return None if images[0] is None or images[1] is None else alike_features(images[0], images[1])


def _compared(pair: _Pair, index: int, shift: int) -> _Compared | None:
    """Return how features of an instant move, and how far they are off; None if too few match."""
    if (index, shift) not in pair.known:
        pair.known[index, shift] = _compare(pair, index, shift)
    return pair.known[index, shift]


def _compare(pair: _Pair, index: int, shift: int) -> _Compared | None:
    """Return what `_compared` says, anew."""
    alike, images = _alike(pair, index, shift), pair.between(index - shift)
    if alike is None or images is None:
        return None
    pixels, seen_px = alike
    before, after = (_followed(images[1], other, pixels, LONG_PX) for other in images[::2])
    if before is None or after is None:
        return None
    rays = unit_rays(pair.both[1].lens, seen_px)
    off = pair.off(pixels, rays)
    earlier, later = pair.off(before[0], rays), pair.off(after[0], rays)
    speeds = 0.5 * (later - earlier)
    bent = np.abs(later - 2.0 * off + earlier)
    with np.errstate(invalid="ignore"):
        rests = before[1] & after[1] & (np.abs(speeds) < _SPEED)
        kept = before[1] & after[1] & (np.abs(off) < _MOST_LAG * np.abs(speeds) + _OFF)
        kept &= bent < _UNEVEN[0] * np.abs(speeds) + _UNEVEN[1]
    size = 0.5 * np.array(pair.both[0].lens.size_px)
    near = exact.lengths(rays - pair.far(pixels))[:, None]
    places = np.hstack([pixels / size - 1.0, near / (100.0 * pair.unit)])
    kept &= np.isfinite(places).all(axis=1)
    return _Compared(
        MovingFeatures(off[kept], speeds[kept], places[kept]),
        still=int(rests.sum()),
        still_off=int((rests & (np.abs(off) > _MOST_LAG * _SPEED + _OFF)).sum()),
    )


def _lag_of(coarse: _Pair, fine: _Pair, order: Sequence[int]) -> Lag | None:
    """Estimate the lag of the second camera; None if it is in step, or its lag unknown.

    Small images show that cameras are in step. Motion is even for an image or so only, so a longer
    lag is estimated from the images of the first camera that many whole ones before.
    """
    rough = _estimated(coarse, order, 0)
    if rough is None or not _is_suspect(rough):
        return None
    shift = round(rough.images) if _is_known(rough) else 0
    for _ in range(_SHIFTS):
        lag = _estimated(fine, order, shift)
        if lag is None or not _is_known(lag):
            return None
        if abs(lag.images) - lag.error < _MOST_LEFT:
            lag = lag.shifted(shift)
            return lag if _is_out(lag) else None
        shift += round(lag.images)
    return None


def _estimated(pair: _Pair, order: Sequence[int], shift: int) -> Lag | None:
    """Compare instants until it is clear whether the second camera is behind by `shift` images.

    None if fewer than a few instants can be compared, or if what rests is off its lines as well:
    no time explains that.
    """
    seen: list[_Compared] = []
    lag = None
    for index in order[:_INSTANTS]:
        one = _compared(pair, index, shift)
        if one is None or not len(one.moving.off):
            continue
        seen.append(one)
        if len(seen) < _SETTLED:
            continue
        if _is_moved(seen):
            return None
        lag = fit_lag([one.moving for one in seen])
        if not _is_known(lag):
            continue
        if _is_in(lag):
            return lag
        if _is_out(lag) and len(seen) >= _LEAST_INSTANTS:
            return lag
    return lag


def _is_moved(seen: Sequence[_Compared]) -> bool:
    """Return whether what rests is off its lines, as if a camera was moved."""
    still, off = sum(one.still for one in seen), sum(one.still_off for one in seen)
    moving = sum(len(one.moving.off) for one in seen)
    return still > _LEAST_STILL * moving and off > _STILL_OFF * still


def _is_suspect(lag: Lag) -> bool:
    """Return whether a lag is worth more time."""
    if _is_known(lag) and _is_in(lag):
        return False
    return 2 * lag.moving >= _LEAST_MOVING and abs(lag.images) > _SUSPECT_ERRORS * lag.error


def _is_known(lag: Lag) -> bool:
    return lag.moving >= _LEAST_MOVING and lag.instants >= _SETTLED


def _is_in(lag: Lag) -> bool:
    return abs(lag.images) + _SETTLED_ERRORS * lag.error < _LEAST_LAG


def _is_out(lag: Lag) -> bool:
    return lag.least > _LEAST_LAG and abs(lag.images) > _ERRORS * lag.error


def _since(pair: _Pair, lag: Lag, instants: Sequence[int]) -> int | None:
    """Return the observation from about which on a camera lags; None if that is unclear, or in all.

    A camera that drops an image in the middle of a recording was in step before.
    """
    there, late = [], []
    for index in instants:
        one = _compared(pair, index, 0)
        moving = None if one is None else one.moving
        if moving is None or moving.moving < _LEAST_OF_INSTANT:
            continue
        moves = np.abs(moving.speeds) > _SPEED
        there.append(index)
        late.append(np.median(moving.off[moves] / moving.speeds[moves]) / lag.images > _LATE)
    first = late.index(True) if True in late else 0
    is_clear = first >= _SETTLED and len(late) - first >= _SETTLED and all(late[first:])
    return there[first] if is_clear else None


def _note(pair: _Pair, lag: Lag, since: int | None) -> str:
    first, second = (camera_called(camera.name) for camera in pair.both)
    late, other = (second, first) if lag.images > 0.0 else (first, second)
    images = abs(lag.images)
    late_ms = round(1000.0 * images * _step_s(pair.album.capture))
    whole = round(images)
    when, there = "", ""
    if since is not None:
        when = f" from about observation {since} on, but not before"
        there = "from there on, "
    cure = "synchronise the cameras"
    if whole and abs(images - whole) < _LEAST_LAG:
        cure = (
            f"{there}give each image of {other} the one of {late} that comes "
            f"{counted(whole, 'image')} later, or {cure}"
        )
    return (
        f"{late} is {late_ms} ms ({images:.1f} images) behind {other}{when}: "
        f"{counted(lag.moving, 'moving feature')} in {counted(lag.instants, 'observation')} "
        f"{are(lag.moving)} where they were that long before, so what moves seems nearer or "
        f"farther away than it is; {cure}"
    )


def _step_s(capture: Capture) -> float:
    """Return the time between two observations, in the median."""
    times = capture.times_s
    if times is not None and len(times) > 1:
        return float(np.median([after - before for before, after in pairwise(times)]))
    return 1.0 / (capture.rate_hz or 1.0)
