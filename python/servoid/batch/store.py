"""Stores finished trials of a batch, so that they are not run again."""

from pathlib import Path
from typing import Any

import msgspec

from servoid.batch.attempt import read_entry
from servoid.batch.experiment import Done, Experiment
from servoid.config import TRIAL_FILE, read_bytes
from servoid.errors import StudyError
from servoid.output import make_folder, write_whole

_TRIALS = "trials"


class Store:
    """A folder with a file for each finished trial, `trials/EXPERIMENT/KEY.json`.

    Files are written atomically, so an interrupted batch can resume.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def open(self, experiment: Experiment[Any, Any]) -> None:
        """Create the folders of an experiment.

        Raises:
            OutputError: they cannot be created.

        """
        for folder in (self.folder, self.folder / _TRIALS, self._place(experiment)):
            make_folder(folder)

    def recall(self, experiment: Experiment[Any, Any], case: msgspec.Struct) -> Done | None:
        """Return the stored trial of a case; None if it was not run, failed, or cannot be read."""
        path = self._file(experiment, case)
        if not path.is_file():
            return None
        try:
            done = read_entry(experiment, read_bytes(path, StudyError, TRIAL_FILE))
        except StudyError:
            return None  # a trial with a damaged file is run again
        return done if done.row is not None and done.case == case else None

    def keep(self, experiment: Experiment[Any, Any], case: msgspec.Struct, entry: bytes) -> Done:
        """Store the entry of a case, and return the decoded trial.

        Raises:
            OutputError: it cannot be written.

        """
        write_whole(self._file(experiment, case), entry)
        return read_entry(experiment, entry)

    def _place(self, experiment: Experiment[Any, Any]) -> Path:
        return self.folder / _TRIALS / experiment.name

    def _file(self, experiment: Experiment[Any, Any], case: msgspec.Struct) -> Path:
        return self._place(experiment) / f"{experiment.key(case)}.json"
