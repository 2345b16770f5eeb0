"""Frequency responses of recognition, gaze and hand, and the stability margins of the loop."""

from collections.abc import Sequence
from pathlib import Path

from servoid_experiments.bode.margin import MARGIN
from servoid_experiments.bode.planning import plan
from servoid_experiments.bode.reporting_margins import report_margins
from servoid_experiments.bode.reporting_responses import report_responses
from servoid_experiments.bode.response import RESPONSE
from servoid_experiments.bode.settings import QUICK, BodeSettings
from servoid_experiments.design import Results, Study
from servoid_experiments.report import Section


def report_bode(settings: BodeSettings, results: Results, folder: Path) -> Sequence[Section]:
    """Draw the figures into a folder, and return the sections with their numbers.

    Raises:
        OutputError: a file cannot be written.

    """
    responses, margins = results.get(RESPONSE.name, ()), results.get(MARGIN.name, ())
    sections = [
        *report_responses(settings.response, responses, folder),
        *report_margins(settings.margin, margins, folder),
    ]
    return sections or [Section("No trial succeeded")]


BODE = Study(
    name="bode",
    title="Frequency responses and margins",
    question=(
        "Up to which frequency do recognition, gaze and hand follow, with and without feed-forward "
        "and turning eyes, and how much gain, delay and latency does the loop withstand?"
    ),
    settings=BodeSettings,
    quick=QUICK,
    plan=plan,
    report=report_bode,
)

__all__ = ["BODE", "BodeSettings"]
