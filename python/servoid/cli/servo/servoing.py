"""`servoid servo`: runs in a simulated world, and writes log, video, plots and report."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import msgspec
import numpy as np
import typer

from servoid.cli.interrupting import INTERRUPTED
from servoid.cli.messages import print_message
from servoid.cli.overwriting import check_inputs_kept, files_of
from servoid.cli.progress import progress_bar
from servoid.cli.servo.interrupted import FolderBefore, after_servoing
from servoid.cli.servo.leftovers import (
    FILM,
    PICTURE,
    RECORDING,
    RUN_FILES,
    check_own,
    remove_leftovers,
)
from servoid.cli.servo.recorded_path import GivenPath, read_path, recorded_file
from servoid.cli.servo.servo_order import Order
from servoid.cli.servo.servo_summary import print_servo_summary
from servoid.errors import DoubtError, ServoError, ServoidError, SimError, TargetError
from servoid.exchange.bags.writing import McapRun, ObjectState, RunRig, mcap_run
from servoid.output import check_folder, claimed, make_folder, write_whole
from servoid.record import (
    ServoVideo,
    draw_answers,
    write_servo_log,
    write_servo_times,
)
from servoid.segment import parse_target
from servoid.servo import ServoMetrics
from servoid.sim.trial import (
    PEOPLE,
    ServoTrial,
    TrialSettings,
    TrialStep,
    run_servo_trial,
    trial_notes,
    trial_numbers,
    trial_rows,
    trial_toml,
)
from servoid.sim.world import World
from servoid.view import ServoPictures, draw_servo_plots, write_report, write_servo_report

_OVERVIEW_PX = (960, 720)
_FILM_HZ = 15.0
# A clock with an error stamps the first images before 0, which ROS cannot represent.
_RECORDED_FROM_S = 1.0  # time in the recording at which the world's clock is 0
# Stages before servoing, and how long each takes, in seconds of servoing that take as long.
_BEFORE_S = {
    "looking": 0.6,
    "looking around": 0.7,
    "coming back": 0.3,
    "modelling": 1.0,
    "taking place": 0.4,
}

_Cause = KeyboardInterrupt | ServoidError | None  # of the end of a run while servoing


def run_servo(order: Order) -> None:
    """Run in a folder that no other run writes into, write the results, and print a summary."""
    if order.out is None:
        raise typer.BadParameter(
            "no folder was given for the run; give one, such as --out out/run",
            param_hint="--out",
        )
    settings = order.settings()
    given = read_path(settings)
    inputs = [order.config, recorded_file(settings), *_mask_file(settings)]
    check_inputs_kept([("--out", order.out / name) for name in RUN_FILES], None, inputs)
    check_folder(order.out, parents=True)
    before = FolderBefore.of(order.out)
    try:
        make_folder(order.out, parents=True)
        with claimed(order.out):
            check_own(order.out)
            _run_and_report(order, order.out, settings, given, before)
    finally:
        before.remove_empty()


def _run_and_report(
    order: Order, folder: Path, settings: TrialSettings, given: GivenPath, before: FolderBefore
) -> None:
    """Run, and write the results even if the run was interrupted or ended by an error.

    Raises:
        ServoError: it ended by an error while servoing.

    """
    trial, cause = _servoed(order, folder, settings, given, before)
    ending = None if cause is None else _ending(trial, cause) + _lacking(order, folder)
    try:
        _report(folder, trial, ending)
    except KeyboardInterrupt:
        _end_interrupted(after_servoing(folder))
    if isinstance(cause, ServoidError):
        raise ServoError(
            f"{cause}; {folder} holds the run until then{_lacking(order, folder)}"
        ) from cause
    if ending is not None:
        _end_interrupted(ending)


def _mask_file(settings: TrialSettings) -> list[Path]:
    """Return the file of the object's mask, if one is named."""
    target = settings.run.target
    return [] if target in PEOPLE else files_of([parse_target(target)])


def _servoed(
    order: Order, folder: Path, settings: TrialSettings, given: GivenPath, before: FolderBefore
) -> tuple[ServoTrial, _Cause]:
    """Run, with video and recording; return also what ended it while servoing.

    Raises:
        Exit: it was interrupted before.

    """
    run: _Run | None = None
    try:
        with ExitStack() as stack, progress_bar("servo run") as update:
            run = _Run(folder, settings.run.seconds, update)
            return _trial(run, stack, order, settings, given)
    except KeyboardInterrupt as interrupt:  # also while video and recording are closed
        if run is None or run.trial is None:
            replaces = run is not None and run.replaces
            _end_interrupted(before.after_no_servoing(replaces=replaces))
        return run.trial, interrupt


def _trial(
    run: "_Run", stack: ExitStack, order: Order, settings: TrialSettings, given: GivenPath
) -> tuple[ServoTrial, _Cause]:
    """Run; what ends the run while servoing completes video and recording."""
    try:
        trial = run_servo_trial(
            settings,
            run.folder,
            path=given.path,
            notes=given.notes,
            prepared=lambda world: run.prepare(world, stack, order),
            watch=run.watch,
        )
    except (KeyboardInterrupt, SimError, ServoError) as cause:
        if run.trial is None:
            raise
        return run.trial, cause
    except DoubtError as doubt:
        picture = run.folder / PICTURE
        write_whole(picture, draw_answers(doubt.image, doubt.masks))
        raise TargetError(
            f"{doubt}; {picture} shows the candidates, and --trust-target uses the first"
        ) from doubt
    return trial, None


def _end_interrupted(message: str) -> NoReturn:
    print_message(message)
    raise typer.Exit(INTERRUPTED)


def _ending(trial: ServoTrial, cause: KeyboardInterrupt | ServoidError) -> str:
    """Describe when a run was interrupted, or ended by which error."""
    done_s, seconds = max(trial.log.times, default=0.0), trial.settings.run.seconds
    done = f"after {done_s:.2f} of {seconds:g} s of servoing"
    if isinstance(cause, ServoidError):
        return f"ended {done} by an error: {cause}"
    return f"interrupted {done}"


def _lacking(order: Order, folder: Path) -> str:
    """Name what was requested and is lost, as after an interrupt while it was completed."""
    wanted = [name for name, is_on in ((RECORDING, order.mcap), (FILM, order.video)) if is_on]
    lost = [name for name in wanted if not (folder / name).is_file()]
    if not lost:
        return ""
    left = "it" if len(lost) == 1 else "them"
    return f"; {' and '.join(lost)} could not be completed, and nothing is left of {left}"


def share_of_run(stage: str, share: float, seconds: float) -> float:
    """Return the share of a run that is done, by that of its stage and the seconds of servoing."""
    whole_s = sum(_BEFORE_S.values()) + seconds
    if stage not in _BEFORE_S:
        return (whole_s - (1.0 - share) * seconds) / whole_s
    stages = list(_BEFORE_S)
    before_s = sum(_BEFORE_S[earlier] for earlier in stages[: stages.index(stage)])
    return (before_s + share * _BEFORE_S[stage]) / whole_s


def stage_words(stage: str, time_s: float) -> str:
    """Return a note on a stage for the progress bar, whose own clock is that of the wall."""
    return f"{stage}, simulated {time_s:.0f} s"


class _Run:
    """Watches a run: shows its progress, and writes its video and its recording."""

    def __init__(self, folder: Path, seconds: float, update: Callable[[float, str], None]) -> None:
        self.trial: ServoTrial | None = None
        self.folder, self._seconds, self._update = folder, seconds, update
        self._world: World | None = None
        self._video: ServoVideo | None = None
        self._recording: McapRun | None = None
        self._is_known = False
        self._is_begun = False
        self.replaces = False  # whether it removed the files of an earlier run

    def prepare(self, world: World, stack: ExitStack, order: Order) -> None:
        """Open the video and the recording of a world, if they were requested."""
        self._world = world
        if order.mcap:
            rig = RunRig.of_source(world.cameras, world.camera_names)
            recording = mcap_run(self.folder / RECORDING, rig, can_wait=True)
            self._recording = stack.enter_context(recording)
        if order.video:
            rate = world.settings.cameras.rate_hz
            self._video = stack.enter_context(
                ServoVideo(
                    self.folder / FILM,
                    world.cameras,
                    world.camera_names,
                    rate / self._every(world),
                    overview_px=_OVERVIEW_PX,
                )
            )

    def watch(self, step: TrialStep) -> None:
        """Process a step."""
        self.trial = step.trial or self.trial
        if not self._is_begun:  # what is written next is the capture of the first look
            self._is_begun, self.replaces = True, remove_leftovers(self.folder)
        share = share_of_run(step.stage, step.share, self._seconds)
        self._update(share, stage_words(step.stage, step.time_s))
        if self._recording is not None:
            self._record(step, self._recording)
        if step.instant is not None:
            self._film(step)

    def _record(self, step: TrialStep, recording: McapRun) -> None:
        """Record joints and images, and the object's estimates since servoing began."""
        if step.row is not None and self.trial is not None:
            state = step.row.tick.state
            later = replace(state, time_s=_RECORDED_FROM_S + state.time_s)
            recording.feel(self.trial.log.names, later)
        if step.instant is None:
            return
        states = []
        if step.row is not None and self.trial is not None:
            body = None if self._is_known else self.trial.exploration.body
            self._is_known = True
            spent_s = step.row.tick.track_s
            states = [ObjectState("object", step.estimate, body, seconds=spent_s)]
        later = replace(step.instant, time_s=_RECORDED_FROM_S + step.instant.time_s)
        recording.see(later, states)

    def _film(self, step: TrialStep) -> None:
        """Add a picture of an observation; while servoing, only as many as the video needs."""
        world = self._world
        if world is None or step.instant is None or self._video is None:
            return
        if step.row is not None and step.instant.index % self._every(world):
            return
        overview = world.overview(self._video.overview_px or _OVERVIEW_PX, samples=1)
        body = None if self.trial is None else self.trial.exploration.body
        line = _line(step, self.trial)
        self._video.add(step.instant, step.estimate, step.command, overview, line, body=body)

    @staticmethod
    def _every(world: World) -> int:
        """Return the number of observations per picture of the video."""
        return max(1, round(world.settings.cameras.rate_hz / _FILM_HZ))


def _line(step: TrialStep, trial: ServoTrial | None) -> str:
    """Describe what the arm does, and how far the true object is from its desired pose."""
    held = None if step.row is None else step.row.hand_from_object
    if trial is None or trial.log.true_goal is None or held is None:
        return step.stage
    off = trial.log.true_goal.error(held)
    place, turn = 1e3 * float(np.linalg.norm(off[:3])), np.degrees(float(np.linalg.norm(off[3:])))
    return f"{step.stage}; accuracy {place:.1f} mm, {turn:.1f} deg"


def _report(folder: Path, trial: ServoTrial, ending: str | None) -> None:
    """Write all files of a run, print its summary, and say on its page if it was interrupted."""
    log, settings = trial.log, trial.settings
    text = trial_toml(settings)
    metrics = ServoMetrics.of(log, settings.run.settle_s)
    files = {name: folder / f"{name}.csv" for name in ("log", "times")}
    files["settings"] = folder / "run.toml"
    write_servo_log(log, files["log"])
    write_servo_times(log, files["times"])
    write_whole(files["settings"], text.encode())
    files["body"] = folder / "body.json"
    trial.exploration.result.save(files["body"], trial.appearance)
    files["figures"] = folder / "summary.json"
    numbers = trial_numbers(trial, metrics, ending)
    write_whole(files["figures"], msgspec.json.format(msgspec.json.encode(numbers)) + b"\n")
    model = folder / "model"
    write_report(trial.exploration.result, model)
    plots = draw_servo_plots(log, folder, settle_s=settings.run.settle_s)
    page = write_servo_report(
        folder,
        log,
        {**trial_rows(trial), **metrics.figures()},
        ServoPictures(trial.world.overview(_OVERVIEW_PX), [*plots, model / "contact_sheet.png"]),
        source=f"{settings.world.object.name}, {settings.world.object.path}",
        settings=text,
        settle_s=settings.run.settle_s,
        notes=trial_notes(trial, metrics),
        ending=ending,
    )
    for kind, name in (("recording", RECORDING), ("video", FILM)):
        if (folder / name).is_file():  # an interrupt may have come before it was complete
            files[kind] = folder / name
    files["looks"] = trial.exploration.capture
    files["report"] = page
    print_servo_summary(trial, metrics, files, ending)
