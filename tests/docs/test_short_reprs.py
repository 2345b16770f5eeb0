"""Public values show themselves in one short line."""

import dataclasses
import inspect
import re
from importlib import import_module
from pathlib import Path

import msgspec
import numpy as np
import pytest

import servoid
from servoid.brief import brief
from servoid.capture import open_capture
from servoid.model import fit
from servoid.pose import Pose
from servoid.segment import Found
from servoid.shape import load_body
from servoid.source import Instant, read_instants
from servoid.track import Request, follow, track_capture

LATER = ("servo", "view")  # their classes are made by a run, and nobody prints them
PARTS = [name for name in servoid.__all__ if name not in ("__version__", "errors", *LATER)]
MUCH = re.compile(r"ndarray|bytes|Sequence\[|tuple\[[^\[\]]*, \.\.\.\]")
WIDEST = 160  # characters, about two lines of a terminal


def _holds_much(kind: type) -> bool:
    if dataclasses.is_dataclass(kind):
        return any(MUCH.search(str(field.type)) for field in dataclasses.fields(kind))
    is_struct = issubclass(kind, msgspec.Struct)
    return is_struct and any(MUCH.search(str(one)) for one in kind.__annotations__.values())


def _prints_all(kind: type) -> bool:
    """Return whether `repr` is the one that dataclasses or msgspec make, with every value."""
    return hasattr(kind.__repr__, "__wrapped__") or kind.__repr__ is msgspec.Struct.__repr__


@pytest.mark.parametrize("part", PARTS)
def test_a_public_class_that_holds_arrays_or_lists_does_not_print_them_all(part: str) -> None:
    module = import_module(f"servoid.{part}")
    kinds = [one for one in vars(module).values() if inspect.isclass(one)]
    named = [kind for kind in kinds if kind.__name__ in module.__all__]
    assert [kind.__name__ for kind in named if _holds_much(kind) and _prints_all(kind)] == []


def test_capture_body_and_track_show_name_counts_and_verdict(
    drawn_capture: Path, tmp_path: Path
) -> None:
    capture = open_capture(drawn_capture)
    result = fit(capture.views(), max_ellipsoids=1, views=slice(0, None, 2))
    result.save(tmp_path / "body.json", appearance=bytes(30_000))
    file = load_body(tmp_path / "body.json")
    request = Request(distance_m=0.45)
    (track,) = track_capture(capture, request=request)
    step = next(iter(follow(capture, request=request)))
    words = {
        "capture": (capture, f"Capture({capture.path}, 8 observations, 1 camera: eye"),
        "camera": (capture.cameras[0], "CaptureCamera(eye, 160x120 pixels, 8 images)"),
        "view": (capture.views()[0], "CaptureView(eye/0000, 160x120 pixels, with mask)"),
        "result": (result, f"ModelResult(1 ellipsoid, fitness {result.fitness:.4f}, 4 of 8 views"),
        "body": (file, f"BodyFile(1 ellipsoid, fitness {result.fitness:.4f}, 4 views"),
        "track": (track, f"TrackResult(object, {track.tracked_count} of 8 observations tracked"),
        "step": (step, "TrackStep("),
        "samples": (result.range_samples, "RangeSamples("),
    }
    for one, beginning in words.values():
        assert repr(one).startswith(beginning)
        assert len(repr(one)) <= WIDEST + len(str(drawn_capture))
        assert "\n" not in repr(one)
    assert result.verdict.word in repr(result)
    assert track.verdict in repr(track)


def test_what_is_in_memory_shows_its_sizes(drawn_capture: Path) -> None:
    capture = open_capture(drawn_capture)
    instant: Instant = next(iter(read_instants(capture, capture.observations())))
    assert "images=1 ndarray" in repr(instant)
    mask = np.zeros((480, 640), np.uint8)
    found = Found(mask=mask, answers=(mask, mask), doubt="it may mean " + "another " * 20)
    shown = repr(found)
    assert shown.startswith("Found(mask=480x640 uint8, answers=2 ndarray, doubt='it may mean")
    assert len(shown) <= WIDEST


def test_what_is_empty_is_left_out_and_few_numbers_are_shown() -> None:
    @dataclasses.dataclass
    class One:
        name: str
        pose: Pose
        sizes: tuple[float, ...]
        raw: bytes
        nothing: None = None
        notes: tuple[str, ...] = ()
        count: int = 0
        __repr__ = brief

    one = One("cup", Pose.identity(), (0.1, 1 / 3), bytes(9))
    assert repr(one) == (
        "One(name='cup', pose=Pose(translation=(0, 0, 0), quaternion=(1, 0, 0, 0)), "
        "sizes=(0.1, 0.3333), raw=9 bytes, count=0)"
    )
