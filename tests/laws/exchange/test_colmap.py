"""COLMAP models: written by pycolmap, and by hand where every byte counts."""

import resource
import struct
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from conftest import write_png
from servoid.errors import CameraError, CaptureError, PoseError, ServoidError
from servoid.exchange import open_colmap
from servoid.exchange.captures.colmap_binary import read_cameras_binary, read_images_binary

SIZE_PX = (64, 48)
NAMES = ("b.png", "a.png", "side/c d.png")
MODELS = {
    "SIMPLE_PINHOLE": [60.0, 31.0, 25.0],
    "PINHOLE": [60.0, 61.0, 31.0, 25.0],
    "SIMPLE_RADIAL": [60.0, 31.0, 25.0, 0.03],
    "RADIAL": [60.0, 31.0, 25.0, 0.03, -0.01],
    "OPENCV": [60.0, 61.0, 31.0, 25.0, 0.03, -0.01, 0.002, -0.003],
    "FULL_OPENCV": [60.0, 61.0, 31.0, 25.0, 0.03, -0.01, 0.002, -0.003, 0.004, 0.01, 0.002, 0.001],
    "OPENCV_FISHEYE": [60.0, 61.0, 31.0, 25.0, 0.03, -0.01, 0.002, -0.003],
    "SIMPLE_RADIAL_FISHEYE": [60.0, 31.0, 25.0, 0.03],
    "RADIAL_FISHEYE": [60.0, 31.0, 25.0, 0.03, -0.01],
    "SIMPLE_FISHEYE": [60.0, 31.0, 25.0],
    "FISHEYE": [60.0, 61.0, 31.0, 25.0],
}


def write_images(folder: Path, names: tuple[str, ...] = NAMES) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_png(folder / name, np.full((SIZE_PX[1], SIZE_PX[0], 3), 7, np.uint8))


def camera_bytes(camera_id: int = 1, model: int = 1, count: int = 1) -> bytes:
    """Pack a cameras.bin with one PINHOLE, by the published format."""
    head = struct.pack("<QIiQQ", count, camera_id, model, *SIZE_PX)
    return head + struct.pack("<4d", 60, 61, 31, 25)


def image_bytes(name: bytes = b"a.png", points: int = 2, count: int = 1) -> bytes:
    """Pack an images.bin with one image."""
    pose = struct.pack("<QI7dI", count, 5, 0.5, 0.5, 0.5, 0.5, 1, 2, 3, 1)
    seen = struct.pack("<ddq", 1, 2, -1) * 2
    return pose + name + b"\0" + struct.pack("<Q", points) + seen


def write_by_hand(project: Path, cameras: bytes, images: bytes) -> Path:
    model = project / "sparse" / "0"
    model.mkdir(parents=True, exist_ok=True)
    (model / "cameras.bin").write_bytes(cameras)
    (model / "images.bin").write_bytes(images)
    write_images(project / "images", ("a.png",))
    return project


@pytest.fixture(scope="module")
def pycolmap():
    return pytest.importorskip("pycolmap", reason="pycolmap, which writes the models, is missing")


def write_with_pycolmap(pycolmap, project: Path, form: str) -> dict[str, np.ndarray]:
    """Write one camera of each model, three images each; return `world_from_camera` by name."""
    model = pycolmap.Reconstruction()
    rng = np.random.default_rng(3)
    poses = {}
    for number, (name, parameters) in enumerate(MODELS.items(), start=1):
        camera = pycolmap.Camera(
            model=name, width=SIZE_PX[0], height=SIZE_PX[1], params=parameters, camera_id=number
        )
        model.add_camera_with_trivial_rig(camera)
        for index, image_name in enumerate(NAMES):
            turn = Rotation.random(random_state=rng.integers(1 << 30))
            place = rng.normal(size=3)
            image = pycolmap.Image(
                name=f"{name}/{image_name}", camera_id=number, image_id=10 * number + index
            )
            image.points2D = pycolmap.Point2DList([pycolmap.Point2D(rng.normal(size=2))] * index)
            moved = pycolmap.Rigid3d(pycolmap.Rotation3d(turn.as_quat()), place)
            model.add_image_with_trivial_frame(image, moved)
            camera_from_world = np.eye(4)
            camera_from_world[:3, :3], camera_from_world[:3, 3] = turn.as_matrix(), place
            poses[f"{name}/{image_name}"] = np.linalg.inv(camera_from_world)
        write_images(project / "images" / name)
    folder = project / "sparse" / "0"
    folder.mkdir(parents=True)
    model.write_binary(folder) if form == "bin" else model.write_text(folder)
    return poses


@pytest.mark.parametrize("form", ["bin", "txt"])
def test_every_image_stands_where_pycolmap_put_it(pycolmap, form: str, tmp_path: Path) -> None:
    poses = write_with_pycolmap(pycolmap, tmp_path, form)
    capture = open_colmap(tmp_path)
    views = capture.all_views()
    assert not capture.is_recording
    assert len(capture) == len(views) == len(poses)
    seen = [view.image_path.relative_to(tmp_path / "images").as_posix() for view in views]
    assert set(seen) == set(poses)
    for view, name in zip(views, seen, strict=True):
        pose = view.world_from_lens.matrix()
        np.testing.assert_allclose(pose, poses[name], atol=1e-12)
    assert len({view.name for view in views}) == len(views)


@pytest.mark.parametrize("form", ["bin", "txt"])
def test_a_lens_projects_as_pycolmap_does_half_a_pixel_off(
    pycolmap, form: str, tmp_path: Path
) -> None:
    write_with_pycolmap(pycolmap, tmp_path, form)
    read_back = pycolmap.Reconstruction(tmp_path / "sparse" / "0")
    rng = np.random.default_rng(5)
    points = np.concatenate([rng.uniform(-0.4, 0.4, (50, 2)), rng.uniform(0.8, 2, (50, 1))], axis=1)
    cameras = open_colmap(tmp_path).cameras
    assert len(cameras) == len(MODELS)
    for camera in cameras:
        expected = read_back.cameras[int(camera.name)].img_from_cam(points) - 0.5
        np.testing.assert_allclose(camera.lens.project(points), expected, atol=1e-9)


def test_a_model_without_pycolmap_is_read_the_same(tmp_path: Path) -> None:
    [view] = open_colmap(write_by_hand(tmp_path, camera_bytes(), image_bytes())).all_views()
    assert view.lens.size_px == SIZE_PX
    assert view.lens.focal_px == (60, 61)
    assert view.lens.center_px == (30.5, 24.5)
    # The quaternion turns x to y, y to z and z to x, so its inverse takes (1, 2, 3) to (2, 3, 1).
    np.testing.assert_allclose(view.world_from_lens.translation, [-2, -3, -1], atol=1e-12)
    assert view.name == "1/a"


@pytest.mark.parametrize("name", ["a.png.png", "a.png"])
def test_a_mask_is_found_under_both_names(name: str, tmp_path: Path) -> None:
    write_by_hand(tmp_path, camera_bytes(), image_bytes())
    mask = np.zeros(SIZE_PX[::-1], np.uint8)
    mask[3, 4] = 255
    (tmp_path / "masks").mkdir()
    write_png(tmp_path / "masks" / name, mask)
    [view] = open_colmap(tmp_path).views()
    np.testing.assert_array_equal(view.mask(), mask)


@pytest.mark.parametrize("start", [".", "sparse/0"])
def test_images_are_found_beside_the_model_or_where_they_are_said_to_be(
    start: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_by_hand(tmp_path, camera_bytes(), image_bytes())
    monkeypatch.chdir(tmp_path / start)
    assert len(open_colmap(".").all_views()) == 1
    (tmp_path / "images").rename(tmp_path / "small")
    with pytest.raises(CaptureError, match="no folder 'images'"):
        open_colmap(".")
    assert len(open_colmap(".", images=tmp_path / "small").all_views()) == 1
    with pytest.raises(CaptureError, match="there is no folder"):
        open_colmap(".", images=tmp_path / "images")


def test_lines_of_points_may_be_empty_or_missing_in_text(tmp_path: Path) -> None:
    model = tmp_path / "sparse"
    model.mkdir()
    write_images(tmp_path / "images")
    (model / "cameras.txt").write_text("# a word\n\n4 PINHOLE 64 48 60 61 31 25\n")
    one = "{} 1 0 0 0 1 2 3 4 {}\n"
    lines = [one.format(1, "b.png"), "\n", one.format(2, "a.png"), "1 2 -1 3 4 7\n"]
    (model / "images.txt").write_text("".join([*lines, one.format(3, "side/c d.png").rstrip()]))
    assert [view.name for view in open_colmap(tmp_path).all_views()] == ["4/a", "4/b", "4/c d"]
    (model / "images.txt").write_text(one.format(1, "b.png") + one.format(2, "a.png"))
    with pytest.raises(CaptureError, match=r"images\.txt, line 2: an image's points belong here"):
        open_colmap(tmp_path)


BAD = {
    "unsupported model": (
        lambda: (camera_bytes(model=7), image_bytes()),
        r"camera 1: the camera model 'FOV' is not supported; supported are SIMPLE_PINHOLE, PINHOLE",
    ),
    "unknown model": (lambda: (camera_bytes(model=99), image_bytes()), r"'number 99' is not"),
    "cameras that lie about their count": (
        lambda: (camera_bytes(count=1 << 60), image_bytes()),
        r"cameras\.bin claims 1152921504606846976 cameras, but only 56 bytes follow",
    ),
    "images that lie about their count": (
        lambda: (camera_bytes(), image_bytes(count=1 << 62)),
        r"images\.bin claims .* images",
    ),
    "points that lie about their count": (
        lambda: (camera_bytes(), image_bytes(points=(1 << 64) - 1)),
        r"claims 18446744073709551615 points of image 5",
    ),
    "too few points": (
        lambda: (camera_bytes(), image_bytes(points=1)),
        r"images\.bin: 24 bytes follow the last entry",
    ),
    "name without an end": (lambda: (camera_bytes(), image_bytes()[:75]), r"claims|cut short"),
    "name that leaves the folder": (
        lambda: (camera_bytes(), image_bytes(name=b"../images/a.png")),
        r"image 5: '\.\./images/a\.png' leaves the capture's folder",
    ),
    "absolute name": (lambda: (camera_bytes(), image_bytes(name=b"/etc/a")), r"leaves the"),
    "name of nothing": (lambda: (camera_bytes(), image_bytes(name=b".")), r"not a file name"),
    "empty name": (lambda: (camera_bytes(), image_bytes(name=b"")), r"is not a file name"),
    "endless name": (lambda: (camera_bytes(), image_bytes(name=b"a" * 9999)), r"there is no"),
    "name in no encoding": (lambda: (camera_bytes(), image_bytes(name=b"\xff")), r"not UTF-8"),
    "image that is missing": (
        lambda: (camera_bytes(), image_bytes(name=b"z.png")),
        r"there is no .*z\.png; give the folder",
    ),
    "image of another camera": (
        lambda: (camera_bytes(camera_id=2), image_bytes()),
        r"image 5: it is of camera 1, which the model does not have",
    ),
    "two cameras of one number": (
        lambda: (camera_bytes(count=2) + camera_bytes()[8:], image_bytes()),
        r"two cameras have the same number",
    ),
    "no image": (lambda: (camera_bytes(), struct.pack("<Q", 0)), r"has no image"),
    "no magic": (lambda: (b"PNG", b"PNG"), r"cameras\.bin is cut short after 3 bytes"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_model_that_cannot_be_used_is_refused(case: str, tmp_path: Path) -> None:
    make, message = BAD[case]
    with pytest.raises(CaptureError, match=message):
        open_colmap(write_by_hand(tmp_path, *make()))


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("cameras", "1 PINHOLE 64 48 60 61 31", r"PINHOLE has 4 parameters, but 3 were given"),
        ("cameras", "1 FOV 64 48 60 61 31 25 1", r"'FOV' is not supported; supported are"),
        ("cameras", "1 PINHOLE 64 48", r"line 1: 4 values were given"),
        ("cameras", "1 PINHOLE 64 4.8 60 61 31 25", r"line 1: '4\.8' is not a whole"),
        ("cameras", "1 PINHOLE 64 48 nan 61 31 25", r"camera 1: .*focal"),
        ("cameras", "1 PINHOLE 64 -48 60 61 31 25", r"camera 1: size_px must be two positive"),
        ("cameras", f"1 PINHOLE 64 {10**30} 60 61 31 25", r"camera 1: size_px must be"),
        ("images", "1 1 0 0 0 1 2 3 1", r"images\.txt, line 1: 9 values were given"),
        ("images", "1 1 0 0 0 1 2 x 1 a.png", r"line 1: 'x' is not a number"),
        ("images", "1 9 0 0 0 1 2 3 1 a.png", r"images\.txt, image 1: .*quaternion"),
        ("images", "1 1 0 0 0 1 2 inf 1 a.png", r"images\.txt, image 1: .*finite"),
    ],
)
def test_text_that_cannot_be_used_is_refused(
    name: str, text: str, message: str, tmp_path: Path
) -> None:
    good = {"cameras": "1 PINHOLE 64 48 60 61 31 25", "images": "1 1 0 0 0 1 2 3 1 a.png"}
    write_images(tmp_path / "images", ("a.png",))
    for kind, line in (good | {name: text}).items():
        (tmp_path / f"{kind}.txt").write_text(line)
    with pytest.raises((CaptureError, CameraError, PoseError), match=message):
        open_colmap(tmp_path)


def test_a_folder_without_a_model_is_named(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match=r"no COLMAP model in .*cameras\.bin and images\.bin"):
        open_colmap(tmp_path)


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_by_hand(tmp_path_factory.mktemp("fuzz"), camera_bytes(), image_bytes())


Spoil = Callable[[bytes], bytes]


def cut(at: int) -> Spoil:
    return lambda data: data[: at % len(data)]


def flip(at: int, bits: int) -> Spoil:
    def spoil(data: bytes) -> bytes:
        at_byte = at % len(data)
        return data[:at_byte] + bytes([data[at_byte] ^ bits]) + data[at_byte + 1 :]

    return spoil


spoils = st.one_of(
    st.builds(cut, st.integers(0, 200)),
    st.builds(flip, st.integers(0, 200), st.integers(1, 255)),
    st.builds(lambda tail: lambda data: data + tail, st.binary(min_size=1, max_size=40)),
    st.builds(lambda whole: lambda _: whole, st.binary(max_size=200)),
)


@settings(max_examples=200, deadline=None)
@given(name=st.sampled_from(["cameras.bin", "images.bin"]), spoil=spoils)
def test_a_damaged_file_is_refused_or_still_a_capture(
    name: str, spoil: Spoil, project: Path
) -> None:
    wholes = {"cameras.bin": camera_bytes(), "images.bin": image_bytes()}
    for kind, whole in wholes.items():
        content = spoil(whole) if kind == name else whole
        (project / "sparse" / "0" / kind).write_bytes(content)
    try:
        capture = open_colmap(project)
    except ServoidError as error:
        assert isinstance(error, (CaptureError, CameraError, PoseError))
        assert str(project) in str(error)
    else:
        assert len(capture.all_views()) >= 1


@settings(max_examples=100, deadline=None)
@given(at=st.integers(0, 7), value=st.integers(0, 255), claim=st.binary(min_size=8, max_size=8))
def test_no_count_in_a_file_asks_for_more_memory_than_the_file_is_long(
    at: int, value: int, claim: bytes, project: Path
) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for whole, read in (
        (camera_bytes(), read_cameras_binary),
        (image_bytes(), read_images_binary),
    ):
        path = project / "lying.bin"
        for count in (claim, whole[:at] + bytes([value]) + whole[at + 1 : 8]):
            path.write_bytes(count + whole[8:])
            with suppress(CaptureError):
                assert len(read(path)) <= 1
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 16  # 64 MiB
