"""Bags as captures: what is in them comes out, in each form, and what is damaged is told."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from bag_writing import (
    START_NS,
    Entry,
    compressed,
    image,
    info,
    tf,
    write_bag,
    write_by_ros1,
)
from scenes_bags import (
    BASELINE_M,
    FRAMES,
    SIZE_PX,
    STEP_NS,
    STILL,
    K,
    only_camera,
    pixels,
    stamp,
    stereo_entries,
    world_from_rig,
)
from tiers import tiered

from servoid.capture import Capture
from servoid.errors import CaptureError, ImageError, ServoidError
from servoid.exchange import is_bag, is_capture, open_any, open_bag
from servoid.source import read_instants
from servoid.words import measured

NAMES = ("run.mcap", "run", "run.bag")


def check_stereo(capture: Capture, count: int = 6) -> None:
    assert [camera.name for camera in capture.cameras] == ["left", "right"]
    assert len(capture) == count and capture.is_recording
    assert capture.rate_hz == pytest.approx(30.0, rel=1e-6)
    assert capture.times_s == tuple(stamp(index) / 10**9 for index in range(count))
    for index, pose in enumerate(capture.world_from_rig):
        assert np.abs((pose.inverse() @ world_from_rig(index)).log()).max() < 1e-12
    for side, camera in enumerate(capture.cameras):
        assert camera.rig_from_camera.translation == (side * BASELINE_M, 0.0, 0.0)
        assert camera.lens.model == "pinhole" and camera.lens.focal_px == (50.0, 51.0)
        assert camera.lens.center_px == (19.25, 14.75)
        for index, picture in enumerate(camera.pictures):
            assert picture is not None
            assert (picture.read(SIZE_PX) == pixels(2 * index + side)).all()


@pytest.mark.parametrize("name", NAMES)
def test_a_bag_of_each_form_is_the_capture_that_was_recorded(tmp_path: Path, name: str) -> None:
    path = write_bag(tmp_path / name, stereo_entries())
    assert is_bag(path) and is_capture(path)
    check_stereo(open_any(path))


@pytest.mark.parametrize("compression", tiered(["lz4", "bz2", "none"]))
def test_a_bag_that_ros_1_itself_wrote_is_the_capture_that_was_recorded(
    tmp_path: Path, compression: str
) -> None:
    path = write_by_ros1(tmp_path / "real.bag", stereo_entries(), compression)
    check_stereo(open_bag(path))


def test_images_are_read_in_any_order(tmp_path: Path) -> None:
    for name in NAMES:
        capture = open_bag(write_bag(tmp_path / name, stereo_entries(20)))
        for index in np.random.default_rng(0).permutation(20):
            for side, camera in enumerate(capture.cameras):
                picture = camera.pictures[index]
                assert picture is not None
                assert (picture.read(SIZE_PX) == pixels(2 * index + side)).all()


def test_guessed_topics_are_said_and_chosen_ones_are_taken_in_their_order(tmp_path: Path) -> None:
    entries = stereo_entries()
    entries += [image("/debug/image_raw", stamp(i), "debug", pixels(i)) for i in range(6)]
    path = write_bag(tmp_path / "run.mcap", entries)
    guessed = open_bag(path)
    assert guessed.notes[0] == (
        "of the topics of images /stereo/left/image_raw, /stereo/right/image_raw were chosen; left "
        "out: /debug/image_raw; --topic chooses others"
    )
    chosen = open_bag(path, ["/stereo/right/image_raw", "/stereo/left/image_raw"])
    assert [camera.name for camera in chosen.cameras] == ["right", "left"]
    assert not any("were chosen" in note for note in chosen.notes)
    with pytest.raises(CaptureError, match=r"no images on '/left'; .* /stereo/left/image_raw, "):
        open_bag(path, ["/left"])
    with pytest.raises(CaptureError, match=r"no camera_info belongs to /debug/image_raw; record"):
        open_bag(path, ["/debug/image_raw"])


def test_images_are_paired_by_their_stamps_and_lone_ones_are_told(tmp_path: Path) -> None:
    entries = []
    for one in stereo_entries(30):
        index = round((one.stamp_ns - START_NS) / STEP_NS)
        if "/right/image" in one.topic:
            if index % 7 == 6:
                continue
            one = replace(one, stamp_ns=one.stamp_ns + 4_000_000)
        entries.append(one)
    capture = open_bag(write_bag(tmp_path / "run.mcap", sorted(entries, key=lambda e: e.stamp_ns)))
    assert len(capture) == 30
    right = capture.cameras[1]
    assert [i for i, picture in enumerate(right.pictures) if picture is None] == [6, 13, 20, 27]
    for index, picture in enumerate(right.pictures):
        assert picture is None or (picture.read(SIZE_PX) == pixels(2 * index + 1)).all()
    notes = "; ".join(capture.notes)
    assert "4 of 30 observations lack an image of right: none was taken at that time" in notes
    assert "images of left and right were taken 4 ms apart, at most 4 ms" in notes


@pytest.mark.parametrize("late_ms", [STEP_NS / 1e6, 5000.0])
def test_an_image_that_is_too_late_to_be_paired_is_told_by_how_much(
    tmp_path: Path, late_ms: float
) -> None:
    late_ns = round(1e6 * late_ms)
    entries = [
        replace(one, stamp_ns=one.stamp_ns + late_ns) if "/right/image" in one.topic else one
        for one in stereo_entries(6)
    ]
    capture = open_bag(write_bag(tmp_path / "run.mcap", sorted(entries, key=lambda e: e.stamp_ns)))
    [first] = read_instants(capture, capture.observations()[:1])
    [notice] = first.notices
    assert notice.startswith(
        f"camera right: there is no image: the nearest was taken {measured(late_ms)} ms after"
    )
    assert "at most 16.33 ms apart; if none was lost, synchronise the cameras" in notice


def test_images_without_a_stamp_get_the_time_at_which_they_were_recorded(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    entries = only_camera(stereo_entries(4))
    # The stamp of a message is written by its fields, the time of recording by its entry.
    capture = open_bag(write_bag(path, entries))
    assert capture.times_s == tuple(stamp(index) / 10**9 for index in range(4))


def test_stamps_that_go_back_are_brought_in_order_and_told(tmp_path: Path) -> None:
    entries = only_camera(stereo_entries(6))
    images = [one for one in entries if "image_raw" in one.topic]
    rest = [one for one in entries if "image_raw" not in one.topic]
    swapped = [images[i] for i in (0, 2, 1, 3, 5, 4)]
    capture = open_bag(write_bag(tmp_path / "run.mcap", [*rest, *swapped, images[0]]))
    assert capture.times_s == tuple(sorted(capture.times_s or ()))
    assert len(capture) == 6


def test_depth_that_is_registered_comes_with_the_images(tmp_path: Path) -> None:
    entries = only_camera(stereo_entries(3))
    rng = np.random.default_rng(1)
    millimetres = rng.integers(0, 4000, (3, 30, 40)).astype(np.uint16)
    for index in range(3):
        at = stamp(index) + 2_000_000
        topic = "/stereo/aligned_depth/image_raw"
        entries.append(image(topic, at, FRAMES[0], millimetres[index], "16UC1"))
    capture = open_bag(write_bag(tmp_path / "run", sorted(entries, key=lambda e: e.stamp_ns)))
    assert [camera.name for camera in capture.cameras] == ["left"]
    for index in range(3):
        depth = capture.cameras[0].recorded_depth(index)
        assert depth is not None
        expected = np.where(millimetres[index] == 0, np.nan, millimetres[index] / 1000.0)
        assert np.array_equal(depth, expected.astype(np.float32), equal_nan=True)
    assert capture.all_views()[1].recorded_depth() is not None


def test_depth_that_is_not_registered_is_refused_where_it_is_named(tmp_path: Path) -> None:
    entries = only_camera(stereo_entries(3))
    depth = np.ones((15, 20), np.float32)
    entries += [image("/depth/image", stamp(i), "depth_optical", depth, "32FC1") for i in range(3)]
    path = write_bag(tmp_path / "run.mcap", entries)
    capture = open_bag(path)
    assert capture.cameras[0].recorded_depth(0) is None
    said = r"the depth on '/depth/image' \(frame 'depth_optical', 20x15 pixels\) is not registered"
    assert any(re.search(said, note) for note in capture.notes)
    with pytest.raises(CaptureError, match="is not registered to the images of /stereo/left"):
        open_bag(path, ["/stereo/left/image_raw", "/depth/image"])


def test_jpegs_are_decoded_as_files_are(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run.mcap", stereo_entries(2, is_jpeg=True))
    picture = open_bag(path).cameras[0].pictures[1]
    file = tmp_path / "image.jpg"
    file.write_bytes(cv2.imencode(".jpg", pixels(2)[..., ::-1])[1].tobytes())
    from servoid.camera import read_image

    assert picture is not None
    assert (picture.read(SIZE_PX) == read_image(file, SIZE_PX)).all()
    assert (picture.read(SIZE_PX, 2) == read_image(file, SIZE_PX, 2)).all()


def test_an_image_that_is_damaged_is_one_that_cannot_be_read(tmp_path: Path) -> None:
    entries = only_camera(stereo_entries(3, is_jpeg=True))
    at = next(
        i for i, one in enumerate(entries) if one.stamp_ns == stamp(1) and "image" in one.topic
    )
    data = entries[at].fields["data"]
    entries[at] = compressed(entries[at].topic, stamp(1), FRAMES[0], data[: len(data) // 2], "jpeg")
    picture = open_bag(write_bag(tmp_path / "run.mcap", entries)).cameras[0].pictures[1]
    assert picture is not None
    with pytest.raises(ImageError, match=r"compressed of .* is cut short"):
        picture.read(SIZE_PX)


@pytest.mark.parametrize("name", NAMES)
def test_a_bag_that_is_cut_anywhere_is_refused_in_words_or_read(tmp_path: Path, name: str) -> None:
    path = write_bag(tmp_path / name, stereo_entries())
    file = path if path.is_file() else next(path.glob("*.db3"))
    whole = file.read_bytes()
    for share in (0.0, 0.001, 0.01, 0.3, 0.5, 0.9, 0.999):
        file.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(CaptureError) as caught:
            open_bag(path)
        assert str(path) in str(caught.value) or file.name in str(caught.value)


@pytest.mark.extended
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(40))
def test_a_bag_with_wrong_bytes_is_refused_in_words_or_read(
    tmp_path: Path, name: str, seed: int
) -> None:
    path = write_bag(tmp_path / name, stereo_entries(3))
    file = path if path.is_file() else next(path.glob("*.db3"))
    data, rng = bytearray(file.read_bytes()), np.random.default_rng(seed)
    for at in rng.integers(0, len(data), rng.integers(1, 40)):
        data[at] = rng.integers(0, 256)
    file.write_bytes(data)
    try:
        capture = open_bag(path)
        for view in capture.all_views():
            view.recorded_image()
    except ServoidError as error:
        assert len(str(error)) > 20


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ([tf(stamp(0), [("a", "b", (0, 0, 0), STILL)])], "holds no images"),
        ([image("/image_raw", stamp(0), "a", pixels(0))], "no camera_info belongs to /image_raw"),
        (
            [
                image("/image_raw", stamp(0), "a", pixels(0)),
                info("/camera_info", stamp(0), "a", SIZE_PX, (0.0,) * 9),
            ],
            "/camera_info has no focal length: the camera is not calibrated",
        ),
        (
            [
                image("/image_raw", stamp(0), "a", pixels(0)),
                info("/camera_info", stamp(0), "a", (80, 60), K),
            ],
            "describes images of 80x60 pixels, but the recorded ones have 40x30",
        ),
        (
            [
                *(image("/image_raw", stamp(i), "a", pixels(0)) for i in (0, 1)),
                info("/camera_info", stamp(0), "a", SIZE_PX, K),
                info("/camera_info", stamp(1), "a", SIZE_PX, (60.0, *K[1:])),
            ],
            "the calibration on /camera_info changes while it is recorded",
        ),
        (
            [
                *(image("/image_raw", stamp(i), "ab"[i], pixels(0)) for i in (0, 1)),
                info("/camera_info", stamp(0), "a", SIZE_PX, K),
            ],
            "the frame of /image_raw changes from 'a' to 'b'",
        ),
        (
            [
                image("/image_raw", stamp(0), "a", pixels(0)),
                info("/camera_info", stamp(0), "a", SIZE_PX, K, model="double_sphere", d=(1, 2)),
            ],
            "distortion_model is 'double_sphere' with 2 coefficients; servoid supports plumb_bob",
        ),
        (
            [
                image("/image_raw", stamp(0), "a", pixels(0)),
                info("/camera_info", stamp(0), "a", SIZE_PX, K),
                tf(stamp(0), [("a", "b", (0, 0, 0), STILL), ("b", "a", (0, 0, 0), STILL)]),
            ],
            "the frames of TF form a cycle",
        ),
        (
            [
                image("/image_raw", stamp(0), "a", pixels(0)),
                info("/camera_info", stamp(0), "a", SIZE_PX, K),
                tf(stamp(0), [("w", "a", (0, 0, 0), (0, 0, 0, 0.5))]),
            ],
            "the transform from w to a: ",
        ),
    ],
)
def test_a_bag_that_says_too_little_is_refused_in_words(
    tmp_path: Path, entries: list[Entry], words: str
) -> None:
    with pytest.raises(ServoidError) as caught:
        open_bag(write_bag(tmp_path / "run.mcap", entries))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("old", "instead"),
    [
        (b"float64[12] p", b"float64[12] q"),
        (b"float64[9] k", b"float64[3] k"),
        (b"float64[] d", b"float64[] c"),
        (b"RegionOfInterest roi", b"RegionOfInterest rio"),
        (b"TransformStamped[] transforms", b"TransformStamped[] transformed"),
        (b"Vector3 translation", b"Vector3 transaction"),
        (b"string encoding", b"uint32 encoding"),
        (b"uint32 step", b"uint32 stop"),
        (b"string format", b"string forman"),
    ],
)
def test_a_bag_whose_own_types_have_other_fields_is_refused_in_words(
    tmp_path: Path, old: bytes, instead: bytes
) -> None:
    for is_jpeg in (False, True):
        path = write_bag(tmp_path / f"{is_jpeg}.mcap", stereo_entries(2, is_jpeg=is_jpeg))
        whole = path.read_bytes()
        if old not in whole:
            continue
        path.write_bytes(whole.replace(old, instead.ljust(len(old))[: len(old)]))
        with pytest.raises(ServoidError, match="is cut short, damaged or not a bag"):
            _read_all(open_bag(path))
        return
    pytest.fail(f"no bag says '{old.decode()}'")


def _read_all(capture: Capture) -> None:
    for camera in capture.cameras:
        for picture in camera.pictures:
            assert picture is not None
            picture.read(SIZE_PX)


def test_what_is_no_bag_is_told(tmp_path: Path) -> None:
    assert not is_bag(tmp_path)
    for name in ("a.mcap", "a.bag", "a.db3"):
        with pytest.raises(CaptureError, match=r"cannot read .*: no such file"):
            open_bag(tmp_path / name)
        (tmp_path / name).write_text("hello")
        with pytest.raises(CaptureError, match="is cut short"):
            open_bag(tmp_path / name)
    with pytest.raises(CaptureError, match=r"has no metadata\.yaml and 3 bag files; name one"):
        open_bag(tmp_path)
    with pytest.raises(CaptureError, match="is not a bag, and only those take topics and frames"):
        (tmp_path / "capture.toml").write_text("version = 1")
        open_any(tmp_path, topics=["/a"])


def test_a_picture_of_a_bag_can_be_read_in_another_process(tmp_path: Path) -> None:
    import pickle

    capture = open_bag(write_bag(tmp_path / "run.mcap", stereo_entries(3)))
    picture = pickle.loads(pickle.dumps(capture.cameras[1].pictures[2]))
    assert (picture.read(SIZE_PX) == pixels(5)).all()


def test_a_bag_that_is_written_anew_is_read_anew(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "run.mcap", stereo_entries(3))
    assert len(open_bag(path)) == 3
    other = write_bag(tmp_path / "other.mcap", stereo_entries(5))
    other.replace(path)
    assert len(open_bag(path)) == 5
