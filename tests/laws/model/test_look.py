"""Captures without masks: a target in one view is enough."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from scenes_model import (
    BY_TARGET,
    box_around,
    click_on,
    of_one_color,
    outline_figures,
    picture_target,
    without_masks,
)

from conftest import (
    BACKGROUND,
    SIZE_PX,
    Command,
    Drawing,
    Outcome,
    camera_toml,
    capture_toml,
    write_png,
)
from servoid.capture import open_capture
from servoid.errors import ModelError
from servoid.model import Request, fit_capture
from servoid.shape import load_body


@pytest.fixture
def unmarked(drawn_capture: Path) -> Path:
    return without_masks(drawn_capture)


def model(servoid_command: Command, folder: Path, *options: object) -> tuple[Outcome, Path]:
    out = folder.parent / "body.json"
    ending = ("--out", out, "--max-ellipsoids", 3, "--delta", 0)
    return servoid_command("model", folder, *options, *ending), out


def test_a_box_in_one_view_is_enough_for_all_views(
    unmarked: Path, drawing: Drawing, servoid_command: Command
) -> None:
    target = f"{box_around(drawing, 3)}@eye/0003"
    outcome, out = model(servoid_command, unmarked, "--target", target)
    assert outcome.code == 0, outcome.err
    file = load_body(out)
    assert BY_TARGET["box"].beyond(outline_figures(file, drawing)) == []
    assert file.made_by is not None
    assert file.made_by.targets == (target,)
    assert file.made_by.views == tuple(f"eye/{index:04}" for index in range(8))
    assert "8 used views" in outcome.out


def test_a_hue_window_is_meant_for_all_views(
    unmarked: Path, drawing: Drawing, servoid_command: Command
) -> None:
    outcome, out = model(servoid_command, unmarked, "--target", "hue:215..20")
    assert outcome.code == 0, outcome.err
    assert BY_TARGET["hue"].beyond(outline_figures(load_body(out), drawing)) == []


def test_a_click_finds_what_has_one_colour(tmp_path: Path, servoid_command: Command) -> None:
    drawing = of_one_color()
    folder = without_masks(drawing.write(tmp_path / "photos"))
    outcome, out = model(servoid_command, folder, "--target", click_on(drawing))
    assert outcome.code == 0, outcome.err
    assert BY_TARGET["click"].beyond(outline_figures(load_body(out), drawing)) == []


@pytest.mark.parametrize("kind", ["mask", "background"])
def test_a_picture_from_elsewhere_is_a_target(
    kind: str, unmarked: Path, drawing: Drawing, servoid_command: Command, tmp_path: Path
) -> None:
    target = picture_target(kind, drawing, tmp_path)
    outcome, out = model(servoid_command, unmarked, "--target", target)
    assert outcome.code == 0, outcome.err
    assert BY_TARGET[kind].beyond(outline_figures(load_body(out), drawing)) == []


def test_an_object_in_a_recording_may_move_unless_observations_are_chosen(
    drawn_capture: Path,
) -> None:
    toml = drawn_capture / "capture.toml"
    toml.write_text(toml.read_text().replace("version = 1", "version = 1\nrate_hz = 10"))
    capture = open_capture(drawn_capture)
    assert capture.is_recording
    with pytest.raises(ModelError, match="at least two views"):
        fit_capture(capture, Request(max_ellipsoids=1))
    result = fit_capture(capture, Request(max_ellipsoids=1), observations=slice(0, 4))
    assert [view.index for view in result.used_views] == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("box:10,10,90,90@eye/0099", r"names no view; the views are eye/0000, .*eye/0007"),
        ("box:10,10,90,90@nose/0001", r"names no view; the views are eye/0000"),
        ("hue:100..110", r"'hue:100\.\.110' finds the object in none of 8 views; choose a"),
        ("hue:100..110@eye/0002", r"no pixel has such a hue; hues in the centre .* 0\.\.20"),
        ("box:500,10,600,90", r"the box lies outside the image, which has u from 0 to 159"),
        ("box:0,0,159,119", r"covers the whole image, .*; draw it closer"),
        ("click:-9,4@eye/0001", r"the click lies outside the image, which has u from 0 to 159"),
        (
            "mask:nowhere.png",
            r"nowhere\.png: no such file or directory; give an image that is zero on all but the "
            r"object; the folder has no \.png",
        ),
        ("background:far/away.png", r"; give an image of the scene without the .* no folder far$"),
        ("circle:3,4", r"no known form; write mask:FILE, box:"),
    ],
)
def test_a_target_that_finds_nothing_is_refused_in_one_line_that_helps(
    target: str, message: str, unmarked: Path, servoid_command: Command
) -> None:
    outcome, out = model(servoid_command, unmarked, "--target", target)
    assert outcome.code == (2 if target == "circle:3,4" else 1)
    assert outcome.err.startswith("error: ")
    assert outcome.err.count("\n") == 1
    assert re.search(message, outcome.err), outcome.err
    assert not out.exists()


def test_without_mask_and_target_the_message_shows_a_target(
    unmarked: Path, servoid_command: Command
) -> None:
    outcome, out = model(servoid_command, unmarked)
    assert outcome.code == 1
    assert outcome.err.count("\n") == 1
    assert re.search(r"--target box:[\d,]+@eye/0000", outcome.err), outcome.err
    assert not out.exists()


def test_an_object_with_few_measured_points_that_no_other_view_shows_is_refused_with_what_to_do(
    drawn_capture: Path,
) -> None:
    (drawn_capture / "depth").mkdir()
    depth = np.zeros(SIZE_PX[::-1], np.uint16)
    mask = drawn_capture / "masks" / "0000.png"
    inside = np.argwhere(cv2.imread(str(mask), cv2.IMREAD_GRAYSCALE))
    depth[tuple(inside[len(inside) // 2 :][:20].T)] = 450
    assert cv2.imwrite(str(drawn_capture / "depth" / "0000.png"), depth)
    extra = 'depths = "depth/*.png"\ndepth_scale_m = 0.001\nsize_px'
    toml = capture_toml(camera_toml().replace("size_px", extra, 1))
    (drawn_capture / "capture.toml").write_text(toml)
    for other in sorted(drawn_capture.glob("images/*.png"))[1:]:
        write_png(other, np.full((*SIZE_PX[::-1], 3), BACKGROUND, np.uint8))
        (drawn_capture / "masks" / other.name).unlink()
    with pytest.raises(ModelError) as refused:
        fit_capture(open_capture(drawn_capture))
    words = str(refused.value)
    assert "at least 50 measured points" in words, words
    assert "found in none of the views without a mask" in words, words
    assert "mark it in more views" in words, words


def test_a_target_gives_the_same_bytes_on_one_and_on_two_threads(
    unmarked: Path, drawing: Drawing, servoid_command: Command
) -> None:
    found = []
    for threads in (1, 2):
        target = f"{box_around(drawing, 0)}@eye/0000"
        options = ("--target", target, "--seed", 9, "--threads", threads)
        outcome, out = model(servoid_command, unmarked, *options)
        assert outcome.code == 0, outcome.err
        found.append(out.read_bytes())
    assert found[0] == found[1]
