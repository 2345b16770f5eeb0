"""`servoid track`, `record` and `sources` with what comes live, from a server beside them."""

import csv
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from commands import Command
from mjpeg_server import images_of
from recordings import Alone, run_servoid
from served_images import served

from servoid.capture import open_capture
from servoid.cli.source import footage
from servoid.opening import GivenCalibration, open_recorded, parse_source
from servoid.track import Request

RIG_CAMERA = """
[[camera]]
name = "{name}"
device = "{address}/{name}"
size_px = [320, 240]
model = "pinhole"
focal_px = [290.0, 290.0]
center_px = [159.5, 119.5]
rig_from_camera = [[1, 0, 0, {x}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""


def write_rig(path: Path, address: str, faults: str = "") -> Path:
    tables = [
        RIG_CAMERA.format(name=name, address=address, x=x).replace(
            f'{address}/{name}"', f'{address}/{name}{faults}"'
        )
        for name, x in (("left", 0.0), ("right", 0.1))
    ]
    path.write_text("version = 1\n" + "".join(tables))
    return path


def poses(path: Path) -> list[list[str]]:
    """Return the lines of a trajectory without their notices."""
    with path.open(newline="") as file:
        return [row[:-1] for row in csv.reader(file)]


def tiny_images(folder: Path) -> Path:
    (folder / "eye").mkdir(parents=True)
    for number in range(10):
        pixels = np.full((48, 64, 3), 20 * number, np.uint8)
        cv2.imwrite(str(folder / "eye" / f"{number}.jpg"), pixels)
    return folder


def test_what_a_camera_sends_is_recorded_file_by_file(
    tmp_path: Path, servoid_command: Command
) -> None:
    with served(tiny_images(tmp_path / "served")) as address:
        eye, run = f"{address}/eye", tmp_path / "run"
        done = servoid_command("record", eye, "--fov", "60", "--count", "6", "--out", run)
    assert done.code == 0, done.err
    assert done.out.startswith(f"Recorded {eye}: 6 observations, 1 camera\n")
    capture = open_capture(run)
    assert (len(capture), capture.cameras[0].lens.size_px) == (6, (64, 48))
    sent = images_of(tmp_path / "served" / "eye")
    assert all(path.read_bytes() in sent for path in (run / "camera").iterdir())
    lines = [line for line in done.out.splitlines() if str(run) not in line and "http" not in line]
    assert max(map(len, lines)) <= 80


def test_images_of_another_size_are_counted_and_not_stored_as_empty_files(
    tmp_path: Path, servoid_command: Command
) -> None:
    folder = tiny_images(tmp_path / "served")
    for number in range(1, 10, 2):
        half = np.full((24, 32, 3), 20 * number, np.uint8)
        cv2.imwrite(str(folder / "eye" / f"{number}.jpg"), half)
    with served(folder) as address:
        run = tmp_path / "run"
        done = servoid_command("record", f"{address}/eye", "--count", "12", "--out", run)
    assert done.code == 0, done.err
    files = list((run / "camera").iterdir())
    assert all(path.stat().st_size > 0 for path in files)
    assert 0 < len(files) < 12 and f"{len(files)} observation" in done.out
    said = " ".join(done.out.split())
    dark = 12 - len(files)
    assert f"{dark} observation{'s' if dark > 1 else ''} without an image of any camera: " in said
    assert "the image is " in said and "must be of the same size" in said
    rows = (run / "poses.csv").read_text().splitlines()[1:]
    assert len(rows) == len(files) == len((run / "images.csv").read_text().splitlines()[1:])


def test_a_camera_is_recorded_before_anything_is_known_of_it(
    tmp_path: Path, servoid_command: Command
) -> None:
    with served(tiny_images(tmp_path / "served")) as address:
        eye, run = f"{address}/eye", tmp_path / "run"
        bag = servoid_command("record", eye, "--count", "3", "--out", tmp_path / "run.mcap")
        done = servoid_command("record", eye, "--count", "3", "--out", run)
    assert bag.code == 2 and "record into a folder and calibrate later" in bag.err
    assert done.code == 0, done.err
    assert "scan calibrates them" in " ".join(done.out.split())
    later = servoid_command("track", run, "--out", tmp_path / "poses.csv")
    assert later.code == 1 and "track and model take --fov or --calibration" in later.err
    opened = open_recorded(parse_source(str(run)), GivenCalibration(fov_deg=90.0))
    assert opened.capture.cameras[0].lens.focal_px[0] == pytest.approx(32.0)


def test_the_topic_of_a_bag_is_chosen_for_its_recording(
    tmp_path: Path, servoid_command: Command
) -> None:
    pytest.importorskip("rosbags", reason="the library that writes bags is not installed")
    with served(tiny_images(tmp_path / "served")) as address:
        halves, bag = f"side-by-side:{address}/eye", tmp_path / "run.mcap"
        given = ("--fov", "60", "--baseline", "0.1", "--count", "3")
        done = servoid_command("record", halves, *given, "--out", bag)
        wrong = servoid_command(
            "record", halves, *given, "--topic", "/left", "--out", tmp_path / "x"
        )
    assert done.code == 0, done.err
    assert wrong.code == 2 and "--topic applies to a bag only" in wrong.err
    again = tmp_path / "left.mcap"
    done = servoid_command("record", bag, "--topic", "/left/image_raw", "--out", again)
    assert done.code == 0, done.err
    assert len(open_recorded(parse_source(str(bag))).capture.cameras) == 2
    assert len(open_recorded(parse_source(str(again))).capture.cameras) == 1


def test_what_a_camera_sends_is_recorded_in_a_bag(tmp_path: Path, servoid_command: Command) -> None:
    pytest.importorskip("rosbags", reason="the library that writes bags is not installed")
    with served(tiny_images(tmp_path / "served")) as address:
        bag = tmp_path / "run.mcap"
        done = servoid_command(
            "record", f"{address}/eye", "--fov", "60", "--count", "4", "--out", bag
        )
    assert done.code == 0, done.err
    capture = open_recorded(parse_source(str(bag))).capture
    assert len(capture) == 4
    (picture, *_) = capture.cameras[0].pictures
    assert picture is not None
    sent = [
        cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        for data in images_of(tmp_path / "served" / "eye")
    ]
    seen = picture.read((64, 48))[..., ::-1]
    assert any((seen == image).all() for image in sent)


def test_sources_lists_what_there_is_within_eighty_columns(servoid_command: Command) -> None:
    output = servoid_command("sources").out
    for word in ("Recorded", "Live", "side-by-side:", "realsense:", "genicam:", "sim:", "RIG.toml"):
        assert word in output
    assert max(map(len, output.splitlines())) <= 80


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("track", "0", "--every", "2"), 2, "0 is live, .*; leave --every out"),
        (("track", "FILM", "--duration", "3"), 2, "is recorded, so --duration does not apply"),
        (("track", "FILM", "--record", "run"), 2, "is recorded, so --record does not apply"),
        (("track", "FILM"), 1, "give --fov, .*; .* servoid scan estimates"),
        (
            ("track", "FILM", "--fov", "180"),
            2,
            "--fov: an angle of view must be more than 0 .* but it is 180",
        ),
        (
            ("track", "http://127.0.0.1:9/", "--fov", "65", "--distance", "1"),
            1,
            "does not answer: connection refused",
        ),
        (("track", "sim:nothing"), 1, "unknown object 'nothing'"),
        (("model", "0", "--out", "b.json"), 1, "servoid record 0 --out run"),
        (("record", "FILM", "--fov", "60", "--count", "3", "--out", "x"), 2, "so --count does not"),
        (
            ("record", "FILM", "--baseline", "0.1", "--out", "x"),
            2,
            "--baseline alone is no calibration",
        ),
        (("record", "0", "--out", "run.avi"), 2, "a folder, or a file that ends in .mcap"),
    ],
)
def test_what_means_nothing_for_a_source_is_refused(
    tmp_path: Path,
    servoid_command: Command,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    code: int,
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    film = cv2.VideoWriter("film.avi", cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (64, 48))
    film.write(np.zeros((48, 64, 3), np.uint8))
    film.release()
    done = servoid_command(*(one.replace("FILM", "film.avi") for one in arguments))
    assert done.code == code, done.err
    assert re.search(message, done.err), done.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.avi"]


@pytest.mark.extended
def test_a_live_run_and_its_recording_have_the_same_poses(alone: Alone, tmp_path: Path) -> None:
    body = alone.folder / "body.json"
    with served(alone.recording.folder, rate_hz=15.0) as address:
        rig = write_rig(tmp_path / "rig.toml", address)
        options = ("--body", body, "--duration", 4, "--record", "run", "--video", "live.mp4")
        output = run_servoid(tmp_path, "track", rig, *options, "--out", "live.csv")
    run_servoid(tmp_path, "track", "run", "--body", body, "--out", "again.csv")
    live = poses(tmp_path / "live.csv")
    assert len(live) > 5
    assert live == poses(tmp_path / "again.csv")
    assert "recording    run" in output and "time 0" in output
    video = cv2.VideoCapture(str(tmp_path / "live.mp4"))
    seconds = float(live[-1][0]) - float(live[1][0])
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) / 30.0 == pytest.approx(seconds, abs=0.5)


@pytest.mark.extended
def test_a_server_that_dies_is_told_and_the_object_tracked_again(
    alone: Alone, tmp_path: Path
) -> None:
    with served(alone.recording.folder, rate_hz=10.0) as address:
        rig = write_rig(tmp_path / "rig.toml", address)
        command = [sys.executable, "-m", "servoid", "track", str(rig), "--out", "live.csv"]
        command += ["--body", str(alone.folder / "body.json")]
        tracking = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
        time.sleep(8.0)
    time.sleep(1.0)
    with served(alone.recording.folder, int(address.rpartition(":")[2]), 10.0):
        time.sleep(5.0)
        tracking.send_signal(signal.SIGTERM)
        output, _ = tracking.communicate(timeout=60.0)
    assert tracking.returncode == (143 if os.name == "posix" else 1)
    assert "poses        live.csv" in output
    with (tmp_path / "live.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    # An eye may have lost the last image of the pair, which is told before.
    anew = re.compile(r"no image came for [1-9].*it was opened anew")
    back = next(at for at, row in enumerate(rows) if anew.search(row["notices"]))
    back_s = float(rows[back]["time_s"])
    soon = [row for row in rows[back:] if float(row["time_s"]) <= back_s + 1.0]
    assert any(row["status"] == "tracking" for row in soon)


def test_a_duration_counts_from_the_first_pose_and_not_while_a_body_is_modelled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock, over = [100.0], []
    monkeypatch.setattr(footage, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    live = object.__new__(footage.LiveFootage)
    vars(live).update(_duration_s=5.0, _first_s=99.0, _opened_s=98.0, _is_starting=False)
    vars(live).update(_source=SimpleNamespace(is_over=False), _feed=None)

    def follow(*_: object) -> Iterator[float]:
        for passed in (60.0, 4.0, 2.0):
            clock[0] += passed
            over.append(live._is_over())
            yield passed

    monkeypatch.setattr(footage, "follow_live", follow)
    assert len(list(live.steps([], Request()))) == 3
    assert over == [False, False, True]
