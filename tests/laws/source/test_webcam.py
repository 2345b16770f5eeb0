"""What a webcam is told through OpenCV; no webcam was ever there, so only the words are tested."""

import cv2
import numpy as np
import pytest

from servoid.errors import CaptureError
from servoid.source import Controls
from servoid.source.devices.uvc import Webcam as Locked
from servoid.source.devices.uvc import lock_webcam


class Webcam:
    """A capture of OpenCV that has some properties, and rounds what they are set to."""

    def __init__(self, *known: int) -> None:
        self.values = dict.fromkeys(known, 7.0)

    def grab(self) -> bool:
        return True

    def retrieve(self) -> tuple[bool, np.ndarray]:
        return True, np.zeros((48, 64, 3), np.uint8)

    def release(self) -> None:
        pass

    def get(self, key: int) -> float:
        return self.values.get(key, 0.0)

    def set(self, key: int, value: float) -> bool:
        if key in self.values:
            self.values[key] = float(round(value))
        return key in self.values


def test_focus_and_white_balance_are_locked_and_an_exposure_only_where_it_is_given() -> None:
    keys = (
        cv2.CAP_PROP_AUTOFOCUS,
        cv2.CAP_PROP_AUTO_WB,
        cv2.CAP_PROP_AUTO_EXPOSURE,
        cv2.CAP_PROP_EXPOSURE,
    )
    webcam = Webcam(*keys)
    assert lock_webcam(webcam, Controls()) == ()
    assert list(webcam.values.values()) == [0.0, 0.0, 7.0, 7.0]
    assert lock_webcam(webcam, Controls(exposure_s=0.0156)) == ()
    assert list(webcam.values.values()) == [0.0, 0.0, 1.0, 156.0]
    untouched = Webcam(*keys)
    assert lock_webcam(untouched, Controls(lock=False)) == ()
    assert set(untouched.values.values()) == {7.0}


def test_what_a_webcam_refuses_or_takes_otherwise_is_said() -> None:
    webcam = Webcam(cv2.CAP_PROP_AUTO_WB, cv2.CAP_PROP_GAIN)
    assert lock_webcam(webcam, Controls(gain=2.4, focus=30.0)) == (
        "the camera refuses autofocus = 0",
        "the camera took gain = 2 in place of 2.4",
        "the camera refuses focus = 30",
    )


@pytest.mark.parametrize("key", ["exposure_s", "gain", "focus", "rate_hz"])
def test_controls_that_cannot_be_are_refused(key: str) -> None:
    with pytest.raises(CaptureError, match=rf"Controls.{key}: expected a number"):
        Controls(**{key: -1.0})


def test_the_first_image_of_a_webcam_says_what_it_refused() -> None:
    locked = Locked(Webcam(cv2.CAP_PROP_AUTO_WB), Controls())
    assert locked.grab()
    found, first = locked.retrieve()
    assert found and first.notices == ("the camera refuses autofocus = 0",)
    assert locked.retrieve()[1].shape == (48, 64, 3)
