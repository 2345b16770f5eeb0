"""What was done in a batch, kept so that it is not done again."""

from pathlib import Path
from typing import Any

import msgspec

from servoid.batch.attempt import read_entry
from servoid.batch.experiment import Experiment
from servoid.batch.work import Done
from servoid.config.limits import TRIAL_FILE
from servoid.config.reading import read_bytes
from servoid.errors import StudyError
from servoid.output import make_folder, write_whole

_TRIALS = "trials"


class Store:
    """A folder with a file for each trial that has ended, `trials/EXPERIMENT/KEY.json`.

    A file is written whole or not at all, so a batch that was broken off goes on where it was.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def open(self, experiment: Experiment[Any, Any]) -> None:
        """Make the folders of an experiment.

        Raises:
            OutputError: they cannot be made.

        """
        for folder in (self.folder, self.folder / _TRIALS, self._place(experiment)):
            make_folder(folder)

    def recall(self, experiment: Experiment[Any, Any], case: msgspec.Struct) -> Done | None:
        """Return what came of a case; None if it was not run, failed, or cannot be read."""
        path = self._file(experiment, case)
        if not path.is_file():
            return None
        try:
            done = read_entry(experiment, read_bytes(path, StudyError, TRIAL_FILE))
        except StudyError:
            return None  # a trial of which the file is damaged is run again
        return done if done.row is not None and done.case == case else None

    def keep(self, experiment: Experiment[Any, Any], case: msgspec.Struct, entry: bytes) -> Done:
        """Write what came of a case, and return it.

        Raises:
            OutputError: it cannot be written.

        """
        write_whole(self._file(experiment, case), entry)
        return read_entry(experiment, entry)

    def _place(self, experiment: Experiment[Any, Any]) -> Path:
        return self.folder / _TRIALS / experiment.name

    def _file(self, experiment: Experiment[Any, Any], case: msgspec.Struct) -> Path:
        return self._place(experiment) / f"{experiment.key(case)}.json"
