"""Opens the recordings beside the repository, tracks their objects, and scores the tracks.

Used by the scripts beside it. The scorer is a separate program, which reads the files independently
and compares motions since the first image, so that no frame is shared.
"""

import csv
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from servoid import model
from servoid.capture import Capture
from servoid.exchange import open_any
from servoid.model import fit_range_samples, range_samples_of_cloud
from servoid.pose import Pose
from servoid.record import waypoints, write_trajectory
from servoid.shape import Body
from servoid.source import Instant
from servoid.source.instants import poses_of
from servoid.track import Request, Subject, TrackResult, read_instants, track_capture

SHARED = Path(__file__).resolve().parents[3] / "shared"
SCORER = SHARED / "tools" / "score_track.py"
STEREO = ("stereo/mustard", "stereo/drill", "stereo/mustard_hand", "stereo/teabox")
MONO = ("mono/dragon_red",)
HARD = ("hard/bleach_turn", "hard/mug_sway", "hard/mustard_half", "hard/sugar_jump")
REAL = ("real/cube_hand",)  # of one camera
SURFACE_POINTS = 8000

_LINE = re.compile(
    r"lost (?P<lost>\d+); ADD mm median (?P<add>\S+) p95 (?P<add_95>\S+); .*"
    r"rotation deg median (?P<turn>\S+) p95 (?P<turn_95>\S+); "
    r"translation mm median (?P<place>\S+); "
    r"ADD<0.1d (?P<within_tenth>\S+)%; 5cm5deg (?P<within_5>\S+)%"
)


@dataclass(frozen=True)
class Score:
    """The scorer's figures for a track: mm, degrees and per cent; medians without `_95`."""

    lost: int
    add: float
    add_95: float
    turn: float
    turn_95: float
    place: float
    within_tenth: float
    within_5: float


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording with ground truth of its object."""

    name: str
    folder: Path
    capture: Capture

    @cached_property
    def _truth(self) -> list[dict[str, str]]:
        (path,) = (self.folder / "truth").glob("*_from_object.csv")
        with path.open() as file:
            return list(csv.DictReader(file))

    def left_from_mesh(self, index: int) -> Pose:
        """Return the true pose of the mesh in the left camera."""
        row = self._truth[index]
        place = [float(row[key]) for key in ("x", "y", "z")]
        return Pose.from_parts(place, [float(row[key]) for key in ("qw", "qx", "qy", "qz")])

    def world_from_mesh(self, index: int) -> Pose:
        """Return the true pose of the mesh in the world."""
        instant = next(self.instants([index]))
        return instant.world_from_camera[0] @ self.left_from_mesh(index)

    @cached_property
    def true_poses(self) -> list[Pose | None]:
        """Return world_from_mesh of each observation, None where the truth is unknown."""
        return [
            poses_of(self.capture, one)[0] @ self.left_from_mesh(one.index)
            if self._truth[one.index].get("valid", "1") == "1"
            else None
            for one in self.capture.observations()
        ]

    def instants(self, indices: Iterable[int] | None = None) -> Iterator[Instant]:
        """Read observations, all of them or those of some indices."""
        observations = self.capture.observations()
        chosen = range(len(observations)) if indices is None else indices
        return read_instants(self.capture, [observations[index] for index in chosen])

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        """Return the true mesh's vertices, (N, 3)."""
        lines = (self.folder / "truth" / "mesh.obj").read_text().splitlines()
        return np.array([line.split()[1:4] for line in lines if line.startswith("v ")], float)

    @property
    def distance_m(self) -> float | None:
        """Return the object's initial distance, an input for one camera without depth."""
        first, *others = self.capture.cameras
        if others or any(first.depth_paths):
            return None
        middle = (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2.0
        return float(self.left_from_mesh(0).transform(middle[None])[0, 2])

    @cached_property
    def many_view_body(self) -> Body:
        """Model eight ellipsoids from points all over the true surface, in the mesh's frame."""
        import trimesh

        mesh = trimesh.load_mesh(self.folder / "truth" / "mesh.obj", process=True)
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
        points, faces, *_ = trimesh.sample.sample_surface(mesh, SURFACE_POINTS, seed=1)
        cloud = range_samples_of_cloud(
            np.asarray(points), np.asarray(mesh.face_normals[faces]), None
        )
        return fit_range_samples(cloud, model.Request(max_ellipsoids=8)).body

    def many_views(self) -> Subject:
        """Return the object with its many-view body at its true first pose."""
        body = self.many_view_body
        start = self.world_from_mesh(0) @ body.world_from_object
        return Subject(body=body, start=start, known_shape=True)

    def track(self, subject: Subject | None = None, **options: Any) -> TrackResult:
        """Track the object, by default with a body from the first observation alone."""
        distance_m = self.distance_m if subject is None else None
        request = Request(distance_m=distance_m, **options)
        return track_capture(self.capture, [subject or Subject()], request)[0]

    def score(
        self, result: TrackResult, only: Collection[int] | None = None, *, trusting: bool = False
    ) -> Score:
        """Score a track, in all its observations or in some of them.

        `trusting` scores every pose, even one that the tracker does not trust.
        """
        kept = [one for one in result.tracked if only is None or one.index in {0, *only}]
        points = waypoints(kept)
        if trusting:
            points = [replace(point, status="tracking") for point in points]
        with tempfile.TemporaryDirectory() as name:
            work = Path(name)
            write_trajectory(work / "estimates.csv", points)
            (work / "truth").mkdir()
            for path in self.folder.iterdir():
                if path.is_file():
                    shutil.copy(path, work)
            shutil.copy(self.folder / "truth" / "mesh.obj", work / "truth")
            lines = (self.folder / "truth" / "left_from_object.csv").read_text().splitlines()
            chosen = [lines[0], *(lines[1 + one.index] for one in kept)]
            (work / "truth" / "left_from_object.csv").write_text("\n".join(chosen) + "\n")
            command = [sys.executable, str(SCORER), str(work / "estimates.csv"), str(work)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
        found = _LINE.search(done.stdout)
        if found is None:
            sys.exit(f"the scorer wrote what this script does not read: {done.stdout}")
        values = found.groupdict()
        return Score(
            lost=int(values.pop("lost")), **{key: float(one) for key, one in values.items()}
        )


def recordings(names: Iterable[str]) -> Iterator[Recording]:
    """Open the recordings that are present, and report which are not."""
    if not SCORER.is_file():
        print(f"skipped: there is no {SCORER.name} in shared/tools beside the repository")
        return
    if find_spec("trimesh") is None:
        print("skipped: many-view bodies are made with trimesh; pip install trimesh")
        return
    for name in names:
        folder = SHARED / "data" / name
        if folder.is_dir():
            yield Recording(folder.name, folder, open_any(folder))
        else:
            print(f"{folder.name} skipped: not in shared/data beside the repository")


class Table:
    """Prints rows as they become known, in columns as wide as their titles."""

    def __init__(self, *titles: str) -> None:
        self._widths = [len(title) for title in titles]
        print("  ".join(titles).rstrip(), flush=True)

    def row(self, *cells: str | float) -> None:
        """Print a row: text left-aligned, numbers right-aligned."""
        texts = []
        for cell, width in zip(cells, self._widths, strict=True):
            shown = f"{cell:.2f}" if isinstance(cell, float) else str(cell)
            texts.append(shown.ljust(width) if isinstance(cell, str) else shown.rjust(width))
        print("  ".join(texts).rstrip(), flush=True)


def shares(stages: dict[str, float]) -> str:
    """Return the share of each stage in a step, in per cent."""
    total = sum(stages.values())
    return ", ".join(
        f"{name} {100.0 * spent / total:.0f}" for name, spent in stages.items() if spent > 0.0
    )
