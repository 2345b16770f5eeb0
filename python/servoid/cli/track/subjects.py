"""Turns `--body`, `--target` and `--start` into the objects to track."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from servoid.cli.wrong_options import OptionError, of_options
from servoid.errors import PoseError, TrackError, located
from servoid.exchange.shapes import SUFFIXES as MESH_SUFFIXES
from servoid.pose import Pose
from servoid.segment import parse_target
from servoid.shape import BodyFile, load_body
from servoid.track import Subject
from servoid.words import number_of

_TAGGED = re.compile(r"([A-Za-z0-9][\w-]*)=(.+)", re.DOTALL)
_OWN_POSE = "body"


def read_subjects(
    bodies: Sequence[str], targets: Sequence[str], starts: Sequence[str]
) -> list[Subject]:
    """Read bodies and poses, and group those of the same object.

    Each text may begin with `NAME=`. A body without a name is named after its file; a target or
    start without a name belongs to the only object.

    Raises:
        BodyError: a body's file is malformed.
        OptionError: a text is malformed, or a name is given twice, belongs to no object, or is
            missing among several.

    """
    files = _read_bodies(bodies)
    with of_options():
        return _put_together(files, targets, starts)


def _put_together(
    files: Mapping[str, BodyFile], targets: Sequence[str], starts: Sequence[str]
) -> list[Subject]:
    tagged_targets = [_split(text) for text in targets]
    names = list(files) or list(dict.fromkeys(name for name, _ in tagged_targets if name))
    names = names or [Subject.name]
    meant: dict[str, list[str]] = {name: [] for name in names}
    for name, text in tagged_targets:
        meant[_owner(name, names, f"--target {text}")].append(text)
    poses: dict[str, str] = {}
    for name, text in map(_split, starts):
        owner = _owner(name, names, f"--start {text}")
        if owner in poses:
            raise TrackError(f"'{owner}' has two starts, {poses[owner]} and {text}; give one")
        poses[owner] = text
    return [_subject(name, files.get(name), meant[name], poses.get(name)) for name in names]


def parse_pose(text: str) -> Pose:
    """Turn `X,Y,Z,QW,QX,QY,QZ` into a pose.

    Raises:
        PoseError: it is not seven numbers, or not a rigid motion.

    """
    try:
        numbers = [number_of(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 7:
        raise PoseError(
            f"'{text}' is not a pose; write X,Y,Z,QW,QX,QY,QZ: metres and a unit quaternion, such "
            "as 0.1,0,0.6,1,0,0,0, or the word body for the pose in the body's file"
        )
    with located(f"'{text}'"):
        return Pose.from_parts(numbers[:3], numbers[3:])


def _split(text: str) -> tuple[str | None, str]:
    tagged = _TAGGED.fullmatch(text)
    return (tagged[1], tagged[2]) if tagged else (None, text)


def body_path(text: str) -> Path:
    """Return the file that a `--body` names."""
    return Path(_split_body(text)[1])


def _split_body(text: str) -> tuple[str | None, str]:
    # An existing file whose name contains = is a file.
    return (None, text) if Path(text).is_file() else _split(text)


def _read_bodies(texts: Sequence[str]) -> dict[str, BodyFile]:
    files: dict[str, BodyFile] = {}
    for text in texts:
        name, place = _split_body(text)
        name = name or Path(place).stem
        if name in files:
            raise OptionError(
                f"two bodies are named '{name}'; give each its own name, such as --body b={place}"
            )
        if Path(place).suffix.lower() in MESH_SUFFIXES:
            raise TrackError(
                f"{place} is a mesh, and a body is a .json file; make one with "
                f"servoid model {place} --out {Path(place).stem}.json"
            )
        files[name] = load_body(place)
    return files


def _owner(name: str | None, names: Sequence[str], option: str) -> str:
    known = ", ".join(names)
    if name is None:
        if len(names) > 1:
            raise TrackError(
                f"{option} does not say which object it is for; put one of the names before it, "
                f"such as {option.replace(' ', f' {names[0]}=', 1)}; the objects are {known}"
            )
        return names[0]
    if name not in names:
        raise TrackError(f"{option} is for '{name}', but the objects are {known}")
    return name


def _subject(
    name: str, file: BodyFile | None, targets: Sequence[str], start: str | None
) -> Subject:
    body = None if file is None else file.body()
    pose = None
    if start is not None:
        if body is None and start == _OWN_POSE:
            raise TrackError("--start body is the pose in a body's file, but no --body was given")
        own = start == _OWN_POSE
        pose = body.world_from_object if body is not None and own else parse_pose(start)
    return Subject(
        name=name,
        body=body,
        start=pose,
        targets=tuple(parse_target(text) for text in targets),
        colors=None if file is None else file.colors(),
        appearance=None if file is None else file.look(),
        fitness=None if file is None else file.fitness,
        known_shape=file is not None and file.is_known_all_around,
        is_metric=file is None or file.is_metric,
    )
