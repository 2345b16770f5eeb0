"""Replays whose bits are the same on every machine: each gives one hash of all its numbers.

`python replays.py NAME ...` prints a line for each, so that a process with another backend or
another processor's arithmetic can be asked; after `--shelf FOLDER` it takes from there what was
drawn before. `python replays.py --write` measures all that is here and writes the table.
"""

import hashlib
import sys
import tempfile
from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "fixtures"))  # when it is run by itself

from drawn import Drawn
from tracks_through import tracks_through

from servoid.exchange import open_any
from servoid.model import Request as ModelRequest
from servoid.model import fit_capture
from servoid.output import write_whole
from servoid.shape import Body
from servoid.sim import Scenario, write_moving_sample, write_sample
from servoid.track import Request

HERE = Path(__file__).parent
TABLE = HERE / "replays.tsv"
HEAD = """\
# The bits of whole runs: `python tests/scenes/replays.py --write` measured them, and does so anew.
# {versions}
replay\thash
"""
DATA = HERE.parents[2] / "shared" / "data"

Replay = Callable[[Path, Drawn], str]


def digest(arrays: Iterable[object]) -> str:
    """Hash numbers, every bit of them."""
    sum_ = hashlib.sha256()
    for array in arrays:
        sum_.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return sum_.hexdigest()[:16]


def of_track(folder: Path, **options: object) -> str:
    """Track what the first mask shows, with a body that evolves; hash every estimate."""
    request = Request(**options)  # type: ignore[arg-type]
    (result,) = tracks_through(open_any(folder), request=request)
    numbers: list[object] = []
    for one in result.tracked:
        estimate = one.estimate
        numbers += [estimate.world_from_object.matrix(), estimate.covariance, estimate.confidence]
    return digest([*numbers, *of_body(result.body)])


def of_body(body: Body) -> list[object]:
    """List the numbers of a body."""
    return [body.world_from_object.matrix(), body.centers, body.radii, body.rotations]


def of_model(folder: Path, views: slice, count: int) -> str:
    """Model a capture; hash the body and its fitness."""
    request = ModelRequest(max_ellipsoids=count, delta=0.0)
    result = fit_capture(open_any(folder), request, views=views)
    return digest([*of_body(result.body), result.fitness])


def drawn_track(folder: Path, drawn: Drawn) -> str:
    """Draw the moving toy, and track it."""
    scenario = Scenario(count=12, size="small")
    return of_track(
        drawn(folder / "moving", "moving", scenario, lambda new: write_moving_sample(new, scenario))
    )


def drawn_model(folder: Path, drawn: Drawn) -> str:
    """Draw the bird, and model it."""
    return of_model(drawn(folder / "bird", "bird", None, write_sample), slice(0, None, 4), 4)


def servo_run(folder: Path, _: Drawn) -> str:
    """Let the arm meet a drill and follow it; hash the log as it is written."""
    from servoid.record import write_servo_log
    from servoid.sim.trial import TrialSettings, changed, run_servo_trial

    values = {
        "world.ideal": True,
        "world.object.name": "drill",
        "world.object.path": "circle:0.03@4s",
        "world.cameras.size_px": (320, 240),
        "servo.look.count": 2,
        "run.seconds": 2.0,
        "run.settle_s": 1.0,
    }
    trial = run_servo_trial(changed(TrialSettings(), values, "this replay"), folder)
    write_servo_log(trial.log, folder / "log.csv")
    return hashlib.sha256((folder / "log.csv").read_bytes()).hexdigest()[:16]


DRAWN: dict[str, Replay] = {
    "drawn/model": drawn_model,
    "drawn/track": drawn_track,
    "world/servo": servo_run,
}
RECORDED: dict[str, Replay] = {
    "stereo/mustard": lambda *_: of_track(DATA / "stereo/mustard"),
    "stereo/mustard_hand": lambda *_: of_track(DATA / "stereo/mustard_hand"),
    "stereo/drill": lambda *_: of_track(DATA / "stereo/drill"),
    "stereo/teabox": lambda *_: of_track(DATA / "stereo/teabox"),
    "mono/dragon_red": lambda *_: of_track(DATA / "mono/dragon_red", distance_m=0.5),
    "photos/temple": lambda *_: of_model(DATA / "photos/temple", slice(0, None, 2), 6),
    "photos/skull": lambda *_: of_model(DATA / "photos/skull", slice(0, None, 4), 4),
    "photos/blowtorch": lambda *_: of_model(DATA / "photos/blowtorch", slice(0, None, 6), 4),
}
REPLAYS = DRAWN | RECORDED


def is_here(name: str) -> bool:
    """Say if what a replay needs is on this machine."""
    return name in DRAWN or (DATA / name).is_dir()


def replayed(name: str, drawn: Drawn | None = None) -> str:
    """Run one replay; return its hash."""
    with tempfile.TemporaryDirectory() as folder:
        return REPLAYS[name](Path(folder), drawn or Drawn(None))


def versions() -> dict[str, str]:
    """Return the versions of the libraries that take part in the arithmetic."""
    modules = {"mujoco": "mujoco", "numpy": "numpy", "opencv": "cv2"}
    return {name: import_module(module).__version__ for name, module in modules.items()}


def read_table() -> tuple[dict[str, str], dict[str, str]]:
    """Return the hash that each replay must have, and the versions that it was measured with."""
    lines = TABLE.read_text(encoding="utf-8").splitlines()
    written = [line[1:] for line in lines if line.startswith("#")][-1]
    rows = [line.split("\t") for line in lines if not line.startswith("#")][1:]
    pairs = [part.split() for part in written.split(",")]
    return dict(rows), dict(pairs)


def write_table() -> None:
    """Measure all that is here; what is not here stays as it is."""
    known = read_table()[0] if TABLE.exists() else {}
    found = known | {name: replayed(name) for name in REPLAYS if is_here(name)}
    head = HEAD.format(versions=", ".join(f"{name} {one}" for name, one in versions().items()))
    rows = "".join(f"{name}\t{found[name]}\n" for name in sorted(found))
    write_whole(TABLE, (head + rows).encode())


def main(arguments: list[str]) -> None:
    """Print or write hashes."""
    if arguments == ["--write"]:
        write_table()
        return
    drawn = Drawn(None)
    if arguments[:1] == ["--shelf"]:
        drawn, arguments = Drawn(Path(arguments[1])), arguments[2:]
    for name in arguments:
        sys.stdout.write(f"{name}\t{replayed(name, drawn)}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
