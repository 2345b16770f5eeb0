"""The same observations give the same trajectory, whichever way they come."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from gige_peer import ADDRESS, gige_camera
from realsense_peer import Shown, need_library, write_recording
from served_images import served

from servoid.capture import Capture, open_capture
from servoid.source import Instant, Live, LiveCamera, read_instants
from servoid.source.devices import GenicamVideo, open_realsense
from servoid.source.streams.halves import HalvesVideo
from servoid.track import Estimate, Request, Subject
from servoid.track.starting import begin

MUSTARD = Path(__file__).parents[3].parent / "shared" / "data" / "stereo" / "mustard"
COUNT, RATE_HZ = 50, 30.0
PATIENCE_S = 120.0
pytestmark = [
    pytest.mark.extended,
    pytest.mark.skipif(not MUSTARD.is_dir(), reason="the recorded mustard is not here"),
]


def from_folder(capture: Capture) -> list[Instant]:
    """Return the observations as they are read from files."""
    return list(read_instants(capture, capture.observations()[:COUNT]))


def from_live(
    open_cameras: Callable[[], Sequence[LiveCamera]], folder: Sequence[Instant]
) -> list[Instant]:
    """Return the observations that come, in the folder's order and at the folder's times.

    What a busy computer left out is awaited when the device shows it again, or is played again.
    Times are the folder's since a device's clock begins when it likes; a tracker sees no others.
    """
    places = {_left(one): place for place, one in enumerate(folder)}
    found: dict[int, Instant] = {}
    end = time.monotonic() + PATIENCE_S
    while len(found) < len(folder) and time.monotonic() < end:
        with Live(open_cameras()) as source:
            while len(found) < len(folder) and not source.is_over and time.monotonic() < end:
                instant = source.newest()
                if instant is not None and all(image is not None for image in instant.images):
                    place = places.get(_left(instant))
                    if place is not None:  # a device may show more than the folder has
                        found.setdefault(place, instant)
                time.sleep(0.0005)
    return [
        replace(found[place], index=place, time_s=place / RATE_HZ, notices=())
        for place in sorted(found)
    ]


def _left(instant: Instant) -> bytes:
    image = instant.images[0]
    assert image is not None
    return image.tobytes()


def trajectory(capture: Capture, instants: Sequence[Instant]) -> list[Estimate]:
    """Track the object that the first mask shows, as `servoid track` does."""
    followed = begin(capture, instants[0], Subject(), Request(seed=1))
    later = [
        followed.tracker.step(one.time_s, one.world_from_camera, one.images) for one in instants[1:]
    ]
    return [followed.first.estimate, *later]


Recorded = tuple[Capture, list[Instant], list[Estimate]]


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    """Return the recording, its observations and its trajectory, for all that show it anew."""
    capture = open_capture(MUSTARD)
    folder = from_folder(capture)
    return capture, folder, trajectory(capture, folder)


def assert_same(
    capture: Capture,
    live: Sequence[Instant],
    folder: Sequence[Instant],
    wanted: Sequence[Estimate],
) -> None:
    assert len(live) == len(folder) == COUNT
    for one, other in zip(live, folder, strict=True):
        for image, true in zip(one.images, other.images, strict=True):
            assert image is not None and true is not None and np.array_equal(image, true)
    found = trajectory(capture, live)
    assert found == wanted
    poses = [np.stack([one.world_from_object.matrix() for one in run]) for run in (found, wanted)]
    assert poses[0].tobytes() == poses[1].tobytes()
    assert np.linalg.norm(poses[0][-1, :3, 3] - poses[0][0, :3, 3]) > 0.01  # it moved


def side_by_side(capture: Capture) -> list[LiveCamera]:
    """Open the camera whose images are those of both eyes."""
    video = HalvesVideo(lambda: GenicamVideo(ADDRESS))
    return [
        LiveCamera(camera.name, video, camera.lens, camera.rig_from_camera)
        for camera in capture.cameras
    ]


def test_a_gige_camera_and_a_folder_give_the_same_trajectory_to_the_bit(
    recorded: Recorded, tmp_path: Path
) -> None:
    capture, folder, wanted = recorded
    images = np.stack([np.concatenate(one.images, axis=1) for one in folder])  # type: ignore
    with gige_camera(tmp_path, images, "RGB8", 10.0):
        live = from_live(lambda: side_by_side(capture), folder)
    assert_same(capture, live, folder, wanted)


def test_streams_of_a_folders_jpeg_files_give_its_trajectory_to_the_bit(
    recorded: Recorded, tmp_path: Path
) -> None:
    capture, folder, wanted = recorded
    for camera in capture.cameras:  # a stream plays all files of a folder before it begins again
        (tmp_path / camera.name).mkdir()
        for picture in camera.pictures[:COUNT]:
            assert picture is not None
            (tmp_path / camera.name / picture.path.name).symlink_to(picture.path)
    with served(tmp_path, rate_hz=15.0) as address:

        def streams() -> list[LiveCamera]:
            return [
                LiveCamera(one.name, f"{address}/{one.name}", one.lens, one.rig_from_camera)
                for one in capture.cameras
            ]

        live = from_live(streams, folder)
    assert_same(capture, live, folder, wanted)


CAMERA = """[[camera]]
name = "{name}"
images = "{name}/*.png"
{masks}size_px = [640, 480]
model = "pinhole"
focal_px = [{focal!r}, {focal!r}]
center_px = [319.5, 239.5]
rig_from_camera = [[1,0,0,{shift!r}],[0,1,0,0],[0,0,1,0],[0,0,0,1]]
"""


def grey_folder(folder: Path, focal_px: float, baseline_m: float) -> Capture:
    """Write the recording as a camera with grey images and numbers of 32 bits has it."""
    original = open_capture(MUSTARD)
    text = f"version = 1\nrate_hz = {RATE_HZ}\n"
    for place, camera in enumerate(original.cameras):
        (folder / camera.name).mkdir(parents=True)
        for number, picture in enumerate(camera.pictures[:COUNT]):
            assert picture is not None
            grey = cv2.cvtColor(picture.read(camera.lens.size_px), cv2.COLOR_RGB2GRAY)
            cv2.imwrite(str(folder / camera.name / f"{number:06d}.png"), grey)
        text += CAMERA.format(
            name=camera.name,
            masks='masks = "masks/*.png"\n' if place == 0 else "",
            focal=focal_px,
            shift=place * baseline_m,
        )
    (folder / "masks").mkdir()
    (mask,) = sorted((MUSTARD / "masks").iterdir())
    (folder / "masks" / "000000.png").write_bytes(mask.read_bytes())
    (folder / "capture.toml").write_text(text + "[rig]\n")
    return open_capture(folder)


def test_a_realsense_recording_and_a_folder_give_the_same_trajectory_to_the_bit(
    tmp_path: Path,
) -> None:
    need_library()
    focal_px, baseline_m = float(np.float32(579.411255)), float(np.float32(0.1))
    capture = grey_folder(tmp_path / "grey", focal_px, baseline_m)
    folder = from_folder(capture)
    left, right = (
        np.stack([one.images[eye][..., 0] for one in folder])  # type: ignore
        for eye in (0, 1)
    )
    path = tmp_path / "run.db3"
    shown = Shown(left, right, focal_px=focal_px, baseline_m=baseline_m, pace_s=0.05)
    write_recording(path, shown)
    cameras = open_realsense(str(path))
    for camera, recorded in zip(cameras, capture.cameras, strict=True):
        assert camera.lens == recorded.lens
        assert camera.rig_from_camera == recorded.rig_from_camera
    cameras[0].device.release()
    live = from_live(lambda: open_realsense(str(path)), folder)
    assert_same(capture, live, folder, trajectory(capture, folder))
