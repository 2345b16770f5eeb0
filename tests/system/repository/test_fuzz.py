"""Whatever is damaged is refused with a ServoidError; half a minute here, hours by `make fuzz`."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))
pytest.importorskip("trimesh", reason="meshes need trimesh")
pytest.importorskip("daqp", reason="settings of servoing need daqp")
pytest.importorskip("rosbags", reason="bags need rosbags")

from fuzz.run import Tally, findings, tried  # noqa: E402
from fuzz.target import Target  # noqa: E402
from fuzz.targets import TARGETS  # noqa: E402

SECONDS = 30.0


@pytest.mark.parametrize("name", [name for name in TARGETS if name != "calls"])
def test_what_damage_begins_with_is_whole(name: str, tmp_path: Path) -> None:
    for data in TARGETS[name].seeds:
        folder = tmp_path / "whole"
        folder.mkdir(exist_ok=True)
        TARGETS[name].run(data, folder)


def test_a_reader_that_stumbles_is_found() -> None:
    def stumble(data: bytes, _: Path) -> object:
        return b"whole"[data.count(b"[") :].decode() if b"[[[" not in data else 1 // 0

    planted = {"planted": Target((b"whole",), stumble)}
    found = next(iter(findings(["planted"], 20.0, 0, planted)))
    assert "ZeroDivisionError" in found.words
    assert tried("planted", planted["planted"], b"whole") is None


def test_an_input_that_came_before_is_neither_taken_nor_counted_again() -> None:
    taken: list[bytes] = []
    two = (b"1", b"2")
    planted = {"planted": Target(two, lambda data, _: taken.append(data))}
    tally = Tally()
    assert list(findings(["planted"], 0.3, 0, planted, tally)) == []
    assert len(taken) == len(set(taken)) == tally.total() > len(two)


@pytest.mark.extended
def test_no_damaged_input_stumbles_for_half_a_minute() -> None:
    assert [(found.target, found.words) for found in findings(list(TARGETS), SECONDS, 0)] == []
