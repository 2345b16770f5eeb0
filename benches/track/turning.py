"""Rotate objects fully before the tracker, and measure the drift.

Drawn objects with print rotate evenly, 6 degrees per image, while they move before two cameras of
640 x 480 pixels; the bleach bottle of the research recordings rotates once around and back. A body
is modelled from the first mask and evolves during tracking; nothing else is given. Tables: the
error by the angle turned since the start; ten turns, and the error at the end of each; bodies of
the same turn played forwards and backwards; the same images, with a known body, interpreted as a
static object around which the cameras move. `--long` then plays a turn back and forth, 10,000
images, and reports the growth of resident memory. Missing recordings are skipped.

Run it with: python benches/track/turning.py [--seeds N] [--long] [OBJECT ...]
"""

import argparse
import itertools
import multiprocessing
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sequences import Recording, Table, recordings
from servoid.cli.progress import progress_bar
from servoid.pose.exact import Floats
from servoid.source import Instant
from servoid.track import Tracked
from track_speed import LONG_IMAGES, LONG_ROWS, to_and_fro

sys.path.extend(
    str(Path(__file__).resolve().parents[2] / part)
    for part in ("tests", "tests/fixtures", "tests/fixtures/shape", "tests/scenes")
)

from resident_memory import resident_mb
from trust_scenes import PRINTED
from trust_verdicts import Verdicts, verdicts
from turning_bodies import Likeness, in_object, like, like_object
from turning_scenes import (
    PER_TURN,
    Turning,
    apart,
    deviations,
    elsewhere,
    followed,
    left_from_objects,
)

OBJECTS = ("bottle", "mug", "drill")
SEEDS, TURNS, BIN_DEG = 2, 10, 30
BLEACH = "hard/bleach_turn"


@dataclass(frozen=True, eq=False)
class Track:
    """The estimates in the images after the first, (N,), and the truth.

    `spread` (N, 2) are the reported standard deviations, in metres and radians.
    """

    found: Verdicts
    spread: Floats

    @classmethod
    def of(cls, tracked: Sequence[Tracked], found: Verdicts) -> "Track":
        """Return a track with its verdicts."""
        return cls(found, deviations(tracked)[1:])

    @cached_property
    def numbers(self) -> Floats:
        """Return ADD in mm, degrees, and the standard deviations in mm and degrees, (N, 4)."""
        errors = np.stack([self.found.add, self.found.turn], axis=1)
        return np.concatenate([errors, self.spread], axis=1) * np.tile([1e3, 180.0 / np.pi], 2)


@dataclass(frozen=True, eq=False)
class Course:
    """The results for one object with one seed.

    `bodies` are compared with the object, except the last ones, which are compared with each other.
    `still` and `around` are tracks of the first turn with a known body, with static eyes and with
    eyes that move around the object; `camera_apart` (N, 2) is the difference of their poses in the
    left eye, in metres and radians.
    """

    name: str
    seed: int
    turns: Track
    back: Track
    bodies: dict[str, Likeness]
    still: Track
    around: Track
    camera_apart: Floats


def arguments() -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("object", nargs="*", default=list(OBJECTS), help="drawn objects")
    parser.add_argument("--seeds", type=int, default=SEEDS, help=f"how many (default {SEEDS})")
    parser.add_argument("--long", action="store_true", help="track 10,000 images too")
    given = parser.parse_args()
    for name in given.object:
        if name not in PRINTED:
            parser.error(f"no object with print is '{name}'; there are: {', '.join(PRINTED)}")
    if given.seeds < 1:
        parser.error(f"{given.seeds} seeds tell nothing; give 1 or more")
    return given


def course_of(name: str, seed: int) -> Course:
    """Turn an object ten times, then its first turn backwards and with eyes moving around it."""
    turning = Turning(name, seed, TURNS * PER_TURN + 1)
    shown = list(turning.instants(range(PER_TURN + 1)))
    one = turning.begin()
    later = turning.instants(range(PER_TURN + 1, turning.images))
    track = followed(one, itertools.chain(shown[1:], later))
    first_turn = list(itertools.islice(track, PER_TURN + 1))
    forwards = in_object(turning, one)
    tracked = [*first_turn, *track]

    other = turning.begin(PER_TURN)
    back = list(followed(other, shown[-2::-1]))
    backwards = in_object(turning, other)

    still, around, camera_apart = seen_from_around(turning, shown)
    return Course(
        name=name,
        seed=seed,
        turns=Track.of(tracked, turning.judge(tracked)),
        back=Track.of(back, turning.judge(back)),
        bodies={
            "first look and object": like_object(in_object(turning, one, one.initial), name),
            "forwards and object": like_object(forwards, name),
            "backwards and object": like_object(backwards, name),
            "forwards and backwards": like(forwards, backwards),
        },
        still=still,
        around=around,
        camera_apart=camera_apart,
    )


def seen_from_around(turning: Turning, shown: list[Instant]) -> tuple[Track, Track, Floats]:
    """Track images as of an object that turns and of one that eyes move around, with a known body.

    Returns both tracks, and the difference of their poses in the left eye, (N, 2).
    """
    moved = elsewhere(shown, turning.at_rest)
    runs = [
        list(followed(turning.begin(known=True), one[1:], evolves=False)) for one in (shown, moved)
    ]
    poses = [left_from_objects(*one) for one in zip(runs, (shown, moved), strict=True)]
    tracks = [
        Track.of(run, turning.judge(run, at_rest=rests))
        for run, rests in zip(runs, (False, True), strict=True)
    ]
    return tracks[0], tracks[1], apart(*poses)[1:]


def courses(given: argparse.Namespace) -> list[Course]:
    """Turn all objects with all seeds."""
    runs = [(name, seed) for name in given.object for seed in range(given.seeds)]
    found = []
    with progress_bar("turning") as update:
        for done, (name, seed) in enumerate(runs):
            update(done / len(runs), f"{name}, seed {seed}")
            found.append(course_of(name, seed))
    return found


def turned_deg(recording: Recording) -> Floats:
    """Return the angle by which an object has turned up to each image after the first, (N,)."""
    poses = [one for one in recording.true_poses if one is not None]
    steps = apart(poses[:-1], poses[1:])[:, 1]
    return np.degrees(np.cumsum(steps))


def bleach_tracks(recording: Recording, seeds: int) -> list[Track]:
    """Track the object of a recording from only its first mask."""
    tracks = []
    for seed in range(seeds):
        tracked = recording.track(seed=seed).tracked
        found = verdicts(tracked, recording.true_poses, recording.vertices)
        tracks.append(Track.of(tracked, found))
    return tracks


def print_angles(found: list[Course], seeds: int) -> None:
    """Print the pose errors by the angle turned since the start, in steps of 30 degrees."""
    table = Table(
        *("sequence    ", "turned deg", "images", "tracked %", "ADD median", "worst mm"),
        *("degrees median", "worst ", "sd mm ", "sd degrees"),
    )
    for recording in recordings([BLEACH]):
        tracks = bleach_tracks(recording, seeds)
        print_bins(table, recording.name, tracks, turned_deg(recording))
    for name in dict.fromkeys(one.name for one in found):
        tracks = [one.turns for one in found if one.name == name]
        angles = 360.0 / PER_TURN * tracks[0].found.index
        print_bins(table, f"drawn {name}", tracks, np.where(angles <= 360.0, angles, np.inf))


def print_bins(table: Table, name: str, tracks: list[Track], angles: Floats) -> None:
    """Print a row for each step of an angle (N,)."""
    steps = np.ceil(angles / BIN_DEG - 1e-6) - 1.0
    for step in sorted({int(one) for one in steps if np.isfinite(one)}):
        chosen = steps == step
        numbers = np.concatenate([one.numbers[chosen] for one in tracks])
        tracking = np.concatenate([one.found.tracking[chosen] for one in tracks])
        label = f"{step * BIN_DEG} to {(step + 1) * BIN_DEG}"
        table.row(name, label, len(numbers), percent(tracking), *medians_and_worst(numbers))


def medians_and_worst(numbers: Floats) -> tuple[float, ...]:
    """Return medians and the worst of errors (N, 4), and the medians of the reported deviations."""
    middle, worst = np.median(numbers, axis=0), numbers.max(axis=0)
    return tuple(map(float, (middle[0], worst[0], middle[1], worst[1], middle[2], middle[3])))


def percent(chosen: NDArray[np.bool_]) -> float:
    """Return the percentage that is chosen."""
    return 100.0 * float(np.mean(chosen))


def print_turns(found: list[Course]) -> None:
    """Print the error at the end of each turn, with the estimates and the truth in it."""
    table = Table(
        *("object      ", "turn", "images", "tracked %", "wrong %", "ADD median", "worst mm"),
        *("degrees median", "worst ", "sd mm ", "sd degrees", "ADD at end", "worst mm"),
        *("degrees at end", "worst "),
    )
    for name, turn in itertools.product(dict.fromkeys(one.name for one in found), range(TURNS)):
        part = slice(turn * PER_TURN, (turn + 1) * PER_TURN)
        tracks = [one.turns for one in found if one.name == name]
        numbers = np.concatenate([one.numbers[part] for one in tracks])
        ends = np.array([one.numbers[part][-1] for one in tracks])
        table.row(
            *(name, turn + 1, len(numbers)),
            *(percent(np.concatenate([one.found.tracking[part] for one in tracks])),),
            *(percent(np.concatenate([one.found.trusted_wrong[part] for one in tracks])),),
            *(*medians_and_worst(numbers), *medians_and_worst(ends)[:4]),
        )


def print_bodies(found: list[Course]) -> None:
    """Print how similar bodies are for a turn that was played forwards and backwards."""
    table = Table(
        *("object      ", "seed", "compared               ", "volume IoU", "silhouette IoU"),
        *("tracked %", "degrees worst"),
    )
    for one in found:
        runs = {"forwards and object": one.turns, "backwards and object": one.back}
        for compared, shares in one.bodies.items():
            run, results = runs.get(compared), ("", "")
            if run is not None:
                results = (
                    percent(run.found.tracking[:PER_TURN]),
                    float(run.numbers[:PER_TURN, 1].max()),
                )
            table.row(one.name, one.seed, compared, shares.volume, shares.silhouette, *results)


def print_camera(found: list[Course]) -> None:
    """Print how far poses differ between an object that turns and eyes that move around it."""
    table = Table(
        *("object      ", "seed", "who moves ", "images", "tracked %", "wrong %", "ADD median"),
        *("worst mm", "degrees median", "worst ", "apart, median mm", "worst "),
        *("degrees median", "worst "),
    )
    for one in found:
        gaps = one.camera_apart * (1e3, 180.0 / np.pi)
        gaps = (*np.median(gaps, axis=0).tolist(), *gaps.max(axis=0).tolist())
        for mover, track in (("the object", one.still), ("the eyes", one.around)):
            table.row(
                *(one.name, one.seed, mover, len(track.numbers), percent(track.found.tracking)),
                percent(track.found.trusted_wrong),
                *medians_and_worst(track.numbers)[:4],
                *((gaps[0], gaps[2], gaps[1], gaps[3]) if mover == "the eyes" else ("",) * 4),
            )


def measure_memory(name: str) -> None:
    """Track a turn back and forth while the body evolves, and print what this process keeps."""
    table = Table(
        *("object      ", "images", "tracked %", "ellipsoids", "points", "look kB"),
        *("resident MB", "growth MB"),
    )
    turning = Turning(name, 0, PER_TURN + 1)
    shown = list(turning.instants())
    one, count, first_mb = turning.begin(), 0, 0.0
    for done, tracked in enumerate(followed(one, itertools.islice(to_and_fro(shown), LONG_IMAGES))):
        count += tracked.is_tracked
        if done in LONG_ROWS:
            now_mb, look = resident_mb(), one.appearance() or b""
            first_mb = first_mb or now_mb
            table.row(
                *(name, done, 100.0 * count / (done + 1), len(one.body), len(one.surface[0])),
                *(len(look) / 1e3, now_mb, now_mb - first_mb),
            )


def main() -> None:
    """Print the tables."""
    given = arguments()
    found = courses(given)
    print_angles(found, given.seeds)
    for print_table in (print_turns, print_bodies, print_camera):
        print()
        print_table(found)
    for name in given.object if given.long else ():
        print(flush=True)
        # In a process of its own, so that memory left by other steps does not count.
        process = multiprocessing.get_context("spawn").Process(target=measure_memory, args=(name,))
        process.start()
        process.join()


if __name__ == "__main__":
    main()
