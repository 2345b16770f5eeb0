"""RealSense cameras, against recordings and software devices of librealsense itself."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from realsense_peer import (
    BASELINE_M,
    FOCAL_PX,
    SERIAL,
    Shown,
    SoftwareCamera,
    need_library,
    write_recording,
)

from servoid.errors import CaptureError, MissingExtraError
from servoid.opening import parse_source
from servoid.opening.live import open_live
from servoid.source import Controls, Delivery, EndedError, Instant
from servoid.source.devices import (
    RealSenseVideo,
    list_realsense,
    open_realsense,
    realsense,
)

PATIENCE_S = 20.0


@pytest.fixture(autouse=True)
def _library() -> None:
    need_library()


def textured(count: int, seed: int, kind: type = np.uint8) -> NDArray:
    return np.random.default_rng(seed).integers(1, 250, (count, 48, 64)).astype(kind)


def shown(count: int = 12, **changes: object) -> Shown:
    return replace(Shown(textured(count, 1), textured(count, 2)), **changes)


def place_of(one: Delivery) -> int:
    """Return which image a delivery is; a busy computer leaves one out now and then."""
    assert one.stamp_s is not None
    return round((one.stamp_s - Shown.first_s) * 30.0)


def played(path: Path, **options: bool) -> list[Delivery]:
    """Return all that a recording delivers."""
    video = RealSenseVideo(str(path), **options)
    found, end = [], time.monotonic() + PATIENCE_S
    try:
        while time.monotonic() < end:
            if video.grab():
                there, data = video.retrieve()
                assert there and data is not None
                found.append(data)
    except EndedError:
        return found
    finally:
        video.release()
    raise AssertionError("the recording does not end")


def test_a_recording_gives_the_images_stamps_lenses_and_baseline_of_its_device(
    tmp_path: Path,
) -> None:
    made = shown(depth=textured(12, 3, np.uint16))
    path = tmp_path / "run.db3"
    write_recording(path, made)
    left, right = open_realsense(str(path))
    assert left.device is right.device
    left.device.release()
    for camera in (left, right):
        assert camera.lens.model == "pinhole"
        assert camera.lens.focal_px == (float(FOCAL_PX), float(FOCAL_PX))
        assert camera.lens.center_px == (31.5, 23.5)
    assert left.rig_from_camera.translation == (0.0, 0.0, 0.0)
    assert right.rig_from_camera.translation == (float(BASELINE_M), 0.0, 0.0)
    found = played(path)
    assert len(found) > 9
    for one in found:
        place = place_of(one)
        assert one.stamp_s == pytest.approx(made.stamps_s()[place], abs=1e-6)
        assert np.array_equal(one.images[0], made.left[place])
        assert np.array_equal(one.images[1], made.right[place])
        assert one.depths[0] == pytest.approx(1e-3 * made.depth[place], rel=1e-6)
        assert one.depths[1] is None
    assert all(one.depths == () for one in played(path, depth=False))


def test_images_are_paired_by_stamp_however_they_come(tmp_path: Path) -> None:
    made = shown(late="left", lost=(("right", 4), ("left", 7)))
    path = tmp_path / "run.db3"
    write_recording(path, made)
    found = played(path)
    assert len(found) > 6
    for one in found:
        place = place_of(one)
        assert place not in (4, 7)
        assert np.array_equal(one.images[0], made.left[place])
        assert np.array_equal(one.images[1], made.right[place])
    notices = [notice for one in found for notice in one.notices]
    assert any(one.endswith("of left had no partner of the same moment") for one in notices)
    assert any(one.endswith("of right had no partner of the same moment") for one in notices)
    assert sum(one.missing or 0 for one in found) >= 1


def test_an_emitter_that_switches_on_is_told_with_each_image_that_it_lights(
    tmp_path: Path,
) -> None:
    emitter = np.zeros(12, np.int64)
    emitter[5:8] = 1
    path = tmp_path / "run.db3"
    write_recording(path, shown(emitter=emitter))
    found = played(path)
    assert len(found) > 9
    for one in found:
        is_on = any("the emitter is on" in notice for notice in one.notices)
        assert is_on == emitter[place_of(one)]


@pytest.mark.extended
def test_a_recording_is_a_source_that_ends(tmp_path: Path) -> None:
    made = shown(depth=textured(12, 3, np.uint16))
    path = tmp_path / "run.db3"
    write_recording(path, made)
    found: list[Instant] = []
    end = time.monotonic() + PATIENCE_S
    with open_live(parse_source(f"realsense:{path}")).source as source:
        while not source.is_over:
            instant = source.newest()
            found += [] if instant is None else [instant]
            assert time.monotonic() < end
            time.sleep(0.001)
    assert len(found) > 6
    assert found[0].names == ("left", "right")
    for one in found:
        left, right = one.images
        assert left is not None and right is not None and one.depths[0] is not None
        place = next(at for at in range(12) if np.array_equal(left[..., 0], made.left[at]))
        assert np.array_equal(right[..., 0], made.right[place])
        assert one.depths[0] == pytest.approx(1e-3 * made.depth[place], rel=1e-6)
    assert np.diff([one.time_s for one in found]).min() > 0.0


@pytest.mark.extended
def test_a_pair_of_a_rigs_file_is_a_source(tmp_path: Path) -> None:
    made = shown()
    write_recording(tmp_path / "run.db3", made)
    rig = tmp_path / "rig.toml"
    rig.write_text(
        f'version = 1\n[[pair]]\nname = "head"\ndevice = "realsense:{tmp_path / "run.db3"}"\n'
    )
    instant, end = None, time.monotonic() + PATIENCE_S
    with open_live(parse_source(str(rig))).source as source:
        while instant is None and time.monotonic() < end:
            instant = source.newest()
            time.sleep(0.001)
    assert instant is not None and instant.names == ("head_left", "head_right")
    left = instant.images[0]
    assert left is not None and any(np.array_equal(left[..., 0], one) for one in made.left)


@pytest.mark.extended
def test_depth_that_is_not_in_the_left_eyes_pixels_is_left_out_and_told(tmp_path: Path) -> None:
    path = tmp_path / "run.db3"
    write_recording(path, shown(depth=textured(12, 3, np.uint16), depth_shift_m=0.015))
    first, *_ = played(path)
    assert first.depths == ()
    assert first.notices == ("its depth is not in the pixels of the left eye, and is left out",)


def test_what_cannot_be_opened_is_refused_in_words(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match=r"no RealSense camera of serial number 99; none"):
        RealSenseVideo("99")
    with pytest.raises(CaptureError, match=r"no RealSense camera plugged in"):
        RealSenseVideo()
    (tmp_path / "text.db3").write_text("no recording")
    with pytest.raises(CaptureError, match=r"text\.db3 is not a recording that librealsense can"):
        RealSenseVideo(str(tmp_path / "text.db3"))
    assert list_realsense() == ()


@pytest.mark.extended
def test_a_camera_without_an_infrared_pair_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.db3"
    write_recording(path, shown(right=np.zeros((0, 0, 0), np.uint8)))
    with pytest.raises(CaptureError, match="has no infrared pair"):
        RealSenseVideo(str(path))
    write_recording(tmp_path / "pair.db3", shown())
    with pytest.raises(CaptureError, match="rate_hz = 60, but this RealSense camera offers 30"):
        RealSenseVideo(str(tmp_path / "pair.db3"), Controls(rate_hz=60.0))


def opened(camera: SoftwareCamera, controls: Controls, patch: pytest.MonkeyPatch) -> RealSenseVideo:
    """Open a device of this process, which librealsense does not list."""
    patch.setattr(realsense, "_plugged_in", lambda *_: camera.device)
    return RealSenseVideo(SERIAL, controls)


def test_the_emitter_is_switched_off_and_the_exposure_set(monkeypatch: pytest.MonkeyPatch) -> None:
    options = {"emitter_enabled": 1.0, "enable_auto_exposure": 1.0, "exposure": 33000.0}
    camera = SoftwareCamera(shown(), **options, gain=16.0)
    video = opened(camera, Controls(exposure_s=0.008), monkeypatch)
    option = camera.library.option
    kept = [camera.sensor.get_option(getattr(option, name)) for name in options]
    assert kept == [0.0, 0.0, 8000.0]
    for name in ("left", "right"):
        camera.show(name, 0)
    assert video.grab()
    _, first = video.retrieve()
    video.release()
    assert first is not None and first.notices == ()


def test_an_exposure_that_adapts_is_locked_after_a_second_and_told_if_it_changes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    options = {"emitter_enabled": 0.0, "enable_auto_exposure": 1.0, "exposure": 33000.0}
    exposure = np.full(50, 7200)
    exposure[45:] = 4000
    camera = SoftwareCamera(shown(50, exposure_us=exposure), **options)
    video = opened(camera, Controls(), monkeypatch)
    notices = []
    for number in range(50):
        assert camera.sensor.get_option(camera.library.option.enable_auto_exposure) == (number < 30)
        for name in ("left", "right"):
            camera.show(name, number)
        assert video.grab()
        _, data = video.retrieve()
        assert data is not None
        notices += [(number, notice) for notice in data.notices]
    video.release()
    assert camera.sensor.get_option(camera.library.option.exposure) == 7200.0
    assert notices == [(45, "its exposure (µs) changed from 7200 to 4000, though locked")]


def test_an_emitter_that_is_switched_on_from_outside_is_switched_off_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    camera = SoftwareCamera(shown(emitter=np.array([0, 1] + [0] * 10)), emitter_enabled=0.0)
    video = opened(camera, Controls(), monkeypatch)
    camera.sensor.set_option(camera.library.option.emitter_enabled, 1.0)
    notices = []
    for number in range(3):
        for name in ("left", "right"):
            camera.show(name, number)
        assert video.grab()
        _, data = video.retrieve()
        assert data is not None
        notices.append(data.notices)
    video.release()
    assert [len(one) for one in notices] == [0, 1, 0]
    assert camera.sensor.get_option(camera.library.option.emitter_enabled) == 0.0


def test_what_a_device_refuses_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    camera = SoftwareCamera(shown(), enable_auto_exposure=0.0)
    camera.sensor.add_read_only_option(camera.library.option.emitter_enabled, 1.0)
    video = opened(camera, Controls(exposure_s=0.008), monkeypatch)
    for name in ("left", "right"):
        camera.show(name, 0)
    assert video.grab()
    _, first = video.retrieve()
    video.release()
    assert first is not None
    assert first.notices[0].startswith("the device refuses emitter_enabled = 0")
    assert first.notices[1] == "the device has no option for exposure = 8000"
    assert "the emitter is on" in first.notices[2]


def test_a_missing_library_is_told_by_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'servoid\[realsense\]'"):
        RealSenseVideo()
