"""Times and rates of captures: the unit that they are in, their order, and the rate of a video."""

from pathlib import Path

import numpy as np
import pytest

from conftest import camera_toml, capture_toml, write_png
from servoid.capture import Capture, open_capture
from servoid.capture.recorded_times import times_notes
from servoid.errors import CaptureError
from servoid.record import image_video

COUNT = 12
HZ = 25.0


def opened(folder: Path, times: list[object], rate_hz: float | None = HZ) -> Capture:
    """Open a capture with these times of its poses, as they are written."""
    (folder / "images").mkdir(parents=True)
    for index in range(len(times)):
        write_png(folder / "images" / f"{index:02}.png", np.zeros((120, 160, 3), np.uint8))
    rows = [f"{time},0,0,0,1,0,0,0" for time in times]
    (folder / "poses.csv").write_text("\n".join(["time_s,x,y,z,qw,qx,qy,qz", *rows, ""]))
    rate = "" if rate_hz is None else f"rate_hz = {rate_hz}\n"
    toml = capture_toml(camera_toml("eye", "images/*.png", "images/*.png"))
    (folder / "capture.toml").write_text(toml.replace("version = 1\n", f"version = 1\n{rate}", 1))
    return open_capture(folder)


@pytest.mark.parametrize(
    "unit", [("milliseconds", 1e3), ("microseconds", 1e6), ("nanoseconds", 1e9)]
)
@pytest.mark.parametrize("start", [0, 1_700_000_000])
def test_times_in_another_unit_are_refused_by_its_name(
    tmp_path: Path, unit: tuple[str, float], start: int
) -> None:
    name, per_s = unit
    times: list[object] = [int(per_s) * start + round(per_s * k / HZ) for k in range(COUNT)]
    with pytest.raises(CaptureError, match=f"poses.csv: .*if they are {name}, divide them"):
        opened(tmp_path / "recording", times)
    (note,) = opened(tmp_path / "no_rate", times, None).notes
    assert f"if they are {name}" in note


@pytest.mark.parametrize("jitter", [0.0, 0.3])
@pytest.mark.parametrize("start", [0.0, 1.7e9])
def test_times_in_seconds_have_no_note(tmp_path: Path, start: float, jitter: float) -> None:
    shifts = jitter / HZ * np.random.default_rng(3).uniform(-1, 1, COUNT)
    times: list[object] = [f"{start + k / HZ + shift:.6f}" for k, shift in enumerate(shifts)]
    del times[4:6]  # images that were dropped
    assert opened(tmp_path / "recording", times).notes == ()
    assert opened(tmp_path / "no_rate", times, None).notes == ()


@pytest.mark.parametrize("times", [[0, 1, 2, 3], [0], [0, 7.5, 21, 90, 110, 300]])
def test_times_of_photographs_may_be_any_that_increase(tmp_path: Path, times: list[object]) -> None:
    assert opened(tmp_path, times, None).notes == ()


@pytest.mark.parametrize(
    ("times", "fault"),
    [
        ([0.0] * COUNT, f"all {COUNT} times are 0"),
        ([10.0 - k / HZ for k in range(COUNT)], r"the times decrease, from 10 to 9\.56"),
        ([k // 10 for k in range(COUNT)], f"10 of {COUNT} times are not later than the one before"),
    ],
)
def test_times_that_do_not_increase_are_refused_for_a_recording(
    tmp_path: Path, times: list[object], fault: str
) -> None:
    with pytest.raises(CaptureError, match=fault):
        opened(tmp_path / "recording", times)
    assert opened(tmp_path / "no_rate", times, None).notes == ()


@pytest.mark.parametrize("step_s", [5.0, 7.5, 10.0, 20.0, 30.0, 60.0, 100.0, 3600.0, 86400.0])
def test_photographs_may_be_taken_at_even_times(tmp_path: Path, step_s: float) -> None:
    times = [0.3 + step_s * index for index in range(36)]
    assert list(times_notes(tmp_path / "poses.csv", times, None)) == []


@pytest.mark.parametrize("hz", [15.0, 24.0, 25.0, 30.0])
@pytest.mark.parametrize("per_s", [1e3, 1e6, 1e9])
def test_steps_of_a_usual_camera_in_another_unit_are_noted(
    tmp_path: Path, hz: float, per_s: float
) -> None:
    times = [float(round(per_s * index / hz)) for index in range(36)]
    (note,) = times_notes(tmp_path / "poses.csv", times, None)
    assert f"divide them by {per_s:.0f}," in note


def test_a_single_time_that_does_not_increase_is_noted(tmp_path: Path) -> None:
    times: list[object] = [k / HZ for k in range(COUNT)]
    times[5] = times[4]
    (note,) = opened(tmp_path, times).notes
    assert "1 time is not later than the one before, the first that of observation 5" in note


def test_a_rate_that_the_times_contradict_is_noted_with_both(tmp_path: Path) -> None:
    (note,) = opened(tmp_path, [k / HZ for k in range(COUNT)], 2 * HZ).notes
    assert note.startswith("rate_hz is 50, but by its times ")
    assert "has 25 observations per second (median); the times are used" in note


@pytest.mark.parametrize("rate_hz", [30.0, 60.0, 61.0])
def test_a_rate_that_a_video_contradicts_is_noted_with_both(tmp_path: Path, rate_hz: float) -> None:
    with image_video(tmp_path / "film.mp4", (160, 120), 60.0) as add:
        for _ in range(COUNT):
            add(np.zeros((120, 160, 3), np.uint8))
    (tmp_path / "0000.png").write_bytes(b"")
    toml = camera_toml("eye", "film.mp4", "*.png")
    (tmp_path / "capture.toml").write_text(f"version = 1\nrate_hz = {rate_hz}\n{toml}")
    capture = open_capture(tmp_path)
    if rate_hz >= 60.0:
        assert capture.notes == ()
    else:
        (note,) = capture.notes
        assert note.startswith("rate_hz is 30, but ")
        assert "film.mp4 itself has 60 observations per second (median); rate_hz is used" in note
        assert note.endswith("correct what is wrong, unless it is slow motion or time lapse")
    assert capture.times_s is not None
    assert capture.times_s[1] == pytest.approx(1.0 / rate_hz)
