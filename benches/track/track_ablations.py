"""Track with parts of the tracker removed or replaced, and score the tracks.

The variants: the paper's genetic algorithm with its points term and with areas; the tracker without
surface points, without colours, without local colours, without a body that evolves, and with other
numbers of hypotheses. All start from the first observation alone. One table per recording, one row
per variant, and every 3rd image of the first recording once more, where the search is harder. The
paper's body does not evolve. Missing recordings are skipped.
"""

from collections.abc import Sequence
from typing import Any

from sequences import STEREO, Recording, Table, recordings
from servoid._native import OneStepSettings, OneStepTracker
from servoid.camera import Camera
from servoid.shape import Body
from servoid.track.follower import Follower, Maker


def one_step(**settings: Any) -> Maker:
    """Return a maker of the paper's tracker with some settings."""

    def make(cameras: Sequence[Camera], body: Body, options: dict[str, Any]) -> Follower:
        del options  # those of the tracker proper
        return OneStepTracker(cameras, body, OneStepSettings(**settings))

    return make


VARIANTS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("paper: points, place alone", {"maker": one_step(turns=False)}),
    ("paper: points", {"maker": one_step()}),
    ("paper: areas instead", {"maker": one_step(region=True)}),
    ("colours alone, global", {"surface": False, "local_colors": False}),
    ("colours alone, local", {"surface": False}),
    ("surface alone", {"region": False}),
    ("both, colours global", {"local_colors": False}),
    ("both: the tracker", {}),
    ("body stays as it is", {"evolve": False}),
    ("2 generations an image", {"generations": 2}),
    ("4 generations an image", {"generations": 4}),
    ("population of 8", {"population": 8}),
    ("population of 64", {"population": 64}),
)


def compare(recording: Recording, every: int) -> None:
    """Print one row per variant."""
    table = Table(
        *("sequence    ", "every", "variant                   ", "lost", "ADD median", "p95 mm"),
        *("degrees median", "p95  ", "ms median", "p99  ", "scores"),
    )
    for variant, options in VARIANTS:
        result = recording.track(every=every, **options)
        score = recording.score(result)
        table.row(
            *(recording.name, every, variant, score.lost, score.add, score.add_95),
            *(score.turn, score.turn_95, 1000.0 * result.step_percentile(50)),
            *(1000.0 * result.step_percentile(99), round(result.evaluations)),
        )
    print()


def main() -> None:
    """Print one table per recording."""
    for number, recording in enumerate(recordings(STEREO)):
        compare(recording, every=1)
        if number == 0:
            compare(recording, every=3)


if __name__ == "__main__":
    main()
