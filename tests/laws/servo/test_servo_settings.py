from pathlib import Path
from typing import Annotated, get_args, get_origin, get_type_hints

import msgspec
import pytest
from msgspec import Meta
from msgspec.structs import replace

from servoid.errors import ServoError
from servoid.servo import JointLaw, ServoSettings, read_settings, settings_from, settings_toml
from servoid.servo.settings import GazeMode, SafetySettings


def decoded(text: str) -> ServoSettings:
    return settings_from(msgspec.toml.decode(text), "run.toml", text)


def test_printed_settings_read_back_equal() -> None:
    settings = ServoSettings()
    changed = replace(
        settings,
        joints=replace(settings.joints, law=JointLaw.PAPER, damping=1e-7),
        gaze=replace(settings.gaze, mode=GazeMode.PARALLEL, feed_forward=False),
        safety=replace(settings.safety, workspace_lower=(-0.1, -2.0, 1e-3)),
    )
    for one in (settings, changed):
        assert decoded(settings_toml(one)) == one


def test_printed_settings_can_stand_inside_another_file() -> None:
    text = 'world = "pa10"\n' + settings_toml(ServoSettings(), "servo")
    inner = msgspec.toml.decode(text)["servo"]
    assert settings_from(inner, "run.toml") == ServoSettings()


def test_every_setting_says_what_it_does() -> None:
    for stage in msgspec.structs.fields(ServoSettings):
        for name, kind in get_type_hints(stage.type, include_extras=True).items():
            assert get_origin(kind) is Annotated, name
            described = [part.description for part in get_args(kind) if isinstance(part, Meta)]
            assert len(described[0] or "") > 10, name
    lines = [line for line in settings_toml(ServoSettings()).splitlines() if " = " in line]
    assert all("  # " in line for line in lines)


def test_what_a_file_leaves_out_keeps_its_default(tmp_path: Path) -> None:
    file = tmp_path / "run.toml"
    file.write_text("[hand]\nposition_gain = 2\n")
    settings = read_settings(file)
    assert settings.hand.position_gain == 2.0
    assert replace(settings, hand=ServoSettings().hand) == ServoSettings()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[hand]\ngain = 1", r"run.toml, line 2, hand: unknown key 'gain'; known keys: position_g"),
        ("[target]\noddness = 9", r"unknown key 'oddness', which is now called 'nis_gate'; known"),
        ("[hand]\nposition_gain = 0", r"hand.position_gain: expected a number above 0"),
        ("[joints]\nspeed_share = 1.5", r"joints.speed_share: expected a number of 1 or less"),
        ("[joints]\nlaw = 'fast'", r"joints.law: invalid enum value 'fast'; choose one of qp, pap"),
        ("[gaze]\nmode = 'left'", r"gaze.mode: .* choose one of fixate, parallel"),
        ("[safety]\ncoast_s = nan", r"safety.coast_s: the number is not finite"),
        ("[safety]\nworkspace_lower = [0, 0]", r"safety.workspace_lower: .*3"),
        ("[safety]\nworkspace_lower = [2, 0, 0]", r"workspace_lower is 2 m in x .* below upper"),
        ("[look]\nnearest = 0.9", r"look.nearest is 0.9 m, look.farthest 0.8 m .* no greater than"),
        ("[look]\nnearest = 0.1", r"look.nearest is 0.1 m, .* greater than least_distance"),
        ("hand = 3", r"hand: expected a table, got a whole number"),
    ],
)
def test_a_wrong_setting_is_refused_with_its_place(text: str, message: str) -> None:
    with pytest.raises(ServoError, match=message):
        decoded(text)


def test_a_file_that_is_no_toml_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "run.toml"
    file.write_text("[hand\n")
    with pytest.raises(ServoError, match="is not valid TOML"):
        read_settings(file)
    with pytest.raises(ServoError, match="cannot read"):
        read_settings(tmp_path / "none.toml")


def test_settings_made_in_python_are_checked_as_well() -> None:
    with pytest.raises(ServoError, match="lower must be below upper"):
        ServoSettings(safety=SafetySettings(workspace_upper=(-2.0, 1.0, 1.0)))
