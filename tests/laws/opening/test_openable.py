"""What servoid cannot open is refused as such, whatever else is wrong with the command."""

from pathlib import Path

import pytest

from servoid.errors import CaptureError
from servoid.opening import GivenCalibration, open_filmed, open_recorded, parse_source


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in (
        "film.mpg",
        "part.obj",
        "photos/IMG_1.HEIC",
        "phone/walk.MOV",
        "all/a/capture.toml",
    ):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return tmp_path


@pytest.mark.parametrize("given", [None, GivenCalibration(fov_deg=65.0)])
@pytest.mark.parametrize("opened", [open_recorded, open_filmed])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("film.mpg", r"^servoid cannot open film\.mpg, by the ending .* videos end in \.mp4, "),
        ("part.obj", r"^part\.obj is a mesh .* servoid model part\.obj --out part\.json$"),
        ("photos", r"^there is no capture in photos: no images \(\.jpg, .*, or a video$"),
        ("phone", r"no images .*; but there is a video in it; name that, phone/walk\.MOV$"),
        ("all", r"no images .*; but there is a capture in it; name that, all/a$"),
    ],
)
def test_what_cannot_be_opened_is_refused_with_what_can_whether_calibrated_or_not(
    text: str, message: str, opened: object, given: GivenCalibration | None, place: Path
) -> None:
    del place
    assert callable(opened)
    with pytest.raises(CaptureError, match=message):
        opened(parse_source(text), given)
