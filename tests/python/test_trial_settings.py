from pathlib import Path

import pytest
from msgspec.structs import replace

from servoid.errors import ServoError
from servoid.sim.world import WorldSettings
from servoid.sim.world.faults import DropImages, Occlude, Teleport
from servoid.study import TrialSettings, changed, read_trial_settings, trial_toml

FAULTS = (
    Occlude(at_s=4.0, seconds=1.5, distance=0.1),
    DropImages(at_s=1.0, seconds=0.5, camera=1),
    Teleport(at_s=3.0),
)


def read(folder: Path, text: str) -> TrialSettings:
    path = folder / "run.toml"
    path.write_text(text)
    return read_trial_settings(path)


def test_the_settings_of_a_run_read_back_equal_with_their_faults(tmp_path: Path) -> None:
    settings = replace(TrialSettings(), world=WorldSettings(faults=FAULTS, seed=3))
    assert read(tmp_path, trial_toml(settings)) == settings
    assert changed(settings, {"run.seconds": 7.0}, "options").world == settings.world


def test_a_fault_may_stand_in_a_table_of_its_own(tmp_path: Path) -> None:
    text = '[[world.faults]]\ntype = "occlude"\nat_s = 4.0\nseconds = 1.5\ndistance = 0.1\n'
    assert read(tmp_path, text).world.faults == FAULTS[:1]


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        ('type = "oclude"\nat_s = 4.0', r"unknown type 'oclude'; choose one of drop, freeze,"),
        ("type = [1]\nat_s = 4.0", r"unknown type \[1\]; choose one of drop, freeze,"),
        ("at_s = 4.0\nseconds = 1.5", r"the key 'type' is missing; choose one of drop, freeze,"),
        ('type = "occlude"\nat = 4.0', r"unknown key 'at'; known keys: type, at_s, seconds,"),
        ('type = "occlude"\nat_s = -1.0\nseconds = 1.0', r"faults\[0\].at_s: expected .* >= 0"),
    ],
)
def test_a_wrong_fault_is_refused_with_its_place(tmp_path: Path, fault: str, says: str) -> None:
    with pytest.raises(ServoError, match=says):
        read(tmp_path, f"[[world.faults]]\n{fault}\n")
