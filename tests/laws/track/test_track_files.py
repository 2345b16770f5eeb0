from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fake_tracker import FakeEstimate
from hypothesis import given
from hypothesis import strategies as st

from servoid.errors import OutputError, PoseError, TrajectoryError
from servoid.pose import Pose
from servoid.record import Waypoint, read_trajectory, waypoints, write_trajectory
from servoid.track import Tracked

PLACES = st.tuples(*[st.floats(-50.0, 50.0)] * 3)
TWISTS = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
HEADER = "time_s,x,y,z,qw,qx,qy,qz,confidence,status"
LINE = "0.5,0.1,0.2,0.3,1,0,0,0,0.9,tracking"


def pose_of(place: tuple[float, ...], turn: tuple[float, ...]) -> Pose:
    return Pose.from_parts(place, Pose.exp((0.0, 0.0, 0.0, *turn)).quaternion)


def some_points() -> list[Waypoint]:
    statuses = ("tracking", "searching", "lost", "tracking")
    poses = [pose_of((0.1 * i, -0.2, 0.6), (0.0, 2.9 - i, 0.3)) for i in range(4)]
    return [
        Waypoint(i / 30.0, pose, 1.0 - 0.2 * i, status, 3 * i, 0.001, 0.02, "dark; late, too")
        for i, (pose, status) in enumerate(zip(poses, statuses, strict=True))
    ]


@pytest.mark.parametrize("name", ["a.csv", "a.tum", "a.txt"])
@given(time_s=st.floats(-1e9, 2e9), place=PLACES, turn=TWISTS)
def test_a_pose_is_read_back_to_a_nanometre(
    tmp_path_factory: pytest.TempPathFactory,
    name: str,
    time_s: float,
    place: tuple[float, ...],
    turn: tuple[float, ...],
) -> None:
    path = tmp_path_factory.getbasetemp() / name
    pose = pose_of(place, turn)
    write_trajectory(path, [Waypoint(time_s, pose, 1.0)])
    [read] = read_trajectory(path)
    assert read.time_s == time_s
    assert np.allclose(read.world_from_object.matrix(), pose.matrix(), rtol=0.0, atol=5e-9)


def test_a_csv_keeps_all_that_is_known_of_each_observation(tmp_path: Path) -> None:
    points = some_points()
    write_trajectory(tmp_path / "a.csv", points)
    read = read_trajectory(tmp_path / "a.csv")
    for name in ("time_s", "status", "observation", "std_m", "std_rad", "notices"):
        assert [getattr(p, name) for p in read] == [getattr(p, name) for p in points]
    assert [p.confidence for p in read] == pytest.approx([1.0, 0.8, 0.6, 0.4])


def test_a_csv_begins_with_the_columns_that_others_expect(tmp_path: Path) -> None:
    write_trajectory(tmp_path / "a.csv", some_points())
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0].startswith(HEADER + ",")
    assert all(float(line.split(",")[4]) >= 0.0 for line in lines[1:])


def test_tum_text_holds_only_what_is_tracked_with_w_last(tmp_path: Path) -> None:
    pose = Pose.from_parts((1.0, 2.0, 3.0), (0.8, 0.6, 0.0, 0.0))
    points = [Waypoint(0.0, pose), Waypoint(1.0, pose, 0.0, "lost"), Waypoint(2.0, pose)]
    write_trajectory(tmp_path / "a.tum", points)
    rows = np.loadtxt(tmp_path / "a.tum")
    assert rows.tolist() == [[t, 1.0, 2.0, 3.0, 0.6, 0.0, 0.0, 0.8] for t in (0.0, 2.0)]


def test_an_estimate_is_kept_with_its_worst_standard_deviations() -> None:
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = turn @ np.diag([1e-6, 4e-6, 9e-6]) @ turn.T
    covariance[3:, 3:] = np.inf
    estimate = FakeEstimate(1.5, Pose.identity(), covariance=covariance)
    [point] = waypoints([Tracked(7, estimate, 0.001, notices=("dark", "late"))])  # type: ignore
    assert point.std_m == pytest.approx(3e-3)
    assert point.std_rad is None
    assert (point.observation, point.notices) == (7, "dark; late")


def test_columns_that_are_unknown_or_missing_do_no_harm(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time_s,x,y,z,qw,qx,qy,qz,mood\n0,0,0,1,1,0,0,0,good\n\n")
    [point] = read_trajectory(tmp_path / "a.csv")
    assert point.status == "tracking"
    assert np.isnan(point.confidence)


def test_comments_in_tum_text_are_passed_over(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("# time tx ty tz qx qy qz qw\n1 0 0 1 0 0 0 1\n")
    assert [point.time_s for point in read_trajectory(tmp_path / "a.txt")] == [1.0]


def test_a_trajectory_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("old")
    with pytest.raises(OutputError, match=r"ends in \.csv, or in \.tum or \.txt"):
        write_trajectory(tmp_path / "a.xyz", some_points())
    with pytest.raises(OutputError):
        write_trajectory(tmp_path / "none" / "a.csv", some_points())
    assert [path.name for path in tmp_path.iterdir()] == ["a.xyz"]
    assert (tmp_path / "a.xyz").read_text() == "old"


BAD: dict[str, tuple[str, str, str]] = {
    "no header": ("a.csv", LINE, r"line 1: the header is '0\.5.*must begin with 'time_s"),
    "empty": ("a.csv", "", r"line 1: the header is ''"),
    "too few values": ("a.csv", f"{HEADER}\n1,2,3", r"line 2: 3 values .* the header names 10"),
    "a word": ("a.csv", f"{HEADER}\n{LINE.replace('0.2', 'up')}", r"line 2: y is 'up'; write a"),
    "NaN": ("a.csv", f"{HEADER}\n{LINE.replace('0.2', 'nan')}", r"y is nan; write a finite"),
    "status": ("a.csv", f"{HEADER}\n{LINE.replace('tracking', 'ok')}", r"status is 'ok'; write"),
    "confidence": (
        "a.csv",
        f"{HEADER}\n{LINE.replace('0.9', '1.5')}",
        r"confidence is 1\.5; write",
    ),
    "times that stay": ("a.csv", "\n".join([HEADER, LINE, LINE]), r"csv: all 2 times are 0\.5; in"),
    "times that fall": ("a.tum", "2 0 0 1 0 0 0 1\n1 0 0 1 0 0 0 1", r"decrease, from 2 to 1; in"),
    "tum too few": ("a.tum", "1 2 3", r"line 1: 3 values .* TUM text has 8"),
    "tum word": ("a.tum", "1 2 3 x 0 0 0 1", r"line 1: z is 'x'"),
    "suffix": ("a.json", "", r"a trajectory ends in \.csv"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_malformed_trajectory_is_refused_with_its_line(tmp_path: Path, case: str) -> None:
    name, text, message = BAD[case]
    (tmp_path / name).write_text(text)
    with pytest.raises(TrajectoryError, match=message):
        read_trajectory(tmp_path / name)


def test_a_single_time_that_repeats_is_read_as_a_track_wrote_it(tmp_path: Path) -> None:
    points = [Waypoint(time_s, Pose.identity(), 1.0) for time_s in (0.0, 0.1, 0.1, 0.2, 0.3)]
    write_trajectory(tmp_path / "a.csv", points)
    assert [one.time_s for one in read_trajectory(tmp_path / "a.csv")] == [0.0, 0.1, 0.1, 0.2, 0.3]


def test_a_line_that_is_no_rigid_motion_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(f"{HEADER}\n{LINE}\n{LINE.replace('1,0,0,0', '0,0,0,0')}\n")
    with pytest.raises(PoseError, match=r"a\.csv, line 3: .*quaternion"):
        read_trajectory(tmp_path / "a.csv")


@pytest.mark.parametrize(
    "spoil",
    [Path.exists, lambda path: path.write_bytes(b"\xff\xfe\x00"), Path.mkdir],
    ids=["missing", "binary", "folder"],
)
def test_a_file_that_cannot_be_read_is_named(
    tmp_path: Path, spoil: Callable[[Path], object]
) -> None:
    spoil(tmp_path / "a.csv")
    with pytest.raises(TrajectoryError, match=r"a\.csv"):
        read_trajectory(tmp_path / "a.csv")


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_may_end_as_on_any_system(tmp_path: Path, end: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(end.join([HEADER, LINE, LINE.replace("0.5,", "0.6,"), ""]).encode())
    assert [point.time_s for point in read_trajectory(path)] == [0.5, 0.6]


@given(damaged=st.binary(min_size=1, max_size=3), place=st.integers(0, 200))
def test_a_damaged_byte_raises_a_servoid_error_or_is_read(
    tmp_path_factory: pytest.TempPathFactory, damaged: bytes, place: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.csv"
    whole = f"{HEADER}\n{LINE}\n{LINE}\n".encode()
    path.write_bytes(whole[:place] + damaged + whole[place + len(damaged) :])
    try:
        read_trajectory(path)
    except (TrajectoryError, PoseError) as error:
        assert "damaged.csv" in str(error)
