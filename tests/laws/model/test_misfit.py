"""What speaks against a body, a mask or a calibration is said, and never passed over."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from refusals import check_refused, edit

from conftest import CENTER_PX, FOCAL_PX, SIZE_PX, Command, Drawing, write_png
from servoid._native import View as NativeView
from servoid.camera import Camera, Lens, read_mask, undistortion
from servoid.capture import View, open_capture
from servoid.errors import CameraError, DoubtError, MaskError, MeshError, ModelError
from servoid.model import Request, fit, fit_capture, fit_mesh
from servoid.model.misfit import (
    are_all_around,
    misfit_notes,
    scale_note,
    swapped_note,
    target_misfit_note,
)
from servoid.pose import Pose
from servoid.segment import BoxTarget, find_object, find_with_doubts, finding
from servoid.shape import Body

WIDTH, HEIGHT = SIZE_PX


def summary_of(command: Command, *arguments: object) -> str:
    done = command("model", *arguments)
    assert done.code == 0, done.err
    return " ".join(done.out.split())


def test_a_body_that_explains_its_views_is_told_without_a_word_against_it(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    summary = summary_of(servoid_command, drawn_capture, "--out", tmp_path / "body.json")
    assert "overlap" not in summary and "swapped" not in summary


def test_a_view_that_the_body_does_not_explain_is_named(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    rows, columns = np.nonzero(cv2.imread(str(drawn_capture / "masks" / "0003.png"), 0))
    # Beside the object, but so near that the views still see a common point.
    mask[rows, np.minimum(columns + np.ptp(columns) + 2, WIDTH - 1)] = 255
    write_png(drawn_capture / "masks" / "0003.png", mask)
    summary = summary_of(servoid_command, drawn_capture, "--out", tmp_path / "body.json")
    assert "the body does not fit 1 of 8 used views: in eye/0003 its silhouette overl" in summary


def test_a_body_that_explains_nothing_is_told_so() -> None:
    names = ["eye/0000", "eye/0001"]
    both = misfit_notes("used", names, np.array([0.36, 0.5]))
    assert len(both) == 1
    assert "overlap their masks by 0.43 on average" in both[0]
    three = [*names, "eye/0002"]
    (one,) = misfit_notes("used", three, np.array([0.99, 0.29, 0.95]))
    assert "1 of 3 used views: in eye/0001 its silhouette overlaps the mask by 0.29" in one
    (alone,) = misfit_notes("used", names[:1], np.array([0.1]))[1:]
    assert "does not fit view eye/0000" in alone
    assert misfit_notes("used", names, np.array([0.5, 0.9])) == []
    assert misfit_notes("unused", [], np.empty(0)) == []


def test_a_view_that_is_far_behind_the_others_is_named() -> None:
    names = [f"eye/{index:04}" for index in range(6)]
    good = np.array([0.95, 0.96, 0.94, 0.95, 0.91, 0.95])
    assert misfit_notes("used", names, good) == []
    behind = good.copy()
    behind[2] = 0.7
    (note,) = misfit_notes("used", names, behind)
    assert "1 of 6 used views: in eye/0002 its silhouette overlaps the mask by 0.70" in note
    assert misfit_notes("used", names, behind - 0.1) == []  # all are rough


def test_masks_whose_black_and_white_are_swapped_are_told(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    for path in (drawn_capture / "masks").iterdir():
        write_png(path, np.asarray(255 - cv2.imread(str(path), 0), np.uint8))
    ended = servoid_command("model", drawn_capture, "--out", tmp_path / "body.json")
    words = " ".join((ended.out + ended.err).split())
    assert "8 masks of 8 touch all four borders of the image: are black and white swapped?" in words


def test_an_object_at_some_borders_is_no_swapped_mask() -> None:
    mask = np.zeros((6, 8), np.uint8)
    mask[:, 2] = mask[3, :3] = 255
    swapped = np.asarray(255 - mask, np.uint8)
    assert swapped_note([mask]) is None
    assert swapped_note([swapped, swapped, mask, mask]) is None
    assert "1 mask of 1 touches all four borders" in str(swapped_note([swapped]))
    assert "2 masks of 3 touch all four borders" in str(swapped_note([swapped, mask, swapped]))


def test_an_object_that_is_cut_off_on_all_sides_is_no_inverted_mask() -> None:
    mask = np.zeros((60, 80), np.uint8)
    mask[:, 4:76] = mask[4:56] = 255  # the corners are free
    assert "1 mask of 1 touches all four borders" in str(swapped_note([mask]))
    assert not are_all_around([mask])
    mask[:] = 255
    mask[20:40, 30:50] = 0
    assert are_all_around([mask])


def test_a_mask_that_fills_much_of_the_image_up_to_three_borders_holds_background() -> None:
    mask = np.zeros((40, 60), np.uint8)
    mask[12:] = 255
    assert "1 mask of 1 touches three borders of the image or more, and covers up to 70 %" in str(
        swapped_note([mask])
    )
    assert swapped_note([mask, np.zeros_like(mask)]) is None, "half of them"
    mask[:, :10] = 0
    assert swapped_note([mask]) is None, "an object whose lower part is out of the image"
    mask[:] = 0
    mask[:, 25:35] = mask[20:24, 25:] = 255
    assert swapped_note([mask]) is None, "a pole with an arm"


def test_views_that_all_have_one_pose_are_refused(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    header, first, *rest = (drawn_capture / "poses.csv").read_text().splitlines()
    lines = [header, *(first for _ in (first, *rest))]
    (drawn_capture / "poses.csv").write_text("\n".join(lines) + "\n")
    check_refused(
        servoid_command, tmp_path,
        r"start at one position, so its distance is not determined.*own pose",
        "model", drawn_capture, "--out", tmp_path / "body.json",
    )  # fmt: skip


def test_places_of_no_common_point_are_told_with_few_digits(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    rng = np.random.default_rng(0)
    for path in (drawn_capture / "masks").iterdir():
        mask = np.zeros((HEIGHT, WIDTH), np.uint8)
        mask[rng.integers(HEIGHT), rng.integers(WIDTH)] = 255
        write_png(path, mask)
    number = r"-?\d(\.\d{1,5})?(e-?\d+)?|-?\d+(\.\d+)?"
    check_refused(
        servoid_command, tmp_path, rf"come closest at \(({number}), ({number}), ({number})\) m",
        "model", drawn_capture, "--out", tmp_path / "body.json",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("box", "sides"),
    [
        ((40, 20, 120, 160), "its bottom by 41 px"),
        ((-10, 20, 120, 100), "its left by 10 px"),
        ((40, -9, 190, 140), "its top by 9 px, its right by 31 px and its bottom by 21 px"),
        ((40, 20, 120, HEIGHT + 2), ""),
    ],
)
def test_a_box_that_reaches_beyond_its_image_is_told_with_by_how_much(
    box: tuple[int, int, int, int], sides: str, drawing: Drawing
) -> None:
    image = drawing.picture(drawing.world_from_cameras()[0])
    notes = find_with_doubts(BoxTarget(*map(float, box)), image).notes
    found = [note for note in notes if "extends beyond the image at" in note]
    assert len(found) == bool(sides)
    if sides:
        assert f"beyond the image at {sides}: u is from 0 to 159 and v from 0 to 119" in found[0]


def test_a_doubt_about_a_box_that_reaches_beyond_its_image_begins_with_that(
    drawing: Drawing, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(finding, "STEADY", 1.1)  # every target is doubtful
    image = drawing.picture(drawing.world_from_cameras()[0])
    with pytest.raises(DoubtError, match=r"': the box extends beyond .*; and a box moved by 3 px"):
        find_object(BoxTarget(40.0, 20.0, 120.0, 160.0), image)
    with pytest.raises(DoubtError, match="': a box moved by 3 px"):
        find_object(BoxTarget(40.0, 20.0, 120.0, 110.0), image)


def test_an_object_in_the_alpha_channel_alone_is_told(tmp_path: Path) -> None:
    pixels = np.zeros((20, 30, 4), np.uint8)
    pixels[5:10, 5:10, 3] = 255
    cv2.imwrite(str(tmp_path / "m.png"), pixels)
    with pytest.raises(
        MaskError, match="the object is in its alpha channel; save that channel as a gr"
    ):
        read_mask(tmp_path / "m.png", (30, 20))
    pixels[5:10, 5:10, 0] = 9
    cv2.imwrite(str(tmp_path / "m.png"), pixels)
    assert (read_mask(tmp_path / "m.png", (30, 20)) != 0).sum() == 25


def test_an_empty_mask_beside_a_lens_is_told_in_the_files_pixels(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    edit("capture.toml", '"pinhole"', '"brown_conrady"')(drawn_capture)
    edit("capture.toml", "distortion = []", "distortion = [0.1, 0, 0, 0]")(drawn_capture)
    write_png(drawn_capture / "masks" / "0004.png", np.zeros((HEIGHT, WIDTH), np.uint8))
    check_refused(
        servoid_command, tmp_path, r"0004\.png: the mask is empty: no pixel of its 160x120 is",
        "model", drawn_capture, "--out", tmp_path / "body.json",
    )  # fmt: skip


@pytest.mark.parametrize(
    "odd",
    [
        {"focal_px": (1e300, 1e300)},
        {"distortion": (0.0, 0.0, 1e5, 1e5)},
        {"center_px": (1e9, 1e9)},
    ],
)
def test_a_calibration_that_leaves_no_picture_is_blamed_itself(odd: dict[str, object]) -> None:
    usual = {"focal_px": (FOCAL_PX, FOCAL_PX), "center_px": CENTER_PX, "distortion": (0.1, 0, 0, 0)}
    lens = Lens(model="brown_conrady", size_px=SIZE_PX, **(usual | odd))  # type: ignore[arg-type]
    with pytest.raises(CameraError, match="calibration"):
        undistortion(lens)


def test_a_mesh_that_no_picture_shows_is_called_too_thin() -> None:
    trimesh = pytest.importorskip("trimesh")
    needle = trimesh.creation.box((0.2, 0.0002, 0.0002))
    with pytest.raises(MeshError, match=r"too thin .* it is 0\.2 x 0\.0002 x 0\.0002 m large"):
        fit_mesh(np.asarray(needle.vertices), np.asarray(needle.faces, np.int64))


def test_a_vertex_far_from_all_others_is_named_instead() -> None:
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(4, 0.1)
    corners = np.array(ball.vertices)
    corners[0] = [50.0, 0.0, 0.0]
    with pytest.raises(
        MeshError, match=r"1 of 2562 vertices lies apart .* at \(50, 0, 0\); remove"
    ):
        fit_mesh(corners, np.asarray(ball.faces, np.int64))


def test_a_mesh_that_its_body_does_not_fit_is_poor_and_told_why() -> None:
    trimesh = pytest.importorskip("trimesh")
    ball, hole = trimesh.creation.icosphere(3, 0.1), trimesh.creation.icosphere(3, 0.095)
    hole.invert()
    few = Request(max_ellipsoids=2)
    shell = trimesh.util.concatenate([ball, hole])
    made = fit_mesh(np.asarray(shell.vertices), np.asarray(shell.faces, np.int64), few)
    assert made.verdict.word == "poor"
    (doubt,) = made.all_doubts
    assert "the body does not fit the mesh: F is 0." in doubt and "a hollow, thin walls" in doubt
    fine = fit_mesh(np.asarray(ball.vertices), np.asarray(ball.faces, np.int64), few)
    assert fine.verdict.word == "good" and fine.all_notes == ()


def test_poses_in_millimetres_are_noticed(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    poses = drawn_capture / "poses.csv"
    header, *rows = poses.read_text().split()
    assert header.startswith("time_s,x,y,z,")
    numbers = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    out = ("--out", tmp_path / "body.json")
    for factor, noticed in ((10.0, False), (1000.0, True)):
        larger = numbers * [1.0, *[factor] * 3, *[1.0] * 4]
        lines = [",".join(map(repr, map(float, row))) for row in larger]
        poses.write_text("\n".join([header, *lines, ""]))
        assert ("in millimetres" in summary_of(servoid_command, drawn_capture, *out)) == noticed


def test_poses_in_millimetres_are_noticed_in_python(drawn_capture: Path) -> None:
    views = []
    for one in (view.view() for view in open_capture(drawn_capture).views()):
        pose = one.world_from_camera
        place = [1000.0 * length for length in pose.translation]
        far = Pose.from_parts(place, pose.quaternion)
        views.append(View(camera=one.camera, world_from_camera=far, mask=one.mask))
    notes = " ".join(fit(views, max_ellipsoids=2).notes)
    assert "in millimetres or centimetres, or the cameras' distance from each other?" in notes


@pytest.mark.parametrize(("share", "noticed"), [(1.0, False), (2.0, True)])
def test_a_matrix_of_images_of_another_size_is_noticed_in_python(
    drawn_capture: Path, share: float, noticed: bool
) -> None:
    views = []
    for one in (view.view() for view in open_capture(drawn_capture).views()):
        size_px = (int(share * SIZE_PX[0]), int(share * SIZE_PX[1]))
        camera = Camera.from_matrix(one.camera.matrix(), size_px)
        mask = cv2.resize(one.mask, size_px, interpolation=cv2.INTER_NEAREST)
        views.append(View(camera=camera, world_from_camera=one.world_from_camera, mask=mask))
    notes = fit(views, max_ellipsoids=2).notes
    assert any("is far from the middle of its image" in note for note in notes) == noticed


@pytest.mark.parametrize(
    ("scale", "why"),
    [(1000.0, "in millimetres"), (100.0, "or centimetres"), (1.0, None), (0.001, "too small by")],
)
def test_lengths_in_another_unit_are_a_doubt(scale: float, why: str | None) -> None:
    ball = Body(
        world_from_object=Pose.from_parts((0.0, 0.0, 0.6 * scale), (1.0, 0.0, 0.0, 0.0)),
        centers=np.zeros((1, 3)), radii=np.full((1, 3), 0.04 * scale),
        rotations=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )  # fmt: skip
    camera = Camera(size_px=SIZE_PX, focal_px=(FOCAL_PX, FOCAL_PX), center_px=CENTER_PX)
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[40:60, 40:60] = 255
    seen = [NativeView(camera=camera, world_from_camera=Pose.identity(), mask=mask)]
    told = scale_note(ball, seen)
    assert (told is None) if why is None else (told is not None and why in told)


def test_photographs_with_a_rate_are_told_that_one_instant_of_a_recording_is_used(
    drawn_capture: Path,
) -> None:
    edit("capture.toml", "version = 1", "version = 1\nrate_hz = 30")(drawn_capture)
    capture = open_capture(drawn_capture)
    with pytest.raises(ModelError, match=r"a recording \(it has a rate, rate_hz\)") as refused:
        fit_capture(capture)
    told = str(refused.value)
    assert "only eye/0000 was used, one of 8 instants" in told
    assert "with --observations 0:8, or remove rate_hz from capture.toml" in told
    made = fit_capture(capture, Request(max_ellipsoids=1), observations=slice(0, 8))
    assert len(made.used_views) == 8


def test_a_target_that_marks_less_than_the_other_views_show_is_told() -> None:
    names = [f"eye/{index}" for index in range(7)]
    # A box that cuts off a sixth of a skull, one around all of it, and views that all are rough.
    cut = np.array([0.81, 0.97, 0.96, 0.93, 0.95, 0.88, 0.95])
    note = target_misfit_note(names, cut, {"eye/0"})
    assert note is not None and "what the target marks in eye/0 is not all" in note
    assert "by 0.81 (intersection over union), and those of the others by 0.95" in note
    assert target_misfit_note(names, np.array([0.88, *cut[1:]]), {"eye/0"}) is None
    assert target_misfit_note(names, np.array([0.75, *(cut[1:] - 0.2)]), {"eye/0"}) is None
    assert target_misfit_note(names, cut, set(names)) is None
    assert target_misfit_note(names[:5], cut[:5], {"eye/0"}) is None
    assert target_misfit_note(names, cut, {"eye/0", "eye/1"}) == note
