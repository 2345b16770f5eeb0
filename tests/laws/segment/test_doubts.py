"""Targets that one can trust: in the image's own pixels, and refused where they are doubtful."""

import pickle
import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scenes_found import box_around, drawn, iou
from scenes_model import box_around as box_of_drawing
from scenes_model import without_masks
from tiers import tiered

from conftest import REAL_PHOTOS, Command, Drawing, write_png
from servoid.camera import Lens
from servoid.capture import Capture, open_capture
from servoid.cli import doubting
from servoid.errors import DoubtError, MaskError, TargetError, located
from servoid.model import Request, find_in_view, fit_capture
from servoid.model.marking import mark
from servoid.record import draw_answers
from servoid.segment import (
    BoxTarget,
    ClickTarget,
    Depth,
    MaskTarget,
    Target,
    find_object,
    find_with_doubts,
    finding,
)
from servoid.segment.boxes import pixels_in
from servoid.segment.doubts import cut_sides

Mask = NDArray[np.uint8]
SIZE_PX = (320, 240)
FOCAL_PX = 240.0
CENTER_PX = (285.0, 210.0)  # far from the object, so that the lens moves it by many pixels
LENSES = {
    "pinhole": (),
    "brown_conrady": (-0.28, 0.09, 1.2e-3, -0.8e-3),
    "kannala_brandt": (0.06, 0.01, -0.002, 0.0003),
}
MOVES = [(0, 0, 0, 0), (-3, -3, 3, 3), (3, 3, 3, 3), (3, -3, 3, -3), (-3, 0, 0, 3), (3, 3, -3, -3)]


def recorded(folder: Path, model: str) -> Capture:
    """Write a capture of one image, taken through a lens that bends it."""
    (folder / "images").mkdir(parents=True)
    write_png(folder / "images" / "0000.png", drawn()[0])
    (folder / "capture.toml").write_text(f"""version = 1
[[camera]]
name = "eye"
images = "images/*.png"
size_px = {list(SIZE_PX)}
model = "{model}"
focal_px = [{FOCAL_PX}, {FOCAL_PX}]
center_px = {list(CENTER_PX)}
distortion = {list(LENSES[model])}
rig_from_camera = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
""")
    return open_capture(folder)


def target_of(kind: str, mask: Mask, folder: Path) -> Target:
    """Say with a target of a kind where a mask is, in the pixels of its image."""
    if kind == "mask":
        write_png(folder / "drawn.png", mask)
        return MaskTarget(folder / "drawn.png")
    return box_around(mask) if kind == "box" else ClickTarget(160, 120)


def patchwork(seed: int = 0) -> NDArray[np.uint8]:
    """Draw patches of a few colours: no object is told from the rest."""
    colors = np.array([(200, 60, 40), (40, 90, 180), (220, 200, 60), (60, 140, 70)], np.uint8)
    patches = np.random.default_rng(seed).integers(0, len(colors), (20, 27))
    return colors[np.kron(patches, np.ones((12, 12), int))[:240, :320]]


def seen_through(lens: Lens, camera_px: NDArray[np.float64], image: Mask) -> Mask:
    """Read an image where a lens, that looks along z, sees what a pinhole has at its pixels."""
    rays = np.column_stack([camera_px, np.ones(len(camera_px))])
    u, v = np.rint(lens.project(rays)).T.astype(int)
    inside = (u >= 0) & (u < image.shape[1]) & (v >= 0) & (v < image.shape[0])
    return np.where(inside, image[v.clip(0, 239), u.clip(0, 319)], 0).astype(np.uint8)


@pytest.mark.parametrize("model", LENSES)
@pytest.mark.parametrize("kind", ["mask", "box", "click"])
def test_a_target_is_in_the_pixels_of_the_image_as_it_was_recorded(
    kind: str, model: str, tmp_path: Path
) -> None:
    truth = drawn()[1]
    view = mark(recorded(tmp_path / model, model), [target_of(kind, truth, tmp_path)]).views[0]
    width, height = view.camera.size_px
    u, v = (axis.ravel() for axis in np.meshgrid(np.arange(width), np.arange(height)))
    plane = (np.stack([u, v], axis=1) - view.camera.center_px) / view.camera.focal_px
    turned = view.ideal.lens_from_camera.transform(np.column_stack([plane, np.ones(len(plane))]))
    expected = seen_through(view.lens, turned[:, :2] / turned[:, 2:], truth)
    assert iou(view.mask(), expected.reshape(height, width)) > 0.97
    if model != "pinhole":  # or this would prove nothing
        assert view.camera.size_px != SIZE_PX or iou(view.mask(), truth) < 0.9


@pytest.mark.parametrize("kind", ["box", "click"])
def test_any_lens_leads_to_the_same_object_in_the_recorded_pixels(
    kind: str, tmp_path: Path
) -> None:
    target = target_of(kind, drawn()[1], tmp_path)
    found = [
        mark(recorded(tmp_path / model, model), [target]).views[0].recorded_mask for model in LENSES
    ]
    assert all(mask is not None and np.array_equal(mask, found[0]) for mask in found)


def test_errors_speak_of_the_size_of_the_recorded_image(tmp_path: Path) -> None:
    capture = recorded(tmp_path / "lens", "brown_conrady")
    ideal_px = capture.all_views()[0].camera.size_px
    assert ideal_px != SIZE_PX
    with pytest.raises(TargetError, match="u from 0 to 319 and v from 0 to 239"):
        mark(capture, [ClickTarget(330, 100)])
    write_png(tmp_path / "ideal.png", np.ones(ideal_px[::-1], np.uint8))
    with pytest.raises(MaskError, match=r"size_px = \[320, 240\]"):
        mark(capture, [MaskTarget(tmp_path / "ideal.png")])


@pytest.mark.parametrize("seed", tiered(range(3)))
def test_a_box_that_is_moved_by_three_pixels_finds_the_same_object(seed: int) -> None:
    image, mask, _ = drawn(seed)
    box = box_around(mask)
    corners = np.array([box.u0, box.v0, box.u1, box.v1])
    found = [find_object(BoxTarget(*(corners + move)), image) for move in MOVES]
    assert min(iou(one, other) for one in found for other in found) > 0.97
    assert min(iou(one, mask) for one in found) > 0.97


def test_a_box_around_what_is_like_its_surroundings_is_refused_with_its_answers() -> None:
    image, box = patchwork(), BoxTarget(100, 60, 220, 170)
    with pytest.raises(DoubtError, match=r"box:100,60,220,170.*(moved by 3 px|fit it)") as refused:
        find_object(box, image)
    assert np.array_equal(refused.value.image, image)
    masks = refused.value.masks
    assert np.array_equal(masks[0], find_object(box, image, trusted=True))
    assert all(mask.shape == image.shape[:2] and mask.any() for mask in masks)
    assert "on all four sides; if this one does, " in str(refused.value)


def test_a_click_between_two_patches_is_refused_as_its_neighbours_find_something_else() -> None:
    with pytest.raises(DoubtError, match="a click moved by 3 px") as refused:
        find_object(ClickTarget(160, 119), patchwork())
    assert len(refused.value.masks) > 1


def test_a_mask_that_is_only_a_line_is_refused(tmp_path: Path) -> None:
    image, mask, _ = drawn()
    disc = np.ones((5, 5), np.uint8)
    rim = mask - np.asarray(cv2.erode(mask, disc))
    write_png(tmp_path / "rim.png", rim)
    with pytest.raises(DoubtError, match=r"line, not an area.*covers the object"):
        find_object(MaskTarget(tmp_path / "rim.png"), image)
    assert np.array_equal(find_object(MaskTarget(tmp_path / "rim.png"), image, trusted=True), rim)


def test_a_mask_of_two_surfaces_is_refused_and_one_that_slants_is_not(tmp_path: Path) -> None:
    image, mask, _ = drawn()
    write_png(tmp_path / "mask.png", mask)
    target = MaskTarget(tmp_path / "mask.png")
    slanted = np.tile(np.linspace(0.5, 0.8, 320, dtype=np.float32), (240, 1))
    assert find_object(target, image, Depth(slanted, 300.0)).any()
    assert find_object(target, image, Depth(slanted * np.nan, 300.0)).any()
    behind = slanted.copy()
    behind[:, 180:] += 0.4
    with pytest.raises(DoubtError, match=r"two surfaces: .* m behind") as refused:
        find_object(target, image, Depth(behind, 300.0))
    _, near, far = refused.value.masks
    assert not near[:, 180:].any()
    assert not far[:, :180].any()
    assert np.array_equal(near | far, mask)


def test_depth_of_another_size_is_refused() -> None:
    image, mask, _ = drawn()
    with pytest.raises(TargetError, match="in the pixels of the image"):
        find_object(box_around(mask), image, Depth(np.ones((24, 32), np.float32), 300.0))


def test_an_object_that_stays_far_from_a_side_of_its_box_is_told() -> None:
    image, mask, _ = drawn()
    box = box_around(mask)
    assert find_with_doubts(box, image).notes == ()
    wide = find_with_doubts(BoxTarget(box.u0 - 60, box.v0, box.u1, box.v1 + 40), image)
    assert wide.doubt is None
    assert "does not reach the left and bottom of its box" in wide.notes[0]


@pytest.mark.parametrize("side", ["left", "top", "right", "bottom"])
def test_an_object_that_its_box_cuts_off_is_told(side: str) -> None:
    image, mask, _ = drawn()
    box = box_around(mask)
    width, height = box.u1 - box.u0, box.v1 - box.v0
    cut = {
        "left": replace(box, u0=box.u0 + 0.2 * width),
        "top": replace(box, v0=box.v0 + 0.2 * height),
        "right": replace(box, u1=box.u1 - 0.2 * width),
        "bottom": replace(box, v1=box.v1 - 0.2 * height),
    }
    box = cut[side]
    inside = pixels_in((box.u0 - 3.0, box.v0 - 3.0, box.u1 + 3.0, box.v1 + 3.0), mask.shape)
    assert cut_sides(np.minimum(mask, inside), (box.u0, box.v0, box.u1, box.v1)) == [side]
    if side == "left":
        told = find_with_doubts(box, image).notes
        assert any("reaches beyond the left of its box, and may have" in one for one in told)


def test_a_box_around_the_object_cuts_off_none_of_it_nor_does_the_border_of_the_image() -> None:
    _, mask, _ = drawn()
    rows, columns = np.nonzero(mask)
    for more in (0, 2, 5):
        box = (columns.min() - more, rows.min() - more, columns.max() + more, rows.max() + more)
        assert cut_sides(mask, tuple(map(float, box))) == []  # type: ignore[arg-type]
    left = int(columns.mean())
    at_border = mask[:, left:]
    beside = (0.0, float(rows.min()), float(columns.max() - left), float(rows.max()))
    assert cut_sides(at_border, beside) == []
    inside = np.pad(at_border, ((0, 0), (9, 0)))
    assert cut_sides(inside, (12.0, beside[1], beside[2] + 9.0, beside[3])) == ["left"]


@pytest.mark.extended
@pytest.mark.parametrize("name", ["stereo/mustard", "stereo/mustard_hand", "hard/mug_sway"])
def test_boxes_around_recorded_objects_cut_off_none_and_boxes_of_a_part_are_told(
    name: str,
) -> None:
    if not (REAL_PHOTOS.parent / name).is_dir():
        pytest.skip(f"{name} is not beside the repository")
    capture = open_capture(REAL_PHOTOS.parent / name)
    view = capture.views()[0]
    rows, columns = np.nonzero(view.mask())

    def told(*box: float) -> bool:
        found = find_in_view(BoxTarget(*box), view, view.recorded_image(), capture.all_views())
        return any("been cut off" in note for note in found.notes)

    for more in range(5):
        assert not told(
            columns.min() - more, rows.min() - more, columns.max() + more, rows.max() + more
        )
    most = 0.9 * rows.max() + 0.1 * rows.min()
    assert told(columns.min() - 4.0, rows.min() - 4.0, columns.max() + 4.0, most)


def test_a_doubt_keeps_its_answers_through_places_and_processes() -> None:
    image, mask, _ = drawn()
    with pytest.raises(DoubtError, match="here: twice") as raised, located("here"):
        raise DoubtError("twice", image, [mask, 255 - mask])
    copy = pickle.loads(pickle.dumps(raised.value))
    assert str(copy) == str(raised.value)
    for error in (raised.value, copy):
        assert [one.tobytes() for one in error.masks] == [mask.tobytes(), (255 - mask).tobytes()]
        assert np.array_equal(error.image, image)


def test_the_picture_shows_every_answer() -> None:
    image, mask, _ = drawn()
    sizes = []
    for count in (1, 2, 4):
        data = draw_answers(image, [mask] * count)
        sheet = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        assert sheet is not None
        sizes.append(sheet.shape[1])
    tile = sizes[1] - sizes[0]
    assert sizes[2] == sizes[1] + 2 * tile


@pytest.fixture
def doubtful(drawn_capture: Path, drawing: Drawing, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Make every box doubtful, and return how to model with one."""
    monkeypatch.setattr(finding, "STEADY", 1.01)
    folder = without_masks(drawn_capture)
    out = drawn_capture.parent / "body.json"
    fast = ["--max-ellipsoids", "2", "--delta", "0"]
    return ["model", str(folder), "--out", str(out), "--target", box_of_drawing(drawing, 0), *fast]


def test_a_doubtful_target_ends_the_command_with_a_picture_and_no_body(
    doubtful: list[str], servoid_command: Command, tmp_path: Path
) -> None:
    outcome = servoid_command(*doubtful)
    assert outcome.code == 1
    assert re.search(r"moved by 3 px.*body_target\.png shows.*--trust-targets", outcome.err)
    assert sorted(path.name for path in tmp_path.glob("body*")) == ["body_target.png"]
    assert cv2.imread(str(tmp_path / "body_target.png")) is not None


def test_a_doubtful_target_is_used_if_it_is_trusted_and_the_summary_says_so(
    doubtful: list[str], servoid_command: Command, tmp_path: Path
) -> None:
    outcome = servoid_command(*doubtful, "--trust-targets")
    assert outcome.code == 0, outcome.err
    assert "was trusted, although" in " ".join(outcome.out.split())
    assert [path.name for path in tmp_path.glob("body*")] == ["body.json"]


@pytest.mark.parametrize("answer", [True, False])
def test_a_person_is_asked_whether_to_go_on(
    answer: bool,
    doubtful: list[str],
    servoid_command: Command,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(doubting, "_can_ask", lambda: True)
    monkeypatch.setattr("typer.confirm", lambda *_words, **_how: answer)
    outcome = servoid_command(*doubtful)
    assert outcome.code == (0 if answer else 1)
    assert (tmp_path / "body.json").exists() == answer
    assert "body_target.png" in outcome.err


def test_a_track_is_refused_with_a_picture_beside_its_poses(
    drawn_capture: Path, drawing: Drawing, servoid_command: Command, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(finding, "STEADY", 1.01)
    toml = drawn_capture / "capture.toml"
    toml.write_text(toml.read_text().replace("version = 1", "version = 1\nrate_hz = 10"))
    folder = without_masks(drawn_capture)
    order = ("track", folder, "--target", box_of_drawing(drawing, 0), "--distance", 0.45)
    outcome = servoid_command(*order, "--out", tmp_path / "poses.csv", "--observations", ":2")
    assert outcome.code == 1
    assert "poses_target.png" in outcome.err
    assert sorted(path.name for path in tmp_path.glob("poses*")) == ["poses_target.png"]
    body = tmp_path / "body.json"
    order = (*order, "--out", tmp_path / "poses.csv", "--observations", ":2", "--trust-targets")
    for more in (("--save-body", body), ("--body", body)):
        trusted = servoid_command(*order, *more)
        assert trusted.code == 0, trusted.err
        words = " ".join(trusted.out.split())
        assert "was trusted, although" in words and "found at first is in doubt" in words


def test_a_box_in_a_doubtful_capture_can_be_trusted_in_python(
    drawn_capture: Path, drawing: Drawing, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(finding, "STEADY", 1.01)
    capture = open_capture(without_masks(drawn_capture))
    box = BoxTarget(*map(float, box_of_drawing(drawing, 0).removeprefix("box:").split(",")))
    with pytest.raises(DoubtError):
        fit_capture(capture, targets=[box])
    asked = Request(max_ellipsoids=1, delta=0.0, trust_targets=True)
    assert "was trusted" in fit_capture(capture, asked, targets=[box]).all_notes[0]


@pytest.mark.extended
@pytest.mark.parametrize("share", [0.0, 0.05, 0.15])
def test_boxes_around_a_real_cube_that_differ_by_three_pixels_agree_or_are_refused(
    share: float,
) -> None:
    folder = REAL_PHOTOS.parent / "real" / "cube_hand"
    if not folder.is_dir():
        pytest.skip("the recording of the cube lies beside the repository, and not here")
    view = open_capture(folder).views()[0]
    image = view.image()
    box = box_around(view.mask(), share)
    corners = np.array([box.u0, box.v0, box.u1, box.v1])
    found = [find_with_doubts(BoxTarget(*(corners + move)), image) for move in MOVES]
    sure = [one.mask for one in found if one.doubt is None]
    assert min((iou(one, other) for one in sure for other in sure), default=1.0) >= 0.9
