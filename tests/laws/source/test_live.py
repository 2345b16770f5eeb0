"""Live cameras as sources of observations."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Event

import cv2
import numpy as np
import pytest
from played_sources import (
    PERIOD_S,
    SIZE_PX,
    FakeClock,
    FakeVideo,
    Played,
    live,
    rig,
)

from servoid.errors import CaptureError
from servoid.pose import Pose
from servoid.source import Instant, Live, LiveSettings, grabbing, read_rig
from servoid.source.device import opened
from servoid.source.host_clock import HostClock


def observed(played: Played, seconds: float) -> list[Instant]:
    found = []
    end = played.now() + seconds
    while played.now() < end:
        played.pass_period()
        instant = played.source.newest()
        if instant is not None:
            found.append(instant)
    played.close()
    return found


def test_images_of_live_cameras_are_paired_by_their_times() -> None:
    found = observed(live(), 1.0)
    assert 27 <= len(found) <= 31
    assert np.diff([one.time_s for one in found]) == pytest.approx(1 / 30, abs=PERIOD_S)
    for one in found:
        left, right = one.images
        assert left is not None and right is not None and not one.notices
        assert left[0, 0].tolist() == right[0, 0].tolist()  # the same number of both
        assert left[0, 0, 2] == 200  # blue comes last


def test_a_delay_is_taken_off_the_times_of_live_images() -> None:
    plain = observed(live(), 0.3)
    late = observed(live(settings=LiveSettings(delay_s=0.03)), 0.3)
    times = [[one.time_s for one in run] for run in (plain, late)]
    assert np.array(times[0]) - np.array(times[1]) == pytest.approx(0.03)


def test_a_live_camera_that_falls_silent_is_waited_for_a_little_and_then_told() -> None:
    found = observed(live(lost=range(6, 25)), 1.5)
    both = [one for one in found if not one.notices]
    dark = [one for one in found if one.images[1] is None]
    (back,) = (one for one in found if one.notices and one.images[1] is not None)
    assert back.notices[0].startswith("camera right: no image came for 0.7 s: the camera deliv")
    assert both[0].time_s < dark[0].time_s < both[-1].time_s
    assert dark[0].time_s - both[5].time_s == pytest.approx(0.2, abs=0.08)
    assert dark[0].notices[0].startswith("camera right: no image came for 0.2 s: the camera del")
    assert all(one.images[0] is not None for one in dark)
    assert np.diff([one.time_s for one in dark]).max() < 0.05  # it is not waited for each time


def test_images_that_were_taken_too_far_apart_are_no_pair() -> None:
    found = observed(live(settings=LiveSettings(apart_s=0.001)), 0.3)
    alone = [one for one in found if one.notices]
    assert alone
    assert all(one.notices[0].endswith("ms apart") and not one.is_dark for one in alone)


def test_no_image_of_a_live_camera_is_delivered_twice() -> None:
    found = observed(live(lost=range(6, 25), settings=LiveSettings(apart_s=1.0)), 1.5)
    for images in zip(*(one.images for one in found), strict=True):
        numbers = [int(image[0, 0, 0]) for image in images if image is not None]
        assert len(numbers) == len(set(numbers)) > 20


def slow_pair(lost: Callable[[int], bool], rate_hz: float) -> list[Instant]:
    """Return what comes in 6 s of two cameras, the right one 2 ms behind, that lose images."""
    clock = FakeClock()
    missing = [number for number in range(200) if lost(number)]
    videos = [
        FakeVideo(clock, rate_hz=rate_hz, shift_s=shift_s, lost=missing) for shift_s in (0.0, 0.002)
    ]
    source = Live(rig(*videos), clock=clock)

    def close() -> None:
        for video in videos:
            video.closed = True
        source.close()

    return observed(Played(source, clock, lambda: clock.advance(0.001), close), 6.0)


def test_images_of_slow_cameras_are_paired_although_every_seventh_is_lost() -> None:
    found = slow_pair(lambda number: number % 7 == 6, 10.0)[1:]
    assert len(found) >= 48
    assert all(image is not None for one in found for image in one.images)
    notices = [notice for one in found for notice in one.notices]
    assert notices and all(
        notice.endswith("1 image is missing before this one") for notice in notices
    )
    assert np.diff([one.time_s for one in found]).min() > 0.09


def test_cameras_that_were_silent_together_come_back_as_a_pair() -> None:
    found = slow_pair(lambda number: 20 <= number < 32, 30.0)[1:]
    assert all(image is not None for one in found for image in one.images)
    (back,) = [one for one in found if one.notices]
    assert len(back.notices) == 2 and all("no image came for 0.4 s" in one for one in back.notices)
    assert np.diff([one.time_s for one in found]).min() > 0.03


def test_nothing_comes_of_live_cameras_that_all_fail() -> None:
    clock = FakeClock()
    videos = [FakeVideo(clock, lost=range(1000)) for _ in range(2)]
    with Live(rig(*videos), clock=clock) as source:
        for _ in range(100):
            clock.advance()
            assert source.newest() is None
        for video in videos:
            video.closed = True


def test_an_image_of_another_size_is_left_out_and_told() -> None:
    clock = FakeClock()
    video = FakeVideo(clock, size_px=(32, 32))
    with Live(rig(video), clock=clock) as source:
        clock.advance(0.1)
        instant = source.newest()
        video.closed = True
    assert instant is not None and instant.is_dark
    assert "camera left: the image is 32x32 pixels, but the lens has 64x48" in instant.notices[0]


def test_an_image_with_masked_pixels_is_left_out_and_told() -> None:
    class Masked(FakeVideo):
        def retrieve(self) -> tuple[bool, np.ndarray]:
            done, image = super().retrieve()
            return done, np.ma.masked_array(image, mask=image > 100)

    clock = FakeClock()
    video = Masked(clock)
    with Live(rig(video), clock=clock) as source:
        clock.advance(0.1)
        instant = source.newest()
        video.closed = True
    assert instant is not None and instant.is_dark
    assert "camera left: the image has masked pixels; say what these are" in instant.notices[0]


def test_a_driver_that_raises_is_silence() -> None:
    class Broken(FakeVideo):
        def retrieve(self) -> tuple[bool, np.ndarray]:
            raise RuntimeError("the cable is out")

    clock = FakeClock()
    videos = FakeVideo(clock), Broken(clock)
    with Live(rig(*videos), clock=clock) as source:
        notices = []
        for _ in range(60):
            clock.advance()
            instant = source.newest()
            notices += [] if instant is None else instant.notices
        for video in videos:
            video.closed = True
    assert notices and notices[-1].endswith("the cable is out")


def test_a_video_file_can_stand_for_a_live_camera(tmp_path: Path) -> None:
    path = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, SIZE_PX)
    for _ in range(20):
        writer.write(np.full((SIZE_PX[1], SIZE_PX[0], 3), 90, np.uint8))
    writer.release()
    with Live(rig(str(path))) as source:
        for _ in range(2000):
            instant = source.newest()
            if instant is not None:
                break
            time.sleep(0.005)
    assert instant is not None and instant.images[0] is not None
    assert np.abs(instant.images[0].astype(int) - 90).max() < 5


def test_a_camera_that_was_unplugged_is_opened_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, made = FakeClock(), []

    class Unplugged(FakeVideo):
        def __init__(self, device: int, _way: int) -> None:
            super().__init__(clock, lost=() if made else range(5, 999_999))
            made.append(device)

        def isOpened(self) -> bool:  # noqa: N802
            return True

        def set(self, _key: int, _value: float) -> None:
            pass

    monkeypatch.setattr(cv2, "VideoCapture", Unplugged)
    monkeypatch.setattr(grabbing, "_RETRY_S", 0.0)
    (camera,) = rig("0")
    with Live([replace(camera, device=3)], clock=clock) as source:
        last_s = 0.0
        for _ in range(400):
            clock.advance()
            instant = source.newest()
            last_s = last_s if instant is None else instant.time_s
        for video in clock.videos:
            video.closed = True  # type: ignore
    assert made == [3, 3]
    assert last_s > clock() - 0.1


def test_a_camera_that_cannot_be_opened_is_named(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match=r"camera left: OpenCV cannot open .*none.avi"):
        Live(rig(str(tmp_path / "none.avi")))
    with pytest.raises(CaptureError, match="there is no camera"):
        Live([])


@pytest.mark.parametrize(
    ("device", "remedy"),
    [
        (97, "check that it is connected .*; servoid sources lists the cameras that are found"),
        ("/dev/video97", "check that it is connected .*; servoid sources lists the cameras"),
        ("nothing ! appsink", "check the pipeline, and that OpenCV was built with GStreamer"),
        ("rtsp://127.0.0.1:9/eye", "check the address, and that its server can be reached"),
        ("none.avi", "check that it is a video, and that it is whole"),
    ],
)
def test_a_device_that_cannot_be_opened_is_refused_with_what_to_do_about_its_kind(
    device: int | str, remedy: str
) -> None:
    with pytest.raises(CaptureError, match=rf"^the camera: OpenCV cannot open '.*'; {remedy}"):
        opened("camera", device)


def test_a_password_is_not_shown() -> None:
    with pytest.raises(CaptureError) as refused:
        Live(rig("file://user:secret@host/none"))
    assert "secret" not in str(refused.value)
    assert "@host/none" in str(refused.value)


def test_cameras_are_closed_however_the_block_ends() -> None:
    class Endless(FakeVideo):
        def grab(self) -> bool:
            time.sleep(0.001)
            return True

    video = Endless(FakeClock())
    with pytest.raises(ZeroDivisionError), Live(rig(video)):
        _ = 1 / 0
    assert video.closed


def test_a_camera_whose_driver_hangs_is_closed_once_it_returns(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    released = Event()

    class Hanging(FakeVideo):
        def grab(self) -> bool:
            return released.wait(10.0)

        def release(self) -> None:
            super().release()
            gone.set()

    gone = Event()
    monkeypatch.setattr(grabbing, "_CLOSING_S", 0.01)
    video = Hanging(FakeClock())
    with Live(rig(video)):
        pass
    assert not video.closed
    released.set()
    assert gone.wait(10.0)


RIG = """version = 1
[[camera]]
name = "left"
device = 0
size_px = [64, 48]
model = "pinhole"
focal_px = [60, 60]
center_px = [31.5, 23.5]
rig_from_camera = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]
[[camera]]
name = "right"
device = "rtsp://10.0.0.5/stream"
size_px = [64, 48]
model = "brown_conrady"
focal_px = [60, 60]
center_px = [31.5, 23.5]
distortion = [-0.2, 0.05, 0.0, 0.0]
rig_from_camera = [[1,0,0,0.1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]
"""


def test_a_rigs_file_says_what_the_cameras_are(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG)
    left, right = read_rig(path)
    assert (left.name, left.device, right.device) == ("left", 0, "rtsp://10.0.0.5/stream")
    assert right.lens.distortion[0] == -0.2
    assert right.rig_from_camera.translation == (0.1, 0.0, 0.0)


def test_a_file_is_no_live_device_of_a_rig(tmp_path: Path) -> None:
    film, path = tmp_path / "film.avi", tmp_path / "rig.toml"
    film.touch()
    path.write_text(RIG.replace("rtsp://10.0.0.5/stream", film.as_posix()))
    with pytest.raises(CaptureError, match=r"camera 'right': device is '.*film.avi', which is a f"):
        read_rig(path)


def test_the_rig_on_the_page_of_formats_can_be_read(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs" / "formats.md").read_text(encoding="utf-8")
    (text,) = [part for part in page.split("```") if part.startswith("toml") and "device" in part]
    (tmp_path / "rig.toml").write_text(text.removeprefix("toml"))
    assert [camera.device for camera in read_rig(tmp_path / "rig.toml")] == [0]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("device = 0\n", "", r"camera\[0\]: the key 'device' is missing"),
        ("device = 0", "images = 0", r"rig.toml, line 4, camera\[0\]: unknown key 'images'"),
        ("device = 0", "device = ''", r"camera\[0\].device: expected a text of length 1 or more"),
        ('name = "right"', 'name = "left"', r"two cameras are named 'left'"),
        ("version = 1", "version = 2", r"this servoid reads rigs of version 1"),
    ],
)
def test_a_rigs_file_that_cannot_be_is_refused(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG.replace(old, new, 1))
    with pytest.raises(CaptureError, match=message):
        read_rig(path)


def test_settings_of_live_cameras_are_checked() -> None:
    with pytest.raises(
        CaptureError, match=r"LiveSettings.delay_s: expected a number of 0 or more, got"
    ):
        LiveSettings(delay_s=-0.1)


def test_a_rig_at_rest_is_where_its_calibration_says() -> None:
    (one, *_) = observed(live(), 0.2)
    left, right = one.world_from_camera
    assert (left.inverse() @ right).translation == pytest.approx((0.1, 0.0, 0.0))
    assert isinstance(left, Pose)


class Silent:
    """A camera that delivers nothing."""

    def __init__(self, *, may_be_silent: bool) -> None:
        self.may_be_silent = may_be_silent

    def grab(self) -> bool:
        return False

    def retrieve(self) -> tuple[bool, None]:
        return False, None

    def release(self) -> None:
        pass


@pytest.mark.parametrize("triggered", [True, False])
def test_silence_is_a_failure_unless_a_trigger_is_awaited(triggered: bool) -> None:
    opened = Event()

    def again() -> Silent:
        opened.set()
        return Silent(may_be_silent=True)

    first = Silent(may_be_silent=triggered)
    grabber = grabbing.Grabber("eye", first, HostClock(time.monotonic), again, tries=2)
    assert opened.wait(0.3 if triggered else 5.0) is not triggered
    grabber.close()
