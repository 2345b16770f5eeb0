"""The collision shapes of an arm and its room, and the distances between them."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid.pose import Floats, exact
from servoid.servo import Clearances
from servoid.sim.world.arms.kinematics import Kinematics
from servoid.sim.world.events.motions import unit_row
from servoid.sim.world.scene.engine import load_mujoco
from servoid.sim.world.scene.visuals import ROOM, Box, Capsule, Cylinder, Ellipsoid, Plane, Visual

_THIN = 0.005  # m: thinner shapes lie on others and are ignored
_NEIGHBOURS = 0.03  # m: parts nearer than this at the start count as joined
_IN_ROOM, _IN_ARM = 0.002, 0.02  # m: how deep parts may intersect; those of a wrist are crowded
_POSTURES = 200  # in which it is sought whether parts come apart


def add_solids(spec: Any, visuals: Iterable[Visual]) -> None:
    """Add the collision shapes of visuals on bodies or in the room to a `mujoco.MjSpec`."""
    for visual in visuals:
        carrier = spec.worldbody if visual.carrier == ROOM else spec.body(visual.carrier)
        shape = shape_of(visual)
        if carrier is None or shape is None:
            continue
        kind, size = shape
        row = unit_row(tuple(visual.carrier_from_visual))
        carrier.add_geom(type=kind, size=size, pos=row[4:].tolist(), quat=row[:4].tolist())


def shape_of(visual: Visual) -> tuple[Any, list[float]] | None:
    """Return the kind and size of a geom, None if it is not solid or too complex."""
    kinds = load_mujoco().mjtGeom
    match visual.shape:
        case Ellipsoid(radii):
            return kinds.mjGEOM_ELLIPSOID, list(radii)
        case Capsule(radius, half):
            return kinds.mjGEOM_CAPSULE, [radius, half, 0.0]
        case Cylinder(radius, half) if half > _THIN:
            return kinds.mjGEOM_CYLINDER, [radius, half, 0.0]
        case Box(half_size):
            return kinds.mjGEOM_BOX, list(half_size)
        case Plane((width, height)):
            return kinds.mjGEOM_PLANE, [width, height, 0.1]
        case _:
            return None


class Solids:
    """Computes distances between parts of an arm and its room.

    Parts that the hand's joints do not move relative to each other, links of the same joint, and
    parts that nearly touch at the start are neighbours, whose distance is not monitored. Those that
    intersect at the start, and not in every posture, are `intersecting`: the numbers of two geoms,
    and the depth in m.
    """

    def __init__(self, model: Any, kinematics: Kinematics, start: Floats) -> None:
        self._mujoco = load_mujoco()
        self._model, self._kinematics = model, kinematics
        self._data = self._mujoco.MjData(model)
        self._radii = np.array(model.geom_rbound)
        self._bodies: list[int] = model.geom_bodyid.tolist()
        self._flat = np.array(model.geom_type) == self._mujoco.mjtGeom.mjGEOM_PLANE
        self._pairs = np.array(list(self._possible()), np.int64).reshape(-1, 2)
        moved = self._ranks()[model.geom_bodyid] > 0
        self.of_arm: list[int] = [one for one in self._solid() if moved[one]]
        self._place(start)
        distances = [self._distance(one, other, _NEIGHBOURS)[0] for one, other in self._pairs]
        deep = [
            (int(one), int(other), -distance)
            for (one, other), distance in zip(self._pairs, distances, strict=True)
            if distance < -(_IN_ARM if moved[[one, other]].all() else _IN_ROOM)
        ]
        self.intersecting: list[tuple[int, int, float]] = self._parting(deep)
        near = [distance < _NEIGHBOURS for distance in distances]
        self._pairs = self._pairs[~np.array(near, np.bool_)]
        self._pairs = np.where(self._flat[self._pairs[:, 1:]], self._pairs[:, ::-1], self._pairs)

    @property
    def pairs(self) -> NDArray[np.int64]:
        """Return the numbers of the monitored geoms, (P, 2)."""
        return self._pairs

    def clearances(self, positions: Floats, within: float) -> Clearances:
        """Return the distances of parts that are at most `within` from each other.

        `positions` are those of all N joints.
        """
        self._place(positions)
        near: list[tuple[tuple[int, int], float, Floats]] = []
        for one, other in self._pairs[self._near(within)].tolist():
            distance, ends = self._distance(one, other, within)
            if distance < within:
                near.append(((one, other), distance, ends))
        if not near:
            return Clearances(np.empty(0), np.empty((0, len(self._kinematics.speeds))))
        pairs, distances, ends = zip(*near, strict=True)
        return Clearances(np.array(distances), self._slopes(pairs, distances, np.array(ends)))

    def _possible(self) -> Iterable[tuple[int, int]]:
        """Yield the pairs of geoms that could collide."""
        solid, rank = self._solid(), self._ranks()
        for place, one in enumerate(solid):
            for other in solid[place + 1 :]:
                a, b = sorted(rank[self._model.geom_bodyid[[one, other]]].tolist())
                # Parts of the room, and links of the same joint.
                if a != b and (a == 0 or b - a > 1):
                    yield one, other

    def _parting(self, pairs: list[tuple[int, int, float]]) -> list[tuple[int, int, float]]:
        """Return those of intersecting geoms that are apart in another posture.

        Others, such as a joint's drum in its base, are drawn inside each other.
        """
        if not pairs:
            return []
        random, joints = np.random.default_rng(0), self._kinematics.joints
        parted: set[tuple[int, int]] = set()
        for _ in range(_POSTURES):
            self._place(random.uniform(joints.lower, joints.upper))
            parted |= {(a, b) for a, b, _ in pairs if self._distance(a, b, _IN_ROOM)[0] > 0.0}
        return [pair for pair in pairs if pair[:2] in parted]

    def _ranks(self) -> NDArray[np.int64]:
        """Return how many of the hand's joints move each body, (B,)."""
        model, count = self._model, self._kinematics.joints.hand_count
        moved = {int(model.dof_bodyid[dof]) for dof in self._kinematics.speeds[:count]}
        ranks = np.zeros(model.nbody, np.int64)
        for body in range(1, model.nbody):
            ranks[body] = ranks[model.body_parentid[body]] + (body in moved)
        return ranks

    def _solid(self) -> list[int]:
        """Return the collision geoms: those marked as such, otherwise all of a body."""
        model = self._model
        hits = (model.geom_contype | model.geom_conaffinity) != 0
        with_collisions = set(model.geom_bodyid[hits].tolist())
        return [
            index
            for index in range(model.ngeom)
            if hits[index] or int(model.geom_bodyid[index]) not in with_collisions
        ]

    def _place(self, positions: Floats) -> None:
        self._data.qpos[self._kinematics.places] = positions
        self._mujoco.mj_kinematics(self._model, self._data)
        self._mujoco.mj_comPos(self._model, self._data)

    def _near(self, within: float) -> NDArray[np.bool_]:
        """Return for which pairs (P,) the bounding balls are near each other."""
        one, other = self._pairs.T
        centers = self._data.geom_xpos
        way = centers[other] - centers[one]
        square = (way * way).sum(axis=1)
        # For a plane, the distance along its normal counts; the room is the first of a pair.
        across = (self._data.geom_xmat[one, 2::3] * way).sum(axis=1)
        square = np.where(self._flat[one], across * across, square)
        return square < np.square(self._radii[one] + self._radii[other] + within)

    def _distance(self, one: int, other: int, within: float) -> tuple[float, Floats]:
        """Return the distance of two geoms, and its end points (2, 3)."""
        ends = np.zeros(6)
        distance = self._mujoco.mj_geomDistance(self._model, self._data, one, other, within, ends)
        return float(distance), ends.reshape(2, 3)

    def _slopes(
        self, pairs: Sequence[tuple[int, int]], distances: Sequence[float], ends: Floats
    ) -> Floats:
        """Return the gradients (K, N) by the joints of K distances between points, (K, 2, 3)."""
        moves = np.empty((len(pairs), 2, 3, self._model.nv))
        for pair, points, by_joints in zip(pairs, ends, moves, strict=True):
            for geom, point, rows in zip(pair, points, by_joints, strict=True):
                body = self._bodies[geom]
                self._mujoco.mj_jac(self._model, self._data, rows, None, point, body)
        ways = ends[:, 1] - ends[:, 0]
        lengths = exact.lengths(ways)
        lengths[lengths == 0.0] = np.inf  # of points in contact, no direction is known
        normals = np.copysign(1.0, distances)[:, None] * ways / lengths[:, None]
        # At once for all, with sums in the order of the axes.
        x, y, z = normals.T[:, :, None, None]
        speeds = x * moves[:, :, 0] + y * moves[:, :, 1] + z * moves[:, :, 2]
        return (speeds[:, 1] - speeds[:, 0])[:, self._kinematics.speeds]
