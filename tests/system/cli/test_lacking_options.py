"""All that a plain video, photographs or a camera lack is named at once, with a command to copy."""

import re
import shlex
from pathlib import Path

import cv2
import numpy as np
import pytest

from conftest import Command, write_png

FOV, TARGET, DISTANCE = "--fov 65", "--target box:120,80,420,400", "--distance 0.6"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stand in a folder with two films and a photograph."""
    monkeypatch.chdir(tmp_path)
    for name in ("film.avi", "other.avi"):
        film = cv2.VideoWriter(name, cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (64, 48))
        film.write(np.zeros((48, 64, 3), np.uint8))
        film.release()
    write_png(tmp_path / "photo.png", np.zeros((48, 64, 3), np.uint8))


@pytest.mark.parametrize(
    ("words", "added"),
    [
        ("track film.avi", (FOV, TARGET, DISTANCE)),
        ("track film.avi --fov 50", (TARGET, DISTANCE)),
        ("track film.avi --target click:30,20", (FOV, DISTANCE)),
        ("track film.avi --distance 0.4", (FOV, TARGET)),
        ("track film.avi+other.avi", (FOV, "--baseline 0.1", TARGET)),
        ("track photo.png", (FOV, TARGET, DISTANCE)),
        ("track 0", (FOV, TARGET, DISTANCE)),
        ("track side-by-side:0 --fov 50", ("--baseline 0.1", TARGET)),
        ("track http://localhost:1/video.mjpg", (FOV, TARGET, DISTANCE)),
        ("model film.avi --out a.json --fov 50", (TARGET, DISTANCE)),
        ("model film.avi+other.avi --out a.json --fov 50", ("--baseline 0.1", TARGET)),
    ],
)
def test_all_that_images_lack_is_named_at_once_with_a_command_that_lacks_nothing(
    words: str, added: tuple[str, ...], servoid_command: Command
) -> None:
    refused = servoid_command(*words.split())
    assert refused.code == 1
    error = " ".join(refused.err.split())
    found = re.search(r"such as: servoid (.*?)(;|$)", error)
    assert found, error
    again = shlex.split(found[1])
    assert set(words.split()) <= set(again)
    assert set(" ".join(added).split()) <= set(again)
    assert all(f"{option.split()[0]}, " in error for option in added)
    assert "such as: servoid" not in servoid_command(*again).err


def test_a_single_thing_that_lacks_is_asked_for_by_the_step_that_needs_it(
    servoid_command: Command,
) -> None:
    unmarked = servoid_command("track", "film.avi", *FOV.split(), *DISTANCE.split())
    assert unmarked.code == 1 and "nothing marks the object" in unmarked.err
    uncalibrated = servoid_command("track", "film.avi", *TARGET.split(), *DISTANCE.split())
    assert uncalibrated.code == 1
    assert "there is no calibration of its camera; give --fov" in uncalibrated.err


def test_photographs_of_one_object_are_pointed_to_the_command_that_models_them(
    drawn_capture: Path, servoid_command: Command
) -> None:
    error = servoid_command("track", drawn_capture, "--out", "poses.csv").err
    assert "such as --distance 0.6" in error
    assert "model it with servoid model" in error
