"""The options of `servoid servo`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from servoid.cli.declared import Sets, command, given_settings, setting_options
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
    world: Annotated[
        str | None,
        Sets("world.arm.name"),
        typer.Option(
            metavar="ARM",
            help="The arm: pa10, or an MJCF or URDF file (default {servo.world.arm.name}).",
            rich_help_panel=_WORLD,
        ),
    ] = None
    object_name: Annotated[
        str | None,
        Sets("world.object.name"),
        typer.Option(
            "--object",
            metavar="NAME",
            help="The object: bottle, drill, mug, painted_ellipsoid, ellipsoid, two_ellipsoids, "
            "plain_bottle or plain_mug (default {servo.world.object.name}).",
            rich_help_panel=_WORLD,
        ),
    ] = None
    path: Annotated[
        str | None,
        Sets("world.object.path"),
        typer.Option(
            metavar="PATH",
            help="The object's motion: still, line:0.2@5s, circle:0.1@10s, sine:0.15@10s, random:7 "
            "or recorded:FILE (default {servo.world.object.path}).",
            rich_help_panel=_WORLD,
        ),
    ] = None
    background: Annotated[
        str | None,
        Sets("world.background"),
        typer.Option(
            metavar="NAME",
            help="The background: cluttered or plain (default {servo.world.background}).",
            rich_help_panel=_WORLD,
        ),
    ] = None
    ideal: Annotated[
        bool | None,
        Sets("world.ideal"),
        typer.Option(
            "--ideal/--laboratory",
            help="A world without errors, or with those of a decent laboratory: of calibration, "
            "sensors, time stamps, joints, and of the person who marks the object (default: "
            "{servo.world.ideal:no error|a laboratory}).",
            show_default=False,
            rich_help_panel=_WORLD,
        ),
    ] = None
    target: Annotated[
        str | None,
        Sets("run.target"),
        typer.Option(
            metavar="TARGET",
            help="How the object is marked in the first left image: hand, box or click, with a "
            "person's error; or mask:FILE, box:U0,V0,U1,V1, click:U,V or hue:LOW..HIGH, as for "
            "servoid track (default {servo.run.target}).",
            rich_help_panel=_RUN,
        ),
    ] = None
    trust_target: Annotated[
        bool | None,
        Sets("run.trust_target"),
        typer.Option(
            "--trust-target",
            help="Use a target even if it may mean several objects.",
            show_default=False,
            rich_help_panel=_RUN,
        ),
    ] = None
    seconds: Annotated[
        float | None,
        Sets("run.seconds"),
        typer.Option(
            metavar="S",
            help="Duration of servoing (default {servo.run.seconds}).",
            rich_help_panel=_RUN,
        ),
    ] = None
    looks: Annotated[
        int | None,
        Sets("servo.look.count"),
        typer.Option(
            metavar="N",
            help="Viewpoints from which the hand looks at the object before it is modelled; with 1 "
            "the hand stays where it is (default {servo.servo.look.count}).",
            rich_help_panel=_RUN,
        ),
    ] = None
    goal: Annotated[
        Triple | None,
        Sets("run.goal"),
        typer.Option(
            parser=triple_parser("--goal"),
            metavar="X,Y,Z",
            help="Desired position of the object's centre in the hand's frame, z forward, in "
            "metres (default {servo.run.goal}).",
            rich_help_panel=_RUN,
        ),
    ] = None
    start_offset: Annotated[
        Triple | None,
        Sets("run.start_offset"),
        typer.Option(
            parser=triple_parser("--start-offset"),
            metavar="X,Y,Z",
            help="Initial offset of the hand from its goal, in metres (default "
            "{servo.run.start_offset}).",
            rich_help_panel=_RUN,
        ),
    ] = None
    start_turn: Annotated[
        Triple | None,
        Sets("run.start_turn_deg"),
        typer.Option(
            parser=triple_parser("--start-turn"),
            metavar="X,Y,Z",
            help="Its initial rotation from the goal: a rotation vector in degrees (default "
            "{servo.run.start_turn_deg}).",
            rich_help_panel=_RUN,
        ),
    ] = None
    feed_forward: Annotated[
        bool | None,
        Sets("servo.hand.feed_forward"),
        typer.Option(
            "--feed-forward/--no-feed-forward",
            help="Add the object's estimated velocity, or let the hand lag (default: "
            "{servo.servo.hand.feed_forward:add it|let it lag}).",
            show_default=False,
            rich_help_panel=_RUN,
        ),
    ] = None
    law: Annotated[
        str | None,
        Sets("servo.joints.law"),
        typer.Option(
            metavar="qp|paper",
            help="How a hand velocity becomes joint speeds: by a QP within all limits, or by the "
            "paper's pseudo-inverse (default {servo.servo.joints.law}).",
            rich_help_panel=_RUN,
        ),
    ] = None
    method: Annotated[
        Method | None,
        Sets("track.method"),
        typer.Option(help="How to track (default {servo.track.method}).", rich_help_panel=_RUN),
    ] = None
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
        Sets("world.seed", "track.seed"),
        typer.Option(
            callback=check_seed,
            metavar="S",
            help="Seed of the clutter, the noise, the laboratory and the searches (default "
            "{servo.world.seed}).",
            rich_help_panel=_RUN,
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
