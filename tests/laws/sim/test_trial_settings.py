from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
import pytest
from msgspec import Meta
from msgspec.structs import replace

from servoid.errors import CaptureError, ServoError, SimError
from servoid.servo import JointLaw, LookSettings, ServoSettings
from servoid.servo.settings import HandSettings, JointSettings
from servoid.sim.trial import (
    RunSettings,
    TrackingSettings,
    TrialSettings,
    changed,
    read_trial_settings,
    trial_toml,
)
from servoid.sim.world import (
    ArmSettings,
    CameraSettings,
    DropImages,
    FreezeCamera,
    LightSettings,
    ObjectSettings,
    Occlude,
    Teleport,
    WorldSettings,
)
from servoid.source import LiveSettings
from servoid.track import Method

CHANGED = TrialSettings(
    run=RunSettings(seconds=1e-3, goal=(0.0, -1e-9, 0.5), start_turn_deg=(0.0, 20.0, 1.0 / 3.0)),
    world=WorldSettings(
        arm=ArmSettings(name='a "b" \\ ü.xml', start=(0.1,) * 7, turning_eyes=False),
        object=ObjectSettings(name="mug", path="random:7:0.05@6s"),
        cameras=CameraSettings(size_px=(320, 240), focal_px=300.5, distortion=(0.1, -0.05)),
        light=LightSettings(step_at_s=2.0),
        faults=(
            DropImages(at_s=1.0, seconds=0.25),
            FreezeCamera(at_s=2.0, seconds=1.0, camera=1),
            Occlude(at_s=4.0, seconds=2.0, half_size=(0.1, 0.2)),
            Teleport(at_s=7.0, by=(0.0, 0.1, -0.2), turn=(0.3, 0.0, 0.0)),
        ),
        seed=7,
        threads=2,
    ),
    track=TrackingSettings(method=Method.PAPER, seed=3, population=40),
    servo=ServoSettings(
        look=LookSettings(count=1),
        hand=HandSettings(feed_forward=False),
        joints=JointSettings(law=JointLaw.PAPER),
    ),
)


def read_back(text: str, folder: Path) -> TrialSettings:
    file = folder / "run.toml"
    file.write_text(text)
    return read_trial_settings(file)


def structs_in(kind: Any) -> list[type[msgspec.Struct]]:
    """List all settings inside settings, whatever holds them."""
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        inner = get_type_hints(kind, include_extras=True).values()
        return [kind, *(found for one in inner for found in structs_in(one))]
    return [found for one in get_args(kind) for found in structs_in(one)]


@pytest.mark.parametrize("settings", [TrialSettings(), CHANGED], ids=["defaults", "changed"])
def test_printed_settings_read_back_equal(settings: TrialSettings, tmp_path: Path) -> None:
    assert read_back(trial_toml(settings), tmp_path) == settings


def test_every_value_of_the_changed_settings_is_told_apart_from_its_default() -> None:
    for stage in ("run", "world", "track", "servo"):
        assert getattr(CHANGED, stage) != getattr(TrialSettings(), stage)


def test_what_a_file_leaves_out_keeps_its_default(tmp_path: Path) -> None:
    settings = read_back('[world.object]\nname = "drill"\n', tmp_path)
    world = replace(settings.world, object=ObjectSettings())
    assert settings.world.object.name == "drill"
    assert replace(settings, world=world) == TrialSettings()


def test_faults_can_be_written_as_tables(tmp_path: Path) -> None:
    text = '[[world.faults]]\ntype = "teleport"\nat_s = 2\n[[world.faults]]\n'
    text += 'type = "drop"\nat_s = 3\nseconds = 1\ncamera = 0\n'
    assert read_back(text, tmp_path).world.faults == (
        Teleport(at_s=2.0),
        DropImages(at_s=3.0, seconds=1.0, camera=0),
    )


def test_every_setting_says_what_it_does() -> None:
    settings = {one for one in structs_in(TrialSettings) if one is not TrialSettings}
    assert {RunSettings, ArmSettings, Occlude, LookSettings} <= settings
    for one in settings:
        for name, kind in get_type_hints(one, include_extras=True).items():
            if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
                continue
            assert get_origin(kind) is Annotated, f"{one.__name__}.{name}"
            descriptions = [
                part.description
                for part in get_args(kind)[1:]
                if isinstance(part, Meta) and part.description
            ]
            assert len("".join(descriptions)) > 8, f"{one.__name__}.{name}"
    lines = [line for line in trial_toml().splitlines() if " = " in line]
    assert len(lines) > 80
    assert all("  # " in line for line in lines)


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("[world]\nmask_px = 2", "; 'mask_px' belongs in [world.lab]"),
        ("mask_px = 2", "; 'mask_px' belongs in [world.lab]"),
        ("[lab]\nmask_px = 2", "; 'lab' belongs in [world]"),
        ("[run]\nworld = 2", "; 'world' belongs above the first table"),
        ("[world]\nat_s = 2", "; 'at_s' belongs in [[world.faults]]"),
        ("[servo]\nlaw = 'qp'", "; 'law' belongs in [servo.joints]"),
        ("[servo]\nseed = 1", "; known keys: look, target, hand, joints, gaze, safety"),
        ("[run]\nsecond = 1", "; did you mean 'seconds'?"),
        (
            "[[world.faults]]\ntype = 'drop'\nat_s = 1\nseconds = 1\nhalf_size = 1",
            "; known keys: type, at_s, seconds, camera",
        ),
    ],
)
def test_a_key_in_the_wrong_table_is_told_where_it_belongs_if_one_table_alone_has_it(
    text: str, end: str, tmp_path: Path
) -> None:
    with pytest.raises(ServoError) as caught:
        read_back(text, tmp_path)
    assert "unknown key" in str(caught.value)
    assert str(caught.value).endswith(end)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[run]\nsecs = 3", r"run.toml, line 2, run: unknown key 'secs'; known keys: seconds, go"),
        ("[motion]\na = 1", r"run.toml: unknown key 'motion'; known keys: run, world, track, ser"),
        ("[world.lamp]\na = 1", r"world: unknown key 'lamp'; known keys: arm, object, cameras"),
        ("[run]\nseconds = 0", r"run.seconds: expected a number above 0, got 0"),
        ("[run]\nseconds = 'long'", r"run.seconds: expected a number, got a text"),
        ("[run]\nsettle_s = nan", r"run.settle_s: the number is not finite"),
        ("[run]\ngoal = [1, 2]", r"run.goal: expected a list of length 3, got 2"),
        ("[track]\nmethod = 'x'", r"track.method: .* 'x'; choose one of region, paper"),
        ("[track]\nmethod = 'paper'\ngenerations = 2", r"generations is 2, but the paper's method"),
        ("[track]\nmethod = 'paper'\nsurface = true", "surface was given, but the paper's method"),
        ("[track]\nseed = -1", r"track.seed: expected a whole number of 0 or more, got -1"),
        (
            "[servo.look]\ncount = 0",
            r"servo.look.count: expected a whole number of 1 or more, got 0",
        ),
        ("[servo.joints]\nlaw = 'x'", r"servo.joints.law: .* 'x'; choose one of qp, paper"),
        ("[world]\nfaults = 3", r"world.faults: expected a list, got a whole number"),
        ("[[world.faults]]\nat_s = 1", r"faults\[0\]: the key 'type' is missing; .* drop, freeze"),
        ("[[world.faults]]\ntype = 'x'", r"faults\[0\]: type is 'x'; choose one of drop, freeze"),
        (
            "[[world.faults]]\ntype = 'drop'\nat_s = 1\nseconds = 1\ncamera = 2",
            r"world.faults\[0\].camera: expected a whole number of 1 or less, got 2",
        ),
        (
            "[[world.faults]]\ntype = 'teleport'\nat_s = 1\nseconds = 1",
            r"world.faults\[0\]: unknown key 'seconds'; known keys: type, at_s, by, turn",
        ),
        ("run = 3", r"run: expected a table, got a whole number"),
        ("[run", r"is not valid TOML"),
    ],
)
def test_a_setting_that_cannot_be_is_refused_with_what_is_allowed(
    text: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(ServoError, match=message):
        read_back(text, tmp_path)


def bounds_of(kind: Any) -> Meta | None:
    """Return what bounds the numbers that a field holds, if it holds one alone."""
    metas = [part for part in get_args(kind)[1:] if isinstance(part, Meta)]
    found = [one for one in metas if any(b is not None for b in (one.gt, one.ge, one.lt, one.le))]
    if found:
        return found[0]
    inner = [bounds_of(one) for one in get_args(kind) if get_origin(one) is Annotated]
    return next((one for one in inner if one is not None), None)


def beyond(bounds: Meta) -> list[int]:
    """Return numbers outside of bounds."""
    lowest = bounds.gt if bounds.gt is not None else bounds.ge
    highest = bounds.lt if bounds.lt is not None else bounds.le
    below = [] if lowest is None else [int(lowest) - 1]
    return below + ([] if highest is None else [int(highest) + 1])


NEEDED = {"at_s": 1.0, "seconds": 1.0}


def test_settings_made_in_python_are_held_to_their_bounds() -> None:
    tried = 0
    for one in dict.fromkeys([*structs_in(TrialSettings), LiveSettings]):
        needed = {f.name: NEEDED[f.name] for f in msgspec.structs.fields(one) if f.required}
        for name, kind in get_type_hints(one, include_extras=True).items():
            bounds = bounds_of(kind)
            for wrong in [] if bounds is None else [*beyond(bounds), np.nan, None, "much"]:
                if wrong is None and type(None) in get_args(get_args(kind)[0]):
                    continue
                with pytest.raises((ServoError, SimError, CaptureError), match=rf"\.{name}"):
                    one(**needed | {name: wrong})
                tried += 1
    assert tried > 200


def test_settings_made_in_python_are_what_a_file_would_make_them() -> None:
    assert type(RunSettings(seconds=3).seconds) is float
    assert JointSettings(law="paper") == JointSettings(law=JointLaw.PAPER)  # pyright: ignore
    assert type(RunSettings(seconds=np.float64(2.5)).seconds) is float
    goal = RunSettings(goal=np.array([0.0, 1.0, 2.0])).goal  # pyright: ignore
    assert goal == (0.0, 1.0, 2.0) and type(goal[0]) is float


def test_an_object_is_wanted_where_it_is_met() -> None:
    assert ObjectSettings().hand_from_object[4:] == RunSettings().goal


def test_a_file_that_is_missing_or_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ServoError, match=r"cannot read .*none.toml"):
        read_trial_settings(tmp_path / "none.toml")
    (tmp_path / "image.toml").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(ServoError, match=r"image.toml: the file is not UTF-8 text"):
        read_trial_settings(tmp_path / "image.toml")


def test_dotted_names_change_single_settings() -> None:
    new = changed(CHANGED, {"world.object.name": "bottle", "run.seconds": 4}, "the options")
    assert (new.world.object.name, new.run.seconds) == ("bottle", 4.0)
    world = replace(new.world, object=CHANGED.world.object)
    assert replace(new, world=world, run=CHANGED.run) == CHANGED
    assert changed(CHANGED, {}, "the options") == CHANGED


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"run.seconds": -2.0}, r"the options, run.seconds: expected a number above 0, got -2"),
        ({"run.secs": 2.0}, r"the options, run: unknown key 'secs'; known keys: seconds"),
        ({"motion.a": 2.0}, r"the options: unknown key 'motion'; known keys: run, world"),
        ({"run.seconds.a": 2.0}, r"the options, run.seconds: expected a number, got a table"),
        ({"run.start_turn_deg": [0.0, 400.0, 0.0]}, r"a rotation by 400 degrees; give at most 180"),
        ({"run.seconds": None}, r"the options, run.seconds: expected a number, got nothing"),
    ],
)
def test_a_changed_setting_that_cannot_be_is_refused(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ServoError, match=message):
        changed(TrialSettings(), values, "the options")


def test_only_options_that_are_set_go_to_the_tracker() -> None:
    assert TrialSettings().track.options() == {}
    plain = changed(TrialSettings(), {"track.surface": False, "track.seed": 0}, "the test")
    assert plain.track.options() == {"surface": False, "seed": 0}


@pytest.mark.parametrize(
    ("table", "line", "most"),
    [("world.cameras", "noise = 400.0", "255"), ("run", "max_ellipsoids = 500", "64")],
)
def test_a_value_above_its_limit_is_refused_with_its_file_and_key(
    tmp_path: Path, table: str, line: str, most: str
) -> None:
    path = tmp_path / "run.toml"
    path.write_text(f"[{table}]\n{line}\n")
    key = line.partition(" ")[0]
    with pytest.raises((ServoError, SimError), match=rf"run\.toml, {table}\.{key}: .* {most} or"):
        read_trial_settings(path)
