"""Inspects what servoid runs on: processor, libraries, renderers, cameras; and judges a test."""

import os
import platform
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from servoid import _native
from servoid.cli.doctor.installed import NEEDED, installed_libraries
from servoid.errors import MissingExtraError
from servoid.sim import SelfTest
from servoid.source.devices import load_library

_CPU_MODEL = re.compile(r"^model name\s*: (.+)$", re.MULTILINE)
_GL_S = 20.0  # time allowed for a graphics driver to answer
_TRY_GL = "from servoid.sim.world.cameras.gl_context import make_context; make_context()"
_WHOLE = "the ray-caster, on the processor, which needs nothing else"


@dataclass(frozen=True)
class Camera:
    """A camera of the system: its device, its persistent names, and whether it can be read."""

    device: str
    name: str
    links: tuple[str, ...]
    readable: bool


@dataclass(frozen=True)
class Machine:
    """What servoid runs on. `libraries` is None where servoid is not installed.

    `unloadable` describes what installed libraries lack to be loaded, by extra.
    """

    servoid: str
    python: str
    system: str
    cores: int
    usable_cores: int
    processor: str | None
    back_end: str
    back_ends: tuple[str, ...]
    libraries: dict[str, dict[str, str | None]] | None
    unloadable: dict[str, str]
    renderers: dict[str, str]
    cameras: tuple[Camera, ...]

    @property
    def problems(self) -> list[str]:
        """Return what keeps servoid from working here."""
        needed = (self.libraries or {}).get(NEEDED, {})
        missing = [name for name, number in needed.items() if number is None]
        if not missing:
            return []
        return [
            f"{', '.join(missing)} missing, which servoid needs; install again with: "
            "pip install --force-reinstall servoid"
        ]


def look_at_machine(*, tries: bool) -> Machine:
    """Return what servoid runs on; `tries` starts OpenGL once. No camera is opened."""
    libraries = installed_libraries()
    model = _CPU_MODEL.search(_text_of(Path("/proc/cpuinfo")))
    return Machine(
        servoid=_native.__version__,
        python=platform.python_version(),
        system=f"{platform.system()} {platform.machine()}",
        cores=os.cpu_count() or 1,
        usable_cores=_usable_cores(),
        processor=None if model is None else model[1].strip(),
        back_end=_native.backend(),
        back_ends=tuple(_native.backends()),
        libraries=libraries,
        unloadable=_unloadable(libraries or {}),
        renderers={"raycast": _WHOLE, "mujoco": _open_gl(tries=tries)},
        cameras=tuple(find_cameras()),
    )


def problems_of(test: SelfTest) -> list[str]:
    """Return what a self-test found wrong; its errors are the same on every machine."""
    if test.is_right:
        return []
    return [
        "the self-test is not as precise as it must be on every machine: please report it, with "
        "the whole output of servoid doctor"
    ]


def find_cameras(
    devices: Path = Path("/dev"), known: Path = Path("/sys/class/video4linux")
) -> list[Camera]:
    """List the cameras of Video4Linux by number, with the names that persist over a restart."""
    links: dict[Path, list[str]] = {}
    for link in sorted((devices / "v4l" / "by-id").glob("*")):
        links.setdefault(link.resolve(), []).append(str(link))
    found = [path for path in devices.glob("video*") if path.name[5:].isdigit()]
    return [
        Camera(
            device=str(path),
            name=_text_of(known / path.name / "name").strip() or "a camera without a name",
            links=tuple(links.get(path.resolve(), ())),
            readable=os.access(path, os.R_OK | os.W_OK),
        )
        for path in sorted(found, key=lambda path: int(path.name[5:]))
    ]


def _unloadable(libraries: Mapping[str, Mapping[str, str | None]]) -> dict[str, str]:
    """Describe what an installed library of cameras lacks, as its source does; by extra."""
    if any(libraries.get("realsense", {}).values()):
        try:
            load_library()
        except MissingExtraError as error:
            return {"realsense": str(error)}
    return {}


def _open_gl(*, tries: bool) -> str:
    """Test whether MuJoCo's OpenGL starts, in a process of its own because a driver may crash."""
    missing = [name for name in ("mujoco", "OpenGL") if find_spec(name) is None]
    if missing:
        return f"not there: {' and '.join(missing)} missing; pip install 'servoid[sim,gl]'"
    if not tries:
        return "OpenGL, not tried"
    try:
        ran = _run([sys.executable, "-c", _TRY_GL])
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"does not start: {type(error).__name__}"
    if ran.returncode == 0:
        return "OpenGL without a window starts"
    last = (ran.stderr.strip().splitlines() or ["it crashed"])[-1]
    return f"does not start: {last.partition(': ')[2] or last}"


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=_GL_S)


def _usable_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _text_of(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
