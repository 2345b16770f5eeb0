"""Industrial cameras, against Aravis' own GigE Vision camera in another process."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from gige_peer import (
    ADDRESS,
    CONTINUOUS,
    GAIN_AUTO,
    PATIENCE_S,
    SERIAL,
    TRIGGERED,
    gige_camera,
)
from numpy.typing import NDArray
from played_sources import lens

from servoid.errors import CaptureError, MissingExtraError
from servoid.opening import GivenCalibration, parse_source
from servoid.opening.live import open_live
from servoid.source import Controls, Delivery, Instant, Live, read_rig
from servoid.source.devices import GenicamVideo, list_genicam, open_genicam, pixels
from servoid.source.devices import aravis as binding
from servoid.source.devices.pixels import FORMATS
from servoid.source.grabbing import Grabber
from servoid.source.host_clock import HostClock, HostTime


def textured(count: int, shape: tuple[int, ...] = (48, 64), seed: int = 0) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, (count, *shape), np.uint8)


def delivered(video: GenicamVideo, count: int) -> list[Delivery]:
    found, end = [], time.monotonic() + PATIENCE_S
    while len(found) < count and time.monotonic() < end:
        if video.grab():
            there, data = video.retrieve()
            assert there and data is not None
            found.append(data)
    return found


def test_images_of_a_gige_camera_are_whole_consecutive_and_stamped_by_its_clock(
    tmp_path: Path,
) -> None:
    images = textured(12)
    with gige_camera(tmp_path, images):
        video = GenicamVideo(ADDRESS)
        found = delivered(video, len(images))
        video.release()
    assert video.size_px == (64, 48)
    assert [(one.missing, one.notices) for one in found] == [(0, ())] * len(images)
    for one, image in zip(found, images, strict=True):
        assert np.array_equal(one.images[0], image)
    stamps = [one.stamp_s for one in found if one.stamp_s is not None]
    # The camera is a process: on a loaded machine it once took one image 0.1 s late.
    assert np.median(np.diff(stamps[1:])) == pytest.approx(1 / 30, abs=0.02)
    assert np.diff(stamps[1:]).min() > 0.0
    assert len(stamps) == len(images)


@pytest.mark.extended
def test_a_gige_camera_is_listed_by_the_name_that_opens_it(tmp_path: Path) -> None:
    with gige_camera(tmp_path, textured(1)):
        (found,) = [one for one in list_genicam() if one.name.endswith(SERIAL)]
        assert "serial number S1, GigEVision at 127.0.0.1" in found.description
        GenicamVideo(found.name).release()
        with pytest.raises(
            CaptureError, match=rf"no camera can be opened as genicam:lost.*{found.name}"
        ):
            GenicamVideo("lost")


def newest(source: Live, seconds: float = PATIENCE_S) -> Instant:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        instant = source.newest()
        if instant is not None:
            return instant
        time.sleep(0.001)
    raise AssertionError(f"no observation came; {source.silence()}")


def test_colours_of_a_gige_camera_are_red_first_in_observations(tmp_path: Path) -> None:
    images = textured(1, (48, 64, 3))
    with gige_camera(tmp_path, images, "RGB8"), Live([open_genicam(ADDRESS, lens())]) as source:
        image = newest(source).images[0]
    assert image is not None and np.array_equal(image, images[0])


def test_a_mosaic_of_a_gige_camera_becomes_colours(tmp_path: Path) -> None:
    mosaic = np.zeros((1, 48, 64), np.uint8)
    mosaic[:, ::2, ::2], mosaic[:, 1::2, 1::2] = 200, 50  # red comes first in BayerRG8
    mosaic[:, ::2, 1::2] = mosaic[:, 1::2, ::2] = 120
    with gige_camera(tmp_path, mosaic, "BayerRG8"):
        video = GenicamVideo(ADDRESS)
        (found,) = delivered(video, 1)
        video.release()
    assert (found.images[0][2:-2, 2:-2] == (50, 120, 200)).all()  # blue first, as OpenCV has it


def test_a_format_that_cannot_be_read_is_refused_by_name(tmp_path: Path) -> None:
    with (
        gige_camera(tmp_path, textured(1, (48, 64, 2)), "Mono12Packed"),
        pytest.raises(CaptureError, match=r"pixel format Mono12Packed cannot .* Mono8, .*, RGB8"),
    ):
        GenicamVideo(ADDRESS)


@pytest.mark.extended
def test_a_camera_that_another_program_holds_is_refused_and_not_disturbed(tmp_path: Path) -> None:
    call = f"from servoid.source.devices import GenicamVideo; GenicamVideo({ADDRESS!r})"
    with gige_camera(tmp_path, textured(5)):
        video = GenicamVideo(ADDRESS)
        assert delivered(video, 3)
        other = subprocess.run([sys.executable, "-c", call], capture_output=True, text=True)
        assert f"CaptureError: genicam:{ADDRESS} is in use by another program" in other.stderr
        assert not [notice for one in delivered(video, 10) for notice in one.notices[1:]]
        video.release()


def test_a_lens_of_another_size_is_refused_and_the_camera_set_free(tmp_path: Path) -> None:
    with gige_camera(tmp_path, textured(1, (32, 64))):
        with pytest.raises(CaptureError, match=r"delivers 64x32 pixels, but the lens has 64x48"):
            open_genicam(ADDRESS, lens())
        video = GenicamVideo(ADDRESS)
        assert delivered(video, 1)
        video.release()


TRIES = 4  # of which one must be as quick as promised: a busy computer delays the others


@pytest.mark.extended
def test_a_camera_that_was_killed_is_told_and_found_again_within_a_second(tmp_path: Path) -> None:
    passed_s = []
    with gige_camera(tmp_path, textured(5)) as peer, Live([open_genicam(ADDRESS, lens())]) as live:
        assert newest(live).notices == ()
        while min(passed_s, default=np.inf) > 1.0 and len(passed_s) < TRIES:
            peer.kill()
            end = time.monotonic() + PATIENCE_S
            while "it cannot be opened yet" not in (live.silence() or ""):
                live.newest()
                assert time.monotonic() < end
                time.sleep(0.01)
            peer.start()
            back_s = time.monotonic()
            found = newest(live)
            passed_s.append(time.monotonic() - back_s)
            assert found.images[0] is not None
            assert found.notices[0].startswith("the camera: no image came for")
    assert min(passed_s) < 1.0


@pytest.mark.extended
def test_a_camera_that_stands_still_for_two_seconds_goes_on_within_a_second(
    tmp_path: Path,
) -> None:
    passed_s = []
    with gige_camera(tmp_path, textured(5)) as peer, Live([open_genicam(ADDRESS, lens())]) as live:
        while min(passed_s, default=np.inf) > 1.0 and len(passed_s) < TRIES:
            newest(live)
            peer.pause(2.0)
            on_s = time.monotonic()
            live.newest()  # it may have come before
            assert newest(live).images[0] is not None
            passed_s.append(time.monotonic() - on_s)
    assert min(passed_s) < 1.0


@pytest.mark.extended
def test_a_camera_that_awaits_a_trigger_is_neither_lost_nor_opened_anew(tmp_path: Path) -> None:
    opened = []

    def again() -> GenicamVideo:
        opened.append(time.monotonic())
        return GenicamVideo(ADDRESS)

    with gige_camera(tmp_path, textured(5), "Mono8", 30.0, *TRIGGERED) as peer:
        video = GenicamVideo(ADDRESS)
        assert video.may_be_silent
        grabber = Grabber("eye", video, HostClock(time.monotonic), again, tries=2)
        try:
            time.sleep(1.5)  # it was asked in between if it is there
            assert "awaits a trigger" in grabber.silence(HostTime(time.monotonic()))[1]
            assert not grabber.shots(HostTime(time.monotonic()))
            end = time.monotonic() + PATIENCE_S
            while not grabber.shots(HostTime(time.monotonic())) and time.monotonic() < end:
                peer.trigger()
                time.sleep(0.05)
            assert grabber.shots(HostTime(time.monotonic())) and not opened
            peer.kill()
            while not opened and time.monotonic() < end:
                time.sleep(0.05)
            assert opened
        finally:
            grabber.close()


def test_images_whose_size_changed_are_left_out_and_told(tmp_path: Path) -> None:
    with gige_camera(tmp_path, textured(5)) as peer, Live([open_genicam(ADDRESS, lens())]) as live:
        assert not newest(live).is_dark
        peer.shrink()
        end = time.monotonic() + PATIENCE_S
        found = newest(live)
        while not found.is_dark and time.monotonic() < end:
            found = newest(live)
    assert found.notices[0].startswith(
        "the camera: the image is 64x24 pixels, but the lens has 64x48"
    )


def test_an_image_with_lost_packets_is_left_out_and_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with gige_camera(tmp_path, textured(5)):
        video = GenicamVideo(ADDRESS)
        call, states = video._call, [0, 3, 0]  # what Aravis says where packets are missing

        def lossy(name: str, *arguments: object) -> object:
            return states.pop(0) if name == "buffer_get_status" else call(name, *arguments)

        monkeypatch.setattr(video, "_call", lossy)
        found = delivered(video, 3)
        video.release()
    assert [len(one.images) for one in found] == [1, 0, 1]
    assert found[1].notices == ("an image is left out: packets of it were lost",)


def test_images_that_a_computer_could_not_take_are_told_by_their_numbers(tmp_path: Path) -> None:
    with gige_camera(tmp_path, textured(5), rate_hz=100.0):
        video = GenicamVideo(ADDRESS)
        delivered(video, 3)
        time.sleep(0.3)  # all buffers are full by then
        missing = [one.missing for one in delivered(video, 15)]
        video.release()
    assert max(number for number in missing if number is not None) >= 5
    assert missing.count(0) >= 12


def test_what_changes_by_itself_is_locked_and_what_is_refused_is_said(tmp_path: Path) -> None:
    with gige_camera(tmp_path, textured(1)):
        video = GenicamVideo(ADDRESS, Controls(exposure_s=0.004, gain=3.0, rate_hz=50.0))
        (first,) = delivered(video, 1)
        kept = [
            video._library.call(f"camera_get_{what}", video._camera)
            for what in ("exposure_time", "gain", "frame_rate")
        ]
        video.release()
        assert kept == pytest.approx([4000.0, 3.0, 50.0], rel=1e-3)
        assert first.notices == ()
        video = GenicamVideo(ADDRESS, Controls(gain=2.5))
        (first,) = delivered(video, 1)
        video.release()
    assert first.notices == ("the camera took gain = 2 in place of 2.5",)


@pytest.mark.parametrize(("lock", "mode"), [(True, "Once"), (False, "Continuous")])
def test_a_gain_that_changes_by_itself_adapts_once_and_stays(
    tmp_path: Path, lock: bool, mode: str
) -> None:
    with gige_camera(tmp_path, textured(1), "Mono8", 30.0, (GAIN_AUTO, CONTINUOUS)):
        video = GenicamVideo(ADDRESS, Controls(lock=lock))
        assert video._library.call("camera_get_string", video._camera, "GainAuto") == mode
        (first,) = delivered(video, 1)
        video.release()
    assert first.notices == ()


def test_a_camera_of_a_rigs_file_can_be_a_gige_camera(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text(
        f'version = 1\n[[camera]]\nname = "eye"\ndevice = "genicam:{ADDRESS}"\n'
        'size_px = [64, 48]\nmodel = "pinhole"\nfocal_px = [60, 60]\ncenter_px = [31.5, 23.5]\n'
        "rig_from_camera = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n"
        "[camera.controls]\ngain = 2.5\n"
    )
    images = textured(1)
    with gige_camera(tmp_path, images), Live(read_rig(tmp_path / "rig.toml")) as source:
        image = newest(source).images[0]
    assert image is not None and np.array_equal(
        image[..., 0] if image.ndim == 3 else image, images[0]
    )


def test_a_source_can_be_a_gige_camera_whose_images_are_two_eyes_side_by_side(
    tmp_path: Path,
) -> None:
    images = textured(1, (48, 128))
    word = parse_source(f"side-by-side:genicam:{ADDRESS}")
    known = GivenCalibration(fov_deg=60.0, baseline_m=0.1)
    with gige_camera(tmp_path, images), open_live(word, known).source as source:
        left, right = newest(source).images
    assert left is not None and right is not None
    assert np.array_equal(left[..., 0], images[0, :, :64])
    assert np.array_equal(right[..., 0], images[0, :, 64:])


def test_a_missing_library_is_told_by_the_name_of_its_package(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    binding.aravis.cache_clear()
    monkeypatch.setattr(binding, "_NAMES", ("libnothing.so.0",))
    monkeypatch.setattr(binding, "find_library", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"apt install libaravis-0\.8-0"):
        GenicamVideo("any")


@pytest.mark.parametrize("form", FORMATS)
def test_a_pixel_format_gives_back_what_was_encoded(form: str) -> None:
    code = {row[1]: row[0] for row in pixels._TABLE}[form]
    grey = textured(1)[0] if form.startswith("Mono") else np.full((48, 64), 93, np.uint8)
    encoded = {
        "Mono8": grey,
        "RGB8": np.repeat(grey[..., None], 3, axis=2),
        "BGR8": np.repeat(grey[..., None], 3, axis=2),
        "YUV422_8": np.stack([grey, np.full_like(grey, 128)], axis=2),
        "YUV422_8_UYVY": np.stack([np.full_like(grey, 128), grey], axis=2),
    }.get(form, grey)
    if form.startswith("Mono") and form != "Mono8":
        encoded = (grey.astype(np.uint16) << 8) >> (16 - int(form[4:]))
    rows = encoded.reshape(48, -1).view(np.uint8)
    padded = np.concatenate([rows, np.full((48, 4), 7, np.uint8)], axis=1).tobytes()
    for data, padding in ((rows.tobytes(), 0), (padded, 4), (padded[:-4], 4)):
        image = pixels.decode_pixels(data, code, (64, 48), padding)
        shown = image >> 8 if image.dtype == np.uint16 else image
        wanted = grey if shown.ndim == 2 else grey[..., None]
        assert np.abs(shown.astype(int) - wanted).max() <= (20 if "YUV" in form else 0)
    with pytest.raises(CaptureError, match=r"64x48 pixels in .* has \d+ bytes, but \d+ came"):
        pixels.decode_pixels(rows.tobytes()[:-1], code, (64, 48))


def test_the_first_pixel_of_a_mosaic_is_the_one_that_its_name_begins_with() -> None:
    colors = {"R": (0, 0, 255), "B": (255, 0, 0)}
    for form, place in (("BayerRG8", (0, 0)), ("BayerBG8", (0, 0)), ("BayerGR8", (0, 1))):
        mosaic = np.zeros((48, 64), np.uint8)
        mosaic[place[0] :: 2, place[1] :: 2] = 255
        code = {row[1]: row[0] for row in pixels._TABLE}[form]
        image = pixels.decode_pixels(mosaic.tobytes(), code, (64, 48))
        first = form[5] if form[5] != "G" else form[6]
        assert (image[4:-4, 4:-4] == colors[first]).all()
