"""Estimates the camera and its poses from matches: incremental structure from motion."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid._native import Lens, Pose
from servoid.pose import Floats
from servoid.scan.adjusting import adjust, deviation_px, intrinsic_covariances, squares
from servoid.scan.matching import SEED, Matched
from servoid.scan.running import pycolmap, run
from servoid.scan.solution import Solution
from servoid.scan.zoom import zoomed_px

_LEAST_IMAGES = 3  # of a connected group
_MOST_GROUPS = 10
_GROWTH, _REFINEMENTS = 1.3, 2  # global bundle adjustment: after this growth, with so many rounds
_CENTER_STD = 0.004  # of the diagonal: a less certain principal point stays at the image centre
_WORTH_BENDING = 0.005  # share of the squared error that a distortion must remove
_FEW_UNSEEN = 0.01  # share of the points of an image that no lens could show there
_CORNER = 0.5  # COLMAP's pixels start at the corner of the first pixel, ours at its centre


def place_images(
    matched: Matched, progress: Callable[[float], None] | None = None
) -> Solution | None:
    """Estimate poses and intrinsics of the largest connected group of images; None if none.

    It runs on one thread, so that the same matches give the same bits.
    """
    found = _map(matched, progress)
    if not found:
        return None
    best, *others = sorted(found, key=lambda one: (-one.num_reg_images(), -one.num_points3D()))
    covariance, center_is_found = _polish(best, matched.diagonal_px)
    groups = tuple(_names(one, matched) for one in others)
    solution = _solution(best, matched, covariance, center_is_found, groups)
    return replace(solution, zoomed_px=zoomed_px(best, matched.files))


def _map(matched: Matched, progress: Callable[[float], None] | None) -> list[Any]:
    """Run the mapper; return its models."""
    colmap = pycolmap()
    options = colmap.IncrementalPipelineOptions()
    options.num_threads = options.mapper.num_threads = 1
    options.random_seed = options.mapper.random_seed = options.triangulation.random_seed = SEED
    options.extract_colors = False
    # A final bundle adjustment follows, so that less of it suffices during mapping.
    options.ba_global_frames_ratio = options.ba_global_points_ratio = _GROWTH
    options.ba_global_max_refinements = _REFINEMENTS
    options.min_model_size = _LEAST_IMAGES
    options.max_num_models = _MOST_GROUPS
    done = [0]

    def count() -> None:
        done[0] += 1

    def work(token: Any) -> dict[int, Any]:
        colmap.set_random_seed(SEED)
        return colmap.incremental_mapping(
            matched.database,
            matched.database.parent,
            matched.database.parent,
            options=options,
            next_image_callback=count,
            cancellation_token=token,
        )

    def report() -> None:
        if progress is not None:
            progress(min(1.0, done[0] / len(matched.names)))

    return list(run(work, report).values())


def _polish(model: Any, diagonal_px: float) -> tuple[Floats, bool]:
    """Run bundle adjustment over all images, with as many intrinsics as the images determine.

    Distortion that hardly reduces the errors is dropped: if the camera moved little around the
    scene, it would only bias the focal length. A principal point with a large uncertainty is
    dropped for the same reason. Returns the covariance of the estimated intrinsics, focal length
    first, for features with a standard deviation of one pixel, and whether the principal point is
    among them.
    """
    (camera,) = model.cameras.values()
    camera.params = [*np.array(camera.params)[:3], 0.0]
    adjust(model, center=False, bent=False)
    straight, without = np.array(camera.params), squares(model)
    adjust(model, center=False, bent=True)
    bent = without > (1.0 + _WORTH_BENDING) * squares(model)
    before = np.array(camera.params) if bent else straight
    camera.params = before
    found = intrinsic_covariances(model, adjust(model, center=True, bent=bent))
    if found:
        deviation = deviation_px(model) * np.sqrt(np.diag(found[0])[1:3].max())
        if deviation < _CENTER_STD * diagonal_px:
            return found[0], True
    camera.params = before
    found = intrinsic_covariances(model, adjust(model, center=False, bent=bent))
    return (found[0] if found else np.full((1, 1), np.nan)), False


def _names(model: Any, matched: Matched) -> tuple[str, ...]:
    files = {model.image(number).name for number in model.reg_image_ids()}
    return tuple(
        name for file, name in zip(matched.files, matched.names, strict=True) if file in files
    )


def _solution(
    model: Any,
    matched: Matched,
    covariance: Floats,
    center_is_found: bool,
    groups: tuple[tuple[str, ...], ...],
) -> Solution:
    lens = _lens(model)
    names = _names(model, matched)
    name_of = dict(zip(matched.files, matched.names, strict=True))
    images = {name_of[model.image(n).name]: model.image(n) for n in model.reg_image_ids()}
    row_of = {number: row for row, number in enumerate(sorted(model.point3D_ids()))}
    points = np.array([model.point3D(number).xyz for number in row_of]).reshape(-1, 3)
    poses, seen, marks, errors = [], [], [], []
    for name in names:
        image = images[name]
        rigid = image.cam_from_world()
        x, y, z, w = rigid.rotation.quat
        camera_from_world = Pose.from_parts(rigid.translation, (w, x, y, z))
        triangulated = [point for point in image.points2D if point.has_point3D()]
        rows = np.array([row_of[point.point3D_id] for point in triangulated], np.int64)
        places = np.array([point.xy for point in triangulated]).reshape(-1, 2) - _CORNER
        off = lens.project(camera_from_world.transform(points[rows])) - places
        errors.append(_error_px(off, matched.diagonal_px))
        poses.append(camera_from_world.inverse())
        seen.append(rows)
        marks.append(places)
    found = set(names)
    return Solution(
        names=names,
        lens=lens,
        world_from_camera=tuple(poses),
        points=points,
        widest_rad=_widest(points, np.array([pose.translation for pose in poses]), seen),
        seen=tuple(seen),
        marks_px=tuple(marks),
        error_px=np.array(errors),
        focal_std_px=deviation_px(model) * float(np.sqrt(covariance[0, 0])),
        center_is_found=center_is_found,
        missing=tuple(name for name in matched.names if name not in found),
        groups=groups,
    )


def _error_px(off: Floats, diagonal_px: float) -> float:
    """Return the error of one image, rms, from the errors (N, 2) of its points.

    Points that no lens could show there, NaN, count as the diagonal, unless they are very few.
    """
    if not len(off):
        return 0.0
    squared = (off**2).sum(axis=1)
    unseen = np.isnan(squared)
    if unseen.mean() < _FEW_UNSEEN:
        return float(np.sqrt(squared[~unseen].mean()))
    return float(np.sqrt(np.where(unseen, diagonal_px**2, squared).mean()))


def _lens(model: Any) -> Lens:
    """Convert the model's simple radial camera to a lens."""
    (camera,) = model.cameras.values()
    focal, u, v, k = camera.params
    return Lens(
        model="brown_conrady",
        size_px=(camera.width, camera.height),
        focal_px=(focal, focal),
        center_px=(u - _CORNER, v - _CORNER),
        distortion=(k, 0.0, 0.0, 0.0),
    )


def _widest(points: Floats, places: Floats, seen: list[NDArray[np.int64]]) -> Floats:
    """Return the largest angle between the rays to each point, (P,) rad."""
    widest = np.zeros(len(points))
    sights: list[list[Floats]] = [[] for _ in points]
    for place, rows in zip(places, seen, strict=True):
        toward = points[rows] - place
        toward /= np.linalg.norm(toward, axis=1)[:, None]
        for row, direction in zip(rows, toward, strict=True):
            sights[row].append(direction)
    for row, directions in enumerate(sights):
        if len(directions) > 1:
            stack = np.array(directions)
            widest[row] = np.arccos(np.clip((stack @ stack.T).min(), -1.0, 1.0))
    return widest
