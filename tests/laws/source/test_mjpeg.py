"""Images that a camera sends over HTTP, from a server in a process of its own."""

import time
from email.message import Message
from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
import pytest
from served_images import served

from servoid.camera import Lens
from servoid.errors import CaptureError
from servoid.opening import GivenCalibration, open_live, parse_source
from servoid.source import Live, RawInstant
from servoid.source.streams.mjpeg import MjpegVideo

SIZE_PX = (64, 48)


@pytest.fixture(scope="module")
def images(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("images")
    for name in ("left", "right"):
        (folder / name).mkdir()
        for number in range(20):
            pixels = np.full((SIZE_PX[1], SIZE_PX[0], 3), 10 * number, np.uint8)
            cv2.imwrite(str(folder / name / f"{number:03d}.jpg"), pixels)
    return folder


def gather(source: Live, seconds: float, enough: int = 10_000) -> list[RawInstant]:
    found: list[RawInstant] = []
    end = time.monotonic() + seconds
    while time.monotonic() < end and len(found) < enough:
        raw = source.newest_raw()
        if raw is not None:
            found.append(raw)
        time.sleep(0.001)
    return found


def test_a_stream_is_a_live_camera_whose_jpeg_files_are_kept(images: Path) -> None:
    with served(images) as address:
        opened = open_live(parse_source(f"{address}/left"), GivenCalibration(fov_deg=60.0))
        with opened.source as source:
            found = gather(source, 20.0, 30)
    (camera,) = source.rig
    assert camera.lens.size_px == SIZE_PX
    assert len(found) == 30
    assert np.all(np.diff([raw.time_s for raw in found]) > 0.0)
    for raw in found:
        (image,) = raw.images
        assert image is not None and image.encoded is not None
        pixels = cv2.imdecode(np.frombuffer(image.encoded, np.uint8), cv2.IMREAD_COLOR)
        assert (image.pixels == np.asarray(pixels)[..., ::-1]).all()


def test_a_server_that_was_killed_is_found_again_and_the_gap_is_told(images: Path) -> None:
    with served(images) as address:
        opened = open_live(parse_source(f"{address}/left"), GivenCalibration(fov_deg=60.0))
        source = opened.source
        assert gather(source, 20.0, 3)
    gather(source, 0.6)  # what had come before
    silence = source.silence()
    assert silence is not None and silence.startswith("the camera: no image came for 0.")
    with served(images, int(address.rpartition(":")[2])), source:
        found = gather(source, 20.0, 3)
    assert len(found) == 3
    assert any("no image came for" in notice for notice in found[0].notices)


@pytest.mark.extended
def test_stamps_of_the_sender_that_jump_are_told_and_times_go_on(images: Path) -> None:
    with served(images) as address:
        opened = open_live(
            parse_source(f"{address}/left?jump=1,-100"), GivenCalibration(fov_deg=60.0)
        )
        with opened.source as source:
            found = gather(source, 20.0, 120)
    notices = [notice for raw in found for notice in raw.notices if "clock went back" in notice]
    assert len(notices) == 1 and notices[0].startswith("the camera: its clock went back by ")
    times_s = np.array([raw.time_s for raw in found])
    assert (np.diff(times_s) > 0.0).all()


@pytest.mark.extended
def test_an_image_that_was_dropped_is_told(images: Path) -> None:
    with served(images, rate_hz=20.0) as address:
        opened = open_live(parse_source(f"{address}/left?drop=7"), GivenCalibration(fov_deg=60.0))
        with opened.source as source:
            found = gather(source, 30.0, 60)
    notices = [notice for raw in found for notice in raw.notices]
    assert "the camera: 1 image is missing before this one" in notices


def test_an_address_that_does_not_answer_is_refused_without_its_password() -> None:
    with pytest.raises(CaptureError, match=r"'http://\*\*\*@127.0.0.1:9/' does not answer") as no:
        open_live(parse_source("http://me:secret@127.0.0.1:9/"), GivenCalibration(fov_deg=60.0))
    assert "secret" not in str(no.value)


def test_an_address_that_answers_with_a_page_was_reached(images: Path) -> None:
    with served(images) as address, pytest.raises(CaptureError) as no:
        open_live(parse_source(f"{address}/left?page=1"), GivenCalibration(fov_deg=60.0))
    assert "page=1' was reached, but answers text/html, which is a page and no images" in str(
        no.value
    )
    assert "does not answer" not in str(no.value) and "/stream" in str(no.value)


def test_images_that_are_cut_short_are_counted_and_not_told_as_missing(images: Path) -> None:
    with served(images, rate_hz=30.0) as address:
        opened = open_live(parse_source(f"{address}/left?cut=5"), GivenCalibration(fov_deg=60.0))
        with opened.source as source:
            found = gather(source, 20.0, 25)
    notices = [notice for raw in found for notice in raw.notices]
    damaged = "the camera: 1 image before this one is damaged, such as cut short, and left out"
    assert notices.count(damaged) >= 3


def answer(body: bytes, boundary: str = "b") -> BytesIO:
    stream = BytesIO(body)
    heads = Message()
    heads["Content-Type"] = f'multipart/x-mixed-replace; boundary="{boundary}"'
    stream.headers = heads  # type: ignore
    return stream


JPEG = cv2.imencode(".jpg", np.full((8, 8, 3), 200, np.uint8))[1].tobytes()


@pytest.mark.parametrize(
    ("body", "boundary"),
    [
        (b"--b\r\nContent-Length: %d\r\n\r\n" % len(JPEG) + JPEG + b"\r\n--b\r\n", "b"),
        (b"--b\ncontent-type: image/jpeg\n\n" + JPEG + b"\n--b\n", "--b"),
        (b"\r\nbefore\r\n--b\r\n\r\n" + JPEG + b"\r\n--b--", "b"),
    ],
)
def test_parts_are_read_however_a_sender_writes_them(body: bytes, boundary: str) -> None:
    video = MjpegVideo(answer(body, boundary))  # type: ignore
    assert video.grab()
    found, delivery = video.retrieve()
    assert found and delivery is not None
    assert delivery.images[0].shape == (8, 8, 3)
    assert delivery.encoded == JPEG
    assert delivery.stamp_s is None


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (b"--b\r\nContent-Length: 99999\r\n\r\n" + JPEG, "the stream ended"),
        (b"--b\r\nContent-Length: 99999999999\r\n\r\n", "announces an image of 95367 MiB"),
        (b"--b\r\n" + b"a: b\r\n" * 100, "has no end"),
        (b"--b\r\n\r\n" + JPEG[:-2], "the stream ended"),
        (b"", "the stream ended"),
    ],
)
def test_a_stream_that_is_none_is_lost(body: bytes, message: str) -> None:
    with pytest.raises(CaptureError, match=message):
        MjpegVideo(answer(body)).grab()  # type: ignore


def test_a_part_that_is_cut_short_is_no_image() -> None:
    cut = JPEG[:-20]
    video = MjpegVideo(answer(b"--b\r\nContent-Length: %d\r\n\r\n" % len(cut) + cut))  # type: ignore
    assert video.grab()
    assert video.retrieve() == (False, None)


def test_the_halves_of_a_stream_are_two_cameras(images: Path) -> None:
    with served(images) as address:
        word = parse_source(f"side-by-side:{address}/left")
        with open_live(word, GivenCalibration(fov_deg=60.0, baseline_m=0.06)).source as source:
            (raw,) = gather(source, 20.0, 1)
    assert [camera.lens.size_px for camera in source.rig] == [(32, 48)] * 2
    assert all(image is not None and image.pixels.shape == (48, 32, 3) for image in raw.images)
    assert isinstance(source.rig[0].lens, Lens)


def test_an_image_that_claims_to_be_huge_is_not_decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    at = JPEG.index(b"\xff\xc0") + 5
    huge = JPEG[:at] + (49525).to_bytes(2, "big") + (30000).to_bytes(2, "big") + JPEG[at + 4 :]
    monkeypatch.setattr(cv2, "imdecode", None)
    video = MjpegVideo(answer(b"--b\r\nContent-Length: %d\r\n\r\n" % len(huge) + huge))  # type: ignore
    assert video.grab()
    assert video.retrieve() == (False, None)
