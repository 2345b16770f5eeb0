"""A camera of a rig at rest that is turned meanwhile is told, and so is a rig that is kicked."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_tracker import plain_body
from recordings import Recording
from turned_cameras import Image, changed, turned

from servoid.capture import Capture, CaptureCamera, doubt_moved, open_capture
from servoid.pose import Pose
from servoid.track import Request, Subject, TrackResult, track_capture

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
COUNT = 12
Course = Callable[[int], float]
"""Returns by how many degrees a camera is turned in an observation."""


def sagging(degrees: float) -> Course:
    return lambda index: degrees * index / (COUNT - 1)


def kicked(degrees: float, at: int = 7) -> Course:
    return lambda index: degrees * (index >= at)


def moved(capture: Capture, course: Course, cameras: tuple[str, ...], step: int = 1) -> Capture:
    """Return every `step`-th observation, in which some cameras are turned."""

    def seen(image: Image, camera: CaptureCamera, number: int) -> Image:
        is_turned = camera.name in cameras
        return turned(image, course(number), camera.lens.focal_px[0]) if is_turned else image

    return changed(capture, COUNT, seen, step)


@pytest.fixture(scope="module")
def still(recording: Callable[[str], Recording]) -> Capture:
    return recording("colour").capture


@pytest.mark.parametrize("name", ["left", "right"])
@pytest.mark.parametrize("course", [sagging(0.5), sagging(-1.0), kicked(0.4), kicked(-2.0)])
def test_the_one_camera_that_turns_is_told(name: str, course: Course, still: Capture) -> None:
    doubt = doubt_moved(moved(still, course, (name,)))
    assert doubt is not None and doubt.is_apart
    assert doubt.words.startswith(f"camera {name} was moved or zoomed meanwhile")
    assert abs(course(doubt.since)) > 0.15 and abs(course(doubt.since - 1)) < 0.25
    assert f"as by a turn of {abs(course(COUNT - 1)):.1f} degrees" in doubt.words


@pytest.mark.parametrize("course", [sagging(0.0), sagging(0.1), kicked(0.1)])
def test_cameras_that_hardly_turn_are_not_told(course: Course, still: Capture) -> None:
    for names in (("right",), ("left", "right")):
        assert doubt_moved(moved(still, course, names)) is None


@pytest.mark.parametrize("degrees", [-1.0, 5.0])
def test_a_rig_that_is_kicked_is_told_with_the_first_observation(
    degrees: float, still: Capture
) -> None:
    doubt = doubt_moved(moved(still, kicked(degrees), ("left", "right")))
    assert doubt is not None and not doubt.is_apart
    assert doubt.since == 7
    assert "from observation 7 on" in doubt.words
    assert "relative to the cameras where they are then" in doubt.words


def test_a_rig_that_moves_all_the_time_is_not_taken_for_kicked(
    recording: Callable[[str], Recording],
) -> None:
    moving = recording("long hand").capture
    assert doubt_moved(moving) is None
    assert doubt_moved(replace(moving, world_from_rig=(Pose.identity(),) * len(moving))) is None


def test_a_rig_that_turns_all_the_time_is_not_taken_for_kicked(still: Capture) -> None:
    assert doubt_moved(moved(still, sagging(12.0), ("left", "right"))) is None


def test_one_thing_that_moves_before_a_plain_wall_is_no_rig_that_is_kicked(still: Capture) -> None:
    def seen(_: Image, camera: CaptureCamera, number: int) -> Image:
        first = camera.pictures[0]
        assert first is not None
        texture = first.read(camera.lens.size_px)
        height, width = texture.shape[0] // 2, texture.shape[1] // 2
        pixels = np.full_like(texture, 128)
        right, down = (8, 5) if number >= 7 else (0, 0)
        pixels[down : down + height, right : right + width] = texture[-height:, :width]
        return pixels

    assert doubt_moved(changed(still, COUNT, seen)) is None


def tracked(capture: Capture) -> TrackResult:
    start = Pose.from_parts((0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0))
    [track] = track_capture(capture, [Subject(body=plain_body(start), start=start)])
    return track


def test_no_pose_is_confirmed_once_a_camera_was_moved(still: Capture) -> None:
    wrong = moved(still, kicked(0.5), ("right",))
    track = tracked(wrong)
    assert track.calibration_doubt is not None
    assert track.calibration_doubt.startswith("camera right was moved")
    before, after = track.estimates[:7], track.estimates[7:]
    assert not any(one.confidence for one in after)
    unmoved = tracked(moved(still, kicked(0.0), ("right",)))
    assert [one.status for one in before] == [one.status for one in unmoved.estimates[:7]]


def test_a_kick_of_the_whole_rig_is_a_doubt_of_its_poses(still: Capture) -> None:
    track = tracked(moved(still, kicked(3.0), ("left", "right")))
    assert track.rig_doubt is not None
    assert track.rig_doubt.startswith("the cameras were moved or zoomed meanwhile, all of them")
    assert track.capture_doubts[-1] == track.rig_doubt


@pytest.mark.extended
@pytest.mark.parametrize("course", [sagging(1.0), kicked(3.0)])
def test_of_moved_cameras_no_track_is_good(course: Course, still: Capture) -> None:
    [right] = track_capture(still, request=Request(observations=slice(COUNT)))
    assert (right.verdict, right.capture_doubts) == ("good", ())
    known = Subject(body=right.body, start=right.estimates[0].world_from_object)
    for names in (("right",), ("left", "right")):
        [track] = track_capture(moved(still, course, names), [known])
        assert track.verdict != "good"


@pytest.mark.extended
@pytest.mark.parametrize(
    "name", ["stereo/mustard", "stereo/drill", "stereo/teabox", "hard/bleach_turn", "hard/mug_sway"]
)
def test_recorded_cameras_are_told_only_if_they_are_moved(name: str) -> None:
    if not (DATA / name).is_dir():
        pytest.skip(f"{name} is not beside the repository")
    capture = open_capture(DATA / name)
    assert doubt_moved(capture) is None
    if name == "stereo/teabox":  # its rig moves all the time
        return
    for course, names in ((sagging(0.5), ("right",)), (kicked(2.0), ("left", "right"))):
        doubt = doubt_moved(moved(capture, course, names, step=8))
        assert doubt is not None and doubt.is_apart == (len(names) == 1)
