"""Bundle adjustment of a model of COLMAP, and what it says of the cameras."""

from typing import Any

import numpy as np

from servoid.pose import Floats
from servoid.scan.running import pycolmap, run

# Features with larger errors, in pixels and in diagonals, count less than by their square.
_FAR_PX, _FAR = 0.5, 0.0006


def adjust(model: Any, *, center: bool, bent: bool) -> Any:
    """Adjust poses, points, focal length and the requested intrinsics; return the adjuster."""
    colmap = pycolmap()
    options = colmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_principal_point = center
    options.refine_extra_params = bent
    options.ceres.loss_function_type = colmap.LossFunctionType.CAUCHY
    camera = next(iter(model.cameras.values()))
    diagonal_px = float(np.hypot(camera.width, camera.height))
    options.ceres.loss_function_scale = max(_FAR_PX, _FAR * diagonal_px)
    options.ceres.solver_options.num_threads = 1
    config = colmap.BundleAdjustmentConfig()
    for number in model.reg_image_ids():
        config.add_image(number)
    config.fix_gauge(colmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    adjuster = colmap.create_default_ceres_bundle_adjuster(options, config, model)
    run(lambda _: adjuster.solve())
    model.update_point_3d_errors()
    return adjuster


def intrinsic_covariances(model: Any, adjuster: Any) -> list[Floats]:
    """Return the covariance of each camera's adjusted intrinsics; none if they are undetermined."""
    colmap = pycolmap()
    options = colmap.BACovarianceOptions()
    found = run(lambda _: colmap.estimate_ba_covariance(options, model, adjuster))
    if found is None:
        return []
    return [found.get_other_params_cov(camera.params) for camera in model.cameras.values()]


def squares(model: Any) -> float:
    """Return the sum of the squared reprojection errors."""
    return float(sum(one.error**2 * one.track.length() for one in model.points3D.values()))


def deviation_px(model: Any) -> float:
    """Return the standard deviation of the reprojection error along one axis."""
    return float(np.sqrt(0.5 * squares(model) / max(1, model.compute_num_observations())))
