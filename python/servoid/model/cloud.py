"""Models a body from range samples alone, as of a point cloud."""

from collections.abc import Sequence
from dataclasses import replace

from servoid.errors import MeshError
from servoid.model.cloud_checks import (
    extent_doubt,
    ground_doubt,
    orientation_of,
    viewpoint_doubts,
)
from servoid.model.cloud_outline import is_around, outline_view, outlook, viewpoint_of
from servoid.model.fit import Request, fit_shape
from servoid.model.neighbours import stray_note, stray_points
from servoid.model.range_samples import RangeSamples
from servoid.model.result import ModelResult
from servoid.words import digits

_OUTLINE_WEIGHT = 3.0  # a body that extends beyond the outline contradicts more than one sample


def fit_range_samples(
    samples: RangeSamples, request: Request | None = None, *, notes: Sequence[str] = ()
) -> ModelResult:
    """Model a body from range samples of its surface alone.

    Samples that were all seen from one viewpoint have an outline, beside which nothing is. Samples
    far from all others are left out, and directions that all point out of a closed surface are
    reversed; notes report it.

    Raises:
        MeshError: the samples lie around their viewpoint.
        ModelError: there are too few samples, or a setting is out of range.

    """
    request = request or Request()
    told = list(notes)
    strays = stray_points(samples.points)
    if strays.any():
        stray = stray_note(samples.points, "point", "points")
        told.append(f"{stray}, and {'was' if strays.sum() == 1 else 'were'} left out")
        samples = RangeSamples(samples.points[~strays], samples.directions[~strays])
    eye = viewpoint_of(samples)
    if eye is None:
        samples, turned, doubts = orientation_of(samples)
        told += [] if turned is None else [turned]
        result = fit_shape(request.given(range_samples=samples), samples, request, told)
        return result.doubted([*doubts, extent_doubt(result.body, samples)])
    if is_around(samples):
        raise MeshError(
            f"the viewpoint ({', '.join(map(digits, eye.tolist()))}) is inside the cloud, which "
            "lies on all sides of it; give the position from which the cloud was seen, in the "
            "cloud's own frame; a cloud that was seen from several sides needs normals instead"
        )
    seen = outlook(samples, eye)
    if seen is None:
        result = fit_shape(request.given(range_samples=samples), samples, request, told)
        return result.doubted([extent_doubt(result.body, samples)])
    outline = outline_view(seen)
    if request.silhouette_weight is None:
        request = replace(request, silhouette_weight=_OUTLINE_WEIGHT)
    given = request.given(views=[outline], range_samples=samples)
    result = replace(fit_shape(given, samples, request, told), outline=outline)
    doubts = (*viewpoint_doubts(samples, seen, eye), ground_doubt(samples, eye))
    return result.doubted([*doubts, extent_doubt(result.body, samples)])
