"""Every input that cannot be used: a clear error, exit code 1, and nothing written."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from refusals import Spoil, check_refused, edit

from conftest import SIZE_PX, Command, camera_toml, write_png
from servoid.camera import read_image
from servoid.errors import ImageError

WIDTH, HEIGHT = SIZE_PX


def toml(old: str, new: str) -> Spoil:
    return edit("capture.toml", old, new)


def pixels(name: str, value: np.ndarray) -> Spoil:
    return lambda folder: write_png(folder / name, value)


def content(name: str, change: Callable[[bytes], bytes]) -> Spoil:
    return lambda folder: (folder / name).write_bytes(change((folder / name).read_bytes()))


def remove(name: str) -> Spoil:
    return lambda folder: (folder / name).unlink()


def replace_row(line: int, column: int, value: str) -> Spoil:
    """Spoil one value of poses.csv; the header is line 1."""

    def spoil(folder: Path) -> None:
        lines = (folder / "poses.csv").read_text().splitlines()
        cells = lines[line - 1].split(",")
        cells[column] = value
        lines[line - 1] = ",".join(cells)
        (folder / "poses.csv").write_text("\n".join(lines) + "\n")

    return spoil


def dangling_image(folder: Path) -> None:
    (folder / "images" / "0003.png").unlink()
    (folder / "images" / "0003.png").symlink_to("nowhere.png")


def look_away(folder: Path) -> None:
    """Turn every second camera around, so that the object is behind it."""
    lines = (folder / "poses.csv").read_text().splitlines()
    for index in range(1, len(lines), 2):
        *place, w, x, y, z = (float(cell) for cell in lines[index].split(","))
        # Half a turn about the camera's own y axis, as a product of quaternions.
        lines[index] = ",".join(map(repr, [*place, -y, -z, w, x]))
    (folder / "poses.csv").write_text("\n".join(lines) + "\n")


def other_masks(folder: Path) -> None:
    for path in (folder / "masks").iterdir():
        path.rename(path.with_stem(f"mask_{path.stem}"))


BLACK = np.zeros((HEIGHT, WIDTH), np.uint8)

IMAGES = {
    "missing image": (remove("images/0003.png"), r"poses\.csv has 8 poses.*7 images"),
    "dangling link": (dangling_image, r"cannot read .*0003\.png: no such file"),
    "garbage image": (
        content("images/0003.png", lambda _: b"not an image"),
        r"0003\.png cannot be decoded: it is no image or it is damaged; replace the file",
    ),
    "image cut short": (
        content("images/0003.png", lambda data: data[: len(data) // 2]),
        r"images/0003\.png is cut short.*copy the file again",
    ),
    "empty image": (content("images/0003.png", lambda _: b""), r"0003\.png is empty; replace"),
    "image of another size": (
        pixels("images/0003.png", np.zeros((50, 60, 3), np.uint8)),
        r"0003\.png is 60x50 pixels, but its camera has size_px = \[160, 120\]; correct",
    ),
    "size of another camera": (
        toml("size_px = [160, 120]", "size_px = [320, 240]"),
        r"images/\d+\.png is 160x120 pixels, but its camera has size_px = \[320, 240\]; correct "
        r"size_px",
    ),
    "empty mask": (pixels("masks/0004.png", BLACK), r"masks/0004\.png: the mask is empty.*mark"),
    "mask that covers the image": (
        pixels("masks/0004.png", BLACK + 255),
        r"masks/0004\.png: the mask covers the whole image.*background",
    ),
    "garbage mask": (
        content("masks/0004.png", lambda _: b"no"),
        r"masks/0004\.png cannot be",
    ),
    "mask cut short": (
        content("masks/0004.png", lambda data: data[:60]),
        r"0004\.png is cut",
    ),
    "mask of another size": (
        pixels("masks/0004.png", np.eye(90, dtype=np.uint8)),
        r"masks/0004\.png is 90x90 pixels, .* size_px = \[160, 120\]; give a mask of the size",
    ),
    "masks named otherwise": (
        other_masks,
        r"no mask has the name of an image.*name each mask like its image, such as 0000\.png",
    ),
    "no masks": (
        toml('masks = "masks/*.png"', ""),
        r"no usable view.*give at least one image",
    ),
    "masks that lose pixels": (toml("masks/*.png", "masks/*.jpg"), r"does not end in \.png"),
    "views that see no common point": (look_away, r"common point"),
}

CAMERAS = {
    "pattern without a match": (
        toml("images/*.png", "images/*.jpg"),
        r"images: 'images/\*\.jpg' matches no file in .*correct the pattern",
    ),
    "pattern in a folder that is not there": (
        toml("images/*.png", "pictures/*.png"),
        r"'pictures/\*\.png' matches no file, because there is no folder 'pictures' in .*photos",
    ),
    "pattern that leaves the folder": (
        toml("images/*.png", "../photos/images/*.png"),
        r"images: '\.\./photos.*' leaves the capture's folder; write it relative",
    ),
    "absolute pattern": (toml("images/*.png", "/images/*.png"), r"leaves the capture's folder"),
    "video that is not there": (
        toml("images/*.png", "film.mp4"),
        r"'film\.mp4' matches no file",
    ),
    "depth without scale": (
        toml("distortion", 'depths = "masks/*.png"\ndistortion'),
        r"camera 'eye': depths needs depth_scale_m.*write depth_scale_m = 0\.001 for millimetres",
    ),
    "depth with a scale of zero": (
        toml("distortion", 'depths = "masks/*.png"\ndepth_scale_m = 0.0\ndistortion'),
        r"depth_scale_m: .* above 0",
    ),
    "depth that loses bits": (
        toml("distortion", 'depths = "images/*.jpg"\ndepth_scale_m = 1.0\ndistortion'),
        r"'images/\*\.jpg' ends in none of \.png, \.tif",
    ),
    "negative focal length": (
        toml("focal_px = [210.0", "focal_px = [-210.0"),
        r"camera 'eye': a focal length must be a positive number.*-210",
    ),
    "focal length of zero": (toml("focal_px = [210.0", "focal_px = [0"), r"focal length must be"),
    "focal length of no lens": (
        toml("focal_px = [210.0", "focal_px = [1e-300"),
        r"camera 'eye': a focal length must be .*0\.001 to 1e\+09, but focal_px is .*1e-300",
    ),
    "centre beyond all images": (
        toml("[79.5", "[-1e10"),
        r"within 1e\+09 pixels, but center_px is",
    ),
    "focal length that is not a number": (
        toml("focal_px = [210.0", "focal_px = [nan"),
        r"capture\.toml, camera\[0\]\.focal_px\[0\]: the number is not finite",
    ),
    "infinite centre": (
        toml("[79.5", "[inf"),
        r"camera\[0\]\.center_px\[0\]: the number is",
    ),
    "three focal lengths": (
        toml("[210.0, 210.0]", "[1, 2, 3]"),
        r"camera\[0\]\.focal_px: .*list of len",
    ),
    "image without pixels": (toml("[160, 120]", "[0, 120]"), r"size_px"),
    "size that is not whole": (
        toml("[160, 120]", "[160.5, 120]"),
        r"camera\[0\]\.size_px.*a whole number",
    ),
    "unknown lens model": (toml('"pinhole"', '"fish"'), r"camera 'eye': .*fish.*pinhole"),
    "pinhole with distortion": (
        toml("distortion = []", "distortion = [0.1, 0.0]"),
        r"camera 'eye': .*pinhole.*distortion.* 2 ",
    ),
    "distortion that is cut short": (
        toml('"pinhole"\n', '"brown_conrady"\n'),
        r"camera 'eye': .*brown_conrady.*distortion.* 0 ",
    ),
    "camera that is scaled": (
        toml("[[1, 0, 0, 0]", "[[2, 0, 0, 0]"),
        r"camera 'eye', rig_from_camera, line 12: ",
    ),
    "camera that is mirrored": (
        toml("[[1, 0, 0, 0]", "[[-1, 0, 0, 0]"),
        r"rig_from_camera, line 12",
    ),
    "camera with three rows": (
        toml(", [0, 0, 0, 1]]", "]"),
        r"camera\[0\]\.rig_from_camera: .*length 4",
    ),
    "two cameras of one name": (
        toml("[rig]", camera_toml() + "[rig]"),
        r"two cameras are named 'eye'; give each its own name",
    ),
    "cameras with different counts": (
        toml("[rig]", camera_toml("one", "images/0000.png") + "[rig]"),
        r"camera 'eye' has 8 images and camera 'one' has 1; every observation needs",
    ),
}

FILES = {
    "unknown key": (
        toml("version = 1", "version = 1\nrate = 3"),
        r"capture\.toml, line 2: unknown key 'rate'; known keys: version, rate_hz, camera, rig",
    ),
    "unknown key of a camera": (
        toml("distortion", "distorsion"),
        r"capture\.toml, line 11, camera\[0\]: unknown key 'distorsion'; known keys: name, "
        r"size_px, model, focal_px, fov_deg, center_px, distortion, rig_from_camera, images, "
        r"masks, depths, depth_scale_m",
    ),
    "unknown key of the rig": (
        toml("poses =", "path ="),
        r"line 15, rig: unknown key 'path'; known keys: poses",
    ),
    "missing key": (
        toml("size_px = [160, 120]", ""),
        r"camera\[0\]: the key 'size_px' is missing; known keys: name",
    ),
    "all keys but one": (
        lambda folder: (folder / "capture.toml").write_text("[[camera]]\nimages = 'i/*.png'\n"),
        r"capture\.toml: the key 'version' is missing; known keys: .*; write such as version = 1; "
        r"camera\[0\]: the keys 'name', 'size_px' are missing; known keys: .*; "
        r"write such as name = \"eye\", size_px = \[640,480\]",
    ),
    "a size that no number holds": (
        toml("size_px = [160, 120]", f"size_px = [160, {10**400}]"),
        r"capture\.toml: 1000000000.* does not fit a 64-bit integer",
    ),
    "no camera": (toml("[[camera]]", "[camera]"), r"camera: expected a list, got a table"),
    "later version": (
        toml("version = 1", "version = 2"),
        r"'version' is 2; this servoid reads",
    ),
    "no version": (toml("version = 1", ""), r"the key 'version' is missing"),
    "rate of zero": (toml("version = 1", "version = 1\nrate_hz = 0.0"), r"rate_hz: .* above 0"),
    "rate in millihertz": (
        toml("version = 1", "version = 1\nrate_hz = 30000"),
        r"capture\.toml: rate_hz is 30000; .* at most 10000; if that is a number .*, write 30\b",
    ),
    "broken TOML": (toml("[[camera]]", "[[camera]"), r"is not valid TOML: .*line 3"),
    "TOML in another encoding": (
        content("capture.toml", lambda data: b"# caf\xe9\n" + data),
        r"capture\.toml: the file is not UTF-8 text",
    ),
    "no capture.toml": (
        remove("capture.toml"),
        r"there is no capture in .*photos: no images .*, no capture\.toml, .*; name a folder",
    ),
    "poses of a name that is too long": (
        toml('"poses.csv"', f'"{"p" * 300}.csv"'),
        r"cannot read .*ppp\.csv: ",
    ),
    "no poses.csv": (remove("poses.csv"), r"cannot read .*poses\.csv: no such file"),
    "poses outside": (toml('"poses.csv"', '"../poses.csv"'), r"rig\.poses: .*leaves the capture's"),
    "poses without a header": (
        edit("poses.csv", "time_s,x,y,z,qw,qx,qy,qz\n", ""),
        r"poses\.csv, line 1: the header is '0,.*it must be 'time_s,x,y,z,qw,qx,qy,qz'",
    ),
    "poses with another order": (
        edit("poses.csv", "qw,qx,qy,qz", "qx,qy,qz,qw"),
        r"line 1: the",
    ),
    "too few poses": (
        content("poses.csv", lambda data: data[: data[:-1].rfind(b"\n") + 1]),
        r"poses\.csv has 7 poses, but each camera has 8 images",
    ),
    "pose that is not a number": (
        replace_row(4, 2, "wide"),
        r"poses\.csv, line 4: y is 'wide'; write a number",
    ),
    "pose that is NaN": (replace_row(4, 2, "nan"), r"poses\.csv, line 4: .*finite"),
    "time that is NaN": (
        replace_row(4, 0, "nan"),
        r"poses\.csv, line 4: time_s is nan; write a",
    ),
    "rotation that is none": (replace_row(5, 4, "3"), r"poses\.csv, line 5: .*quaternion"),
    "pose with a value too many": (
        replace_row(6, 7, "0,0"),
        r"poses\.csv, line 6: 9 values were given; a pose has 8",
    ),
}

CASES = IMAGES | CAMERAS | FILES


def test_an_image_of_real_numbers_is_refused_as_such(tmp_path: Path) -> None:
    path = tmp_path / "real.tiff"
    assert cv2.imwrite(str(path), BLACK + np.float32(0.5))
    with pytest.raises(ImageError, match=r"its values are of type float32, .*8 or 16 bits"):
        read_image(path, (WIDTH, HEIGHT))


@pytest.mark.parametrize("case", CASES)
def test_a_capture_that_cannot_be_used_is_refused(
    case: str, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    spoil, message = CASES[case]
    spoil(drawn_capture)
    check_refused(
        servoid_command, tmp_path, message, "model", drawn_capture, "--out", tmp_path / "body.json"
    )


def test_the_capture_that_is_spoiled_here_can_be_used_as_it_is(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    out = tmp_path / "body.json"
    outcome = servoid_command("model", drawn_capture, "--out", out, "--max-ellipsoids", 1)
    assert outcome.code == 0, outcome.err
    assert out.exists()


def test_an_existing_body_survives_an_error(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    out = tmp_path / "body.json"
    out.write_text("yesterday's body")
    (drawn_capture / "masks" / "0004.png").write_bytes(b"")
    check_refused(servoid_command, tmp_path, "is empty", "model", drawn_capture, "--out", out)


@pytest.mark.parametrize(
    ("arguments", "message", "code"),
    [
        (("--views", "8:"), r"no usable view: views 8: selects none of the 8 views", 1),
        (("--delta", "nan"), r"delta", 2),
        (("--delta", "-1"), r"delta", 2),
        (("--max-ellipsoids", "65"), r"--max-ellipsoids must be 1 to 64, but it is 65", 2),
        (("--distance", "-1"), r"--distance is -1; give a positive number", 2),
        (("--target", "box:1,2,3"), r"needs 4 numbers", 2),
        (("--target", "box:9,2,3,4"), r"left < right", 2),
        (("--viewpoint", "0,0,1"), r"applies to a point cloud", 2),
    ],
)
def test_settings_that_make_no_sense_are_refused(
    arguments: tuple[str, str],
    message: str,
    code: int,
    drawn_capture: Path,
    tmp_path: Path,
    servoid_command: Command,
) -> None:
    check_refused(
        servoid_command, tmp_path, message,
        "model", drawn_capture, "--out", tmp_path / "body.json", *arguments, code=code,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["none", "empty"])
def test_a_capture_that_is_not_there_is_named(
    name: str, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    (drawn_capture / "empty").mkdir()
    check_refused(
        servoid_command, tmp_path, name,
        "model", drawn_capture / name, "--out", tmp_path / "body.json",
    )  # fmt: skip
