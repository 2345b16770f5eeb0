"""Laws of the frame that the body of a mesh has, by the command line."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from recordings import Recording, pose_text, run_servoid

from servoid.pose import Pose
from servoid.record import read_trajectory
from servoid.shape import load_body

trimesh = pytest.importorskip("trimesh")
# The mesh's frame: far from the toy, and askew.
MESH_FROM_TOY = np.array(
    [[0.0, -1.0, 0.0, 0.3], [0.0, 0.0, -1.0, -0.2], [1.0, 0.0, 0.0, 0.1], [0.0, 0.0, 0.0, 1.0]]
)
MOST_M, MOST_RAD = 0.005, np.radians(4.0)


def test_a_start_in_a_meshs_frame_is_right_as_the_command_says_it_must_be_given(
    tmp_path: Path, recording: Callable[[str], Recording]
) -> None:
    seen = recording("colour")
    # What is drawn is open where its parts meet; its hull is closed.
    mesh = trimesh.load(seen.folder / "truth" / "mesh.obj", force="mesh").convex_hull
    mesh.apply_transform(MESH_FROM_TOY)
    mesh.export(tmp_path / "toy.ply")
    output = run_servoid(
        tmp_path, "model", "toy.ply", "--out", "toy.json", "--max-ellipsoids", 3, "--delta", 0
    )
    assert "the body has a frame of its own, not the mesh's" in " ".join(output.split())
    assert "world_from_mesh * mesh_from_object" in " ".join(output.split())
    mesh_from_object = load_body(tmp_path / "toy.json").body().world_from_object
    world_from_mesh = Pose(seen.truth(0) @ np.linalg.inv(MESH_FROM_TOY))
    start = pose_text(world_from_mesh @ mesh_from_object)
    options = ("--body", "toy.json", "--start", start, "--observations", ":12")
    run_servoid(tmp_path, "track", seen.folder, *options)
    for point in read_trajectory(tmp_path / "poses.csv"):
        world_from_toy = (
            point.world_from_object.matrix()
            @ np.linalg.inv(mesh_from_object.matrix())
            @ MESH_FROM_TOY
        )
        off = Pose(np.linalg.inv(seen.truth(point.observation or 0)) @ world_from_toy).log()
        assert np.linalg.norm(off[:3]) < MOST_M, point
        assert np.linalg.norm(off[3:]) < MOST_RAD, point
        assert point.status == "tracking"
