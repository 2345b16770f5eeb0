"""Computes the poses of all visuals of a world at a time."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from servoid.pose import Floats, exact
from servoid.sim.world.arms.kinematics import Kinematics
from servoid.sim.world.events.motions import STILL, compose, row_of
from servoid.sim.world.events.timeline import Timeline
from servoid.sim.world.scene.visuals import BOARD, OBJECT, ROOM, Visual


class Layout:
    """Computes poses of visuals from the joint angles and the time."""

    def __init__(
        self,
        visuals: Sequence[Visual],
        model: Any,
        kinematics: Kinematics,
        timeline: Timeline,
    ) -> None:
        self._kinematics, self._timeline = kinematics, timeline
        self._carried = np.array([visual.carrier_from_visual for visual in visuals], float)
        self._carried[:, :4] /= exact.lengths(self._carried[:, :4])[:, None]
        bodies = model.nbody
        own = {ROOM: bodies, OBJECT: bodies + 1, BOARD: bodies + 2}
        self._carriers = np.array(
            [
                own[visual.carrier] if visual.carrier in own else model.body(visual.carrier).id
                for visual in visuals
            ]
        )

    def world_from_visuals(self, positions: Floats, time_s: float) -> Floats:
        """Return the poses (T, 7) of all visuals with the joints at these angles (N,)."""
        carriers = np.concatenate(
            [
                self._kinematics.bodies(positions),
                np.array([STILL]),
                row_of(self._timeline.world_from_object_at(time_s))[None],
                self._timeline.board_at(time_s)[None],
            ]
        )
        return compose(carriers[self._carriers], self._carried)
