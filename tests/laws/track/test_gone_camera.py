"""A camera that gives nothing for the rest of a recording is told, with the time from which on."""

import pytest

from servoid.track.gone import gone_note

TIMES_S = [0.1 * index for index in range(60)]
BLANK = "camera right: the image shows nothing where the object should be"
SAME = "camera right: the image repeats the previous one"
LOST = "camera right delivered no image"


def noticed(notice: str, first: int, last: int = 60) -> list[tuple[str, ...]]:
    return [("time jumps", notice) if first <= at < last else () for at in range(60)]


@pytest.mark.parametrize("notice", [BLANK, SAME, LOST, "camera right: no image came for 1.0 s"])
def test_a_camera_that_gives_nothing_until_the_end_is_told(notice: str) -> None:
    assert gone_note(noticed(notice, 20), TIMES_S, 2) == (
        "camera right gave no new image from 2.00 s on, in the last 40 of 60 observations: what "
        "was tracked since rests on 1 other camera"
    )


def test_a_camera_that_comes_back_or_is_lost_for_a_moment_is_not_told() -> None:
    assert gone_note(noticed(SAME, 20, 59), TIMES_S, 2) is None
    assert gone_note(noticed(LOST, 53), TIMES_S, 2) is None
    assert gone_note([], [], 2) is None


def test_what_all_cameras_repeat_is_an_object_at_rest() -> None:
    both = [(*one, *(each.replace("right", "left") for each in one)) for one in noticed(SAME, 20)]
    assert gone_note(both, TIMES_S, 2) is None
    assert gone_note(noticed(SAME, 20), TIMES_S, 1) is None
