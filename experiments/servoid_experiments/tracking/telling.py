"""What the study of tracking found, in sentences, pictures and tables."""

from pathlib import Path

from servoid_experiments.design import Results
from servoid_experiments.findings import Picture, Section
from servoid_experiments.sweeping import band_words, failure_words
from servoid_experiments.tracking.figures import (
    LARGE_ERROR,
    MIDDLE_ERROR,
    SUCCESS,
    Trials,
    draw_tracking,
    error_panels,
    success_panels,
)
from servoid_experiments.tracking.footage import AWAY
from servoid_experiments.tracking.plan import Plan, layout
from servoid_experiments.tracking.settings import TrackStudySettings
from servoid_experiments.tracking.tables import every_figure, limits
from servoid_experiments.tracking.trial import TRACKING, VIEWS
from servoid_experiments.tracking.words import (
    center_words,
    cost_words,
    error_words,
    eyes_words,
    found_again_words,
    search_words,
)


def tell_tracking(settings: TrackStudySettings, results: Results, folder: Path) -> list[Section]:
    """Draw the pictures into a folder and say what came out.

    Raises:
        OutputError: a file cannot be written.

    """
    sweep: Trials = Trials(results[TRACKING.name])
    if sweep.is_empty:
        return [Section("No trial succeeded", failure_words(sweep.failed))]
    plan = layout(settings)
    draw_tracking(plan, sweep, settings.near, folder)
    return [
        _matters(settings, plan, sweep, folder),
        _precise(plan, sweep, folder),
        Section(
            "All figures",
            ("The middle of the seeds, and in brackets their extremes.",),
            tables=(every_figure(plan, sweep, settings.near),),
        ),
        _done(settings, sweep),
    ]


def _matters(settings: TrackStudySettings, plan: Plan, sweep: Trials, folder: Path) -> Section:
    panels = success_panels(plan, sweep, settings.near)
    return Section(
        "What matters most",
        (
            *cost_words(plan, panels, sweep, settings.near),
            *center_words(plan, sweep, settings.near),
            *search_words(plan, panels),
            *found_again_words(plan, panels),
        ),
        pictures=(
            Picture(
                folder / SUCCESS,
                "Share of the images in which the tracker says that it tracks, and ADD is below "
                f"{100.0 * settings.near:g} % of the object's diameter. One panel a factor; all "
                f"else is as in the centre. {band_words(settings.seeds)} Where a board hides the "
                "object, solid lines are the images in which it does, dashed ones those after it.",
            ),
        ),
        tables=(limits(plan, panels),),
    )


def _precise(plan: Plan, sweep: Trials, folder: Path) -> Section:
    panels = error_panels(plan, sweep, 50.0)
    said = "of the images in which the tracker says that it tracks"
    return Section(
        "How precise it is",
        (*error_words(plan, panels), *eyes_words(plan, panels)),
        pictures=(
            Picture(folder / MIDDLE_ERROR, f"Median error of the object's middle, {said}."),
            Picture(
                folder / LARGE_ERROR,
                f"Error of the object's middle that 95 % {said} stay below.",
            ),
        ),
    )


def _done(settings: TrackStudySettings, sweep: Trials) -> Section:
    width, height = settings.size_px
    return Section(
        "How it was done",
        (
            f"{sweep.count} trials of {settings.images} images of {width} x {height} pixels from "
            f"each of two eyes, which stand still {AWAY:g} m before the middle of the "
            "object's path, a smooth random curve in six degrees of freedom. The same seed gives "
            "the same path, room, noise and search.",
            f"The body was modelled beforehand from {VIEWS} exact outlines around the object; both "
            "trackers begin at the true pose. The paper's 1-step GA is told the true orientation "
            "in each image, as in the paper's experiments, and seeks x, y and z; its score is that "
            "of the paper's points.",
            "ADD is the mean distance between points of the object's surface where they are and "
            "where they are believed to be. For an object that looks the same however it is spun, "
            "the spin does not count.",
            *failure_words(sweep.failed),
        ),
    )
