"""Python without files: arrays in, bodies and poses out."""

from pathlib import Path

import numpy as np
import pytest

from servoid.camera import Camera, Lens
from servoid.capture import CaptureView, PosedImage, View, capture_of, open_capture, views_of
from servoid.errors import (
    BodyError,
    CameraError,
    CaptureError,
    ImageError,
    MaskError,
    MeshError,
    ModelError,
    ServoError,
    ServoidError,
    TrackError,
)
from servoid.model import Request, fit, fit_capture, fit_mesh, range_samples_of_cloud
from servoid.pose import Pose
from servoid.servo import Joints, JointState
from servoid.shape import Body
from servoid.sim import write_sample
from servoid.track import Subject, Tracker, track_capture
from servoid.view import write_report


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> list[CaptureView]:
    folder = tmp_path_factory.mktemp("arrays") / "sample"
    return open_capture(write_sample(folder, views=6, size_px=(160, 120))).views()


def native(views: list[CaptureView]) -> list[View]:
    return [
        View(camera=one.camera, world_from_camera=one.world_from_camera, mask=one.mask())
        for one in views
    ]


def posed(view: CaptureView, **parts: object) -> PosedImage:
    given = {"image": view.image(), "mask": view.mask()} | parts
    return PosedImage(camera=view.camera, world_from_camera=view.world_from_camera, **given)  # type: ignore[arg-type]


def test_views_of_arrays_and_views_of_files_make_the_same_body(seen: list[CaptureView]) -> None:
    images = [one.image() for one in seen]
    of_files = fit(seen, max_ellipsoids=2, delta=0.0, views=slice(0, None, 2))
    of_arrays = fit(
        native(seen), images=images, max_ellipsoids=2, delta=0.0, views=slice(0, None, 2)
    )
    assert of_arrays.body == of_files.body
    assert (of_arrays.colors == of_files.colors).all()
    assert (of_arrays.iou_unused == of_files.iou_unused).all()


def test_a_capture_of_arrays_and_one_of_files_make_the_same_body(seen: list[CaptureView]) -> None:
    request = Request(max_ellipsoids=2, delta=0.0)
    made = fit_capture(capture_of([posed(one) for one in seen]), request)
    assert made.body == fit(seen, max_ellipsoids=2, delta=0.0).body


def test_a_result_of_arrays_is_saved_and_reported(seen: list[CaptureView], tmp_path: Path) -> None:
    result = fit(native(seen), images=[one.image() for one in seen], max_ellipsoids=1)
    result.save(tmp_path / "body.json")
    write_report(result, tmp_path / "report")
    assert "view/0" in (tmp_path / "body.json").read_text(encoding="utf-8")
    assert (tmp_path / "report" / "report.html").is_file()


def test_views_without_images_make_a_grey_body(seen: list[CaptureView]) -> None:
    result = fit(native(seen), max_ellipsoids=1)
    assert len(set(result.colors.ravel().tolist())) == 1
    with pytest.raises(ImageError, match="has no image"):
        result.used_views[0].image()


def test_views_and_images_that_do_not_fit_are_refused_in_words(seen: list[CaptureView]) -> None:
    images = [one.image() for one in seen]
    with pytest.raises(ImageError, match="6 views have 5 images"):
        fit(native(seen), images=images[:-1])
    with pytest.raises(ImageError, match=r"\(255 \* image\)"):
        fit(native(seen), images=[image / 255.0 for image in images])
    with pytest.raises(ModelError, match="leave images out"):
        fit(seen, images=images)
    with pytest.raises(ModelError, match=r"View\(camera=, .* but one is of type str"):
        fit(["eye/0000"])  # type: ignore[list-item]
    with pytest.raises(ImageError, match="160x60 pixels, but its camera has 160x120"):
        views_of(native(seen)[:1], [images[0][:60]])


def test_a_mask_may_be_of_any_whole_number_and_of_no_float(seen: list[CaptureView]) -> None:
    mask = seen[0].mask()
    kinds = (mask != 0, mask.astype(np.int64), mask.astype(np.uint16) * 257, mask // 255)
    views = {posed_view(seen[0], kind) for kind in (*kinds, mask.tolist())}
    assert len(views) == 1
    with pytest.raises(MaskError, match=r"mask > 0\.5"):
        posed_view(seen[0], mask / 255.0)
    with pytest.raises(MaskError, match="one channel"):
        posed_view(seen[0], np.stack([mask] * 3, axis=-1))


def posed_view(view: CaptureView, mask: np.ndarray) -> View:
    return View(camera=view.camera, world_from_camera=view.world_from_camera, mask=mask)


def test_depth_in_memory_is_evidence(seen: list[CaptureView]) -> None:
    view = seen[0]
    mask = view.mask()
    away = float(np.linalg.norm(view.world_from_camera.translation))
    depth = np.where(mask != 0, away, 0.0)
    result = fit_capture(capture_of([posed(view, depth_m=depth)]), Request(max_ellipsoids=1))
    assert len(result.range_samples) > 100
    with pytest.raises(ImageError, match=r"metres, but an array \(120, 160\) of int64"):
        posed(view, depth_m=depth.astype(int))


def test_cameras_of_one_instant_are_a_rig_and_a_lens_is_straightened(
    seen: list[CaptureView],
) -> None:
    K = seen[0].camera.matrix()  # noqa: N806
    lens = Lens.from_matrix(K, (160, 120), [0.1, 0.0, 0.0, 0.0, 0.0])
    right = Pose.from_parts([0.06, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])
    pairs = [
        [
            PosedImage(camera=lens, world_from_camera=pose, image=one.image(), mask=one.mask())
            for pose in (one.world_from_camera, one.world_from_camera @ right)
        ]
        for one in seen[:3]
    ]
    capture = capture_of(pairs, rate_hz=10.0)
    assert [camera.name for camera in capture.cameras] == ["camera_1", "camera_2"]
    assert np.allclose(capture.cameras[1].rig_from_camera.matrix(), right.matrix())
    assert capture.views()[0].image().shape[:2] != (0, 0)
    assert capture.views()[0].ideal.camera.size_px != (160, 120)


def test_what_makes_no_capture_is_refused(seen: list[CaptureView]) -> None:
    with pytest.raises(ServoidError, match="no image"):
        capture_of([])
    with pytest.raises(ServoidError, match="2 observations have 1 time;"):
        capture_of([posed(one) for one in seen[:2]], times_s=[0.0])
    for wrong in (seen[0].image(), [[seen[0].image()]], ["photos"]):
        with pytest.raises(CaptureError, match="an observation must be a PosedImage"):
            capture_of(wrong)  # type: ignore[arg-type]
    with pytest.raises(ServoidError, match="a Pose, but it is a ndarray; make one with Pose"):
        PosedImage(camera=seen[0].camera, world_from_camera=np.eye(4), image=seen[0].image())  # type: ignore[arg-type]


def test_clouds_and_meshes_may_be_lists() -> None:
    corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]]
    faces += [[0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    assert len(fit_mesh(corners, faces, Request(max_ellipsoids=1)).body) == 1
    assert range_samples_of_cloud(corners, None, [0, 0, 9]).directions[0].tolist() == [0, 0, -9]
    for wrong in (corners[0], "abc", [["a", "b", "c"]]):
        with pytest.raises(MeshError, match="rows of three numbers"):
            range_samples_of_cloud(wrong, None, (0, 0, 9))  # type: ignore[arg-type]
    with pytest.raises(MeshError, match="8 points have 1 normal;"):
        range_samples_of_cloud(corners, [[0, 0, 1]], None)
    with pytest.raises(BodyError, match="whole numbers of shape"):
        fit_mesh(corners, np.array(faces) * 1.5)


def body() -> Body:
    at = Pose.from_parts([0.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0])
    return Body(
        world_from_object=at,
        centers=[[0, 0, 0]],
        radii=[[0.1, 0.08, 0.06]],
        rotations=[[1, 0, 0, 0]],
    )


def test_one_camera_and_one_image_stand_for_lists_of_one() -> None:
    camera, here = Camera.from_fov((160, 120), 60.0), Pose.identity()
    image = np.where(body().silhouette(camera, here), np.uint8(200), np.uint8(40))
    alone, listed = Tracker(camera, body()), Tracker([camera], body())
    first = alone.start(0.0, here, image, body().world_from_object, masks=image > 100)
    assert first == listed.start(0.0, [here], [image], body().world_from_object, [image > 100])
    assert alone.step(0.1, here, image) == listed.step(0.1, (here,), (image,))


def test_a_step_before_any_start_is_refused() -> None:
    camera = Camera.from_fov((160, 120), 60.0)
    with pytest.raises(TrackError, match="never started"):
        Tracker(camera, body()).step(0.0, Pose.identity(), np.zeros((120, 160), np.uint8))


def test_what_is_no_number_is_refused_by_its_name() -> None:
    camera = Camera.from_fov((160, 120), 60.0)
    image = np.zeros((120, 160), np.uint8)
    with pytest.raises(TrackError, match="time_s must be a number of seconds, but 'now' was given"):
        Tracker(camera, body()).step("now", Pose.identity(), image)  # type: ignore[arg-type]
    with pytest.raises(CameraError, match="fov_deg must be a number of degrees, but None was"):
        Camera.from_fov((160, 120), None)  # type: ignore[arg-type]


def test_joints_take_lists_and_refuse_other_counts() -> None:
    rows = {"lower": [-1, -1], "upper": [1, 1], "speed": [1, 1], "acceleration": [2, 2]}
    joints = Joints(names=["a", "b"], hand_count=2, **rows)  # type: ignore[arg-type]
    assert joints.lower.dtype == np.float64
    assert joints.names == ("a", "b")
    with pytest.raises(ServoError, match=r"Joints\.upper must be 2 numbers"):
        Joints(names=("a", "b"), hand_count=2, **(rows | {"upper": [1]}))  # type: ignore[arg-type]
    with pytest.raises(ServoError, match=r"JointState\.positions must be a row of numbers"):
        JointState(0.0, ["a"], [0.0])  # type: ignore[arg-type]


@pytest.mark.parametrize("far", [False, True])
def test_tracking_arrays_notices_a_matrix_of_images_of_another_size(
    far: bool, seen: list[CaptureView]
) -> None:
    body = fit(seen, max_ellipsoids=1, delta=0.0).body
    matrix = seen[0].camera.matrix()
    matrix[:2, 2] *= 0.5 if far else 1.0
    camera = Camera.from_matrix(matrix, seen[0].camera.size_px)
    image = PosedImage(
        camera=camera, world_from_camera=seen[0].world_from_camera, image=seen[0].image()
    )
    subject = Subject(body=body, start=body.world_from_object)
    (track,) = track_capture(capture_of([image, image], rate_hz=10.0), [subject])
    assert any("far from the middle of its image" in note for note in track.notes) == far
