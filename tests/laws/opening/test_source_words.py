"""SOURCE: one grammar for whatever is there, and what it opens as."""

import os
from pathlib import Path

import cv2
import numpy as np
import pytest

from servoid.camera import Lens
from servoid.errors import CameraError, CaptureError
from servoid.opening import (
    GivenCalibration,
    Kind,
    belongs_to_source,
    open_filmed,
    open_recorded,
    parse_source,
)
from servoid.pose import Pose
from servoid.record import FolderRecorder
from servoid.source import MountedCamera, RawImage, RawInstant, read_rig

SIZE_PX = (64, 48)


def picture(number: int, size_px: tuple[int, int] = SIZE_PX) -> np.ndarray:
    """Return an image whose brightness is its number, and whose right half is brighter by 100."""
    image = np.full((size_px[1], size_px[0], 3), 5 * number, np.uint8)
    image[:, size_px[0] // 2 :] += 100
    return image


def write_video(path: Path, count: int = 8, rate_hz: float = 25.0) -> Path:
    code = "MJPG" if path.suffix == ".avi" else "mp4v"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*code), rate_hz, SIZE_PX)
    for number in range(count):
        writer.write(picture(number))
    writer.release()
    return path


def write_images(folder: Path, count: int = 4) -> Path:
    folder.mkdir()
    for number in range(count):
        cv2.imwrite(str(folder / f"{number:03d}.png"), picture(number))
    return folder


@pytest.mark.parametrize(
    ("text", "kind", "name"),
    [
        ("0", Kind.CAMERA, "0"),
        ("007", Kind.CAMERA, "7"),
        ("/dev/v4l/by-id/usb-eye-index0", Kind.CAMERA, "/dev/v4l/by-id/usb-eye-index0"),
        ("rtsp://10.0.0.5/stream", Kind.STREAM, "rtsp://10.0.0.5/stream"),
        ("HTTP://phone:8080/video", Kind.STREAM, "HTTP://phone:8080/video"),
        ("videotestsrc ! appsink", Kind.STREAM, "videotestsrc ! appsink"),
        ("realsense:0123", Kind.REALSENSE, "0123"),
        ("genicam:Fake_1", Kind.GENICAM, "Fake_1"),
        ("sim:snail", Kind.SIM, "snail"),
    ],
)
def test_a_word_names_a_device(text: str, kind: Kind, name: str) -> None:
    word = parse_source(text)
    assert (word.kind, word.name, word.is_live, str(word)) == (kind, name, True, text)


def test_a_file_is_told_by_its_name_and_a_folder_by_what_lies_in_it(tmp_path: Path) -> None:
    video = write_video(tmp_path / "a+b.mp4")
    images = write_images(tmp_path / "images")
    (images / "._000.png").write_bytes(b"what macOS leaves")
    bag, ros = tmp_path / "run.mcap", tmp_path / "ros"
    bag.touch()
    ros.mkdir()
    for name in ("metadata.yaml", "ros_0.db3"):
        (ros / name).touch()
    capture = tmp_path / "capture.toml"
    capture.write_text("version = 1\n[[camera]]\nimages = 'device = 0'\n")
    rig = tmp_path / "rig.toml"
    rig.write_text("version = 1\n[[camera]]\n  device = 0\n")
    found = {str(path): parse_source(str(path)) for path in (video, images, bag, ros, capture, rig)}
    kinds = [word.kind for word in found.values()]
    assert kinds == [Kind.VIDEO, Kind.IMAGES, Kind.BAG, Kind.BAG, Kind.CAPTURE, Kind.RIG]
    assert [path.name for path in found[str(images)].places] == [f"00{n}.png" for n in range(4)]
    assert parse_source(str(tmp_path)).kind is Kind.CAPTURE  # whoever wrote the file wants it read


def test_several_files_are_written_in_one_word(tmp_path: Path) -> None:
    left, right = write_video(tmp_path / "l.mp4"), write_video(tmp_path / "r.mp4")
    pair = parse_source(f"{left}+{right}")
    assert (pair.kind, pair.places) == (Kind.VIDEOS, (left, right))
    images = write_images(tmp_path / "images")
    some = parse_source(f"{images}/00[13]*")
    assert [path.name for path in some.places] == ["001.png", "003.png"]
    halves = parse_source(f"side-by-side:{left}")
    assert (halves.kind, halves.halves, halves.place) == (Kind.VIDEO, True, left)


def test_two_folders_of_images_are_not_taken_for_a_file_that_is_missing(tmp_path: Path) -> None:
    left, right = (write_images(tmp_path / name) for name in ("left", "right"))
    for text in (f"{left}+{right}", f"{left}/*.png+{right}/*.png", f"{left}/001.png+{right}"):
        with pytest.raises(CaptureError, match=r"a plus sign joins videos only; .* capture\.toml"):
            parse_source(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("none.mp4", r"^there is no file or folder none\.mp4; correct its name .{0,50}$"),
        ("", "SOURCE is empty, as that of a variable that was not set; name it, or write ."),
        (" ", "SOURCE is empty"),
        ("a.mp4+b.mp4", "there is no video a.mp4"),
        ("none/*.png", "'none/\\*.png' matches no image"),
        ("ftp://here/film.mp4", "servoid cannot open ftp:// address"),
        ("side-by-side:sim:snail", "but sim:snail is a sim"),
    ],
)
def test_a_word_that_names_nothing_is_refused(text: str, message: str) -> None:
    with pytest.raises(CaptureError, match=message):
        parse_source(text)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.parametrize("text", ["film.mp4", "film.mp4+right.mp4", "side-by-side:film.mp4"])
def test_a_pipe_is_refused_as_a_pipe_and_not_as_missing(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo("film.mp4")
    message = r"^cannot read film\.mp4: it is a named pipe, not a file; give a file$"
    with pytest.raises(CaptureError, match=message):
        parse_source(text)


def test_a_bare_video_is_a_recording_of_one_camera_at_rest(tmp_path: Path) -> None:
    word = parse_source(str(write_video(tmp_path / "film.mp4")))
    opened = open_recorded(word, GivenCalibration(fov_deg=90.0))
    (camera,) = opened.capture.cameras
    assert camera.lens.size_px == SIZE_PX
    assert camera.lens.focal_px == pytest.approx((32.0, 32.0))
    assert camera.lens.center_px == (31.5, 23.5)
    assert opened.capture.is_recording
    assert opened.capture.times_s == pytest.approx(np.arange(8) / 25.0)
    assert [len(camera.pictures), len(opened.capture)] == [8, 8]
    assert (
        "64x48 pixels cover 90 degrees from left to right, a focal length of 32 px"
        in (opened.notes[0])
    )


def test_a_video_without_any_calibration_is_refused_by_naming_what_would_do(tmp_path: Path) -> None:
    left, right = write_video(tmp_path / "l.avi"), write_video(tmp_path / "r.avi")
    with pytest.raises(CaptureError, match=r"give --fov.* --fov 65, or .* servoid scan"):
        open_recorded(parse_source(str(left)))
    with pytest.raises(CaptureError, match=r"give --fov.*--baseline.*--calibration"):
        open_recorded(parse_source(f"{left}+{right}"))
    with pytest.raises(
        CaptureError, match=r"the poses of its 2 cameras are unknown; .* or --baseline"
    ):
        open_recorded(parse_source(f"{left}+{right}"), GivenCalibration(fov_deg=60.0))


def test_two_videos_are_two_parallel_cameras_by_a_baseline(tmp_path: Path) -> None:
    left, right = write_video(tmp_path / "l.avi", 9), write_video(tmp_path / "r.avi", 8)
    known = GivenCalibration(fov_deg=60.0, baseline_m=0.06)
    opened = open_recorded(parse_source(f"{left}+{right}"), known)
    one, other = opened.capture.cameras
    assert (one.name, other.name) == ("left", "right")
    assert (one.rig_from_camera.inverse() @ other.rig_from_camera).translation == (0.06, 0.0, 0.0)
    assert len(opened.capture) == 8
    assert "l.avi has 1 image more than the other" in opened.notes[1]
    slow = write_video(tmp_path / "slow.avi", rate_hz=20.0)
    with pytest.raises(CaptureError, match="25 and 20 images per second"):
        open_recorded(parse_source(f"{left}+{slow}"), known)


def test_the_halves_of_an_image_are_two_cameras(tmp_path: Path) -> None:
    folder = write_images(tmp_path / "images")
    known = GivenCalibration(fov_deg=60.0, baseline_m=0.06, rate_hz=10.0)
    opened = open_recorded(parse_source(f"side-by-side:{folder}"), known)
    assert [camera.lens.size_px for camera in opened.capture.cameras] == [(32, 48)] * 2
    left, right = (camera.pictures[3] for camera in opened.capture.cameras)
    assert left is not None and right is not None
    assert (left.read((32, 48)) == 15).all() and (right.read((32, 48)) == 115).all()
    assert left.read((32, 48), 2).shape == (24, 16, 3)
    assert opened.capture.times_s == pytest.approx((0.0, 0.1, 0.2, 0.3))
    assert not any("assumed" in note for note in opened.notes)


def test_images_without_times_are_said_to_be_taken_thirty_a_second(tmp_path: Path) -> None:
    opened = open_recorded(
        parse_source(str(write_images(tmp_path / "i"))), GivenCalibration(fov_deg=60.0)
    )
    assert opened.capture.rate_hz == 30.0
    assert opened.notes[1].startswith("30 images per second are assumed")


CALIBRATION = """version = 1
[[camera]]
name = "eye"
device = 3
size_px = [64, 48]
model = "brown_conrady"
focal_px = [60.5, 60.25]
center_px = [31.0, 24.0]
distortion = [-0.2, 0.05, 0.0, 0.0]
"""


def test_a_calibration_says_how_a_bare_video_was_seen(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(CALIBRATION)
    word = parse_source(str(write_video(tmp_path / "film.mp4")))
    opened = open_recorded(word, GivenCalibration(calibration=path))
    (camera,) = opened.capture.cameras
    assert (camera.name, camera.lens.focal_px) == ("eye", (60.5, 60.25))
    assert opened.notes == ()
    path.write_text(CALIBRATION.replace("[64, 48]", "[640, 480]"))
    with pytest.raises(CaptureError, match=r"have 64x48 pixels; give the calibration that was"):
        open_recorded(word, GivenCalibration(calibration=path))
    with pytest.raises(CaptureError, match=r"is of 1 camera, but .* has 2"):
        open_recorded(parse_source(f"side-by-side:{word}"), GivenCalibration(calibration=path))


@pytest.mark.parametrize(
    ("text", "tool"),
    [
        ("# Camera list with one line of data per camera:\n1 PINHOLE 640 480", "COLMAP"),
        ('<?xml version="1.0"?>\n<document version="2">\n', "Metashape"),
        ('{"camera_angle_x": 0.7, "frames": []}', "nerfstudio"),
    ],
)
def test_a_calibration_of_another_program_is_named_with_what_to_do(
    text: str, tool: str, tmp_path: Path
) -> None:
    path = tmp_path / "calibration"
    path.write_text(text)
    word = parse_source(str(write_video(tmp_path / "film.mp4")))
    with pytest.raises(CaptureError, match=rf"is a calibration by {tool}: .*howto/lenses\.md"):
        open_recorded(word, GivenCalibration(calibration=path))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with a name here")
def test_a_calibration_that_is_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "calibration"
    os.mkfifo(path)
    word = parse_source(str(write_video(tmp_path / "film.mp4")))
    with pytest.raises(CaptureError, match="calibration"):
        open_recorded(word, GivenCalibration(calibration=path))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"fov_deg": 0.0}, "--fov: an angle of view must be more than 0 .* but it is 0"),
        ({"fov_deg": 1.009}, r"is that of hardly any lens \(in radians it would be 57.8 degrees\)"),
        ({"fov_deg": 178.0}, "178 degrees from left to right is that of a fisheye"),
        ({"fov_deg": float("nan")}, "--fov: .* but it is NaN"),
        ({"baseline_m": -1.0}, "--baseline is -1; give a positive number"),
        ({"rate_hz": float("inf")}, "--rate is inf"),
        ({"fov_deg": 60.0, "calibration": Path("a")}, "leave --fov and --baseline out"),
    ],
)
def test_what_is_told_of_cameras_is_checked(given: dict[str, float], message: str) -> None:
    with pytest.raises((CaptureError, CameraError), match=message):
        GivenCalibration(**given)  # type: ignore


def test_what_a_capture_says_of_its_cameras_is_not_told_twice(tmp_path: Path) -> None:
    write_images(tmp_path / "images")
    (tmp_path / "capture.toml").write_text(
        'version = 1\n[[camera]]\nname = "eye"\nimages = "images/*.png"\nsize_px = [64, 48]\n'
        "fov_deg = 50\n"
    )
    with pytest.raises(CaptureError, match="has its own calibration; leave --fov out"):
        open_recorded(parse_source(str(tmp_path)), GivenCalibration(fov_deg=60.0))


def test_a_recording_that_is_not_calibrated_takes_what_is_told(tmp_path: Path) -> None:
    video = [np.zeros((48, 64, 3), np.uint8)] * 2
    lens = Lens(model="pinhole", size_px=SIZE_PX, focal_px=(60.0, 60.0), center_px=(31.5, 23.5))
    eye = MountedCamera("eye", lens, Pose.identity())
    recorder = FolderRecorder(tmp_path / "run", [eye], is_calibrated=False)
    for index, pixels in enumerate(video):
        image = RawImage(pixels, 0.1 * index, index + 1)
        recorder.add(RawInstant(index, 0.1 * index, (image,), (Pose.identity(),)))
    word = parse_source(str(recorder.close()))
    with pytest.raises(CaptureError, match=r"give focal_px, .* take --fov or --calibration"):
        open_recorded(word)
    capture = open_recorded(word, GivenCalibration(fov_deg=90.0)).capture
    assert capture.cameras[0].lens.focal_px == pytest.approx((32.0, 32.0))
    assert capture.times_s == (0.0, 0.1)
    calibration = tmp_path / "rig.toml"
    calibration.write_text(CALIBRATION)
    capture = open_recorded(word, GivenCalibration(calibration=calibration)).capture
    assert capture.cameras[0].lens.focal_px == (60.5, 60.25)
    assert [len(open_filmed(word).footage.names), open_filmed(word).lens] == [2, None]


def test_what_is_live_is_no_capture() -> None:
    with pytest.raises(CaptureError, match="servoid record rtsp://a/b --out run"):
        open_recorded(parse_source("rtsp://a/b"))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("devices = 0", "line 4, .*unknown key 'devices'; .*did you mean 'device'"),
        ("source = 'left'", "line 4, .*unknown key 'source'; known keys: .*device"),
        ("", "the key 'device' is missing"),
    ],
)
def test_a_rig_file_whose_device_is_mistyped_is_told_by_the_key_and_owns_no_other_file(
    tmp_path: Path, line: str, words: str
) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(
        f"version = 1\n[[camera]]\nname = 'left'\n{line}\nsize_px = [640, 480]\n"
        "focal_px = [579.4, 579.4]\ncenter_px = [319.5, 239.5]\n"
    )
    word = parse_source(str(path))
    assert word.kind is Kind.RIG
    assert not belongs_to_source(tmp_path / "poses.csv", word)
    with pytest.raises(CaptureError, match=words):
        read_rig(path)


@pytest.mark.parametrize("key", ["images = 'left'", "image = 'left'", "masks = 'masks'"])
def test_a_file_of_cameras_with_images_is_a_capture_under_any_name(
    tmp_path: Path, key: str
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(f"version = 1\n[[camera]]\nname = 'left'\n{key}\n")
    assert parse_source(str(path)).kind is Kind.CAPTURE
