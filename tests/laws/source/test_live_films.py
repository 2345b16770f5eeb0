"""Recorded videos in place of live cameras."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from played_sources import SIZE_PX, rig

from servoid.errors import CaptureError
from servoid.source import Instant, Live, Video
from servoid.source.streams.film import FilmVideo

RATE_HZ, COUNT = 20.0, 12

Device = Callable[[Path], str | Video]


def film(path: Path, *, rate_hz: float = RATE_HZ) -> Path:
    """Write a film whose images are brighter from one to the next."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), rate_hz, SIZE_PX)
    for number in range(COUNT):
        writer.write(np.full((SIZE_PX[1], SIZE_PX[0], 3), 10 * number, np.uint8))
    writer.release()
    return path


def played(*devices: str | Video) -> tuple[list[Instant], list[float]]:
    """Return the observations of films until their end, and when each arrived."""
    found, arrived_s = [], []
    limit_s = time.monotonic() + 10.0
    with Live(rig(*devices)) as source:
        while not source.is_over:
            assert time.monotonic() < limit_s, "the films do not end"
            instant = source.newest()
            if instant is not None:
                found.append(instant)
                arrived_s.append(time.monotonic())
            time.sleep(0.001)
    return found, arrived_s


@pytest.mark.parametrize(
    "device",
    [str, Path.as_uri, lambda path: cv2.VideoCapture(str(path))],
    ids=["path", "address", "VideoCapture"],
)
def test_a_film_comes_as_its_camera_would_send_it_and_is_then_over(
    device: Device, tmp_path: Path
) -> None:
    found, arrived_s = played(device(film(tmp_path / "film.avi")))
    shown = [one.images[0] for one in found]
    bright = [image.mean() for image in shown if image is not None]
    assert np.diff(bright).min() > 5.0
    assert COUNT - 2 <= len(bright) <= COUNT  # a busy computer may be late for one
    steps = np.diff([one.time_s for one in found])
    # Whole intervals, although images arrive when the computer has time for them.
    assert steps * RATE_HZ == pytest.approx(np.round(steps * RATE_HZ), abs=0.1)
    assert found[-1].time_s - found[0].time_s == pytest.approx((COUNT - 1) / RATE_HZ, abs=0.11)
    assert arrived_s[-1] - arrived_s[0] > 0.8 * (COUNT - 1) / RATE_HZ


def test_two_films_are_a_pair_of_cameras(tmp_path: Path) -> None:
    films = [str(film(tmp_path / f"{name}.avi")) for name in ("left", "right")]
    found, _ = played(*films)
    pairs = [one.images for one in found if all(image is not None for image in one.images)]
    assert len(pairs) >= COUNT - 2
    for left, right in pairs:
        assert left is not None and right is not None
        assert left.mean() == right.mean()


def test_images_of_a_film_that_nobody_was_in_time_for_are_missing(tmp_path: Path) -> None:
    class Slow:
        """A film that halts before its fourth image, as a computer does that is busy."""

        def __init__(self, path: Path) -> None:
            from servoid.source import opened

            self._film, self._count = opened("left", str(path)), 0

        def grab(self) -> bool:
            self._count += 1
            if self._count == 4:
                time.sleep(5.5 / RATE_HZ)
            return self._film.grab()

        def retrieve(self) -> tuple[bool, object]:
            return self._film.retrieve()

        def release(self) -> None:
            self._film.release()

    found, _ = played(Slow(film(tmp_path / "film.avi")))
    notices = [notice for one in found for notice in one.notices]
    assert any("images are missing before this one" in notice for notice in notices)
    assert found[-1].time_s - found[0].time_s == pytest.approx((COUNT - 1) / RATE_HZ, abs=0.11)


def test_a_film_that_is_decoded_more_slowly_than_it_plays_is_shown_as_slowly(
    tmp_path: Path,
) -> None:
    class Slow:
        """A film of which each image takes longer than it is shown."""

        def __init__(self, path: Path) -> None:
            film = cv2.VideoCapture(str(path))
            self.get, self.retrieve, self.release = film.get, film.retrieve, film.release
            self._grab = film.grab

        def grab(self) -> bool:
            time.sleep(1.6 / RATE_HZ)
            return self._grab()

    found, _ = played(FilmVideo(Slow(film(tmp_path / "film.avi"))))  # type: ignore[arg-type]
    assert len([one for one in found if one.images[0] is not None]) >= COUNT // 3


def test_a_film_that_breaks_off_says_so_with_its_last_image_and_is_over(tmp_path: Path) -> None:
    whole = film(tmp_path / "whole.avi")
    broken = tmp_path / "broken.avi"
    *pieces, _ = whole.read_bytes().split(b"00dc")[:8]
    broken.write_bytes(b"00dc".join(pieces))
    with Live(rig(str(broken))) as source:
        found: list[Instant] = []
        while not source.is_over:
            instant = source.newest()
            found += [] if instant is None else [instant]
            time.sleep(0.001)
        time.sleep(0.3)
        silence = source.silence()
    words = f"the film breaks off: its header promises {COUNT} images, but only "
    assert words in found[-1].notices[-1] and found[-1].images[0] is not None
    assert not any(words in notice for one in found[:-1] for notice in one.notices)
    assert silence is not None and words in silence
    assert not any(
        "breaks off" in notice for one in played(str(whole))[0] for notice in one.notices
    )


def test_a_film_is_not_over_before_its_last_image_was_returned(tmp_path: Path) -> None:
    path = film(tmp_path / "film.avi", rate_hz=100.0)
    with Live(rig(str(path))) as source:
        time.sleep(COUNT / 100.0 + 1.0)
        assert not source.is_over
        last = source.newest()
        assert source.is_over
    assert last is not None and last.images[0] is not None
    assert last.images[0].mean() == pytest.approx(10.0 * (COUNT - 1), abs=3.0)


class Gap:
    """A film whose times jump before its fourth image."""

    def __init__(self, path: Path, gap_s: float) -> None:
        film = cv2.VideoCapture(str(path))
        self.grab, self.retrieve, self.release = film.grab, film.retrieve, film.release
        self._get, self._gap_s = film.get, gap_s

    def get(self, kind: int) -> float:
        jumped = kind == cv2.CAP_PROP_POS_MSEC and self._get(cv2.CAP_PROP_POS_FRAMES) > 3
        return self._get(kind) + 1e3 * self._gap_s * jumped


def test_a_film_that_waits_for_its_next_image_is_closed_at_once(tmp_path: Path) -> None:
    video = FilmVideo(Gap(film(tmp_path / "film.avi"), 3600.0))  # type: ignore[arg-type]
    with Live(rig(video)) as source:
        limit_s = time.monotonic() + 1.0
        while time.monotonic() < limit_s:
            source.newest()
            time.sleep(0.01)
        closing_s = time.monotonic()
    assert time.monotonic() - closing_s < 0.5
    assert not source.is_over


def test_an_hour_between_two_images_of_a_film_is_played_as_seconds_and_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("servoid.source.streams.film._LONGEST_GAP_S", 0.5)
    video = FilmVideo(Gap(film(tmp_path / "film.avi"), 3600.0))  # type: ignore[arg-type]
    found, arrived_s = played(video)
    assert max(np.diff(arrived_s)) < 2.0
    assert max(np.diff([one.time_s for one in found])) == pytest.approx(0.5, abs=0.15)
    notices = [notice for one in found for notice in one.notices]
    assert any("times jump by 3600" in n and "shown after 0.5 s" in n for n in notices)


def test_a_camera_of_other_things_than_a_camera_has_is_refused(tmp_path: Path) -> None:
    (camera,) = rig(str(tmp_path / "film.avi"))
    for wrong, words in (
        ({"device": None}, "LiveCamera.device must be a number, .* but is of type NoneType"),
        ({"lens": "phone"}, "LiveCamera.lens must be a servoid.camera.Lens, but is of type str"),
        ({"rig_from_camera": np.eye(4)}, "rig_from_camera must be a .*Pose, but .* ndarray"),
    ):
        with pytest.raises(CaptureError, match=words):
            replace(camera, **wrong)  # type: ignore[arg-type]
    with pytest.raises(CaptureError, match=r"a list of LiveCamera, but it holds 0; .*open_live"):
        Live([0])  # type: ignore[list-item]
    assert replace(camera, device=tmp_path).device == str(tmp_path)  # type: ignore[arg-type]
