"""An image of the first observation that cannot be read is named, whatever fails for want of it."""

from pathlib import Path

import numpy as np
import pytest

from conftest import Command
from servoid.capture import open_capture
from servoid.sim import Scenario, write_moving_sample


def spoiled(folder: Path, camera: str) -> tuple[str, str]:
    """Write a sample, cut a camera's first image short; return its name and a box of the object."""
    capture = open_capture(write_moving_sample(folder, Scenario(count=2, size="small")))
    rows, columns = np.nonzero(capture.views()[0].mask())
    image = folder / camera / "000000.jpg"
    image.write_bytes(image.read_bytes()[:900])
    corners = (columns.min() - 3, rows.min() - 3, columns.max() + 3, rows.max() + 3)
    return f"{camera}/{image.name}", f"box:{','.join(map(str, corners))}"


@pytest.mark.parametrize("verb", ["model", "track"])
@pytest.mark.parametrize("camera", ["left", "right"])
@pytest.mark.parametrize("is_marked", [False, True])
def test_what_fails_for_want_of_an_image_names_it(
    verb: str, camera: str, is_marked: bool, servoid_command: Command, tmp_path: Path
) -> None:
    name, box = spoiled(tmp_path / "toy", camera)
    marked = ("--target", box) if is_marked else ()
    out = tmp_path / ("body.json" if verb == "model" else "poses.csv")
    outcome = servoid_command(verb, tmp_path / "toy", *marked, "--out", out)
    assert outcome.code == 1, outcome.out
    assert f"{name} is cut short" in " ".join(outcome.err.split())
    assert not out.exists()


@pytest.mark.parametrize("at", ["", "@left/000000"])
def test_a_target_never_moves_on_to_another_image(
    at: str, servoid_command: Command, tmp_path: Path
) -> None:
    _, box = spoiled(tmp_path / "toy", "left")
    options = ("--target", f"{box}{at}", "--trust-targets", "--distance", "0.6")
    outcome = servoid_command("track", tmp_path / "toy", *options, "--out", tmp_path / "a.csv")
    assert outcome.code == 1
    assert "means left/000000, which cannot be read" in outcome.err
    assert "@right/000000" in outcome.err
