"""Says what the runs of the study of frequency responses and margins found."""

from collections.abc import Sequence
from pathlib import Path

from servoid.output import make_folder
from servoid_experiments.bode.margin import MARGIN
from servoid_experiments.bode.response import RESPONSE
from servoid_experiments.bode.settings import BodeSettings
from servoid_experiments.bode.telling_margins import tell_margins
from servoid_experiments.bode.telling_responses import tell_responses
from servoid_experiments.design import Results
from servoid_experiments.findings import Section


def tell(settings: BodeSettings, results: Results, folder: Path) -> Sequence[Section]:
    """Draw the figures into a folder, with their numbers beside them, and say what they show.

    Raises:
        OutputError: a file cannot be written.

    """
    make_folder(folder)
    responses, margins = results.get(RESPONSE.name, ()), results.get(MARGIN.name, ())
    return [
        *tell_responses(settings.response, responses, folder),
        *tell_margins(settings.margin, margins, folder),
    ]
