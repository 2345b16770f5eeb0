"""Bags without a calibration on the command line: tracked, recorded, scanned and modelled."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from bag_writing import Entry, compressed, image, tf, write_bag
from fake_tracker import plain_body
from rooms_to_scan import AIM, FOCAL_PX, LENS, Room, around, draw, few_features
from scenes_bags import FRAMES, SIZE_PX, link, only_camera, pixels, stamp, stereo_entries

from conftest import Command
from servoid.capture import open_capture
from servoid.opening import GivenCalibration, open_recorded, parse_source
from servoid.pose import Pose
from servoid.record import read_trajectory
from servoid.shape import save_body
from servoid.source.instants import poses_of

OWN = Pose.from_parts((0.1, 0.2, 0.3), (0.0, 1.0, 0.0, 0.0))
CUP = ("--body", "cup.json", "--start", "body")


def flat(text: str) -> str:
    return " ".join(text.split())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    save_body(tmp_path / "cup.json", plain_body(OWN))
    return tmp_path


def moving(count: int = 6, *, is_jpeg: bool = False) -> list[Entry]:
    """Return one camera that TF moves, without a calibration."""
    entries = only_camera(stereo_entries(count, is_jpeg=is_jpeg))
    return [one for one in entries if one.kind != "info"]


@pytest.mark.usefixtures("folder", "fake_core")
def test_a_bag_is_recorded_before_anything_is_known_of_its_camera(
    servoid_command: Command,
) -> None:
    write_bag(Path("run.mcap"), moving())
    done = servoid_command("record", "run.mcap", "--out", "run")
    assert done.code == 0, done.err
    assert done.out.startswith("Wrote run.mcap: 6 observations\n")
    assert "the cameras are not calibrated" in flat(done.out)
    known = GivenCalibration(fov_deg=60.0)
    bag, kept = (open_recorded(parse_source(word), known).capture for word in ("run.mcap", "run"))
    assert bag.times_s == kept.times_s
    for one, other in zip(bag.world_from_rig, kept.world_from_rig, strict=True):
        assert np.abs(one.matrix() - other.matrix()).max() < 1e-15
    for index, (one, other) in enumerate(
        zip(bag.cameras[0].pictures, kept.cameras[0].pictures, strict=True)
    ):
        assert one is not None and other is not None
        assert (one.read(SIZE_PX) == other.read(SIZE_PX)).all()
        assert (other.read(SIZE_PX) == pixels(2 * index)).all()
    for source in ("run.mcap", "run"):
        done = servoid_command("track", source, *CUP, "--fov", "60", "--out", f"{source}.csv")
        assert done.code == 0, done.err
        assert "60 degrees from left to right" in flat(done.out)
        assert "origin" not in done.out
    assert Path("run.mcap.csv").read_bytes() == Path("run.csv").read_bytes()
    assert read_trajectory("run.csv")[1].time_s == stamp(1) / 10**9


@pytest.mark.usefixtures("folder")
def test_jpeg_files_of_a_bag_stay_as_they_are_unless_colours_would_change(
    servoid_command: Command,
) -> None:
    entries = moving(3, is_jpeg=True)
    write_bag(Path("run.mcap"), entries)
    assert servoid_command("record", "run.mcap", "--out", "run").code == 0
    sent = [one.fields["data"] for one in entries if one.kind == "compressed"]
    assert [path.read_bytes() for path in sorted(Path("run/left").iterdir())] == sent
    swapped = [
        compressed("/left/image/compressed", stamp(i), "left", data, "rgb8; jpeg compressed rgb8")
        for i, data in enumerate(sent)
    ]
    write_bag(Path("swapped.mcap"), swapped)
    assert servoid_command("record", "swapped.mcap", "--out", "swapped").code == 0
    both = [
        open_recorded(parse_source(f"swapped{end}"), GivenCalibration(fov_deg=60.0))
        for end in ("", ".mcap")
    ]
    one, other = (opened.capture.cameras[0].pictures[0] for opened in both)
    assert one is not None and one.path.suffix == ".png"
    assert other is not None and (one.read(SIZE_PX) == other.read(SIZE_PX)).all()


@pytest.mark.usefixtures("folder")
def test_a_film_is_recorded_into_a_folder(servoid_command: Command) -> None:
    film = cv2.VideoWriter("film.avi", cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (64, 48))
    for number in range(4):
        film.write(np.full((48, 64, 3), 40 * number, np.uint8))
    film.release()
    done = servoid_command("record", "film.avi", "--fov", "60", "--out", "run")
    assert done.code == 0, done.err
    capture = open_capture("run")
    assert capture.times_s == pytest.approx((0.0, 0.05, 0.1, 0.15))
    assert capture.cameras[0].lens.focal_px[0] == pytest.approx(32.0 / np.tan(np.pi / 6))
    again = servoid_command("record", "run", "--out", "other/copy")
    assert again.code == 2 and "is recorded already" in again.err
    assert again.err.endswith("with --out other/copy.mcap\n")
    assert not Path("other").exists()


@pytest.mark.usefixtures("folder")
def test_a_bag_of_which_nothing_is_told_names_what_would_do(servoid_command: Command) -> None:
    write_bag(Path("run.mcap"), moving())
    for command in (("track", "run.mcap"), ("record", "run.mcap", "--out", "out.mcap")):
        done = servoid_command(*command)
        assert done.code == 1
        for word in ("camera_info", "--fov", "--calibration", "servoid scan", "--topic"):
            assert word in done.err
    model = ("model", "run.mcap", "--out", "body.json")
    done = servoid_command(*model)
    assert done.code == 2 and "mark it in the first image" in flat(done.err)
    done = servoid_command(*model, "--target", "click:10,10@0009")
    assert done.code == 2 and "0000 to 0005" in done.err
    done = servoid_command(*model, "--target", "click:10,10", "--world", "map")
    assert done.code == 2 and "to a scan --world does not apply" in flat(done.err)
    left = sorted(path.name for path in Path().iterdir())
    assert left == ["cup.json", "run.mcap", "run_folder"]  # the last one is the bag writer's


def filmed(path: Path, way: np.ndarray) -> Path:
    """Write what a camera on its way saw as a bag that says nothing of it."""
    images = draw(Room(seed=3), way)
    entries = [
        image("/camera/image_raw", stamp(index), "", pixels, "rgb8")
        for index, pixels in enumerate(images)
    ]
    return write_bag(path, entries)


@pytest.mark.extended
@pytest.mark.usefixtures("folder")
def test_a_bag_without_a_calibration_is_scanned_and_modelled(
    servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    few_features(monkeypatch)
    way = around(10, 50.0)
    filmed(Path("film.mcap"), way)
    middle = LENS.project(Pose(way[0]).inverse().transform(np.array([[*AIM[:2], 0.06]])))[0]
    u, v = middle
    box = f"box:{u - 45:.0f},{v - 55:.0f},{u + 45:.0f},{v + 50:.0f}"
    chosen = ("--topic", "/camera/image_raw", "--max-ellipsoids", 3)
    done = servoid_command(
        *("model", "film.mcap", "--out", "body.json", "--target", box, "--trust-targets", *chosen)
    )
    assert done.code == 0, done.err
    assert "capture         body_scan" in done.out and "not in metres" in done.out
    lens = open_capture("body_scan").cameras[0].lens
    assert lens.focal_px[0] == pytest.approx(FOCAL_PX, rel=0.02)
    assert Path("body.json").is_file()


@pytest.mark.usefixtures("folder", "fake_core")
def test_a_camera_that_sits_turned_on_its_link_is_recorded_where_it_was(
    servoid_command: Command,
) -> None:
    seat = Pose.from_parts((0.2, 0.0, 0.1), (0.5, -0.5, 0.5, -0.5))
    moved = [one for one in moving() if one.topic != "/tf_static"]
    write_bag(
        Path("run.mcap"), [tf(stamp(0), [link("rig", FRAMES[0], seat)], "/tf_static"), *moved]
    )
    assert servoid_command("record", "run.mcap", "--out", "run").code == 0
    known = GivenCalibration(fov_deg=60.0)
    bag, kept = (open_recorded(parse_source(word), known).capture for word in ("run.mcap", "run"))
    for one, other in zip(bag.observations(), kept.observations(), strict=True):
        off = poses_of(bag, one)[0].inverse() @ poses_of(kept, other)[0]
        assert np.linalg.norm(off.log()) < 1e-12


@pytest.mark.usefixtures("folder")
def test_images_that_cannot_be_read_are_told_and_a_bag_of_nothing_else_is_refused(
    servoid_command: Command,
) -> None:
    entries = moving(4, is_jpeg=True)
    damaged = [
        replace(
            one, fields=one.fields | {"data": one.fields["data"][: len(one.fields["data"]) // 2]}
        )
        if one.kind == "compressed"
        else one
        for one in entries
    ]
    half = damaged[: len(entries) // 2] + entries[len(entries) // 2 :]
    write_bag(Path("half.mcap"), half)
    done = servoid_command("record", "half.mcap", "--out", "half")
    assert done.code == 0 and "1 image could not be read; the first: " in flat(done.out)
    write_bag(Path("none.mcap"), damaged)
    done = servoid_command("record", "none.mcap", "--out", "none")
    assert done.code == 1 and "not one image can be read; the first: " in flat(done.err)
    assert not Path("none").exists()
