"""Files that are none, never end, are too large or too deep: refused before they are read."""

import os
import resource
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from refusals import check_refused

from conftest import Command, capture_toml
from servoid._native import Body, Camera, ModelSettings
from servoid.config.limits import (
    BODY_FILE,
    FILE_LIMITS,
    IMAGE_FILE,
    MOST_CAMERAS,
    MOST_KEYS,
    MOST_NESTED,
    MOST_TRANSFORMS,
    MOST_VIEW_PX,
    SCENE_FILE,
    SETTINGS_FILE,
    FileLimit,
)
from servoid.config.reading import read_bytes, read_json, read_text, read_toml_text
from servoid.errors import BodyError, CaptureError, ServoidError
from servoid.shape import load_body

Spoil = Callable[[Path], object]

READ_OF_A_CAPTURE = ("capture.toml", "poses.csv", "images/0003.png", "masks/0003.png")
DOCS = Path(__file__).parents[3] / "docs" / "errors.md"


@pytest.mark.parametrize("name", READ_OF_A_CAPTURE)
def test_a_named_pipe_in_a_capture_is_refused_and_not_waited_for(
    name: str, drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    (drawn_capture / name).unlink()
    os.mkfifo(drawn_capture / name)
    is_capture = name == "capture.toml"
    message = "there is no capture" if is_capture else f"{name}: it is a named pipe, not a file"
    check_refused(
        servoid_command, tmp_path / "none", message,
        "model", drawn_capture, "--out", tmp_path / "body.json",
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["image", "body", "mesh"])
def test_a_device_is_refused_before_it_is_read(kind: str) -> None:
    limit = FileLimit(kind, 1 << 40)
    with pytest.raises(CaptureError, match="/dev/zero: it is a device, not a file"):
        read_bytes(Path("/dev/zero"), CaptureError, limit)


def test_a_video_that_is_a_named_pipe_is_refused(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    os.mkfifo(drawn_capture / "film.mp4")
    toml = drawn_capture / "capture.toml"
    toml.write_text(toml.read_text().replace("images/*.png", "film.mp4"))
    out = tmp_path / "body.json"
    ended = servoid_command("model", drawn_capture, "--out", out)
    assert (ended.code, out.exists()) == (1, False)
    assert "film.mp4: it is a named pipe, not a file" in ended.err


@pytest.mark.parametrize("limit", FILE_LIMITS, ids=lambda limit: limit.what)
def test_a_file_beyond_its_limit_is_refused_before_it_is_read(
    limit: FileLimit, tmp_path: Path
) -> None:
    large = tmp_path / "large"
    with large.open("wb") as file:
        file.truncate(limit.most_bytes + 1)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(CaptureError, match=f"more than {limit.text}, the most for {limit.what}"):
        read_bytes(large, CaptureError, limit)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 14  # 16 MiB


DEEP = {
    "lists in TOML": (read_toml_text, "x = " + 200_000 * "[", CaptureError),
    "tables in TOML": (read_toml_text, "x = " + 5_000 * "{a=", CaptureError),
    "a key of many parts": (read_toml_text, ".".join(50_000 * "a") + " = 1", CaptureError),
    "a table's name of many parts": (
        read_toml_text, "[" + " . ".join(50_000 * ['"a"']) + "]", CaptureError,
    ),
    "as deep as can be parsed": (
        read_toml_text, "x = " + 100 * "[" + 100 * "]", CaptureError,
    ),
    "lists in JSON": (
        lambda path, error: read_json(path, error, BODY_FILE), 200_000 * "[", BodyError,
    ),
    "tables in JSON": (
        lambda path, error: read_json(path, error, BODY_FILE), 100_000 * '{"a":', BodyError,
    ),
    "just too deep": (
        lambda path, error: read_json(path, error, BODY_FILE),
        (MOST_NESTED + 1) * "[" + (MOST_NESTED + 1) * "]",
        BodyError,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", DEEP)
def test_what_is_nested_too_deeply_is_refused_at_once(case: str, tmp_path: Path) -> None:
    read, text, error = DEEP[case]
    path = tmp_path / "deep"
    path.write_text(text)
    start = time.process_time()
    with pytest.raises(error, match=rf"nested too deeply|more than {MOST_NESTED} parts"):
        read(path, error)
    assert time.process_time() - start < 2.0


def test_what_lies_as_deep_as_is_allowed_is_read(tmp_path: Path) -> None:
    path = tmp_path / "deep"
    path.write_text(MOST_NESTED * "[" + MOST_NESTED * "]")
    assert read_json(path, BodyError, BODY_FILE)
    path.write_text(".".join(MOST_NESTED * "a") + " = 'a.b'\n")
    assert read_toml_text(path, CaptureError)[0]


def test_toml_that_an_editor_begins_with_a_byte_order_mark_is_read(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    path.write_bytes(b"\xef\xbb\xbfa = 1\n")
    assert read_toml_text(path, CaptureError) == ({"a": 1}, "a = 1\n")


def test_a_body_of_very_many_ellipsoids_is_refused_by_their_count(tmp_path: Path) -> None:
    path = tmp_path / "body.json"
    one = '{"center": [0, 0, 0], "radii": [1, 1, 1], "rotation": [1, 0, 0, 0]}'
    whole = (
        '{"version": 1, "units": "m", "world_from_object": [0, 0, 0, 1, 0, 0, 0], '
        f'"ellipsoids": [{", ".join(50_000 * [one])}]}}'
    )
    path.write_text(whole)
    start = time.process_time()
    with pytest.raises(BodyError, match="50000 ellipsoids were given; a body has 1 to 64"):
        load_body(path)
    assert time.process_time() - start < 2.0


def test_a_capture_of_very_many_cameras_is_refused_by_their_count(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    toml = drawn_capture / "capture.toml"
    one = toml.read_text().partition("[[camera]]")[2].partition("[rig]")[0]
    toml.write_text(capture_toml(3000 * f"[[camera]]{one}"))
    start = time.process_time()
    check_refused(
        servoid_command, tmp_path, "names 3000 cameras; at most 64 are allowed",
        "model", drawn_capture, "--out", tmp_path / "body.json",
    )  # fmt: skip
    assert time.process_time() - start < 3.0


def link_folder(capture: Path, elsewhere: Path) -> None:
    (capture / "masks").rename(elsewhere / "masks")
    (capture / "masks").symlink_to(elsewhere / "masks")


def link_file(capture: Path, elsewhere: Path) -> None:
    (capture / "masks" / "0003.png").rename(elsewhere / "secret.png")
    (capture / "masks" / "0003.png").symlink_to(elsewhere / "secret.png")


def link_poses(capture: Path, elsewhere: Path) -> None:
    (capture / "poses.csv").rename(elsewhere / "poses.csv")
    (capture / "poses.csv").symlink_to(os.path.relpath(elsewhere / "poses.csv", capture))


@pytest.mark.parametrize("link", [link_folder, link_file, link_poses])
def test_a_link_out_of_a_capture_is_refused(
    link: Callable[[Path, Path], None],
    drawn_capture: Path,
    tmp_path: Path,
    servoid_command: Command,
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    link(drawn_capture, elsewhere)
    check_refused(
        servoid_command, tmp_path, r"a link leads from .* to .*elsewhere.*, out of the capture's",
        "model", drawn_capture, "--out", tmp_path / "body.json",
    )  # fmt: skip


def test_links_within_a_capture_and_to_a_capture_are_followed(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    (drawn_capture / "images" / "0003.png").rename(drawn_capture / "three.png")
    (drawn_capture / "images" / "0003.png").symlink_to("../three.png")
    (tmp_path / "link").symlink_to(drawn_capture)
    out = tmp_path / "body.json"
    done = servoid_command("model", tmp_path / "link", "--out", out, "--max-ellipsoids", 1)
    assert done.code == 0, done.err


def test_links_in_a_circle_are_told(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    (drawn_capture / "images" / "0003.png").unlink()
    (drawn_capture / "images" / "0003.png").symlink_to("0003.png")
    ended = servoid_command("model", drawn_capture, "--out", tmp_path / "body.json")
    assert ended.code == 1
    assert "cannot read" in ended.err


def test_the_page_of_errors_lists_every_limit() -> None:
    table = dict(
        (cell.strip() for cell in line.strip("|").split("|"))
        for line in DOCS.read_text(encoding="utf-8").splitlines()
        if line.startswith("|") and line.count("|") == 3
    )
    for limit in FILE_LIMITS:
        assert table[limit.what] == limit.text
    counts = {
        "tables and lists of TOML, JSON and YAML inside each other, and parts of a key": (
            MOST_NESTED
        ),
        "cameras of a capture.toml, and of a bag": MOST_CAMERAS,
        "transforms of a bag": MOST_TRANSFORMS,
        "images that a scan chooses of a video": MOST_KEYS,
        "pixels along a side of an image": Camera.MAX_SIDE_PX,
        "pixels of all views together that are modelled from; more are shrunk as they are read": (
            MOST_VIEW_PX
        ),
        "ellipsoids of a body": Body.MAX_ELLIPSOIDS,
        "threads, and processes of a batch": ModelSettings.MAX_THREADS,
    }
    for what, most in counts.items():
        assert table[what] == str(most)
    assert issubclass(CaptureError, ServoidError)
    assert SETTINGS_FILE in FILE_LIMITS and IMAGE_FILE in FILE_LIMITS


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b'{"version": 1,\n "body": ', "it ends in the middle, at line 2, as if it were cut off"),
        (b'{"version": 1,\n "body": "a b', "it ends in the middle, at line 2"),
        (b'{"version": 1,\n "body": tr', "it ends in the middle, at line 2"),
        (b'{"version": 1,\n "body" 2}', r"Expecting ':' delimiter \(at line 2, column 9\)"),
        (b"a,b\n1,2\n", "line 1 begins with 'a,b', not with a brace"),
        (b"\n \nhello " + 99 * b"l", r"line 3 begins with 'hello l+\.\.\.', not with a brace"),
        (b" \n", "the file is empty"),
        (b"\x1c", "the file is empty"),
        ("\u00a0\n".encode(), "the file is empty"),
        (b"\xef\xbb\xbf{}", "it begins with a byte order mark; save it as UTF-8 without one"),
        (b'{"version": "\xff"}', "the file is not UTF-8 text"),
        (
            b'{"version":\n [1, NaN]}',
            "NaN at line 2, column 6 is no number of JSON; write a finite number",
        ),
        (b'{"version": -Infinity}', "Infinity at line 1, column 14 is no number of JSON; write"),
        (b'{"version": ' + 5000 * b"9" + b" x}", "."),
    ],
)
def test_a_fault_in_json_is_told_with_its_place(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "body.json"
    path.write_bytes(content)
    with pytest.raises(BodyError, match=rf"body\.json is not valid JSON: ({said})"):
        read_json(path, BodyError, BODY_FILE)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "is no text; give the right one"),
        ('{"version": 1}'.encode("utf-16"), "the file is not UTF-8 text; save it as UTF-8"),
    ],
)
def test_a_file_that_is_no_text_is_not_to_be_saved_as_utf_8(
    tmp_path: Path, content: bytes, said: str
) -> None:
    path = tmp_path / "body.json"
    path.write_bytes(content)
    with pytest.raises(BodyError, match=said):
        read_text(path, BodyError, BODY_FILE)


@pytest.mark.parametrize(
    "content", [b"", b"a,b\n", b'{"version": 1', b'{"version" 1}', b'{"a": NaN}']
)
def test_what_is_no_json_is_told_with_the_file_that_is_wanted(
    tmp_path: Path, content: bytes
) -> None:
    path = tmp_path / "body.json"
    path.write_bytes(content)
    with pytest.raises(BodyError) as told:
        read_json(path, BodyError, BODY_FILE)
    assert str(told.value).endswith("; give a body, such as servoid model --out writes")
    with pytest.raises(CaptureError) as of_scene:
        read_json(path, CaptureError, SCENE_FILE)
    assert str(of_scene.value).endswith("; give the file as its program writes it")


def test_a_body_that_is_not_there_is_told_with_what_makes_one_and_which_are_there(
    tmp_path: Path,
) -> None:
    lost = tmp_path / "mugg.json"
    wanted = "no such file or directory; give a body, such as servoid model --out writes"
    with pytest.raises(BodyError, match=rf"{wanted}; the folder has no \.json file$"):
        load_body(lost)
    for name in ("bottle.json", "drill.json", "mug.json", "mug.png", "plain_mug.json", "x.json"):
        (tmp_path / name).touch()
    with pytest.raises(BodyError, match=rf"{wanted}; the folder has mug\.json, .* and 2 more$"):
        load_body(lost)
    with pytest.raises(BodyError, match=rf"{wanted}; there is no folder .*away$"):
        load_body(tmp_path / "away" / "mug.json")
