"""What goes wrong with images and objects is said, and no wrong pose is called tracked."""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from faults import Moment, Moments, faults
from recordings import SNAIL, Alone, Recording, wrong
from tiers import tiered
from tracking_errors import tracking_errors

from servoid._native import Estimate
from servoid.capture import open_capture
from servoid.errors import ModelError
from servoid.pose.exact import Floats
from servoid.sim import MovingScene
from servoid.track import track_capture

STRIKES = 10
LAST = 24
FAULTS = faults(STRIKES)
NOTICES = {
    "both images dropped": "delivered no image",
    "right image dropped": "camera 1 delivered no image",
    "images repeated": "the image repeats the previous one",
    "images black": "shows nothing",
    "images white": "shows nothing",
    "left image of another size": "camera 0: the image is 320x120 pixels",
    "clock jumps ahead": "time jumps",
    "clock runs back": "time goes back",
    "left camera dies": "camera 0 delivered no image",
    "right camera dies": "camera 1 delivered no image",
}
BLIND = {"both images dropped", "images black", "images white"}


class EmptyRoom(MovingScene):
    """The scene after the toy was taken away: it is behind the cameras."""

    def room_from_object(self, index: int) -> Floats:
        del index
        pose = np.eye(4)
        pose[1, 3] = -3.0
        return pose


@pytest.fixture(scope="module")
def moments(recording: Callable[[str], Recording]) -> Moments:
    return recording("colour").moments()


@pytest.fixture(scope="module")
def without(recording: Callable[[str], Recording]) -> Callable[[str, int], Moment]:
    """Return an observation without the toy: of the empty room, or of nothing."""
    made = recording("colour")
    room = EmptyRoom(made.scene.scenario).look(0).images
    first = made.moments()[0]

    def see(what: str, index: int) -> Moment:
        random = np.random.default_rng(index)
        noise = [random.integers(-2, 3, image.shape) for image in room]
        images = tuple(
            np.clip(image.astype(int) * (what == "an empty room") + one, 0, 255).astype(np.uint8)
            for image, one in zip(room, noise, strict=True)
        )
        return replace(first, time_s=index / 30.0, images=images)

    return see


def steps(alone: Alone, moments: Sequence[Moment]) -> list[Estimate]:
    """Track from the first of the moments on."""
    tracker = alone.tracker_in(alone.recording, moments[0])
    return [tracker.step(one.time_s, one.world_from_camera, one.images) for one in moments[1:]]


def are_wrong(alone: Alone, estimates: Sequence[Estimate], indices: Sequence[int]) -> list[bool]:
    """Say which estimates of the toy are far off in these observations."""
    poses = [one.world_from_object.matrix() for one in estimates]
    truth = [alone.recording.truth(index) for index in (0, *indices)]
    start = alone.start_in(alone.recording).matrix()
    return wrong(tracking_errors([start, *poses], truth, SNAIL)).tolist()


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_said_and_no_wrong_pose_is_called_tracked(
    name: str, alone: Alone, moments: Moments
) -> None:
    estimates = steps(alone, FAULTS[name](moments[:LAST]))
    struck = estimates[STRIKES - 1]
    assert any(NOTICES[name] in notice for notice in struck.notices), struck.notices
    assert all(not one.notices for one in estimates[: STRIKES - 1])
    assert (struck.status == "tracking") == (name not in BLIND)
    statuses = [one.status for one in estimates]
    off = are_wrong(alone, estimates, range(1, LAST))
    assert not any(
        wrong and status == "tracking" for wrong, status in zip(off, statuses, strict=True)
    )
    assert statuses[STRIKES:] == ["tracking"] * (LAST - 1 - STRIKES)


def test_every_kind_of_fault_has_its_words() -> None:
    assert set(NOTICES) == set(FAULTS)


@pytest.mark.parametrize(
    ("what", "later"), tiered([("an empty room", 0), ("darkness", 0), ("an empty room", 8)])
)
def test_an_object_that_leaves_is_searched_then_lost_and_found_when_it_comes_back(
    what: str,
    later: int,
    alone: Alone,
    moments: Moments,
    without: Callable[[str, int], Moment],
) -> None:
    leaves, away = 12, 24
    gone = [without(what, leaves + count) for count in range(away)]
    after = [replace(one, time_s=one.time_s + away / 30.0) for one in moments[leaves + later :]]
    estimates = steps(alone, [*moments[:leaves], *gone, *after])
    before = [one.status for one in estimates[: leaves - 1]]
    during = [one.status for one in estimates[leaves - 1 : leaves - 1 + away]]
    back = estimates[leaves - 1 + away :]
    assert before == ["tracking"] * (leaves - 1)
    assert during == sorted(during, reverse=True)  # searching, then lost
    assert set(during) == {"searching", "lost"}
    assert max(one.confidence for one in estimates[leaves - 1 : leaves - 1 + away]) < 0.5
    off = are_wrong(alone, back, range(leaves + later, len(moments)))
    found = [one.status == "tracking" for one in back]
    assert all(found[3:])
    assert not any(wrong and seen for wrong, seen in zip(off, found, strict=True))


@pytest.mark.extended
def test_a_lost_object_s_pose_is_less_sure(
    alone: Alone, moments: Moments, without: Callable[[str, int], Moment]
) -> None:
    gone = [without("an empty room", 6 + count) for count in range(20)]
    estimates = steps(alone, [*moments[:6], *gone])
    spread = [float(np.trace(one.covariance)) for one in estimates]
    # The best of all wrong poses may fit as sharply as a right one; it is not what is reported.
    assert min(spread[5:]) > 10.0 * max(spread[:5])


def test_an_eye_of_another_size_is_named_before_what_follows_from_it(
    recording: Callable[[str], Recording], tmp_path: Path
) -> None:
    folder = tmp_path / "pair"
    shutil.copytree(recording("colour").folder, folder)
    for path in (folder / "right").iterdir():
        image = np.asarray(cv2.imread(str(path)))
        cv2.imwrite(str(path), cv2.resize(image, None, fx=0.5, fy=0.5))
    with pytest.raises(ModelError, match=r"^of observation 0, camera right: .* is 160x120 pixels"):
        track_capture(open_capture(folder))
