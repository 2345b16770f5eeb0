"""Models every capture in a folder, as a batch."""

import hashlib
import os
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from servoid.batch import Done, Experiment, Work, Workers, run_batch
from servoid.batch.running import ProgressCallback
from servoid.errors import StudyError
from servoid.exchange import is_capture, open_any
from servoid.model import Request, fit_capture, fit_capture_by_paper
from servoid.output import check_folder, claimed, make_folder, write_whole
from servoid.segment import parse_target
from servoid.track import learn_appearance

__all__ = [
    "CAPTURES",
    "CaptureCase",
    "CaptureRow",
    "ModelledFolder",
    "folders_in",
    "model_capture",
    "model_folder",
]

Bounds = tuple[int | None, int | None, int | None]


class CaptureCase(msgspec.Struct, frozen=True, kw_only=True):
    """A capture, and how to model it; None takes servoid's default."""

    capture: Annotated[str, Meta(description="folder, as all workers see it")]
    content: Annotated[str, Meta(description="names, sizes and times of its files, as a digest")]
    by_paper: Annotated[bool, Meta(description="with the paper's own method")] = False
    targets: tuple[str, ...] = ()
    views: Annotated[Bounds, Meta(description="which views: start, stop and step")] = (
        None,
        None,
        None,
    )
    observations: Annotated[Bounds | None, Meta(description="which instants, likewise")] = None
    distance: Annotated[float | None, Meta(description="of the object, for one image alone, m")] = (
        None
    )
    trust_targets: Annotated[
        bool, Meta(description="use targets that may mean several objects")
    ] = False
    max_ellipsoids: int | None = None
    delta: float | None = None
    seed: int | None = None


class CaptureRow(msgspec.Struct, frozen=True, kw_only=True):
    """The result for a capture; only `seconds` differs between runs."""

    ellipsoids: int
    fitness: float
    iou_used: Annotated[float | None, Meta(description="mean silhouette IoU, views used")]
    iou_unused: Annotated[float | None, Meta(description="mean silhouette IoU, other views")]
    surface_seen: Annotated[float | None, Meta(description="share of the surface")]
    seconds: Annotated[float, Meta(description="on the wall, of modelling alone")]
    notes: list[str]
    verdict: Annotated[str | None, Meta(description="good, rough or poor; none without views")] = (
        None
    )
    body: Annotated[str, Meta(description="the body's file, JSON")]


def model_capture(case: CaptureCase) -> CaptureRow:
    """Model a capture on one core.

    Raises:
        ServoidError: it cannot be read or modelled.

    """
    capture = open_any(case.capture)
    targets = [parse_target(text) for text in case.targets]
    request = Request(
        max_ellipsoids=case.max_ellipsoids,
        delta=case.delta,
        seed=case.seed,
        threads=1,
        trust_targets=case.trust_targets,
    )
    instants = None if case.observations is None else slice(*case.observations)
    chosen = {"observations": instants, "views": slice(*case.views)}
    if case.by_paper:
        result = fit_capture_by_paper(capture, request, targets=targets, **chosen)
    else:
        result = fit_capture(capture, request, targets=targets, distance_m=case.distance, **chosen)
    result = replace(result, notes=(*capture.notes, *result.notes))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "body.json"
        result.save(file, learn_appearance(result))
        body = file.read_text(encoding="utf-8")
    return CaptureRow(
        ellipsoids=len(result.body),
        fitness=result.fitness,
        iou_used=_mean(result.iou_used),
        iou_unused=_mean(result.iou_unused),
        surface_seen=None if result.coverage is None else result.coverage.share,
        seconds=result.seconds,
        notes=list(result.all_notes),
        verdict=result.verdict.word,
        body=body,
    )


CAPTURES = Experiment("captures", model_capture, CaptureCase, CaptureRow)


@dataclass(frozen=True)
class ModelledFolder:
    """The results for a folder: trials by capture name, and folders that are not captures.

    Hidden folders are in neither.
    """

    trials: dict[str, Done]
    passed_over: tuple[str, ...]


def model_folder(
    folder: str | Path,
    out: str | Path,
    case: CaptureCase,
    *,
    workers: Workers | None = None,
    watch: ProgressCallback | None = None,
) -> ModelledFolder:
    """Model each capture in a folder with the settings of `case`, whose own capture is ignored.

    `out` receives `NAME.json` for each capture, `captures.parquet`, and `trials`, from which an
    interrupted batch resumes. A capture whose files have changed is modelled again; if it fails, an
    earlier body of it stays. Hidden folders, whose names begin with a dot, are left out.

    Raises:
        StudyError: the folder does not exist, contains no capture, or one whose name is not UTF-8.
        OutputError: `out` cannot be written, or another run is writing into it.

    """
    place = Path(folder)
    if not place.is_dir():
        raise StudyError(f"there is no folder {place}; name one that holds captures")
    inside = folders_in(place)
    captures = [path for path in inside if is_capture(path)]
    if not captures:
        raise StudyError(
            f"no folder in {place} is a capture; to model a single capture, leave --each out"
        )
    check_folder(Path(out))
    for path in captures:
        _check_name(path)
    cases = [
        msgspec.structs.replace(case, capture=str(path.resolve()), content=_content(path))
        for path in captures
    ]
    make_folder(Path(out))
    with claimed(Path(out)):
        trials = run_batch([Work(CAPTURES, cases)], out, workers, watch)[CAPTURES.name]
        for path, done in zip(captures, trials, strict=True):
            if done.row is not None:
                write_whole(Path(out) / f"{path.name}.json", done.row.body.encode())
    return ModelledFolder(
        dict(zip((path.name for path in captures), trials, strict=True)),
        tuple(path.name for path in inside if path not in captures),
    )


def _check_name(folder: Path) -> None:
    try:
        str(folder.resolve()).encode()
    except UnicodeEncodeError as error:
        name = str(folder).encode(errors="replace").decode()
        raise StudyError(
            f"the name of the capture {name} is not UTF-8, and cannot be stored in a table; rename "
            "the folder"
        ) from error


def folders_in(folder: Path) -> list[Path]:
    """Return the folders in a folder that are not hidden, in order."""
    inside = (path for path in folder.iterdir() if path.is_dir())
    return sorted(path for path in inside if not path.name.startswith("."))


def _content(folder: Path) -> str:
    """Return a digest that changes when a file in the folder changes."""
    digest = hashlib.sha256()
    for root, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            path = Path(root) / name
            about = path.stat() if path.exists() else path.lstat()  # a link may be broken
            line = f"{path.relative_to(folder)} {about.st_size} {about.st_mtime_ns}\n"
            digest.update(line.encode(errors="surrogateescape"))
    return digest.hexdigest()[:24]


def _mean(values: NDArray[np.float64]) -> float | None:
    return float(np.mean(values)) if len(values) else None
