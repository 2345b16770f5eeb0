"""Outlines of several keyframes tell how an object without print turned, whose shape is a guess."""

from pathlib import Path

import numpy as np
import pytest
from trust_scenes import SMALL, write_course
from trust_verdicts import Verdicts, verdicts

from servoid.capture import open_capture
from servoid.exchange.shapes.mesh_file import read_mesh
from servoid.record import read_trajectory
from servoid.track import Request, track_capture


def plain_sway(folder: Path, seed: int, *, adjusted: bool) -> Verdicts:
    """Track a plain object that sways after one look, and judge all poses."""
    request = Request(seed=seed, adjust_outlines=adjusted)
    tracked = list(track_capture(open_capture(folder), None, request)[0].tracked)
    truth = read_trajectory(folder / "truth" / "left_from_object.csv")
    vertices = read_mesh(folder / "truth" / "mesh.obj").vertices
    return verdicts(tracked, [one.world_from_object for one in truth], vertices)


@pytest.mark.parametrize("seed", [1, 3])
def test_outlines_of_several_sides_turn_a_plain_object_as_it_turned(
    seed: int, tmp_path: Path
) -> None:
    write_course(tmp_path / "sway", "plain", seed, SMALL)
    alone, together = (
        plain_sway(tmp_path / "sway", seed, adjusted=adjusted) for adjusted in (False, True)
    )
    assert np.median(together.turn) < 0.6 * np.median(alone.turn)
    assert together.wrong.mean() < 0.1
    # Of what looks the same all around they make up a spin: so the status is not theirs to tell.
    assert not together.trusted_wrong.any()
