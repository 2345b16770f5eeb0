"""Each setting is declared once: help, Python and --print-config show the same default."""

import inspect
import re
import textwrap
from pathlib import Path
from typing import Any

import msgspec
import pytest
import typer.main

from conftest import Command
from servoid import model, track
from servoid._native import ModelSettings, TrackSettings
from servoid.cli import values
from servoid.cli.app import app
from servoid.cli.defaults import with_defaults
from servoid.cli.source.options import LIVE
from servoid.exchange.export import export_body
from servoid.exchange.export.surface import MOST_DETAIL
from servoid.sim import Scenario
from servoid.sim.samples.scene import SIZES_PX
from servoid.sim.trial import TrialSettings
from servoid.source import ASSUMED_HZ
from servoid_experiments.running import STUDIES, study_named

COMMANDS: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
DEFAULT = re.compile(r"\(default:? ([^()]*)\)")
WRITTEN = re.compile(r"[\d.,-]*\d|yes|no")

# The options of `servoid servo` by the settings that each sets, with a value beside its default.
SERVO = {
    "--world": ("arm.xml", ["world.arm.name"]),
    "--object": ("drill", ["world.object.name"]),
    "--path": ("circle:0.1@10s", ["world.object.path"]),
    "--background": ("plain", ["world.background"]),
    "--ideal": (None, ["world.ideal"]),
    "--target": ("click", ["run.target"]),
    "--trust-target": (None, ["run.trust_target"]),
    "--trust-calibration": (None, ["run.trust_calibration"]),
    "--seconds": ("7.5", ["run.seconds"]),
    "--looks": ("3", ["servo.look.count"]),
    "--goal": ("0,-0.1,0.6", ["run.goal"]),
    "--start-offset": ("0.1,0,0", ["run.start_offset"]),
    "--start-turn": ("0,5,0", ["run.start_turn_deg"]),
    "--no-feed-forward": (None, ["servo.hand.feed_forward"]),
    "--law": ("paper", ["servo.joints.law"]),
    "--method": ("paper", ["track.method"]),
    "--seed": ("3", ["world.seed", "track.seed"]),
}  # fmt: skip
WORDS = {"world.ideal": "a laboratory", "servo.hand.feed_forward": "add it"}


def shown(command: str) -> dict[str, str]:
    """Return the default in the help of each option that has one there."""
    texts = {
        name: with_defaults(option.help or "")
        for option in COMMANDS[command].params
        if option.param_type_name == "option"
        for name in option.opts + option.secondary_opts
    }
    found = {name: DEFAULT.search(text) for name, text in texts.items()}
    return {name: one[1] for name, one in found.items() if one}


def flat(tables: dict[str, Any], above: str = "") -> dict[str, Any]:
    """Return settings by their dotted names."""
    found: dict[str, Any] = {}
    for name, value in tables.items():
        inner = isinstance(value, dict)
        found |= flat(value, f"{above}{name}.") if inner else {f"{above}{name}": value}
    return found


def printed(command: Command, *options: str) -> dict[str, Any]:
    return flat(msgspec.toml.decode(command("servo", *options, "--print-config").out))


def declared() -> dict[str, Any]:
    everything = flat(msgspec.to_builtins(TrialSettings()))
    return {name: value for name, value in everything.items() if value is not None}


def written(name: str, value: Any) -> str:
    """Return a default as the help writes it."""
    if isinstance(value, bool):
        return WORDS[name]
    if isinstance(value, (tuple, list)):
        return ",".join(f"{number:g}" for number in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def test_what_servo_prints_is_what_its_settings_declare(servoid_command: Command) -> None:
    found = {name: tuple(one) if isinstance(one, list) else one
             for name, one in printed(servoid_command).items()}  # fmt: skip
    assert found == declared()


@pytest.mark.parametrize("option", SERVO)
def test_an_option_of_servo_sets_its_setting_and_shows_the_default(
    option: str, servoid_command: Command
) -> None:
    value, names = SERVO[option]
    before = printed(servoid_command)
    after = printed(servoid_command, option, *([] if value is None else [value]))
    changed = {name for name in after if name not in before or before[name] != after[name]}
    assert changed == set(names)
    if not option.startswith("--trust"):
        assert shown("servo")[option] == written(names[0], declared()[names[0]])


@pytest.mark.parametrize("option", ["--trust-target", "--trust-targets"])
def test_servo_trusts_its_target_by_the_words_of_model_and_track_too(
    option: str, servoid_command: Command
) -> None:
    assert printed(servoid_command, option)["run.trust_target"] is True


def test_every_option_of_servo_that_is_a_setting_is_held_here() -> None:
    others = {"--out", "--video", "--mcap", "--config", "--print-config", "--paper"}
    names = {one.opts[0] for one in COMMANDS["servo"].params if not one.hidden}
    assert names - others == {one.replace("--no-", "--") for one in SERVO}


@pytest.mark.parametrize("name", STUDIES)
def test_what_a_study_prints_is_what_its_settings_declare(
    name: str, servoid_command: Command
) -> None:
    printed = servoid_command("study", name, "--print-config").out
    settings = study_named(name).settings
    assert msgspec.toml.decode(printed, type=settings) == settings()


def test_model_track_sample_and_export_show_the_defaults_of_python() -> None:
    core, tracker = ModelSettings(), TrackSettings()
    numbers = {
        "model": {
            "--max-ellipsoids": f"chosen by held-out views; "
            f"{core.max_ellipsoids} if --delta is given",
            "--delta": f"{core.delta:g}",
            "--seed": str(core.seed),
            "--rate": f"{ASSUMED_HZ:g}",
        },
        "track": {
            "--population": str(tracker.population),
            "--generations": str(tracker.generations),
            "--adjust": "yes" if tracker.adjust else "no",
            "--depth-from-motion": "yes" if tracker.depth_from_motion else "no",
            "--seed": str(tracker.seed),
            "--every": str(track.Request().every),
            "--rate": f"{ASSUMED_HZ:g}",
        },
        "sample": {
            "--count": f"{Scenario().count}, or the whole turn",
            "--size": Scenario().size,
        },
        "export": {
            name: written(name, inspect.signature(export_body).parameters[argument].default)
            for name, argument in (("--frame", "frame"), ("--detail", "detail"))
        } | {"--density": "water's, 1000"},
    }  # fmt: skip
    for command, expected in numbers.items():
        found = shown(command)
        assert {name: found[name] for name in expected} == expected
        # No other default with a number stands in a help text, where it could grow old.
        more = {name for name, text in found.items() if WRITTEN.fullmatch(text)} - set(expected)
        assert {name for name in more if not name.startswith("--no-")} == set()
    assert "{export.density_kg_m3}" in next(
        one.help for one in COMMANDS["export"].params if one.name == "density"
    )


def test_what_is_not_given_is_left_to_what_declares_it() -> None:
    tracking = {
        one.name: one.default for one in COMMANDS["track"].params if one.name in vars(track.Request)
    }
    assert tracking.pop("method").value == track.Request().method.value
    assert tracking == {name: getattr(track.Request(), name) for name in tracking}
    core = {"seed", "population", "generations", "adjust", "adjust_outlines", "depth_from_motion"}
    assert {name: tracking[name] for name in core} == dict.fromkeys(core)
    fit = inspect.signature(model.fit).parameters
    options = {one.name: one.default for one in COMMANDS["model"].params}
    for name in ("max_ellipsoids", "delta", "seed", "threads"):
        assert fit[name].default is None and options[name] is None, name
    assert all(one.default is None for one in COMMANDS["export"].params if not one.required)


def test_words_and_ranges_of_options_are_those_of_python(servoid_command: Command) -> None:
    assert {one.value for one in values.Method} == {one.value for one in track.Method}
    assert {one.value for one in values.Size} == set(SIZES_PX)
    detail = next(one for one in COMMANDS["export"].params if one.name == "detail")
    assert f"N from 0 to {MOST_DETAIL}" in detail.help
    for options, message in (
        (("model", "x", "--out", "y.json", "--max-ellipsoids", "0"), "must be 1 to 64"),
        (("track", "x", "--population", "0"), "must be 8 to 4096"),
        (("track", "x", "--generations", str(2**33)), "must be 1 to 1000"),
        (
            ("track", "x", "--generations", "-1"),
            "must be a whole number, 0 or more, but -1 was given",
        ),
    ):
        outcome = servoid_command(*options)
        assert outcome.code == 2
        assert message in " ".join(outcome.err.replace("│", "").split())


def test_the_page_on_counts_has_the_greatest_count_of_python() -> None:
    page = Path(__file__).parents[3] / "docs" / "howto" / "count.md"
    said = f"the largest count, {ModelSettings().max_ellipsoids} if only `--delta` is given"
    assert said in page.read_text(encoding="utf-8")


def test_what_ends_a_live_recording_stands_together() -> None:
    panels = {
        one.name: one.rich_help_panel
        for one in COMMANDS["record"].params
        if one.name in ("count", "duration")
    }
    assert panels == dict.fromkeys(("count", "duration"), LIVE)


@pytest.mark.parametrize("command", [name for name in COMMANDS if not COMMANDS[name].hidden])
def test_no_help_page_cuts_an_option_at_80_columns(command: str, servoid_command: Command) -> None:
    page = servoid_command(command, "--help").out
    assert "…" not in page
    switches = set(re.findall(r"--\[no-\]([\w-]+)", page))
    names = set(re.findall(r"(?<![\w-])--[\w-]+", page))
    names |= {f"--{name}" for name in switches} | {f"--no-{name}" for name in switches}
    options = [
        one
        for one in COMMANDS[command].params
        if one.param_type_name == "option" and not one.hidden
    ]
    given = {name for one in options for name in (*one.opts, *one.secondary_opts)}
    assert {name for name in given if name.startswith("--")} - names == set()


@pytest.mark.parametrize("command", [[], *([name] for name in COMMANDS if name != "servoid")])
def test_a_flag_has_no_type_on_a_help_page(command: list[str], servoid_command: Command) -> None:
    page = servoid_command(*command, "--help").out
    assert "Show this message and exit." in page
    assert re.search("bool", page, re.IGNORECASE) is None


@pytest.mark.parametrize("command", [name for name in COMMANDS if not COMMANDS[name].hidden])
def test_a_help_page_ends_no_line_before_the_terminal_does(
    command: str, servoid_command: Command
) -> None:
    page = servoid_command(command, "--help").out
    lines = [line.strip() for line in page.splitlines()]
    for paragraph in re.sub(r"\[/?\w+\]", "", COMMANDS[command].help).split("\n\n"):
        for line in textwrap.wrap(paragraph, 78, break_on_hyphens=False):
            assert line in lines
