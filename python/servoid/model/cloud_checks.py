"""Finds what contradicts a point cloud: stray points, its normals, its viewpoint, its body."""

import numpy as np
from numpy.typing import NDArray

from servoid._native import Body
from servoid.model.cloud_outline import Outlook
from servoid.model.neighbours import nearest, some_of, surface_normals
from servoid.model.range_samples import RangeSamples
from servoid.pose import exact
from servoid.shape import body_sides
from servoid.words import counted, digits, measured

_QUERIES = 400
_LEAST = 50  # points below which the core refuses a cloud
_FLAT = 0.2  # rise over distance up to which two points lie on one piece of the surface
# Of points sampled on six objects, from all sides and from one, with noise of 0 to 2 mm:
_OPEN = 0.15  # length of the mean normal; from all sides 0.02 at most, from one 0.35 and more
_INWARD = 0.05  # inwardness of a closed surface; -0.15 and less, of a mug, and the opposite
_HOLLOW = 0.07  # of one side; -0.03 at most, but 0.5 of a mug seen from above
_DISCORD = 0.2  # 0.09 at most; with 40 % of the normals reversed 0.47 and more
_HIDDEN = 0.25  # 0.22 at most; seen from all sides mostly more
# Of the points: on a plane, before it, and both, from which on the object seems to be on a table
_ON_GROUND, _BEFORE, _BOTH = 0.3, 0.03, 0.9
_THIN = 0.015  # half the thickness of that plane, of the cloud's radius
_PLANES = 100
_BEYOND = 1.5  # longest side of the body, in that of the cloud


def orientation_of(samples: RangeSamples) -> tuple[RangeSamples, str | None, list[str]]:
    """Return samples seen against their normals with these outward, a note if not, and doubts."""
    if len(samples) < _LEAST:
        return samples, None, []
    points, normals = samples.points, _normals(samples)
    share = discord(points, normals)
    if share > _DISCORD:
        return (
            samples,
            None,
            [
                f"the normals contradict each other: {100.0 * share:.0f} % of neighbouring ones "
                "point to opposite sides, so the outside of the surface is not known; orient them "
                "consistently, or give the position from which the cloud was seen with --viewpoint "
                "X,Y,Z"
            ],
        )
    inward = inwardness(points, normals)
    if openness(normals) <= _OPEN and inward > _INWARD:
        note = (
            f"the normals of the {counted(len(samples), 'point')} point into the object, and were "
            "reversed; save the cloud with normals that point outward"
        )
        return RangeSamples(points, -samples.directions), note, []
    if inward > _HOLLOW:
        return (
            samples,
            None,
            [
                "the normals seem to point into the object: the surface is hollow on the side to "
                "which they point, so the object is taken to be around the cloud; unless the cloud "
                "shows only the inside of a bowl or a cup, reverse the normals"
            ],
        )
    return samples, None, []


def viewpoint_doubts(samples: RangeSamples, seen: Outlook, eye: NDArray[np.float64]) -> list[str]:
    """Report what contradicts that a cloud was seen from its viewpoint."""
    if len(samples) < _LEAST:
        return []
    place = ", ".join(digits(one) for one in eye.tolist())
    doubts = []
    if hollowness(samples) > _HOLLOW:
        doubts.append(
            f"the surface is hollow towards the viewpoint ({place}), so the object is taken to be "
            "around the cloud: the viewpoint seems to be behind or within the cloud; unless the "
            "cloud shows only the inside of a bowl or a cup, give the position from which it was "
            "seen, in the cloud's own frame"
        )
    share = hidden_share(seen)
    if share > _HIDDEN:
        doubts.append(
            f"{100.0 * share:.0f} % of the points lie behind others, as seen from the viewpoint "
            f"({place}): the cloud was not seen from there alone; give the position from which it "
            "was seen, or, if it was seen from several sides, save it with normals"
        )
    return doubts


def ground_doubt(samples: RangeSamples, eye: NDArray[np.float64]) -> str | None:
    """Report a plane with much of a cloud, before which the rest lies, as on a table; else None."""
    points = samples.points
    if len(points) < _LEAST:
        return None
    queries = some_of(len(points), _PLANES)
    near, _ = nearest(points, queries, 60)
    normals = surface_normals(points, near)
    toward = ((eye - points[queries]) * normals).sum(axis=1, keepdims=True)
    normals = np.where(toward < 0.0, -normals, normals)
    heights = exact.product(points, np.ascontiguousarray(normals.T))
    heights = heights - (points[queries] * normals).sum(axis=1)
    thin = _THIN * float(exact.lengths(points - points.mean(axis=0)).max())
    on = (np.abs(heights) <= thin).mean(axis=0)
    best = int(np.argmax(on))
    before = float((heights[:, best] > 2.0 * thin).mean())
    if on[best] < _ON_GROUND or before < _BEFORE or on[best] + before < _BOTH:
        return None
    return (
        f"{100.0 * on[best]:.0f} % of the points lie on a plane, and the others before it: if that "
        "is a table, a floor or a wall, it was modelled as well; remove its points from the cloud"
    )


def extent_doubt(body: Body, samples: RangeSamples) -> str | None:
    """Report a body that extends far beyond the cloud that it was modelled from; else None."""
    in_body = exact.product(
        samples.points - np.array(body.world_from_object.translation),
        np.ascontiguousarray(body.world_from_object.matrix()[:3, :3]),
    )
    of_cloud, of_body = np.ptp(in_body, axis=0), body_sides(body)
    if float(of_body.max()) <= _BEYOND * float(of_cloud.max()):
        return None
    return (
        f"the body extends far beyond the cloud: it is {_metres(of_body)} m large, and the cloud "
        f"{_metres(of_cloud)} m; what was not seen may be wrong, or the normals or the viewpoint "
        "are: give a cloud of more sides, or the position from which it was seen with --viewpoint "
        "X,Y,Z"
    )


def _metres(sides: NDArray[np.float64]) -> str:
    return " x ".join(measured(side) for side in sides.tolist())


def _normals(samples: RangeSamples) -> NDArray[np.float64]:
    return -samples.directions / exact.lengths(samples.directions)[:, None]


def inwardness(points: NDArray[np.float64], normals: NDArray[np.float64]) -> float:
    """Return how far a surface faces its own middle, -1 to 1: -1 for a ball, 1 if inside out.

    Of a closed surface it has the sign of the enclosed volume.
    """
    offsets = points - points.mean(axis=0)
    reach = float(exact.lengths(offsets).mean())
    return -float((offsets * normals).sum(axis=1).mean()) / reach if reach > 0.0 else 0.0


def openness(normals: NDArray[np.float64]) -> float:
    """Return the length of the mean normal: 0 for a closed surface, 0.5 for half a ball."""
    return exact.norm(normals.mean(axis=0))


def discord(points: NDArray[np.float64], normals: NDArray[np.float64]) -> float:
    """Return the share of neighbours on the same piece of the surface that face the other way."""
    queries = some_of(len(points), _QUERIES)
    near, ways = nearest(points, queries, 8)
    offsets = points[near] - points[queries][:, None]
    rise = np.abs((offsets * normals[queries][:, None]).sum(axis=2))
    beside = (rise <= _FLAT * ways) & (ways > 0.0)
    against = (normals[near] * normals[queries][:, None]).sum(axis=2) < 0.0
    return float((beside & against).sum()) / max(int(beside.sum()), 1)


def hollowness(samples: RangeSamples) -> float:
    """Return the inwardness of a cloud whose surface faces its viewpoint."""
    queries = some_of(len(samples), _QUERIES)
    near, _ = nearest(samples.points, queries, 20)
    normals = surface_normals(samples.points, near)
    toward = -samples.directions[queries]
    normals = np.where((normals * toward).sum(axis=1, keepdims=True) < 0.0, -normals, normals)
    return inwardness(samples.points[queries], normals)


def hidden_share(seen: Outlook) -> float:
    """Return the share of a cloud's points that lie behind others, as seen from its viewpoint."""
    queries = some_of(len(seen.depths), _QUERIES)
    near, ways = nearest(seen.image_points, queries, 12)
    nearby = ways <= 1.5 * seen.spacing
    ahead = seen.depths[queries][:, None] - seen.depths[near]
    across = float(np.ptp(seen.image_points, axis=0).max()) * float(seen.depths.mean())
    behind = ahead > 0.15 * (float(np.ptp(seen.depths)) + across)
    return float((nearby & behind).any(axis=1).mean())
