"""The reports of `servoid track`: a folder for each object, checked before tracking starts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from servoid.capture import Capture
from servoid.output import check_folder, make_folder
from servoid.track import Historian, History, TrackResult

WriteReport = Callable[..., list[Path]]


@dataclass(frozen=True, eq=False)
class Reports:
    """The folders of the reports, in the order of the objects; the history and its source."""

    folders: tuple[Path, ...]
    historian: Historian
    source: str
    writer: WriteReport

    @classmethod
    def into(cls, folders: Sequence[Path], capture: Capture, source: str) -> "Reports":
        """Prepare reports; fails early if the plotting library is missing.

        Raises:
            MissingExtraError: the library is missing.

        """
        from servoid.view import write_track_report  # it takes long to import

        return cls(tuple(folders), Historian(capture), source, write_track_report)

    def make_folders(self) -> None:
        """Make the folders, into which other files may be written too.

        Raises:
            OutputError: one cannot be made.

        """
        for folder in self.folders:
            make_folder(folder)

    def write(
        self, results: Sequence[TrackResult], ending: str | None, notes: Sequence[str] = ()
    ) -> list[Path]:
        """Write a report of each object, and return the pages.

        `ending` says why it ended early; `notes` are on the images, for all objects.

        Raises:
            OutputError: one cannot be written.

        """
        histories: list[History] = self.historian.histories()
        return [
            self.writer(result, history, folder, source=self.source, ending=ending, notes=notes)[0]
            for result, history, folder in zip(results, histories, self.folders, strict=True)
        ]


def check_reports(folders: Sequence[Path]) -> None:
    """Check that reports can be written into folders, each of which is made if missing.

    Raises:
        OutputError: one cannot be made or written to.

    """
    for folder in folders:
        check_folder(folder)
