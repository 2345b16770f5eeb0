"""The reports of `servoid track`: a folder for each object, checked before the work."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from servoid.capture import Capture
from servoid.output import check_folder, make_folder
from servoid.track import Historian, History, TrackResult

WriteReport = Callable[..., list[Path]]


@dataclass(frozen=True, eq=False)
class Reports:
    """Folders to write reports into, in the order of the objects, and what gathers for them."""

    folders: tuple[Path, ...]
    historian: Historian
    writer: WriteReport

    @classmethod
    def into(cls, folders: Sequence[Path], capture: Capture) -> "Reports":
        """Make ready for reports; the library that draws is sought now.

        Raises:
            MissingExtraError: the library is missing.

        """
        from servoid.view import write_track_report  # it takes long to import

        return cls(tuple(folders), Historian(capture), write_track_report)

    def make_folders(self) -> None:
        """Make the folders, which other files may go into.

        Raises:
            OutputError: one cannot be made.

        """
        for folder in self.folders:
            make_folder(folder)

    def write(self, results: Sequence[TrackResult], notes: Sequence[str]) -> list[Path]:
        """Write a report of each object, and return the pages.

        Raises:
            OutputError: one cannot be written.

        """
        histories: list[History] = self.historian.histories()
        return [
            self.writer(result, history, folder, notes=notes)[0]
            for result, history, folder in zip(results, histories, self.folders, strict=True)
        ]


def check_reports(folders: Sequence[Path]) -> None:
    """Check that reports can be written into folders, each of which is made if need be.

    Raises:
        OutputError: one cannot be made or written to.

    """
    for folder in folders:
        check_folder(folder)
