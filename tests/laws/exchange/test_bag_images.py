"""Images of bags with fewer bits than their messages, and depth that is stamped late."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from bag_writing import compressed, image, write_bag
from scenes_bags import FRAMES, SIZE_PX, only_camera, pixels, stamp, stereo_entries

from servoid.exchange import open_bag

COUNT = 4


@pytest.mark.parametrize("encoding", ["mono16", "bgr16", "png"])
@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_images_of_any_bits_are_as_bright_as_in_8(tmp_path: Path, bits: int, encoding: str) -> None:
    seen = [pixels(index) for index in range(COUNT)]
    entries = [one for one in only_camera(stereo_entries(COUNT)) if "image" not in one.topic]
    for index, one in enumerate(seen):
        stored = one[..., 0] if encoding == "mono16" else one[..., ::-1]
        values = stored.astype(np.uint16) << (bits - 8)
        topic = "/stereo/left/image_raw"
        if encoding == "png":
            data = cv2.imencode(".png", values)[1].tobytes()
            form = "bgr16; png compressed bgr16"
            entries.append(compressed(f"{topic}/compressed", stamp(index), FRAMES[0], data, form))
        else:
            entries.append(
                image(topic, stamp(index), FRAMES[0], np.ascontiguousarray(values), encoding)
            )
    capture = open_bag(write_bag(tmp_path / "run.mcap", entries))
    for picture, one in zip(capture.cameras[0].pictures, seen, strict=True):
        assert picture is not None
        expected = np.repeat(one[..., :1], 3, axis=2) if encoding == "mono16" else one
        np.testing.assert_array_equal(picture.read(SIZE_PX), expected)
    told = [note for note in capture.notes if "taken as" in note]
    assert len(told) == (bits < 16)
    assert all(f"all are taken as {bits}-bit values" in note for note in told)


@pytest.mark.parametrize("late_ms", [-30, -12, -9, 0, 9, 12, 150])
def test_depth_that_is_stamped_too_far_from_its_image_is_told(tmp_path: Path, late_ms: int) -> None:
    entries = only_camera(stereo_entries(COUNT))
    for index in range(COUNT):
        depth = np.full(SIZE_PX[::-1], 640, np.uint16)
        at = stamp(index) + late_ms * 10**6
        entries.append(image("/stereo/left/depth/image_raw", at, FRAMES[0], depth, "16UC1"))
    capture = open_bag(write_bag(tmp_path / "run.mcap", entries))
    told = [note for note in capture.notes if "no depth image is within 10 ms" in note]
    used = [path is not None for path in capture.cameras[0].depth_paths]
    if abs(late_ms) <= 10:
        assert all(used) and not told
    elif abs(late_ms) < 33:
        assert not any(used) or late_ms == -30
        assert bool(told) == (not any(used))
        assert all(f"the nearest is {abs(late_ms)} ms off" in note for note in told)
    else:
        assert not any(used)
        (note,) = told
        assert "the nearest is 50 ms off" in note
