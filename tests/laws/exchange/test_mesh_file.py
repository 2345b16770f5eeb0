import json
import re
import struct
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from conftest import REAL_PHOTOS
from servoid.errors import MeshError, MissingExtraError
from servoid.exchange.shapes.mesh_file import SUFFIXES, MeshFile, read_mesh
from servoid.exchange.shapes.mesh_repair import signed_volume

trimesh = pytest.importorskip("trimesh")
MESHES = REAL_PHOTOS.parent / "meshes"
BALL = trimesh.creation.icosphere(2, 0.05)


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Build anew of coarse cells, which is quick."""
    monkeypatch.setattr("servoid.exchange.shapes.mesh_rebuild._CELLS", 20)


def write(path: Path, vertices: object, faces: object) -> Path:
    trimesh.Trimesh(vertices, faces, process=False).export(path)
    return path


def is_closed_and_outward(mesh: MeshFile) -> bool:
    """Ask trimesh, which did not repair it."""
    return bool(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_volume)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_closed_mesh_is_read_as_it_is_from_every_format(tmp_path: Path, suffix: str) -> None:
    BALL.export(tmp_path / f"ball{suffix}")
    mesh = read_mesh(tmp_path / f"ball{suffix}")
    assert (len(mesh.vertices), len(mesh.faces)) == (len(BALL.vertices), len(BALL.faces))
    assert mesh.notes == ()
    assert is_closed_and_outward(mesh)
    assert signed_volume(mesh.vertices, mesh.faces) == pytest.approx(BALL.volume, rel=1e-5)
    assert (mesh.vertices.dtype, mesh.faces.dtype) == (np.float64, np.int64)


def test_a_text_stl_and_a_polygon_obj_are_read(tmp_path: Path) -> None:
    BALL.export(tmp_path / "ball.stl", file_type="stl_ascii")
    assert is_closed_and_outward(read_mesh(tmp_path / "ball.stl"))
    lines = ["mtllib ../../outside.mtl"]
    lines += [f"v {x} {y} {z}" for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    lines += ["f 1 3 4 2", "f 5 6 8 7", "f 1 2 6 5", "f 3 7 8 4", "f 1 5 7 3", "f 2 4 8 6"]
    (tmp_path / "cube.obj").write_text("\n".join(lines))
    cube = read_mesh(tmp_path / "cube.obj")
    assert signed_volume(cube.vertices, cube.faces) == pytest.approx(1.0)


def test_the_placement_of_parts_in_a_glb_is_kept(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(BALL)
    scene.add_geometry(BALL, transform=trimesh.transformations.translation_matrix([1, 0, 0]))
    scene.export(tmp_path / "two.glb")
    mesh = read_mesh(tmp_path / "two.glb")
    assert np.ptp(mesh.vertices, axis=0)[0] == pytest.approx(1.1, rel=1e-3)
    assert signed_volume(mesh.vertices, mesh.faces) == pytest.approx(2 * BALL.volume, rel=1e-5)


@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(seed=st.integers(0, 10**6))
def test_faces_that_look_anywhere_are_turned_outward(tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    faces = BALL.faces.copy()
    turned = random.random(len(faces)) < random.random()
    faces[turned] = faces[turned, ::-1]
    mesh = read_mesh(write(tmp_path / "ball.ply", BALL.vertices, faces))
    assert is_closed_and_outward(mesh)
    if turned.any():
        were = "was" if turned.sum() == 1 else "were"
        note = f"{turned.sum()} of {len(faces)} faces had the wrong orientation and {were} flipped"
        assert mesh.notes == (note,)


@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 6))
def test_small_holes_are_closed_and_counted(tmp_path: Path, seed: int, count: int) -> None:
    fine = trimesh.creation.icosphere(3, 0.05)
    gone = np.random.default_rng(seed).choice(len(fine.faces), count, replace=False)
    mesh = read_mesh(write(tmp_path / "a.ply", fine.vertices, np.delete(fine.faces, gone, 0)))
    assert is_closed_and_outward(mesh)
    assert len(mesh.notes) == 1
    assert "closed" in mesh.notes[0]
    assert signed_volume(mesh.vertices, mesh.faces) == pytest.approx(fine.volume, rel=0.01)


def test_a_hole_is_named_with_its_edges(tmp_path: Path) -> None:
    fan = (BALL.faces == BALL.faces[0, 0]).any(axis=1)
    mesh = read_mesh(write(tmp_path / "a.ply", BALL.vertices, BALL.faces[1:]))
    assert mesh.notes == ("1 hole of 3 edges was closed",)
    wide = read_mesh(write(tmp_path / "b.ply", BALL.vertices, BALL.faces[~fan])).notes[0]
    assert wide == f"1 hole of {fan.sum()} edges was closed"


def test_a_cavity_stays_a_cavity_and_a_part_inside_out_is_turned(tmp_path: Path) -> None:
    inner, beside = BALL.copy(), BALL.copy()
    inner.apply_scale(0.5)
    inner.invert()
    beside.apply_translation([0.2, 0.0, 0.0])
    beside.invert()
    both = trimesh.util.concatenate([BALL, inner, beside])
    mesh = read_mesh(write(tmp_path / "a.ply", both.vertices, both.faces))
    expected = (1.0 - 0.125 + 1.0) * BALL.volume
    assert signed_volume(mesh.vertices, mesh.faces) == pytest.approx(expected, rel=1e-6)
    assert mesh.notes[:-1] == ("320 of 960 faces had the wrong orientation and were flipped",)


def test_degenerate_and_double_faces_and_unused_vertices_are_dropped(tmp_path: Path) -> None:
    vertices = np.concatenate([BALL.vertices, [[9.0, 9.0, 9.0]]])
    faces = np.concatenate([BALL.faces, BALL.faces[:3, ::-1], [[4, 4, 7], [5, 6, 5]]])
    mesh = read_mesh(write(tmp_path / "a.ply", vertices, faces))
    assert mesh.notes == (
        "2 faces without area were dropped",
        "3 double faces were dropped",
    )
    assert is_closed_and_outward(mesh)
    assert np.abs(mesh.vertices).max() < 0.06


@pytest.mark.parametrize("name", ["banana", "bunny", "duck", "mug", "mustard", "spot"])
def test_real_meshes_need_nothing(name: str) -> None:
    if not MESHES.is_dir():
        pytest.skip("the meshes lie beside the repository, and not here")
    mesh = read_mesh(MESHES / f"{name}.ply")
    expected = trimesh.load(MESHES / f"{name}.ply")
    assert mesh.notes == ()
    assert signed_volume(mesh.vertices, mesh.faces) == pytest.approx(expected.volume, rel=1e-9)


def sheet() -> tuple[object, object]:
    return [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]]


def flat_box() -> tuple[object, object]:
    box = trimesh.creation.box((1, 1, 1e-12))
    return box.vertices, box.faces


def half_ball() -> tuple[object, object]:
    return BALL.vertices, BALL.faces[BALL.triangles_center[:, 2] < 0.01]


def fin() -> tuple[object, object]:
    vertices = np.concatenate([BALL.vertices, [[0.0, 0.0, 0.2]]])
    return vertices, np.concatenate([BALL.faces, [[*BALL.faces[0, :2], len(BALL.vertices)]]])


def crossed() -> tuple[object, object]:
    """Return two balls that share an edge, of which one lacks a face there."""
    middle = BALL.vertices[BALL.faces[0, :2]].mean(axis=0)
    other = 2.0 * middle - BALL.vertices
    faces = np.concatenate([BALL.faces[1:], BALL.faces[:, ::-1] + len(BALL.vertices)])
    return np.concatenate([BALL.vertices, other]), faces


@pytest.mark.parametrize(
    ("make", "volume", "words"),
    [
        (
            half_ball,
            0.65,
            r"1 hole of \d+ edges was closed \d+ % .* around \(.*, .*, 0\.0[0-2]\d*\)",
        ),
        (fin, 1.0, r"1 face of a loose sheet was dropped, around \(-?[0-9.e-]+, "),
        (
            crossed,
            2.0,
            r"1 edge has faces that no closed surface has there: .*; one is at \(-?[0-9.e-]+, .*"
            "so the surface was rebuilt",
        ),
    ],
)
def test_a_mesh_that_is_not_closed_is_closed_and_the_place_is_said(
    tmp_path: Path, make: Callable[[], tuple[object, object]], volume: float, words: str
) -> None:
    mesh = read_mesh(write(tmp_path / "a.ply", *make()))
    assert is_closed_and_outward(mesh)
    assert signed_volume(mesh.vertices, mesh.faces) == pytest.approx(volume * BALL.volume, rel=0.08)
    assert re.search(words, " ".join(mesh.notes))


def with_nan() -> tuple[object, object]:
    vertices = BALL.vertices.copy()
    vertices[3, 1] = np.nan
    return vertices, BALL.faces


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (sheet, "the mesh is open"),
        (flat_box, "volume"),
        (with_nan, "1 of 162 vertices is not finite"),
        (lambda: (BALL.vertices * 1e8, BALL.faces), "scale the mesh"),
        (lambda: (BALL.vertices, [[0, 1, 1]]), "three different corners"),
    ],
)
def test_a_mesh_that_is_no_volume_is_refused_in_words(
    tmp_path: Path, make: Callable[[], tuple[object, object]], words: str
) -> None:
    with pytest.raises(MeshError, match=words):
        read_mesh(write(tmp_path / "a.ply", *make()))


def test_a_face_that_names_a_missing_vertex_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n")
    with pytest.raises(MeshError):
        read_mesh(tmp_path / "a.off")
    binary = BALL.export(file_type="ply")
    at = len(binary) - 4
    (tmp_path / "b.ply").write_bytes(binary[:at] + struct.pack("<i", 90000))
    with pytest.raises(MeshError, match="names vertex 90000"):
        read_mesh(tmp_path / "b.ply")


def test_faces_of_no_vertices_at_all_are_refused(tmp_path: Path) -> None:
    view = {"buffer": 0, "byteLength": 12}
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 0, "type": "VEC3"},
            {"bufferView": 0, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [view],
        "buffers": [{"byteLength": 12}],
    }
    (tmp_path / "a.glb").write_bytes(glb(tree, b"\0" * 12))
    with pytest.raises(MeshError, match="names vertex 0, but there are 0"):
        read_mesh(tmp_path / "a.glb")


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_file_cut_anywhere_is_refused_or_still_a_volume(tmp_path: Path, suffix: str) -> None:
    whole = BALL.export(file_type=suffix[1:])
    data = whole.encode() if isinstance(whole, str) else whole
    path = tmp_path / f"a{suffix}"
    for share in (0.0, 0.001, 0.01, 0.1, 0.5, 0.9, 0.99):
        path.write_bytes(data[: int(share * len(data))])
        try:
            mesh = read_mesh(path)
        except MeshError as refusal:
            assert "a" + suffix in str(refusal)
            continue
        # Only OBJ does not say how much there should be.
        assert suffix == ".obj"
        assert any("a guess: there was no face" in note for note in mesh.notes)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.sampled_from(SUFFIXES), st.integers(0, 10**6), st.integers(0, 255))
def test_a_damaged_byte_raises_a_mesh_error_or_nothing(
    tmp_path: Path, suffix: str, place: int, value: int
) -> None:
    whole = trimesh.creation.box((1, 2, 3)).export(file_type=suffix[1:])
    data = bytearray(whole.encode() if isinstance(whole, str) else whole)
    data[place % len(data)] = value
    (tmp_path / f"a{suffix}").write_bytes(bytes(data))
    try:
        mesh = read_mesh(tmp_path / f"a{suffix}")
    except MeshError:
        return
    assert signed_volume(mesh.vertices, mesh.faces) > 0.0


HUGE = 2_000_000_000


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.ply", f"ply\nformat ascii 1.0\nelement vertex {HUGE}\nproperty float x\nend_header\n"),
        ("a.ply", f"ply\nformat ascii 1.0\nelement face {HUGE}\nend_header\n1\n"),
        ("a.off", f"OFF\n{HUGE} {HUGE} 0\n0 0 0\n"),
        ("a.stl", "x" * 80 + "\xff\xff\xff\x7f"),
    ],
)
def test_counts_that_lie_are_refused_before_anything_is_made(
    tmp_path: Path, name: str, data: str
) -> None:
    (tmp_path / name).write_bytes(data.encode("latin-1"))
    with pytest.raises(MeshError, match="promises"):
        read_mesh(tmp_path / name)


def glb(tree: dict[str, object], binary: bytes = b"") -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


ACCESSOR = {"componentType": 5126, "type": "VEC3", "bufferView": 0}
VIEW = {"buffer": 0, "byteLength": 12}


@pytest.mark.parametrize(
    ("tree", "words"),
    [
        ({"buffers": [{"uri": "../../secret.bin", "byteLength": 9}]}, "external files"),
        ({"images": [{"uri": "../../secret.png"}]}, "external files"),
        ({"bufferViews": [{"buffer": 0, "byteLength": HUGE}]}, "lies outside"),
        ({"bufferViews": [VIEW], "accessors": [{**ACCESSOR, "count": HUGE}]}, "promises"),
        ({"bufferViews": [VIEW], "accessors": [{**ACCESSOR, "count": -1}]}, "promises"),
        ({"accessors": [{"componentType": 5126, "type": "VEC3", "count": HUGE}]}, "sparse"),
        ({"bufferViews": [{}]}, "is not glTF"),
        ([], "is not glTF"),
        (
            {
                "bufferViews": [VIEW],
                "accessors": [{**ACCESSOR, "count": 1}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}] * 200_000}],
                "nodes": [{"mesh": 0}] * 1000,
            },
            "simplify the scene",
        ),
    ],
)
def test_a_glb_that_asks_for_more_than_it_holds_is_refused(
    tmp_path: Path, tree: dict[str, object], words: str
) -> None:
    (tmp_path / "a.glb").write_bytes(glb(tree, b"\0" * 12))
    with pytest.raises(MeshError, match=words):
        read_mesh(tmp_path / "a.glb")


@pytest.mark.parametrize("name", ["a.step", "a", "a.gltf"])
def test_an_unknown_ending_is_refused_with_the_known_ones(tmp_path: Path, name: str) -> None:
    with pytest.raises(MeshError, match=r"\.ply, \.obj, \.stl, \.off, \.glb"):
        read_mesh(tmp_path / name)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("data", [b"", b"hello\n", b"\x89PNG\r\n\x1a\n" + b"\0" * 300])
def test_another_kind_of_file_is_refused(tmp_path: Path, suffix: str, data: bytes) -> None:
    (tmp_path / f"a{suffix}").write_bytes(data)
    with pytest.raises(MeshError):
        read_mesh(tmp_path / f"a{suffix}")


def test_without_trimesh_the_pip_line_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    BALL.export(tmp_path / "a.ply")
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'servoid\[exchange\]'"):
        read_mesh(tmp_path / "a.ply")


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="no such file"):
        read_mesh(tmp_path / "missing.ply")


def test_a_mesh_too_small_to_be_told_from_a_point_is_refused(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(2, 1e-9)
    ball.export(tmp_path / "ball.obj", digits=16)
    with pytest.raises(MeshError, match="lengths are metres, at least 1e-06; scale the mesh"):
        read_mesh(tmp_path / "ball.obj")
