"""`servoid demo`: models, tracks and servos to rendered objects by ordinary commands."""

import shlex
import textwrap
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import typer

from servoid.cli.interrupting import INTERRUPTED, InterruptedCommand
from servoid.cli.servo.servo_order import EXTRAS as SERVO_EXTRAS
from servoid.output import check_folder, make_folder
from servoid.record import read_trajectory
from servoid.sim import Scenario, median_add_m, outer_mesh, snail
from servoid.words import are

_REPORT_EXTRAS = {"matplotlib": "view"}
_TRACKED = 2  # the number of the part with known ground truth
_MM_PER_M = 1e3
_WIDTH = 79  # columns
_SCENARIO = Scenario(count=45, size="small", occluder=True)


@dataclass(frozen=True)
class Part:
    """One part of the demo: a heading, commands, the libraries they need, and their results.

    `extras` names the extra that installs each library; without them the part is left out.
    """

    heading: str
    commands: tuple[tuple[str, ...], ...]
    shown: Mapping[str, str]
    extras: Mapping[str, str]


def run_demo(out: Path) -> None:
    """Run all parts that can run here, then list the results and the parts that were left out."""
    check_folder(out, parents=True)
    make_folder(out, parents=True)
    begun = time.perf_counter()
    shown: dict[str, str] = {}
    left_out: list[str] = []
    for number, part in enumerate(_parts(out), 1):
        typer.echo(f"\n{number}. {part.heading}")
        lacking = _lacking(part.extras)
        if lacking:
            typer.echo(textwrap.fill(f"Left out: {lacking}", _WIDTH))
            left_out.append(lacking)
            continue
        _run(part.commands, out)
        if number == _TRACKED:
            typer.echo(f"  {_against_truth(out)}")
        shown |= part.shown
    typer.echo(f"\nDone in {time.perf_counter() - begun:.0f} s. Look at")
    for path, words in shown.items():
        typer.echo(f"  {path}\n      {words}")
    if left_out:
        typer.echo(
            "To see all of it: pip install 'servoid[servo,sim,view]', and again:\n"
            f"  servoid demo --out {shlex.quote(str(out))}"
        )


def _parts(out: Path) -> tuple[Part, ...]:
    photos, recording, arm = (str(out / name) for name in ("photos", "recording", "arm"))
    report, video = str(out / "report"), str(out / "track.mp4")
    can_report = _lacking(_REPORT_EXTRAS) == ""
    model = ("model", photos, "--views", "::2", "--out", str(out / "body.json"))
    return (
        Part(
            "A wooden bird, photographed from all around, becomes a body of ellipsoids.",
            (("sample", photos), (*model, *(("--report", report) if can_report else ()))),
            {f"{report}/report.html": "an interactive view of the bird's body, and its photographs"}
            if can_report
            else {str(out / "body.json"): "the bird's body; its report needs "
                  "pip install 'servoid[view]'"},
            {},
        ),
        Part(
            "A toy snail is modelled from one stereo pair, and tracked.",
            (
                ("sample", recording, "--moving", "--size", _SCENARIO.size,
                 "--count", str(_SCENARIO.count), "--occluder"),
                ("track", recording, "--out", str(out / "poses.csv"), "--video", video),
            ),
            {video: "the snail, with the tracked outline"},
            {},
        ),
        Part(
            "An arm with moving cameras models a simulated bottle, and follows it.",
            (("servo", "--object", "bottle", "--path", "sine:0.1@8s", "--seconds", "6",
              "--out", arm),),
            {
                f"{arm}/servo.mp4": "the arm and the images of its cameras",
                f"{arm}/report.html": "how well it followed",
            },
            SERVO_EXTRAS,
        ),
    )  # fmt: skip


def _lacking(extras: Mapping[str, str]) -> str:
    """Name the missing libraries and the extras that install them; empty if none is missing."""
    missing = [library for library in extras if find_spec(library) is None]
    if not missing:
        return ""
    named = ",".join(dict.fromkeys(extras[library] for library in missing))
    return f"{', '.join(missing)} {are(len(missing))} not installed; pip install 'servoid[{named}]'"


def _run(commands: Sequence[Sequence[str]], out: Path) -> None:
    """Print and run commands as if they were typed."""
    from servoid.cli.app import app  # which names this demo

    for command in commands:
        typer.echo(f"$ servoid {shlex.join(command)}")
        try:
            code = app(args=list(command), prog_name="servoid", standalone_mode=False)
        except InterruptedCommand:
            code = INTERRUPTED
        if code:
            typer.echo(f"the demo ends here; its files are in {out}", err=True)
            raise typer.Exit(code)


def _against_truth(out: Path) -> str:
    """Compare the track with the true motion of the snail."""
    found = [point.world_from_object for point in read_trajectory(out / "poses.csv")]
    true = read_trajectory(out / "recording" / "truth" / "left_from_object.csv")
    vertices, _ = outer_mesh(snail.PARTS)
    error_m = median_add_m(found, [point.world_from_object for point in true], vertices)
    return f"{'true motion':<12} {_MM_PER_M * error_m:.2f} mm off in the median, on all its surface"
