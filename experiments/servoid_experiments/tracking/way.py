"""The object's path in a scene: a smooth curve along which it moves equally far per image."""

import numpy as np

from servoid.pose import Pose
from servoid.pose.exact import Floats
from servoid.sim.world.events.paths import Random

_REACH = 0.05  # metres, along each axis
_PERIOD_S = 6.0
_BEGIN_S = 2.0  # after which the path's own start has ended
_STEP_S = 0.02
_SOFT = 6  # images over which the motion is faded in


def rest_from_objects(seed: int, way: float, count: int) -> list[Pose]:
    """Return the object's pose in each image, in a frame in the middle of its path.

    Its middle moves `way` metres along the curve from one image to the next, less in the first few.
    """
    path = Random(seed, _REACH, _PERIOD_S)
    shares = np.minimum(np.arange(count) / _SOFT, 1.0)
    gone = way * np.cumsum(shares)
    return [path.start_from_object(time_s) for time_s in _times(path, gone)]


def _times(path: Random, gone: Floats) -> list[float]:
    """Return the times at which a path has covered distances (N,) along its curve."""
    times, lengths = [_BEGIN_S], [0.0]
    place = np.array(path.start_from_object(_BEGIN_S).translation)
    while lengths[-1] < gone[-1]:
        times.append(times[-1] + _STEP_S)
        after = np.array(path.start_from_object(times[-1]).translation)
        lengths.append(lengths[-1] + float(np.linalg.norm(after - place)))
        place = after
    return np.interp(gone, lengths, times).tolist()
