"""The recipes of CONTRIBUTING.md: names, toys that follow some, and the files to open first."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from architecture import read_modules, read_table

from servoid.camera import Camera
from servoid.pose import Pose
from servoid.servo import Arm
from servoid.sim import arm_file
from servoid.sim.serial_arm import SerialArm
from servoid.source import Instant, Source

ROOT = Path(__file__).parents[2]
SHIPPED = (ROOT / "python" / "servoid" / "sim" / "arms" / "pa10.toml").read_text(encoding="utf-8")
ARCHITECTURE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
GROUND = {
    "brief",
    "changing",
    "errors",
    "output",
    "parallel",
    "rates",
    "renamed",
    "simd",
    "words",
    "_native",
    "config",
}


def recipes() -> str:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return text.split("## How to add\n")[1].split("\n## ")[0]


def faults(text: str, root: Path) -> list[str]:
    """Return the files that a text names and that are not there, and what they should hold."""
    files = re.findall(r"`([\w.-]+(?:/[\w.-]+)+)`", text)
    named = re.findall(r"`(\w+)`(?: and `(\w+)`)? in `([^`]+/[^`]+)`", text)
    wrong = [file for file in files if not (root / file).exists()]
    for *items, file in named:
        held = (root / file).read_text(encoding="utf-8") if (root / file).is_file() else ""
        wrong += [f"{one} in {file}" for one in items if one and not re.search(rf"\b{one}\b", held)]
    return wrong


def test_each_file_and_name_of_a_recipe_is_there() -> None:
    assert faults(recipes(), ROOT) == []
    assert len(re.findall(r"^\*\*(?:A|An) \w+", recipes(), flags=re.MULTILINE)) == 5


def test_a_recipe_that_names_what_is_gone_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "b.py").write_text("class Here: ...\n")
    assert faults("`Here` in `a/b.py`, `Gone` in `a/b.py`, `a/c.py`", tmp_path) == [
        "a/c.py",
        "Gone in a/b.py",
    ]


def test_each_stage_has_a_file_to_open_first_in_its_own_folder() -> None:
    rows = {
        row[0].strip("`"): row[1:] for row in read_table(ARCHITECTURE, "Which file to open first")
    }
    files = [cell.strip("`") for row in rows.values() for cell in row if cell != "-"]
    assert [file for file in files if not (ROOT / file).is_file()] == []
    modules = read_modules(ARCHITECTURE)
    assert set(modules) - set(rows) == GROUND
    for name, module in modules.items():
        if name in rows:
            rust, python = (cell.strip("`") for cell in rows[name])
            assert rust.startswith(f"crates/servoid/src/{name}/") if module.rust else rust == "-"
            assert python.startswith(f"python/servoid/{name}/") if module.python else python == "-"


class OnePicture:
    """A source that was written by the recipe: one grey image, an arm's clock."""

    def __init__(self) -> None:
        self._left = [Instant(0, 0.5, (Pose.identity(),), (np.zeros((48, 64), np.uint8),))]

    @property
    def cameras(self) -> tuple[Camera, ...]:
        return (Camera(size_px=(64, 48), focal_px=(60.0, 60.0), center_px=(31.5, 23.5)),)

    def newest(self) -> Instant | None:
        return self._left.pop() if self._left else None


def test_a_class_with_two_members_is_a_source() -> None:
    source = OnePicture()
    assert isinstance(source, Source)
    instant = source.newest()
    assert instant is not None
    assert instant.images[0] is not None
    height, width = instant.images[0].shape
    assert (width, height) == source.cameras[0].size_px
    assert source.newest() is None
    assert not isinstance(object(), Source)


def test_an_arm_is_a_toml_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    longer = SHIPPED.replace("[0.317, 0.45, 0.48, 0.07]", "[0.317, 0.50, 0.48, 0.07]")
    assert longer != SHIPPED
    (tmp_path / "toy.toml").write_text(longer, encoding="utf-8")
    shipped = SerialArm(arm_file.read_arm("pa10"), positions=np.zeros(10))
    monkeypatch.setattr(arm_file, "_FOLDER", tmp_path)
    arm = SerialArm(arm_file.read_arm("toy"), positions=np.zeros(10))
    assert isinstance(arm, Arm)
    # All links point up: the hand is higher by what one of them is longer.
    higher = [one.world_from_hand(np.zeros(10)).translation[2] for one in (arm, shipped)]
    assert higher[0] - higher[1] == pytest.approx(0.05)


def test_a_study_of_another_package_is_a_command(tmp_path: Path) -> None:
    info = tmp_path / "toy_study-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-study\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[servoid.commands]\nroll = toy_study:roll\n")
    (tmp_path / "toy_study.py").write_text(
        "import random\n"
        "def roll(seed: int = 0, count: int = 2) -> None:\n"
        '    """Roll dice."""\n'
        "    random.seed(seed)\n"
        "    print(sum(random.randint(1, 6) for _ in range(count)))\n"
    )
    paths = os.pathsep.join([str(tmp_path), str(ROOT / "python"), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "servoid", "roll", "--seed", "3", "--count", "4"]
    env = {**os.environ, "PYTHONPATH": paths}
    ran = [subprocess.run(command, env=env, capture_output=True, text=True) for _ in range(2)]
    assert [one.stderr for one in ran] == ["", ""]
    assert ran[0].stdout == ran[1].stdout
    assert 4 <= int(ran[0].stdout) <= 24
