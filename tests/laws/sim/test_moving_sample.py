"""The moving sample on disk: read back, scored, spoilt and replaced."""

import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from faults import Moments, faults, moments_of
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from tracking_errors import tracking_errors

from conftest import Command
from servoid.capture import open_capture
from servoid.cli import sampling
from servoid.errors import OutputError
from servoid.sim import WHOLE_TURN, MovingScene, Scenario, write_moving_sample, write_sample
from servoid.sim.samples import moving

SCORER = Path(__file__).parents[3].parent / "shared" / "tools" / "score_track.py"
SHORT = Scenario(count=3, size="small")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_moving_sample(tmp_path_factory.mktemp("made") / "toy", SHORT)


@pytest.fixture(scope="module")
def moments() -> Moments:
    return moments_of(MovingScene(Scenario(count=5, size="small")))


def table(path: Path) -> NDArray[np.float64]:
    return np.genfromtxt(path, delimiter=",", skip_header=1)


def files(folder: Path) -> dict[str, bytes]:
    return {str(one.relative_to(folder)): one.read_bytes() for one in folder.rglob("*.*")}


def test_the_recording_is_a_stereo_capture_with_one_mask(written: Path) -> None:
    capture = open_capture(written)
    assert len(capture) == 3
    assert capture.is_recording
    assert [camera.name for camera in capture.cameras] == ["left", "right"]
    assert capture.cameras[1].rig_from_camera.translation == (0.1, 0.0, 0.0)
    assert [view.name for view in capture.views()] == ["left/000000"]
    times_s = table(written / "truth/left_from_object.csv")[:, 0]
    np.testing.assert_allclose(times_s, np.array(capture.times_s), atol=1e-8)


def test_the_files_hold_what_the_scene_shows(written: Path) -> None:
    scene, capture = MovingScene(SHORT), open_capture(written)
    for index, view in enumerate(capture.all_views()):
        shown = scene.look(index % 3).images[index // 3]
        assert np.abs(view.image().astype(int) - shown).mean() < 5.0  # a JPEG file's loss
    np.testing.assert_array_equal(capture.views()[0].mask(), scene.look(0).mask)
    for index, row in enumerate(table(written / "truth/left_from_object.csv")):
        turn = Rotation.from_quat(row[4:], scalar_first=True).as_matrix()
        truth = scene.left_from_object(index)
        np.testing.assert_allclose(np.column_stack([turn, row[1:4]]), truth[:3], atol=1e-9)


@pytest.mark.extended
def test_the_rig_in_a_hand_writes_poses_in_which_the_toy_rests(tmp_path: Path) -> None:
    scenario = Scenario(count=3, size="small", hand=True, one_camera=True, grey=True)
    folder = write_moving_sample(tmp_path / "a", scenario)
    capture, rows = open_capture(folder), table(folder / "truth/left_from_object.csv")
    places = [
        pose.transform(row[None, 1:4])[0]
        for pose, row in zip(capture.world_from_rig, rows, strict=True)
    ]
    np.testing.assert_allclose(places, [places[0]] * 3, atol=1e-9)
    assert len(capture.cameras) == 1
    stored = cv2.imread(str(capture.all_views()[0].image_path), cv2.IMREAD_UNCHANGED)
    assert stored is not None
    assert stored.shape == (240, 320)


@pytest.mark.skipif(not SCORER.exists(), reason="the tools are not beside this clone")
@pytest.mark.skipif(sys.version_info < (3, 11), reason="the tool needs Python 3.11")
def test_the_scorer_reads_the_recording_and_agrees_with_the_tests_own_measure(
    written: Path, tmp_path: Path
) -> None:
    scene = MovingScene(SHORT)
    truth = [scene.left_from_object(index) for index in range(3)]
    lines = (written / "truth/left_from_object.csv").read_text().splitlines()
    last = lines[-1].split(",")
    last[1] = str(float(last[1]) + 0.004)
    (tmp_path / "poses.csv").write_text("\n".join([*lines[:-1], ",".join(last), ""]))
    done = subprocess.run(
        [sys.executable, str(SCORER), str(tmp_path / "poses.csv"), str(written)],
        capture_output=True,
        text=True,
        check=True,
    )
    moved = [*truth[:2], truth[2] + np.array([[0, 0, 0, 0.004], *[[0] * 4] * 3])]
    errors = tracking_errors(moved, truth, np.random.default_rng(0).normal(size=(50, 3)))
    found = re.search(r"lost (\d+); ADD mm median ([\d.]+)", done.stdout)
    assert found is not None, done.stdout
    assert found.groups() == ("0", f"{1e3 * np.median(errors.add):.2f}")


def test_errors_are_measured_from_the_first_pose_and_in_any_frame_of_the_object() -> None:
    scene = MovingScene(Scenario(size="small", one_camera=True))
    truth = [scene.left_from_object(index) for index in (0, 10, 20)]
    other = scene.room_from_object(33)  # any rigid motion
    points = np.random.default_rng(1).normal(0.0, 0.05, (40, 3))
    none = tracking_errors([pose @ other for pose in truth], truth, points)
    np.testing.assert_allclose([none.add, none.translation], 0.0, atol=1e-12)
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec([0.0, 0.02, 0.0]).as_matrix()
    some = tracking_errors([truth[0], truth[1] @ turn, None], truth, points)
    assert some.rotation[0] == pytest.approx(0.02)
    assert np.isinf([some.add[1], some.translation[1], some.rotation[1]]).all()


def test_the_same_scenario_gives_the_same_bytes(written: Path, tmp_path: Path) -> None:
    assert files(write_moving_sample(tmp_path / "again", SHORT)) == files(written)


def test_a_sample_takes_the_place_of_a_sample_and_of_nothing_else(tmp_path: Path) -> None:
    single = Scenario(count=1, size="small", one_camera=True)
    write_sample(tmp_path / "a", views=1, size_px=(40, 30))
    write_moving_sample(tmp_path / "a", single)
    assert not (tmp_path / "a" / "images").exists()
    write_sample(tmp_path / "a", views=1, size_px=(40, 30))
    assert not (tmp_path / "a" / "left").exists()
    (tmp_path / "a" / "letters.txt").write_text("mine")
    with pytest.raises(OutputError, match="holds other files"):
        write_moving_sample(tmp_path / "a", single)
    assert (tmp_path / "a" / "letters.txt").read_text() == "mine"


@pytest.mark.parametrize("name", ["poses.csv", "left/000001.jpg", "masks/000001.png", "truth/a"])
def test_a_recording_to_which_a_file_was_added_is_refused_by_the_name_of_the_file(
    tmp_path: Path, name: str
) -> None:
    single = Scenario(count=1, size="small", one_camera=True)
    folder = write_moving_sample(tmp_path / "a", single)
    write_moving_sample(folder, single)
    (folder / name).write_bytes(b"mine")
    with pytest.raises(OutputError, match=f"other files, such as {name}, "):
        write_moving_sample(folder, single)
    assert (folder / name).read_bytes() == b"mine"


def test_a_recording_that_breaks_off_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(moving, "_capture", full)
    with pytest.raises(OutputError, match="no space left"):
        write_moving_sample(tmp_path / "a", SHORT)
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_what_it_was_asked_for(tmp_path: Path, servoid_command: Command) -> None:
    folder = tmp_path / "toy"
    options = ("--moving", "--count", "2", "--size", "small", "--one-camera", "--plain")
    outcome = servoid_command("sample", str(folder), *options)
    assert outcome.code == 0, outcome.err
    assert "a recording of 2 observations" in outcome.out
    scenario = Scenario(count=2, size="small", one_camera=True, plain=True)
    assert files(folder) == files(write_moving_sample(tmp_path / "again", scenario))


def test_a_toy_that_is_turned_is_recorded_all_the_way_around_if_no_count_is_given(
    tmp_path: Path, servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Scenario] = []
    monkeypatch.setattr(
        sampling, "write_moving_sample", lambda _, scenario, **__: asked.append(scenario)
    )
    for more in ((), ("--count", "3")):
        outcome = servoid_command("sample", str(tmp_path / "toy"), "--moving", "--turn", *more)
        assert outcome.code == 0, outcome.err
    assert asked == [Scenario(count=WHOLE_TURN, turn=True), Scenario(count=3, turn=True)]


@pytest.mark.parametrize(
    "options",
    [
        ("--moving", "--count", "0"),
        ("--moving", "--size", "huge"),
        ("--moving", "--seed", "-1"),
        ("--count", "3"),
        ("--one-camera",),
        ("--turn",),
        ("--moving", "--turn", "--hand"),
    ],
)
def test_wrong_usage_exits_with_2_and_writes_nothing(
    options: tuple[str, ...], tmp_path: Path, servoid_command: Command
) -> None:
    outcome = servoid_command("sample", str(tmp_path / "toy"), *options)
    assert outcome.code == 2
    assert "Traceback" not in outcome.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", sorted(faults(2)))
def test_a_fault_strikes_where_it_should_and_leaves_what_was_before(
    name: str, moments: Moments
) -> None:
    struck = faults(2)[name](moments)
    assert len(struck) == len(moments)
    for before, after in zip(moments[:2], struck[:2], strict=True):
        assert before.time_s == after.time_s
        assert all(one is other for one, other in zip(before.images, after.images, strict=True))
    same_time = struck[2].time_s == moments[2].time_s
    same = [one is other for one, other in zip(struck[2].images, moments[2].images, strict=True)]
    assert not (same_time and all(same))
    last = [one is other for one, other in zip(struck[-1].images, moments[-1].images, strict=True)]
    healed = struck[-1].time_s == moments[-1].time_s and all(last)
    assert healed != ("dies" in name or "clock" in name)
