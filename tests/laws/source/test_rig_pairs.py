"""Pairs of a rig's file: devices that know themselves how their eyes see."""

from pathlib import Path

import pytest
from played_sources import FakeClock, FakeVideo, rig

from servoid.errors import CaptureError, PoseError
from servoid.source import Controls, LiveCamera, devices, read_rig

PAIR = """version = 1
[[camera]]
name = "hand"
device = 0
size_px = [64, 48]
focal_px = [60, 60]
rig_from_camera = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]
[[pair]]
name = "head"
device = "realsense:123"
rig_from_left = [[1,0,0,0.5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]
[pair.controls]
exposure_s = 0.008
"""


def test_a_pair_of_a_rigs_file_says_itself_how_it_sees(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def opened(serial: str, controls: Controls | None) -> tuple[LiveCamera, ...]:
        asked.append((serial, controls))
        return rig(FakeVideo(FakeClock()), FakeVideo(FakeClock()))

    monkeypatch.setattr(devices, "open_realsense", opened)
    (tmp_path / "rig.toml").write_text(PAIR)
    found = read_rig(tmp_path / "rig.toml")
    assert asked == [("123", Controls(exposure_s=0.008))]
    assert [one.name for one in found] == ["hand", "head_left", "head_right"]
    shifts = [one.rig_from_camera.translation[0] for one in found]
    assert shifts == pytest.approx([0.0, 0.5, 0.6])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("rig_from_left", "# rig_from_left", "pair 'head': rig_from_left is missing"),
        ("realsense:123", "0", "a pair with a calibration of its own is realsense:SERIAL"),
        ("[[1,0,0,0.5]", "[[2,0,0,0.5]", "pair 'head', rig_from_left"),
    ],
)
def test_a_pair_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(PAIR.replace(old, new, 1))
    with pytest.raises((CaptureError, PoseError), match=message):
        read_rig(path)
    path.write_text("version = 1\n")
    with pytest.raises(CaptureError, match=r"names no camera; write a \[\[camera\]\] table"):
        read_rig(path)
