"""The notices of a track in its report: their kinds, and those that hold for each observation."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from fake_tracker import plain_body
from track_histories import history_of, track_of, turned

from servoid import view
from servoid.track import TrackResult
from servoid.view.track.timeline_plot import draw_timeline, notice_times

OWN = turned((0.0, 0.0, 0.0))


def test_notices_that_differ_by_numbers_are_one_kind() -> None:
    notices = [["dark by 3"], ["late", "dark by 4.5"], [], ["dark by 5"]]
    track = track_of([OWN] * 4, lambda place: {"notices": notices[place]})
    assert notice_times(track) == {"dark by 3 to 5": pytest.approx([0.0, 0.1, 0.3]), "late": [0.1]}


def test_what_puts_all_poses_in_doubt_is_a_notice_of_each_observation(tmp_path: Path) -> None:
    track = track_of([OWN] * 3, lambda place: {"notices": ["dark"] * place})
    doubt = "the images contradict the poses of the rig"
    result = TrackResult("object", track, plain_body(count=2), smoothed=[OWN] * 3, rig_doubt=doubt)
    view.write_track_report(result, history_of(3), tmp_path / "report")
    page = (tmp_path / "report" / "report.html").read_text()
    assert re.search(r"<td>the poses of the rig are in doubt</td><td>3</td>", page)
    without = replace(result, rig_doubt=None)
    pictures = [draw_timeline(track, one.notices_on_all) for one in (result, without)]
    heights = [cv2.imdecode(np.frombuffer(one, np.uint8), 1).shape[0] for one in pictures]
    assert heights[0] > heights[1], "it has a lane of its own"
