"""Scans: turns images without poses and calibration into a capture that has both."""

import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from servoid.camera import read_image
from servoid.errors import ScanError
from servoid.output import check_replaceable, write_folder
from servoid.scan import motion
from servoid.scan.footage import Footage, open_footage
from servoid.scan.groups import LEAST_IMAGES, check_found
from servoid.scan.inside import copy_masks, write_inside, write_moving
from servoid.scan.keys import choose_keys
from servoid.scan.mapping import place_images
from servoid.scan.matching import match
from servoid.scan.metres.board import scale_of_board
from servoid.scan.metres.pair import scale_of_partner
from servoid.scan.metres.scale import Scale, scale_of_baselines, scale_of_lengths
from servoid.scan.request import Request
from servoid.scan.result import Scan
from servoid.scan.running import pycolmap
from servoid.scan.solution import Solution
from servoid.scan.staging import Staged, stage
from servoid.scan.writing import FOLDER, IMAGES, MASKS, write_capture

_MASKING = 0.05  # share of the feature stage
# Shares of the whole work: selecting key images, features and matches, poses, and the second
# camera, which is rarely present.
_SHARES = {"key images": 0.1, "features": 0.6, "poses": 0.22, "second eye": 0.08}

Page = Callable[[Scan, Path], bytes]


def scan(
    source: str | Path | Footage,
    out: Path,
    request: Request | None = None,
    page: Page | None = None,
) -> Scan:
    """Estimate poses and calibration of a video or of photographs, and write a capture to `out`.

    `page` takes the scan and the folder of its images, and returns report.html. An earlier scan in
    `out` is replaced; on any error nothing is written.

    Raises:
        ScanError: the images cannot be scanned; the message gives the reason and the remedy.
        CaptureError, ImageError, MaskError: a file cannot be used.
        MissingExtraError: pycolmap is not installed.
        OutputError: `out` contains something else, or cannot be written.

    """
    pycolmap()
    check_replaceable(out, FOLDER)
    footage = open_footage(source) if isinstance(source, (str, Path)) else source
    made: list[Scan] = []
    work = _Work(footage, out, request or Request(), page)
    write_folder(out, lambda draft: made.append(work.fill(draft)), FOLDER)
    return made[0]


@dataclass
class _Work:
    """A scan in progress: its request, and the duration of each stage."""

    footage: Footage
    out: Path
    request: Request
    page: Page | None
    times: dict[str, float] = field(default_factory=dict)

    def fill(self, draft: Path) -> Scan:
        """Write the capture into an empty folder, stage by stage."""
        _check_count(self.footage.path, len(self.footage.names))
        _check_named(self.footage, self.request.keys())
        with self._stage("key images") as report:
            keys = choose_keys(self.footage, self.request.keys(), lambda s: report(0.6 * s))
            (draft / IMAGES).mkdir()
            staged = stage(self.footage, keys, draft / IMAGES, lambda s: report(0.6 + 0.4 * s))
        with tempfile.TemporaryDirectory(prefix="servoid-scan-") as scratch:
            solution = self._solve(staged, Path(scratch))
            check_found(solution, len(keys))
            scale = self._scale(solution, staged, Path(scratch))
        solution = solution.scaled(1.0 / solution.distance if scale is None else scale.metres)
        masks = self.request.masks
        if masks is not None:
            (draft / MASKS).mkdir()
            copy_masks(masks, staged, draft / MASKS)
        made = Scan(
            source=self.footage.path,
            path=self.out,
            count=len(self.footage.names),
            keys=len(keys),
            solution=solution,
            scale=scale,
            times=self.times,
            notes=(*self.request.notes, *staged.notes),
            given_lens=self.request.given_lens,
            image_doubts=staged.doubts,
        )
        write_capture(draft, made, staged, self.page)
        return made

    def _solve(self, staged: Staged, scratch: Path) -> Solution:
        request = self.request
        with self._stage("features") as report:
            masks = self._inside(staged, scratch / "inside")
            report(_MASKING)
            matched = match(
                staged.folder,
                staged.files,
                scratch / "database.db",
                is_film=self.footage.is_film,
                focal_px=staged.focal_px,
                masks=masks,
                moving_only=request.turntable,
                threads=request.threads,
                progress=lambda s: report(_MASKING + (1.0 - _MASKING) * s),
            )
            motion.check_features(matched)
            if not request.turntable:
                motion.check_camera_moves(matched)
            motion.check_turning(matched)
        with self._stage("poses") as report:
            solution = place_images(matched, report)
            if solution is None:
                motion.refuse_unplaced(matched)
            return solution

    def _inside(self, staged: Staged, folder: Path) -> Path | None:
        """Write the masks for feature detection; None: detect everywhere."""
        request = self.request
        if request.inside is None and not request.turntable:
            return None
        folder.mkdir()
        if request.inside is not None:
            write_inside(request.inside, staged, folder)
        else:
            write_moving(staged, folder)
        return folder

    def _scale(self, solution: Solution, staged: Staged, scratch: Path) -> Scale | None:
        request = self.request
        found = scale_of_lengths(solution, request.lengths)
        if found is None and request.board is not None:
            found = scale_of_board(solution, request.board, lambda: _images(staged))
        found = found or scale_of_baselines(solution, request.baselines)
        if found is None and request.partner is not None:
            with self._stage("second eye"):
                found = scale_of_partner(
                    solution, request.partner, staged.folder, scratch, request.threads
                )
        return found

    @contextmanager
    def _stage(self, name: str) -> Iterator[Callable[[float], None]]:
        """Time a stage, and return the function that reports the share of it that is done."""
        before = sum(share for known, share in _SHARES.items() if known in self.times)
        start = time.perf_counter()
        self.times[name] = 0.0

        def report(share: float) -> None:
            if self.request.progress is not None:
                self.request.progress(before + _SHARES[name] * share, name)

        report(0.0)
        yield report
        self.times[name] = time.perf_counter() - start


def _images(staged: Staged) -> Iterable[tuple[str, NDArray[np.uint8]]]:
    for file in staged.files:
        yield Path(file).stem, read_image(staged.folder / file, staged.size_px)


def _check_named(footage: Footage, names: Iterable[str]) -> None:
    """Check that there are the images in which a length is marked, before they are scanned."""
    missing = next((name for name in names if name not in footage.names), None)
    if missing is not None:
        first, last = footage.names[0], footage.names[-1]
        raise ScanError(
            f"there is no image '{missing}' in {footage.path}; its images are named {first} to "
            f"{last}; mark one of them"
        )


def _check_count(path: Path, count: int) -> None:
    if count < LEAST_IMAGES:
        raise ScanError(
            f"{path} has {count} image{'s' * (count != 1)}, too few: a scan needs at least "
            f"{LEAST_IMAGES}, and works well with 15 to 50 from all around the object"
        )
