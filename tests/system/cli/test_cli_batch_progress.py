import pytest
import typer

from servoid.batch import BatchProgress
from servoid.cli.batch_progress import INTERRUPTED, watched_batch, words_of


def test_an_interrupted_batch_exits_and_says_what_is_kept(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(typer.Exit) as stopped, watched_batch("a batch") as show:
        show(BatchProgress(done=3, failed=1, total=7, recalled=2, seconds_left=9.0))
        raise KeyboardInterrupt
    assert stopped.value.exit_code == INTERRUPTED
    output = capsys.readouterr().err
    assert output == (
        "interrupted: 3 of 7 trials are done and kept; rerun the same command to resume\n"
    )


def test_the_time_left_is_said_in_seconds_and_then_in_minutes() -> None:
    assert words_of(BatchProgress(2, 1, 9, 0, 40.0)) == "2 of 9 trials, 1 failed, about 40 s left"
    assert words_of(BatchProgress(2, 0, 9, 0, 600.0)) == "2 of 9 trials, about 10 min left"
    assert words_of(BatchProgress(9, 0, 9, 0, 0.0)) == "9 of 9 trials"
