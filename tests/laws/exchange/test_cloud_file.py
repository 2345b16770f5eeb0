from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.lib.recfunctions import repack_fields
from numpy.typing import NDArray

from servoid.errors import MeshError
from servoid.exchange.shapes.cloud_file import is_cloud, read_cloud

plyfile = pytest.importorskip("plyfile")
FORMATS = [(True, "="), (False, "<"), (False, ">")]
HUGE = 2_000_000_000


def table(count: int = 50, kind: str = "f4") -> NDArray[np.void]:
    random = np.random.default_rng(count)
    names = ("x", "y", "z", "nx", "ny", "nz")
    rows = np.zeros(
        count, [(name, kind) for name in names] + [(c, "u1") for c in ("red", "green", "blue")]
    )
    for name in names:
        rows[name] = random.normal(size=count)
    for name in ("red", "green", "blue"):
        rows[name] = random.integers(0, 256, count)
    return rows


def write(path: Path, rows: NDArray[np.void], text: bool = False, order: str = "<") -> Path:
    """Write a cloud with a library that servoid does not read with."""
    element = plyfile.PlyElement.describe(rows, "vertex")
    plyfile.PlyData([element], text=text, byte_order=order).write(str(path))
    return path


def columns(rows: NDArray[np.void], names: str) -> NDArray[np.float64]:
    return np.stack([rows[name].astype(np.float64) for name in names.split()], axis=1)


@pytest.mark.parametrize(("text", "order"), FORMATS)
@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_a_cloud_is_read_as_another_library_wrote_it(
    tmp_path: Path, text: bool, order: str, kind: str
) -> None:
    rows = table(kind=kind)
    cloud = read_cloud(write(tmp_path / "a.ply", rows, text, order))
    assert cloud.notes == ()
    assert cloud.points == pytest.approx(columns(rows, "x y z"), rel=1e-6, abs=1e-9)
    assert cloud.normals is not None
    normals = columns(rows, "nx ny nz")
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    assert cloud.normals == pytest.approx(normals / lengths, rel=1e-5, abs=1e-6)
    assert (np.asarray(cloud.colors) == columns(rows, "red green blue")).all()


def test_a_cloud_without_normals_and_colors_has_none(tmp_path: Path) -> None:
    cloud = read_cloud(write(tmp_path / "a.ply", repack_fields(table()[["x", "y", "z"]])))
    assert cloud.normals is None
    assert cloud.colors is None


def test_colors_from_zero_to_one_are_stretched(tmp_path: Path) -> None:
    rows = np.array(
        [(0, 0, 0, 0.0, 0.5, 1.0)], [(n, "f4") for n in ("x", "y", "z", "red", "green", "blue")]
    )
    assert np.asarray(read_cloud(write(tmp_path / "a.ply", rows)).colors).tolist() == [
        [0, 128, 255]
    ]


@pytest.mark.parametrize(("text", "order"), FORMATS)
def test_points_that_are_not_finite_are_dropped_and_counted(
    tmp_path: Path, text: bool, order: str
) -> None:
    rows = table()
    rows["y"][[3, 9]] = np.nan
    rows["z"][12] = np.inf
    rows["nx"][20] = np.nan
    cloud = read_cloud(write(tmp_path / "a.ply", rows, text, order))
    assert cloud.notes == ("3 of 50 points were not finite and dropped",)
    assert np.isfinite(cloud.points).all()
    assert (
        len(cloud.points) == len(np.asarray(cloud.normals)) == len(np.asarray(cloud.colors)) == 47
    )
    assert np.isfinite(np.asarray(cloud.normals)).all()


@pytest.mark.filterwarnings("error")
def test_a_signalling_nan_is_dropped_like_any_other_and_without_a_warning(tmp_path: Path) -> None:
    rows = table()
    rows["z"].view(np.uint32)[7] = 0x7FA00000
    cloud = read_cloud(write(tmp_path / "a.ply", rows))
    assert cloud.notes == ("1 of 50 points was not finite and dropped",)
    assert len(cloud.points) == 49


def test_a_cloud_that_is_mostly_not_finite_is_refused(tmp_path: Path) -> None:
    rows = table()
    rows["x"][:26] = np.nan
    with pytest.raises(MeshError, match="26 of 50 points are not finite"):
        read_cloud(write(tmp_path / "a.ply", rows))


def test_points_after_other_elements_are_found(tmp_path: Path) -> None:
    camera = plyfile.PlyElement.describe(np.array([(1.0, 2)], [("f", "f8"), ("n", "i4")]), "camera")
    rows = table()
    for text in (True, False):
        element = plyfile.PlyElement.describe(rows, "vertex")
        plyfile.PlyData([camera, element], text=text).write(str(tmp_path / "a.ply"))
        cloud = read_cloud(tmp_path / "a.ply")
        assert cloud.points == pytest.approx(columns(rows, "x y z"), rel=1e-6)


def test_a_file_with_faces_is_no_cloud_and_one_without_is(tmp_path: Path) -> None:
    rows = table()
    faces = np.zeros(1, [("vertex_indices", "i4", (3,))])
    elements = [
        plyfile.PlyElement.describe(rows, "vertex"),
        plyfile.PlyElement.describe(faces, "face"),
    ]
    plyfile.PlyData(elements).write(str(tmp_path / "mesh.ply"))
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    assert not is_cloud(tmp_path / "mesh.ply")
    assert not is_cloud(tmp_path / "a.obj")
    assert is_cloud(write(tmp_path / "cloud.ply", rows))
    assert read_cloud(tmp_path / "mesh.ply").notes == ("the faces were ignored",)


@pytest.mark.parametrize(("text", "order"), FORMATS)
def test_a_cloud_cut_anywhere_is_refused(tmp_path: Path, text: bool, order: str) -> None:
    data = write(tmp_path / "a.ply", table(), text, order).read_bytes()
    # Text that lacks its last newline lacks nothing.
    last = len(data) - (len(data.split()[-1]) + 1 if text else 1)
    for end in (*(int(share * len(data)) for share in (0.0, 0.01, 0.1, 0.3, 0.6, 0.95)), last):
        (tmp_path / "a.ply").write_bytes(data[:end])
        with pytest.raises(MeshError, match=r"a\.ply"):
            read_cloud(tmp_path / "a.ply")


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.sampled_from(FORMATS), st.integers(0, 10**6), st.integers(0, 255))
def test_a_damaged_byte_raises_a_mesh_error_or_leaves_finite_points(
    tmp_path: Path, form: tuple[bool, str], place: int, value: int
) -> None:
    data = bytearray(write(tmp_path / "a.ply", table(8), *form).read_bytes())
    data[place % len(data)] = value
    (tmp_path / "a.ply").write_bytes(bytes(data))
    try:
        cloud = read_cloud(tmp_path / "a.ply")
    except MeshError:
        return
    assert np.isfinite(cloud.points).all()
    assert cloud.normals is None or np.isfinite(cloud.normals).all()


HEAD = "ply\nformat {}\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD.format("binary_little_endian 1.0", HUGE) + "end_header\n0123", "promises 2000000000"),
        (HEAD.format("ascii 1.0", HUGE) + "end_header\n0 0 0\n", "promises 2000000000"),
        (HEAD.format("ascii 1.0", "9" * 30) + "end_header\n", "whole number"),
        (HEAD.format("ascii 1.0", -1) + "end_header\n", "whole number"),
        (HEAD.format("ascii 1.0", 0) + "end_header\n", "no points"),
        (
            HEAD.format("ascii 1.0", 2) + "end_header\n0 0 0\n\n\n\n\n\n\n",
            "2 points, but 1 line follows",
        ),
        (HEAD.format("ascii 1.0", 1) + "end_header\n0 0\n   \n", "2 values were given, not 3"),
        (HEAD.format("ascii 1.0", 1) + "end_header\n0 0 cup\n", "is not a number"),
        (HEAD.format("ascii 1.0", 1) + f"end_header\n0 0 {'1' * 500}\n", "too long"),
        (HEAD.format("morse 1.0", 1) + "end_header\n0 0 0\n", "the header has no format"),
        (
            HEAD.format("ascii 1.0", 1) + "property colour c\nend_header\n0 0 0\n",
            "is not a property",
        ),
        (HEAD.format("ascii 1.0", 1) + "0 0 0\n", "end_header"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "no y, z"),
        ("hello", "is not a PLY file"),
        ("", "is not a PLY file"),
    ],
)
def test_bad_clouds_are_refused_in_words(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "a.ply").write_text(text)
    with pytest.raises(MeshError, match=words):
        read_cloud(tmp_path / "a.ply")


def test_a_missing_cloud_is_refused(tmp_path: Path) -> None:
    for read in (read_cloud, is_cloud):
        with pytest.raises(MeshError, match="no such file"):
            read(tmp_path / "a.ply")


def test_points_at_the_viewpoint_are_no_measurements_and_are_dropped_with_a_note(
    tmp_path: Path,
) -> None:
    rows = table()
    rows[3:13] = np.zeros(1, rows.dtype)
    path = write(tmp_path / "a.ply", rows)
    cloud = read_cloud(path, (0.0, 0.0, 0.0))
    assert len(cloud.points) == 40
    assert cloud.points.any(axis=1).all()
    assert cloud.notes == (
        "10 of 50 points were at the viewpoint (0, 0, 0), as invalid measurements are, and dropped",
    )
    assert len(read_cloud(path, (0.0, 0.0, 1.0)).points) == 50
    rows[:26] = np.zeros(1, rows.dtype)
    with pytest.raises(MeshError, match=r"26 of 50 points were at the viewpoint \(0, 0, 0\)"):
        read_cloud(write(path, rows), (0.0, 0.0, 0.0))


def test_normals_without_a_length_are_refused_unless_there_is_a_viewpoint(tmp_path: Path) -> None:
    rows = table()
    for name in ("nx", "ny", "nz"):
        rows[name] = 0.0
    path = write(tmp_path / "a.ply", rows)
    with pytest.raises(MeshError, match=r"normals of all 50 points have no length.*--viewpoint"):
        read_cloud(path)
    assert len(read_cloud(path, (0.0, 0.0, 9.0)).points) == 50
