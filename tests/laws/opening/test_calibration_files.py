"""--calibration FILE of another program: the same cameras as a rig.toml, or what is wrong in it."""

import copy
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tool_calibrations import (
    LENSES,
    RIGHT_FROM_LEFT,
    SIZE_PX,
    distortion_of,
    kalibr,
    matrix_of,
    opencv_lenses,
    opencv_poses,
    ros,
    write,
    write_opencv,
    write_ros_pair,
)

from servoid.errors import ServoidError
from servoid.opening import GivenCalibration
from servoid.pose import Pose
from servoid.source import MountedCamera

Damage = Callable[[dict[str, Any]], object]
LEFT, RIGHT = LENSES["four numbers"], LENSES["fisheye"]
LENS = LENSES["five numbers"]
NAMES = ("left", "right")


def cameras_of(
    path: Path, names: tuple[str, ...] = NAMES, size_px: tuple[int, int] | None = SIZE_PX
) -> tuple[MountedCamera, ...]:
    sizes_px = None if size_px is None else [size_px] * len(names)
    return GivenCalibration(calibration=path).rig("run", names, sizes_px).cameras


def chain() -> dict[str, Any]:
    return kalibr([LEFT, RIGHT], [RIGHT_FROM_LEFT])


def pair() -> dict[str, Any]:
    return {
        key: {"rows": len(one), "cols": one.shape[1], "data": one.ravel().tolist()}
        for key, one in (opencv_lenses(LENS, LENS) | opencv_poses(RIGHT_FROM_LEFT)).items()
    }


def write_rig(path: Path) -> Path:
    """Write the two cameras of the chain as a rig.toml."""
    poses = Pose.identity(), RIGHT_FROM_LEFT.inverse()
    tables = [
        f"""[[camera]]
name = "{name}"
size_px = {list(one.size_px)}
model = "{one.model}"
focal_px = {list(one.focal_px)}
center_px = {list(one.center_px)}
distortion = {distortion_of(one).tolist()}
rig_from_camera = {pose.matrix().tolist()}
"""
        for name, one, pose in zip(NAMES, (LEFT, RIGHT), poses, strict=True)
    ]
    path.write_text("version = 1\n" + "".join(tables))
    return path


def test_the_first_camera_of_the_source_is_the_origin_whichever_a_tool_names_first(
    tmp_path: Path,
) -> None:
    write_ros_pair(tmp_path, LENS, LENS, RIGHT_FROM_LEFT)
    left, right = (tmp_path / f"{name}.yaml" for name in NAMES)
    for path in (Path(f"{left}+{right}"), Path(f"{right}+{left}")):
        for names in (NAMES, NAMES[::-1]):
            first, second = cameras_of(path, names)
            assert (first.name, second.name) == names
            assert np.abs(first.rig_from_camera.log()).max() < 1e-9
            other = RIGHT_FROM_LEFT if names == NAMES else RIGHT_FROM_LEFT.inverse()
            assert np.abs((second.rig_from_camera @ other).log()).max() < 1e-9


def test_a_camchain_of_a_known_rig_gives_the_cameras_of_its_rig_toml(tmp_path: Path) -> None:
    own = cameras_of(write_rig(tmp_path / "rig.toml"))
    kalibrs = cameras_of(write(tmp_path / "camchain.yaml", chain()))
    rays = np.random.default_rng(2).uniform((-0.4, -0.4, 1.1), (0.4, 0.4, 1.9), (40, 3))
    for one, other in zip(own, kalibrs, strict=True):
        off = one.rig_from_camera.matrix() - other.rig_from_camera.matrix()
        assert np.abs(off).max() < 1e-12
        assert np.abs(one.lens.project(rays) - other.lens.project(rays)).max() < 1e-12
        assert one.lens == other.lens


def test_cameras_of_a_chain_are_matched_by_the_names_of_their_topics(tmp_path: Path) -> None:
    topics = ("/rig/right/image_raw", "/rig/left/image_raw")
    path = write(tmp_path / "camchain.yaml", kalibr([LEFT, RIGHT], [RIGHT_FROM_LEFT], topics))
    cameras = cameras_of(path)
    assert [camera.name for camera in cameras] == ["left", "right"]
    assert [camera.lens.model for camera in cameras] == ["kannala_brandt", "brown_conrady"]


def test_the_files_of_a_calibration_are_those_that_its_path_names(tmp_path: Path) -> None:
    both = write_ros_pair(tmp_path, LENS, LENS, RIGHT_FROM_LEFT)
    files = (tmp_path / "left.yaml", tmp_path / "right.yaml")
    assert GivenCalibration(calibration=both).files == files
    assert GivenCalibration(calibration=tmp_path).files == files
    assert GivenCalibration(calibration=files[0]).files == files[:1]
    assert GivenCalibration(fov_deg=60.0).files == ()
    plus = write_rig(tmp_path / "a+b.toml")
    assert GivenCalibration(calibration=plus).files == (plus,)
    assert len(cameras_of(plus)) == 2


def test_notes_on_a_calibration_are_those_of_the_rig(tmp_path: Path) -> None:
    content = opencv_lenses(LENS, LENS) | opencv_poses(RIGHT_FROM_LEFT)
    path = write_opencv(tmp_path / "both.yml", content)
    rig = GivenCalibration(calibration=path).rig("run", NAMES, [SIZE_PX] * 2)
    assert len(rig.notes) == 2 and rig.is_seated


def at(*keys: str | int, value: Any) -> Damage:
    """Return what puts a value into a table, or takes it out if it is None."""

    def damage(content: dict[str, Any]) -> None:
        inside: Any = content
        for key in keys[:-1]:
            inside = inside[key]
        if value is None:
            del inside[keys[-1]]
        else:
            inside[keys[-1]] = value

    return damage


STEP = ("cam1", "T_cn_cnm1")
MILLIMETRES = [[1, 0, 0, -120.0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
FAULTS: dict[str, tuple[Callable[[], dict[str, Any]], Damage, str]] = {
    "no step": (chain, at(*STEP, value=None), "cam1: T_cn_cnm1 is missing, the pose of cam0 in"),
    "a mirror": (chain, at(*STEP, 0, value=[-1, 0, 0, 0]), "cam1, T_cn_cnm1: .*rotation"),
    "a long row": (chain, at(*STEP, 0, value=[1, 0, 0, 0, 0]), "T_cn_cnm1.*of length 4, got 5"),
    "millimetres": (
        chain, at(*STEP, value=MILLIMETRES),
        "distance of cam1 from cam0 is 120 m, .*if it is in millimetres, write 0.12; Kalibr's",
    ),
    "an omni lens": (
        chain, at("cam0", "camera_model", value="omni"),
        "cam0: its lens is 'omni' with 'radtan'; servoid supports 'pinhole' with 'radtan', 'equi'",
    ),
    "an fov lens": (chain, at("cam1", "distortion_model", value="fov"), "'pinhole' with 'fov'; .*"),
    "no intrinsics": (chain, at("cam0", "intrinsics", value=None), "the key 'intrinsics' is miss"),
    "five intrinsics": (
        chain, at("cam0", "intrinsics", value=[0.5, 400, 400, 320, 240]),
        r"intrinsics: \[0.5, 400, 400, 320, 240\] are not the four of a pinhole camera: fu, fv",
    ),
    "a focal length of zero": (chain, at("cam0", "intrinsics", 0, value=0.0), "cam0: .*focal"),
    "a far focal length": (
        chain, at("cam0", "intrinsics", 1, value=1e12), "cam0: a focal .*, 1000000000000.0"
    ),
    "a far middle": (pair, at("M2", "data", 2, value=1e11), "right: the principal point must be"),
    "three numbers": (
        chain, at("cam1", "distortion_coeffs", value=[0.1, 0.1, 0.0]),
        "cam1, distortion_coeffs: 3 numbers were given; 'equi' has 4",
    ),
    "not a number": (
        chain, at("cam1", "intrinsics", 1, value=float("nan")), "cam1, intrinsics.1.: .*not finite"
    ),
    "a text": (chain, at("cam1", "resolution", value="640x480"), "cam1, resolution: expected a li"),
    "no table": (chain, at("cam1", value=[1, 2]), "cam1: expected a table of keys and values"),
    "a gap": (
        chain, at("cam3", value={}), "has cam0, cam1, cam3; the cameras of a chain must be cam0, c"
    ),
    "another size": (
        chain, at("cam1", "resolution", value=[752, 480]), "'cam1': size_px = .752, 480., but the "
    ),
    "no translation": (
        pair, at("T", value=None),
        r"T is missing; a pair has M1, D1, M2, D2, R, T; .*intrinsics.yml\+extrinsics.yml",
    ),
    "a turn vector": (
        pair, at("R", value={"rows": 3, "cols": 1, "data": [0, 0, 1]}),
        "R has 3 rows, 1 columns and 3 numbers; it must be 3x3",
    ),
    "no rotation": (pair, at("R", "data", 0, value=2.0), "R: .*rotation"),
    "squares": (
        pair, at("T", "data", value=[-60, 0, 0]), "is 60 m, .*write 0.06; T is in the unit of the b"
    ),
    "twelve numbers": (
        pair, at("D1", value={"rows": 1, "cols": 12, "data": [0.1] * 12}),
        "D has 12 coefficients; servoid supports the first 8",
    ),
    "four numbers": (
        pair, at("D2", value={"rows": 1, "cols": 4, "data": [0.1] * 4}),
        "D2: four numbers are those of calibrateCamera or of fisheye.calibrate; add the key fish",
    ),
    "a fisheye of five": (pair, at("fisheye_model", value=1), "D1: 5 numbers were given; a fish"),
    "a skew": (pair, at("M2", "data", 1, value=0.5), "M2 is not that of a camera: it must be fx 0"),
    "no lens": (pair, at("M1", "data", value=[0.0] * 8 + [1.0]), "M1 has no focal length: the cam"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_what_is_wrong_in_a_calibration_is_named_with_its_place(name: str, tmp_path: Path) -> None:
    make, damage, message = FAULTS[name]
    content = make()
    path = write(tmp_path / "calibration.yaml", content)
    assert len(cameras_of(path)) == 2
    damage(content)
    write(path, content)
    with pytest.raises(ServoidError, match=message) as refused:
        cameras_of(path)
    assert str(refused.value).startswith(str(path))


FLAT = [500, 0, 320, 0, 0, 500, 240, 0, 0, 0, 1, 0]


@pytest.mark.parametrize(
    ("files", "damage", "message"),
    [
        ("left", at("image_width", value=None), "left.yaml: the key 'image_width' is missing"),
        ("right", at("camera_matrix", "data", value=[1.0]), "right.yaml, camera_matrix has 3 rows"),
        ("left", at("camera_matrix", "data", 0, value=0.0), "the camera is not calibrated"),
        ("left", at("distortion_model", value="thin_prism"), "model is 'thin_prism' with 5 coeff"),
        ("right", at("rectification_matrix", "data", 0, value=-3.0), "right.yaml, R: .*rotation"),
        ("right", at("projection_matrix", "rows", value=3.5), "_matrix.rows: expected a whole"),
        ("left right", at("projection_matrix", "data", value=FLAT),
         "do not have the pose of one camera in the other: P has the same offset in both; calib"),
        ("right", at("projection_matrix", "data", 3, value=-9e4),
         "right.yaml, projection_matrix: the distance of right from left is 1.* m, and more than 10"
         " .*in millimetres, write 0.1.*; calibrate with --square in metres"),
    ],
)  # fmt: skip
def test_what_is_wrong_in_a_file_of_ros_is_named(
    files: str, damage: Damage, message: str, tmp_path: Path
) -> None:
    both = write_ros_pair(tmp_path, LENS, LENS, RIGHT_FROM_LEFT)
    assert len(cameras_of(both)) == 2
    for name in files.split():
        path = tmp_path / f"{name}.yaml"
        content = yaml.safe_load(path.read_text())
        damage(content)
        write(path, content)
    with pytest.raises(ServoidError, match=message):
        cameras_of(both)


def test_one_file_of_a_pair_is_told_to_be_one_of_two(tmp_path: Path) -> None:
    write_ros_pair(tmp_path, LENS, LENS, RIGHT_FROM_LEFT)
    with pytest.raises(
        ServoidError, match=r"of 1 camera, but run has 2; of a pair, .*left\.yaml\+"
    ):
        cameras_of(tmp_path / "left.yaml")
    with pytest.raises(ServoidError, match=r"of 2 cameras, but run has 1; give what the others"):
        cameras_of(tmp_path, ("camera",))
    with pytest.raises(ServoidError, match=r"cannot read .*gone\.yaml: no such file"):
        cameras_of(Path(f"{tmp_path}/left.yaml+gone.yaml"))
    with pytest.raises(ServoidError, match=r"no such .* the folder has right\.yaml and left\.yaml"):
        cameras_of(tmp_path / "rihgt.yaml")
    (tmp_path / "right.yaml").unlink()
    with pytest.raises(ServoidError, match=r"a folder without both .* the folder has left\.yaml"):
        cameras_of(tmp_path)
    sample = {"camera_matrix": matrix_of(LENS), "distortion_coefficients": distortion_of(LENS)}
    write_opencv(tmp_path / "one.yml", sample)
    with pytest.raises(ServoidError, match="has 2; of a pair, give a file with M1, D1, M2"):
        cameras_of(tmp_path / "one.yml")


@pytest.mark.parametrize("tool", ["ROS", "OpenCV"])
def test_the_lens_of_one_camera_is_checked_as_that_of_several(tool: str, tmp_path: Path) -> None:
    content = ros(LENS)
    content["camera_matrix"]["data"][0] = 1e12
    if tool == "OpenCV":
        content = {key: content[key] for key in ("camera_matrix", "distortion_coefficients")}
    path = write(tmp_path / "one.yaml", content)
    with pytest.raises(ServoidError, match=r"one\.yaml, .*: a focal length must be a positive num"):
        cameras_of(path, ("camera",))


def test_files_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    write_ros_pair(tmp_path, LENS, LENS, RIGHT_FROM_LEFT)
    write(tmp_path / "camchain.yaml", chain())
    write(tmp_path / "both.yml", pair())
    write(tmp_path / "empty.yaml", {"a": 1})
    write_rig(tmp_path / "rig.toml")
    left, camchain, both = (tmp_path / name for name in ("left.yaml", "camchain.yaml", "both.yml"))
    for names, message in (
        (f"{camchain}+{camchain}", "are 2 chains of Kalibr; give the camchain"),
        (f"{both}+{both}", "both have 'D1'"),
        (f"{left}+{camchain}", "are not a calibration that servoid knows; give a rig.toml, a camc"),
        (f"{left}+{left}+{left}", "3 calibrations by ROS were given"),
        (f"{left}+{left}", "P has the same offset in both"),
        (f"{tmp_path}/rig.toml+{left}", r"write their \[\[camera\]\] tables into one TOML file"),
        (f"{tmp_path}/empty.yaml", "is not a calibration that servoid knows"),
    ):
        with pytest.raises(ServoidError, match=message):
            cameras_of(Path(names))
    write_opencv(tmp_path / "both.xml", opencv_lenses(LENS, LENS))
    with pytest.raises(ServoidError, match=r"by OpenCV in XML, .*ends in \.yml"):
        cameras_of(tmp_path / "both.xml")
    with pytest.raises(ServoidError, match="does not say for which size of images it is valid"):
        cameras_of(both, size_px=None)


def places_in(content: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of each value in a table, deep inside, too."""
    items: Any = ()
    if isinstance(content, (dict, list)):
        items = content.items() if isinstance(content, dict) else enumerate(content)
    for key, value in items:
        yield (*path, key)
        yield from places_in(value, (*path, key))


WRONG = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8),
    st.lists(st.floats(), max_size=5), st.dictionaries(st.text(max_size=3), st.integers()),
)  # fmt: skip
MAKERS = {
    "Kalibr": chain,
    "OpenCV": pair,
    "ROS": lambda: ros(LENS),
}


def check_is_read_or_refused(path: Path) -> None:
    """Check that a file is read, or refused by an error of servoid in one line of words."""
    try:
        cameras_of(path, ("camera",) if "ROS" in path.stem else NAMES)
    except ServoidError as error:
        assert len(str(error)) > len(str(path)) and "\n" not in str(error)


@pytest.mark.parametrize("tool", MAKERS)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_value_in_place_of_another_is_read_or_refused_in_words(
    tool: str, tmp_path: Path, data: st.DataObject
) -> None:
    content = copy.deepcopy(MAKERS[tool]())
    for _ in range(data.draw(st.integers(1, 3))):
        *above, last = data.draw(st.sampled_from(list(places_in(content))))
        inside: Any = content
        for key in above:
            inside = inside[key]
        inside[last] = data.draw(WRONG)
    check_is_read_or_refused(write(tmp_path / f"{tool}.yaml", content))


@pytest.mark.parametrize("tool", MAKERS)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_bytes_in_place_of_others_are_read_or_refused_in_words(
    tool: str, tmp_path: Path, data: st.DataObject
) -> None:
    path = write(tmp_path / f"{tool}.yaml", MAKERS[tool]())
    content = path.read_bytes()
    start = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(start, min(len(content), start + 12)))
    signs = st.sampled_from([b"[", b"{", b"&a ", b"*a", b"\n", b"- ", b"!!int ", b": ", b"%", b"'"])
    new = data.draw(st.one_of(st.binary(max_size=8), signs))
    path.write_bytes(content[:start] + new + content[end:])
    check_is_read_or_refused(path)
