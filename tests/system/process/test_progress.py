"""How far long work is can be read in a log, too."""

import time

import pytest

from servoid.cli import progress
from servoid.cli.progress import progress_bar


def test_without_a_terminal_a_line_tells_now_and_then_how_far_the_work_is(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "_LINE_S", 0.2)
    with progress_bar("modelling") as update:
        update(0.35, "4 ellipsoids")
        time.sleep(0.5)  # nothing is told meanwhile
    out, err = capfd.readouterr()
    assert out == ""
    assert set(err.splitlines()[:2]) == {"modelling: 35 % after 0 s, 4 ellipsoids"}


def test_short_work_tells_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    with progress_bar("modelling") as update:
        update(0.5, "half")
    assert capfd.readouterr() == ("", "")


def test_what_is_told_ends_with_the_work_also_if_that_fails(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "_LINE_S", 0.05)
    with pytest.raises(RuntimeError), progress_bar("modelling"):
        raise RuntimeError
    time.sleep(0.2)
    assert capfd.readouterr() == ("", "")
