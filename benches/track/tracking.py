"""Track the research recordings beside the repository, and score the tracks.

First table: all recordings, with a body from the first observation alone that evolves, and with a
body from many views that starts at the true pose. `Lost` counts observations that are not tracked;
ADD is the mean distance of the true mesh's vertices, moved by the estimated and by the true motion
since the first image. Second table: every 1st to 4th image, which multiplies the motion between
images. Missing recordings are skipped.
"""

from sequences import MONO, STEREO, Table, recordings, shares
from servoid.track import TrackResult

EVERY = (1, 2, 3, 4)


def milliseconds(result: TrackResult) -> list[float]:
    """Return median, 95th and 99th percentile of the time of a step."""
    return [1000.0 * result.step_percentile(percent) for percent in (50, 95, 99)]


def compare_bodies() -> None:
    """Print one row per recording and body."""
    table = Table(
        *("sequence    ", "body      ", "images", "lost", "ADD median", "p95 mm"),
        *("degrees median", "p95  ", "ms median", "p95  ", "p99  ", "% of a step"),
    )
    for recording in recordings((*STEREO, *MONO)):
        for body, subject in (("first look", None), ("many views", recording.many_views())):
            result = recording.track(subject)
            score = recording.score(result)
            table.row(
                *(recording.name, body, len(result), score.lost, score.add, score.add_95),
                *(score.turn, score.turn_95, *milliseconds(result)),
                shares(result.stage_seconds),
            )


def compare_motion() -> None:
    """Print one row per recording, body and stride."""
    table = Table(
        *("sequence    ", "body      ", "every", "images", "lost", "ADD median", "p95 mm"),
        *("ADD < 0.1 d %", "5 cm 5 deg %"),
    )
    for recording in recordings(STEREO[:2]):
        for body, subject in (("first look", None), ("many views", recording.many_views())):
            for every in EVERY:
                result = recording.track(subject, every=every)
                score = recording.score(result)
                table.row(
                    *(recording.name, body, every, len(result), score.lost),
                    *(score.add, score.add_95, score.within_tenth, score.within_5),
                )


def main() -> None:
    """Print both tables."""
    compare_bodies()
    print()
    compare_motion()


if __name__ == "__main__":
    main()
