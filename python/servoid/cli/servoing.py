"""`servoid servo`: a run in a simulated world, with its log, video, plots and report."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import typer
from numpy.typing import NDArray

from servoid.cli.progress import progress_bar
from servoid.cli.servo_summary import print_servo_summary
from servoid.errors import ServoError
from servoid.output import check_folder, make_folder, write_whole
from servoid.record import ServoVideo, read_trajectory, write_servo_log
from servoid.servo import ServoMetrics
from servoid.sim.world import Path as ObjectPath
from servoid.sim.world import Recorded, World
from servoid.study import (
    ServoTrial,
    TrialSettings,
    TrialStep,
    changed,
    read_trial_settings,
    run_servo_trial,
    trial_toml,
)
from servoid.view import ServoPictures, draw_servo_plots, write_report, write_servo_report

INTERRUPTED = 130

_RECORDED = "recorded:"
_OVERVIEW_PX = (960, 720)
_FILM_HZ = 15.0


@dataclass(frozen=True, kw_only=True)
class Order:
    """What `servoid servo` was asked for; `values` are settings by their dotted names."""

    out: Path | None
    video: bool
    config: Path | None
    values: dict[str, Any]


def print_settings(order: Order) -> None:
    """Print all settings as commented TOML."""
    typer.echo(trial_toml(_settings(order)), nl=False)


def run_servo(order: Order) -> None:
    """Run, write what came of it even if it was interrupted, and print a summary."""
    if order.out is None:
        raise typer.BadParameter(
            "nothing says where the run is to be written; give a folder, such as out/run",
            param_hint="--out",
        )
    settings = _settings(order)
    path = _recorded(settings)
    check_folder(order.out)
    make_folder(order.out)
    run = _Run(order.out)
    stopped: BaseException | None = None
    with ExitStack() as stack, progress_bar("starting") as update:
        run.show(update)
        try:
            run_servo_trial(
                settings,
                order.out,
                path=path,
                prepared=lambda world: run.prepare(world, stack, order.video),
                watch=run.watch,
            )
        except KeyboardInterrupt as interrupt:
            if run.trial is None:
                typer.echo("interrupted before servoing began", err=True)
                raise typer.Exit(INTERRUPTED) from interrupt
            stopped = interrupt
    if run.trial is None:
        raise ServoError("the run ended before servoing began; make run.seconds longer")
    _report(run, run.trial, order)
    if stopped is not None:
        typer.echo(f"interrupted after {len(run.trial.log)} control periods", err=True)
        raise typer.Exit(INTERRUPTED)


class _Run:
    """Watches a run: shows how far it is, and makes its video."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.trial: ServoTrial | None = None
        self.overview: NDArray[np.uint8] | None = None
        self._world: World | None = None
        self._video: ServoVideo | None = None
        self._looks = 0

    def show(self, update: Any) -> None:
        """Take what shows the progress."""
        self._update = update

    def prepare(self, world: World, stack: ExitStack, wants_video: bool) -> None:
        """Open the video of a world, if one is wanted."""
        self._world = world
        if wants_video:
            rate = world.settings.cameras.rate_hz
            self._video = stack.enter_context(
                ServoVideo(
                    self.folder / "servo.mp4",
                    world.cameras,
                    ("left", "right"),
                    rate / self._every(world),
                    overview_px=_OVERVIEW_PX,
                )
            )

    def watch(self, step: TrialStep) -> None:
        """Take in a step."""
        self.trial = step.trial or self.trial
        self._update(step.share, f"{step.stage} {step.time_s:6.2f} s")
        if step.instant is not None:
            self._film(step)

    def _film(self, step: TrialStep) -> None:
        """Add a picture of an observation, of those while servoing so many as a film needs."""
        world = self._world
        if world is None or step.instant is None or self._video is None:
            return
        if step.row is not None and step.instant.index % self._every(world):
            return
        overview = world.overview(self._video.overview_px or _OVERVIEW_PX, samples=1)
        body = None if self.trial is None else self.trial.meeting.body
        self._video.add(step.instant, step.estimate, step.command, overview, _line(step), body=body)

    @staticmethod
    def _every(world: World) -> int:
        """Return how many observations one picture of the video stands for."""
        return max(1, round(world.settings.cameras.rate_hz / _FILM_HZ))


def _line(step: TrialStep) -> str:
    """Say what the arm does."""
    if step.row is None or step.row.world_from_goal is None:
        return step.stage
    off = step.row.world_from_goal.inverse() @ step.row.world_from_hand
    place = 1e3 * float(np.linalg.norm(off.translation))
    turn = np.degrees(float(np.linalg.norm(off.log()[3:])))
    return f"{step.stage}; in truth {place:.1f} mm, {turn:.1f} deg off"


def _settings(order: Order) -> TrialSettings:
    settings = TrialSettings() if order.config is None else read_trial_settings(order.config)
    return changed(settings, order.values, "the options")


def _recorded(settings: TrialSettings) -> ObjectPath | None:
    """Read the path of the object from a file, if one is named."""
    text = settings.world.object.path
    if not text.startswith(_RECORDED):
        return None
    points = read_trajectory(text.removeprefix(_RECORDED))
    return Recorded(
        [point.time_s for point in points], [point.world_from_object for point in points]
    )


def _report(run: _Run, trial: ServoTrial, order: Order) -> None:
    """Write all files of a run that has ended, and print its summary."""
    folder, log, settings = run.folder, trial.log, trial.settings
    metrics = ServoMetrics.of(log, settings.run.settle_s)
    files = {"log": folder / "log.csv", "settings": folder / "run.toml"}
    write_servo_log(log, files["log"])
    write_whole(files["settings"], trial_toml(settings).encode())
    files["body"] = folder / "body.json"
    trial.meeting.result.save(files["body"], trial.appearance)
    files["figures"] = folder / "summary.json"
    write_whole(files["figures"], msgspec.json.format(msgspec.json.encode(metrics.numbers())))
    model = folder / "model"
    write_report(trial.meeting.result, model)
    plots = draw_servo_plots(log, folder, settle_s=settings.run.settle_s)
    page = write_servo_report(
        folder,
        log,
        metrics.figures(),
        ServoPictures(trial.world.overview(_OVERVIEW_PX), [*plots, model / "contact_sheet.png"]),
        settings=trial_toml(settings),
        notes=trial.meeting.result.all_notes,
    )
    if order.video:
        files["video"] = folder / "servo.mp4"
    files["report"] = page
    print_servo_summary(trial, metrics, files)
