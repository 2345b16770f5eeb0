"""The options of `servoid track`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from servoid._native import TrackSettings
from servoid.cli.declared import command
from servoid.cli.source.options import (
    LIVE,
    LIVE_HELP,
    SOURCE_HELP,
    Baseline,
    Calibration,
    CameraOptions,
    Duration,
    Fov,
    Rate,
    Topic,
    Unit,
    World,
)
from servoid.cli.values import Method, check_count, check_seed, checked_by, slice_parser

_defaults = TrackSettings()

# Headings of the help.
_OBJECT = "Which object, and where it is at first"
_OUTPUT = "What to write"
_IMAGES = "Which images"
_SEARCH = "How to track"


def _check_budget(budget_ms: float | None) -> float | None:
    if budget_ms is not None and not 0.0 < budget_ms < float("inf"):
        raise typer.BadParameter(f"{budget_ms:g} is not a duration; give milliseconds above 0")
    return budget_ms


@dataclass(frozen=True, kw_only=True)
class TrackOrder(CameraOptions):
    """The options of `servoid track`; None leaves the choice to servoid."""

    source: Annotated[
        str, typer.Argument(metavar="SOURCE", help=f"{SOURCE_HELP}{LIVE_HELP}.", show_default=False)
    ]
    bodies: Annotated[
        list[str],
        typer.Option(
            "--body",
            metavar="[NAME=]FILE",
            help="The body to track, a .json file written by model; without one, the object is "
            "modelled from the first observation. May be given several times.",
            rich_help_panel=_OBJECT,
        ),
    ] = field(default_factory=list)
    targets: Annotated[
        list[str],
        typer.Option(
            "--target",
            metavar="[NAME=]TARGET",
            help="Where the object is in the first observation: mask:FILE, box:U0,V0,U1,V1, "
            "click:U,V, hue:LOW..HIGH or background:FILE, each with @VIEW at its end if not for "
            "the first view (default: the capture's masks). May be given several times.",
            rich_help_panel=_OBJECT,
        ),
    ] = field(default_factory=list)
    trust_targets: Annotated[
        bool,
        typer.Option(
            "--trust-targets",
            help="Use a target even if it may mean several objects; the summary then says so.",
            rich_help_panel=_OBJECT,
        ),
    ] = False
    trust_poses: Annotated[
        bool,
        typer.Option(
            "--trust-poses",
            help="Use the poses of a moving rig even if the images contradict them, because most "
            "of what its cameras see moves, as around a vehicle; the summary then says so.",
            rich_help_panel=_OBJECT,
        ),
    ] = False
    starts: Annotated[
        list[str],
        typer.Option(
            "--start",
            metavar="[NAME=]POSE",
            help="Pose of the body in the first observation: X,Y,Z,QW,QX,QY,QZ, or the word "
            "body for the pose in its file (default: where it fits the target or mask).",
            rich_help_panel=_OBJECT,
        ),
    ] = field(default_factory=list)
    fov: Fov = None
    baseline: Baseline = None
    calibration: Calibration = None
    rate: Rate = None
    duration: Duration = None
    record: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="Record the tracked images into a folder or an .mcap; tracking it gives the same "
            "poses.",
            rich_help_panel=LIVE,
        ),
    ] = None
    distance: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Initial distance of the object from the camera in metres, needed to model it "
            "with a single camera.",
            rich_help_panel=_OBJECT,
        ),
    ] = None
    out: Annotated[
        Path,
        typer.Option(
            metavar="FILE",
            help="The poses to write: .csv, or .tum or .txt for TUM text. Of several objects, "
            "each gets a file with _NAME before the ending.",
            rich_help_panel=_OUTPUT,
        ),
    ] = Path("poses.csv")
    video: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write an .mp4 with the objects drawn over the images.",
            rich_help_panel=_OUTPUT,
        ),
    ] = None
    mcap: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write an .mcap with ROS 2 messages: the images as they were recorded, poses, "
            "bodies and diagnostics.",
            rich_help_panel=_OUTPUT,
        ),
    ] = None
    save_body: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write the body as it evolved, a .json file; named like --out.",
            rich_help_panel=_OUTPUT,
        ),
    ] = None
    smooth: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Also write the smoothed poses, with all later corrections; a file like "
            "that of --out.",
            rich_help_panel=_OUTPUT,
        ),
    ] = None
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Write a page with the growth of the body, the sides that were seen, drift, and "
            "the result of each observation; of several objects, into DIR_NAME each.",
            rich_help_panel=_OUTPUT,
        ),
    ] = None
    observations: Annotated[
        slice | None,
        typer.Option(
            parser=slice_parser("--observations"),
            metavar="START:STOP:STEP",
            help="Track through these instants only, sliced as in Python (default: all).",
            show_default=False,
            rich_help_panel=_IMAGES,
        ),
    ] = None
    topics: Topic = field(default_factory=list)
    world: World = None
    unit: Unit = None
    every: Annotated[
        int,
        typer.Option(
            callback=check_count,
            metavar="N",
            help="Use every Nth of the instants (default 1).",
            show_default=False,
            rich_help_panel=_IMAGES,
        ),
    ] = 1
    method: Annotated[
        Method,
        typer.Option(
            help="How to track: region is servoid's own method; paper is the method of the paper "
            "that it starts from, as a baseline.",
            rich_help_panel=_SEARCH,
        ),
    ] = Method.region
    population: Annotated[
        int | None,
        typer.Option(
            callback=checked_by(TrackSettings, "population"),
            metavar="N",
            help=f"Hypotheses per generation (default {_defaults.population}).",
            rich_help_panel=_SEARCH,
        ),
    ] = None
    generations: Annotated[
        int | None,
        typer.Option(
            callback=checked_by(TrackSettings, "generations"),
            metavar="N",
            help="Generations per image; more follow where the pose is not confirmed (default "
            f"{_defaults.generations}).",
            rich_help_panel=_SEARCH,
        ),
    ] = None
    budget_ms: Annotated[
        float | None,
        typer.Option(
            callback=_check_budget,
            metavar="MS",
            help="After this time start no generation, nor a search for known sides; the "
            "estimates then depend on the machine.",
            rich_help_panel=_SEARCH,
        ),
    ] = None
    evolve: Annotated[
        bool | None,
        typer.Option(
            "--evolve/--no-evolve",
            help="Extend bodies as new sides appear, or keep them unchanged (default: a body "
            "modelled from the first observation grows, one from a file does not).",
            show_default=False,
            rich_help_panel=_SEARCH,
        ),
    ] = None
    adjust: Annotated[
        bool | None,
        typer.Option(
            "--adjust/--no-adjust",
            help="Adjust all keyframes jointly in a background thread "
            f"(default: {'yes' if _defaults.adjust else 'no'}).",
            show_default=False,
            rich_help_panel=_SEARCH,
        ),
    ] = None
    adjust_outlines: Annotated[
        bool | None,
        typer.Option(
            "--adjust-outlines/--no-adjust-outlines",
            help="Adjust the body of an object without print to the outlines of all its sides "
            "that two cameras see, and its poses with it, in a background thread; a step may wait "
            "for it, usually below 0.1 s, at times 0.3 s (default: a body that was modelled from "
            "the first observation and evolves is adjusted, one from a file is not).",
            show_default=False,
            rich_help_panel=_SEARCH,
        ),
    ] = None
    depth_from_motion: Annotated[
        bool | None,
        typer.Option(
            "--depth-from-motion/--no-depth-from-motion",
            help="Estimate from the start the depth of points that a single camera sees, by "
            "their motion; otherwise only where the body proves to be a bad guess. Leave it off "
            "for an object that hardly rotates "
            f"(default: {'yes' if _defaults.depth_from_motion else 'no'}).",
            show_default=False,
            rich_help_panel=_SEARCH,
        ),
    ] = None
    seed: Annotated[
        int | None,
        typer.Option(
            callback=check_seed,
            metavar="S",
            help=f"The same seed gives the same estimates (default {_defaults.seed}).",
            rich_help_panel=_SEARCH,
        ),
    ] = None


@command
def track(order: TrackOrder) -> None:
    """Track the 6-DoF pose of an object, through a recording or live.

    Try it: [bold]servoid sample out/moving --moving[/bold], then
    [bold]servoid track out/moving --video out/track.mp4[/bold].

    [bold]servoid track video --body body.json --out poses.csv[/bold]

    [bold]servoid track video --target box:120,80,420,400 --video out.mp4[/bold]

    [bold]servoid track film.mp4 --fov 65 --target box:240,160,400,320 --distance 0.4[/bold]

    [bold]servoid track 0 --fov 65 --body a.json --duration 60 --record run[/bold]
    """
    from servoid.cli.track.tracking import run_track

    run_track(order)
