"""Detects features in images and matches them between pairs of images, with pycolmap."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.scan.running import pycolmap, run

SEED = 0
_MOST_FEATURES = 4096
_MOST_IN_FILM = 2500  # neighbours share nearly all features
_LONGEST_PX = 1600  # larger images are shrunk before features are detected in them
_ALL_PAIRS = 30  # up to this number of images of a film, all pairs are compared
_ALL_PAIRS_OF_PHOTOS = 80
_NEIGHBOURS = 8
_ANCHORS = 20  # images spread over a longer sequence, all pairs of which are compared
_AT_ONCE = 6  # images, or their pairs with all others, between two reports of progress

Share = Callable[[float], None]
Pair = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Matched:
    """The features of images and their matches; images are counted from 0 in their order.

    `keypoints` are (N, 2) float64 for each image, in pixels, whose (0, 0) is the centre of the
    first. `alike` are (M, 2) pairs of features with similar descriptors in two images, and
    `agreeing` those of them that one camera motion in a static scene explains.
    """

    names: tuple[str, ...]
    files: tuple[str, ...]
    size_px: tuple[int, int]
    database: Path
    keypoints: tuple[NDArray[np.float64], ...]
    alike: dict[Pair, NDArray[np.int64]]
    agreeing: dict[Pair, NDArray[np.int64]]

    @cached_property
    def diagonal_px(self) -> float:
        """Return the diagonal of the images in pixels."""
        return float(np.hypot(*self.size_px))

    def places(self, pair: Pair, matches: NDArray[np.int64]) -> tuple[Any, Any]:
        """Return the positions of matches in the two images, (M, 2) float64 each."""
        first, second = pair
        return self.keypoints[first][matches[:, 0]], self.keypoints[second][matches[:, 1]]


def choose_pairs(count: int, *, is_film: bool) -> list[Pair]:
    """Return the pairs to compare: all, or neighbours and some others of many images of a film."""
    if count <= (_ALL_PAIRS if is_film else _ALL_PAIRS_OF_PHOTOS):
        return [(i, j) for i in range(count) for j in range(i + 1, count)]
    pairs = {(i, j) for i in range(count) for j in range(i + 1, min(i + 1 + _NEIGHBOURS, count))}
    anchors = sorted({round(at) for at in np.linspace(0, count - 1, _ANCHORS)})
    pairs |= {(i, j) for i in anchors for j in anchors if i < j}
    return sorted(pairs)


def match(
    folder: Path,
    files: Sequence[str],
    database: Path,
    *,
    is_film: bool,
    focal_px: float | None = None,
    masks: Path | None = None,
    moving_only: bool = False,
    threads: int | None = None,
    progress: Share | None = None,
) -> Matched:
    """Detect features in the `files` of a folder and match them; results are kept in a `database`.

    All images are of one camera. `focal_px` is its nominal focal length. The folder `masks` has a
    mask for each image, with the image's name and .png at the end: features are detected where it
    is not zero. With `moving_only`, features that stay at their position in the image are left out,
    as if only the object moved.
    """
    report = progress or (lambda _: None)
    most = _MOST_IN_FILM if is_film else _MOST_FEATURES
    _extract(folder, files, database, masks, (most, threads), lambda share: report(0.5 * share))
    if focal_px is not None:
        _set_focal(database, focal_px)
    pairs = choose_pairs(len(files), is_film=is_film)
    _compare(files, pairs, database, moving_only, threads, lambda s: report(0.5 + 0.5 * s))
    return _read(files, database)


def match_pairs(
    folder: Path,
    files: Sequence[str],
    database: Path,
    pairs: Sequence[Pair],
    *,
    threads: int | None = None,
) -> Matched:
    """Detect features in images of a film and match the given pairs; otherwise as `match`."""
    _extract(folder, files, database, None, (_MOST_IN_FILM, threads), lambda _: None)
    _compare(files, pairs, database, False, threads, lambda _: None)
    return _read(files, database)


def _threads(threads: int | None) -> int:
    return -1 if threads is None else threads


def _extract(
    folder: Path,
    files: Sequence[str],
    database: Path,
    masks: Path | None,
    effort: tuple[int, int | None],
    report: Share,
) -> None:
    colmap = pycolmap()
    options = colmap.FeatureExtractionOptions()
    options.sift.max_num_features, threads = effort
    options.num_threads = _threads(threads)
    options.max_image_size = _LONGEST_PX
    reader = colmap.ImageReaderOptions()
    if masks is not None:
        reader.mask_path = str(masks)
    colmap.Database.open(database).close()
    for first in range(0, len(files), _AT_ONCE):
        some = list(files[first : first + _AT_ONCE])

        def work(token: Any, some: list[str] = some) -> None:
            # Number them before the threads finish in an arbitrary order.
            colmap.import_images(database, folder, colmap.CameraMode.SINGLE, some, reader)
            reader.existing_camera_id = 1  # all share the camera that the first one created
            colmap.extract_features(
                database,
                folder,
                some,
                camera_mode=colmap.CameraMode.SINGLE,
                reader_options=reader,
                extraction_options=options,
                device=colmap.Device.cpu,
                cancellation_token=token,
            )

        run(work)
        report((first + len(some)) / len(files))


def _set_focal(database: Path, focal_px: float) -> None:
    """Store the camera's nominal focal length in the database."""
    with pycolmap().Database.open(database) as opened:
        (camera,) = opened.read_all_cameras()
        camera.focal_length = focal_px
        camera.has_prior_focal_length = True
        opened.update_camera(camera)


def _compare(
    files: Sequence[str],
    pairs: Sequence[Pair],
    database: Path,
    moving_only: bool,
    threads: int | None,
    report: Share,
) -> None:
    colmap = pycolmap()
    matching = colmap.FeatureMatchingOptions()
    matching.num_threads = _threads(threads)
    verifying = colmap.TwoViewGeometryOptions()
    verifying.ransac.random_seed = SEED
    verifying.filter_stationary_matches = moving_only
    listed = database.with_name("pairs.txt")
    starts = sorted({first for first, _ in pairs})
    for at in range(0, len(starts), _AT_ONCE):
        some = set(starts[at : at + _AT_ONCE])
        lines = [f"{files[i]} {files[j]}" for i, j in pairs if i in some]
        listed.write_text("\n".join(lines) + "\n", encoding="utf-8")
        pairing = colmap.ImportedPairingOptions()
        pairing.match_list_path = str(listed)

        def work(token: Any, pairing: Any = pairing) -> None:
            colmap.match_image_pairs(
                database,
                matching_options=matching,
                pairing_options=pairing,
                verification_options=verifying,
                device=colmap.Device.cpu,
                cancellation_token=token,
            )

        run(work)
        report((at + len(some)) / len(starts))
    _sort(database)


def _sort(database: Path) -> None:
    """Sort the pairs, stored in the order in which threads ended: the mapper uses that order."""
    with pycolmap().Database.open(database) as opened:
        pairs = sorted(zip(*opened.read_all_matches(), strict=True), key=_number)
        geometries = sorted(zip(*opened.read_two_view_geometries(), strict=True), key=_number)
        opened.clear_matches()
        opened.clear_two_view_geometries()
        for number, matches in pairs:
            opened.write_matches(*pycolmap().pair_id_to_image_pair(number), matches)
        for number, geometry in geometries:
            opened.write_two_view_geometry(*pycolmap().pair_id_to_image_pair(number), geometry)


def _number(pair: tuple[int, Any]) -> int:
    return pair[0]


def _read(files: Sequence[str], database: Path) -> Matched:
    colmap = pycolmap()
    with colmap.Database.open(database) as opened:
        numbers = {image.name: image.image_id for image in opened.read_all_images()}
        index_of = {numbers[file]: index for index, file in enumerate(files)}
        (camera,) = opened.read_all_cameras()
        keypoints = tuple(
            # COLMAP's pixel coordinates start at the corner of the first pixel, ours at its centre.
            np.asarray(opened.read_keypoints(numbers[file]), np.float64)[:, :2] - 0.5
            for file in files
        )
        alike = _by_pair(*opened.read_all_matches(), index_of=index_of)
        ids, geometries = opened.read_two_view_geometries()
        agreeing = _by_pair(ids, [one.inlier_matches for one in geometries], index_of=index_of)
    return Matched(
        names=tuple(Path(file).stem for file in files),
        files=tuple(files),
        size_px=(camera.width, camera.height),
        database=database,
        keypoints=keypoints,
        alike=alike,
        agreeing=agreeing,
    )


def _by_pair(
    ids: Sequence[int], matches: Sequence[Any], *, index_of: dict[int, int]
) -> dict[Pair, NDArray[np.int64]]:
    """Return matches by the indices of their images, the smaller one first."""
    found: dict[Pair, NDArray[np.int64]] = {}
    for number, rows in zip(ids, matches, strict=True):
        first, second = (index_of[one] for one in pycolmap().pair_id_to_image_pair(number))
        columns = np.asarray(rows, np.int64).reshape(-1, 2)
        if first > second:
            first, second, columns = second, first, columns[:, ::-1]
        if len(columns):
            found[first, second] = columns
    return found
