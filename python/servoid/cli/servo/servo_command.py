"""The options of `servoid servo`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from servoid.cli.declared import Setting, command, given_settings, setting_options
from servoid.cli.values import Method, Triple, check_seed, triple_parser

_WORLD = "The world"
_RUN = "What to do"
_OUTPUT = "What to write"


@dataclass(frozen=True, kw_only=True)
class ServoOptions:
    """The options of `servoid servo`; None leaves a setting as it is."""

    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="The folder for log, video, plots and report; it is made if missing.",
            rich_help_panel=_OUTPUT,
        ),
    ] = None
    video: Annotated[
        bool,
        typer.Option(
            "--video/--no-video",
            help="Write a video of the cameras' images and of the scene.",
            rich_help_panel=_OUTPUT,
        ),
    ] = True
    mcap: Annotated[
        bool,
        typer.Option(
            "--mcap",
            help="Write run.mcap with ROS 2 messages: images, joints, poses, the body.",
            rich_help_panel=_OUTPUT,
        ),
    ] = False
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Settings in TOML, as --print-config prints them; options override them.",
            rich_help_panel=_RUN,
        ),
    ] = None
    print_config: Annotated[
        bool,
        typer.Option(
            "--print-config",
            help="Print every setting as commented TOML, and exit.",
            rich_help_panel=_RUN,
        ),
    ] = False
    world: Annotated[str | None, Setting("world.arm.name", metavar="ARM", panel=_WORLD)] = None
    object_name: Annotated[
        str | None, Setting("world.object.name", name="--object", metavar="NAME", panel=_WORLD)
    ] = None
    path: Annotated[str | None, Setting("world.object.path", metavar="PATH", panel=_WORLD)] = None
    background: Annotated[str | None, Setting("world.background", metavar="NAME", panel=_WORLD)] = (
        None
    )
    ideal: Annotated[
        bool | None,
        Setting(
            "world.ideal",
            name="--ideal/--laboratory",
            panel=_WORLD,
            help="A world without errors, or with those of a decent laboratory: of "
            "calibration, sensors, time stamps, joints, and of the person who marks the "
            "object (default: {servo.world.ideal:no error|a laboratory}).",
        ),
    ] = None
    target: Annotated[str | None, Setting("run.target", metavar="TARGET", panel=_RUN)] = None
    trust_targets: Annotated[  # as `model` and `track` spell it
        bool | None, Setting("run.trust_target", name="--trust-targets", panel=_RUN, hidden=True)
    ] = None
    trust_target: Annotated[
        bool | None, Setting("run.trust_target", name="--trust-target", panel=_RUN)
    ] = None
    trust_calibration: Annotated[
        bool | None,
        Setting("run.trust_calibration", name="--trust-calibration", panel=_RUN),
    ] = None
    seconds: Annotated[float | None, Setting("run.seconds", metavar="S", panel=_RUN)] = None
    looks: Annotated[int | None, Setting("servo.look.count", metavar="N", panel=_RUN)] = None
    goal: Annotated[
        Triple | None,
        Setting("run.goal", metavar="X,Y,Z", panel=_RUN, parser=triple_parser("--goal")),
    ] = None
    start_offset: Annotated[
        Triple | None,
        Setting(
            "run.start_offset", metavar="X,Y,Z", panel=_RUN, parser=triple_parser("--start-offset")
        ),
    ] = None
    start_turn: Annotated[
        Triple | None,
        Setting(
            "run.start_turn_deg", metavar="X,Y,Z", panel=_RUN, parser=triple_parser("--start-turn")
        ),
    ] = None
    feed_forward: Annotated[
        bool | None,
        Setting(
            "servo.hand.feed_forward",
            name="--feed-forward/--no-feed-forward",
            panel=_RUN,
            help="Add the object's estimated velocity, or let the hand lag (default: "
            "{servo.servo.hand.feed_forward:add it|let it lag}).",
        ),
    ] = None
    law: Annotated[str | None, Setting("servo.joints.law", metavar="qp|paper", panel=_RUN)] = None
    method: Annotated[Method | None, Setting("track.method", panel=_RUN)] = None
    paper: Annotated[
        bool,
        typer.Option(
            "--paper",
            help="The paper's servoing as a whole: its tracking method, its joint law, no "
            "filter, no prediction, no feed-forward. Other options override it.",
            rich_help_panel=_RUN,
        ),
    ] = False
    seed: Annotated[
        int | None,
        Setting(
            "world.seed",
            "track.seed",
            metavar="S",
            panel=_RUN,
            callback=check_seed,
            help="Seed of the clutter, the noise, the laboratory and the searches (default "
            "{servo.world.seed}).",
        ),
    ] = None


@command
def servo(options: ServoOptions) -> None:
    """Let a simulated arm model an object that it has never seen, and follow it.

    [bold]servoid servo --object bottle --path sine:0.15@10s --seconds 20 --out out/run[/bold]

    [bold]servoid servo --print-config > run.toml[/bold]

    [bold]servoid servo --config run.toml --object drill --path random:3 --out out/run[/bold]
    """
    from servoid.cli.extras import check_extras
    from servoid.cli.servo.servo_order import EXTRAS, Order, paper_values, print_settings

    order = Order(
        out=options.out,
        video=options.video,
        mcap=options.mcap,
        config=options.config,
        values=(paper_values() if options.paper else {}) | given_settings(options),
        names=setting_options(ServoOptions),
    )
    if options.print_config:
        print_settings(order)
    else:
        check_extras("servoid servo", EXTRAS | ({"rosbags": "bags"} if options.mcap else {}))
        from servoid.cli.servo.servoing import run_servo

        run_servo(order)
