"""Says what servoid runs on, for a report of a fault or of a speed."""

import operator
import os
import platform
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator
from importlib.metadata import PackageNotFoundError, metadata, version
from pathlib import Path

import typer

from servoid import _native

_LABEL_WIDTH, _WIDTH = 15, 80
_NEEDED = "needed"
_NAME = re.compile(r"[\w.-]+")
_EXTRA = re.compile(r"extra == ['\"](?P<extra>[\w-]+)['\"]")
_PYTHON = re.compile(
    r"python_(?P<full>full_)?version (?P<sign><=|>=|==|!=|<|>) ['\"](?P<numbers>[\d.]+)['\"]"
)
_Numbers = tuple[int, ...]
_SIGNS: dict[str, Callable[[_Numbers, _Numbers], bool]] = {
    "<=": operator.le,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    ">": operator.gt,
}
_CPU_MODEL = re.compile(r"^model name\s*: (.+)$", re.MULTILINE)


def run_doctor() -> None:
    """Print versions, the back end and the libraries that extras bring, present or not."""
    for label, value in _rows():
        lines = textwrap.wrap(
            value, _WIDTH - _LABEL_WIDTH - 1, break_long_words=False, break_on_hyphens=False
        )
        for number, line in enumerate(lines):
            typer.echo(f"{label if number == 0 else '':<{_LABEL_WIDTH}} {line}")


def _rows() -> Iterator[tuple[str, str]]:
    yield "servoid", _native.__version__
    yield "python", f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    yield "cores", _cores()
    others = ", ".join(_native.backends())
    yield (
        "back end",
        f"{_native.backend()} (this machine has {others}; SERVOID_BACKEND forces one, and all give "
        "the same numbers)",
    )
    try:
        requirements = metadata("servoid").get_all("Requires-Dist") or ()
    except PackageNotFoundError:
        yield "libraries", "not known: servoid runs without being installed"
        return
    for extra, names in libraries(requirements, platform.python_version()).items():
        label = extra if extra == _NEEDED else f"[{extra}]"
        found = {name: _version(name) for name in names}
        said = ", ".join(f"{name} {number or 'missing'}" for name, number in found.items())
        if extra != _NEEDED and None in found.values():
            said += f"; pip install 'servoid[{extra}]' brings it"
        yield label, said


def libraries(requirements: Iterable[str], python: str) -> dict[str, list[str]]:
    """Return the names of the libraries by extra, without those for other versions of Python.

    What is always needed comes first. `requirements` are written as a package's metadata has them.
    """
    found: dict[str, set[str]] = {_NEEDED: set()}
    for requirement in requirements:
        what, _, marker = requirement.partition(";")
        name, extra = _NAME.match(what.strip()), _EXTRA.search(marker)
        if name is not None and _applies(marker, python):
            found.setdefault(_NEEDED if extra is None else extra["extra"], set()).add(name[0])
    return {extra: sorted(names) for extra, names in sorted(found.items(), key=_needed_first)}


def _needed_first(item: tuple[str, object]) -> tuple[bool, str]:
    return item[0] != _NEEDED, item[0]


def _applies(marker: str, python: str) -> bool:
    return all(
        _SIGNS[one["sign"]](_numbers(python, 3 if one["full"] else 2), _numbers(one["numbers"], 3))
        for one in _PYTHON.finditer(marker)
    )


def _numbers(written: str, count: int) -> _Numbers:
    parts = [int(part) for part in re.findall(r"\d+", written)[:count]]
    return (*parts, 0, 0)[:3]


def _cores() -> str:
    count, usable = os.cpu_count() or 1, _usable_cores()
    said = str(count) if usable == count else f"{usable} of {count}"
    model = _CPU_MODEL.search(_text_of(Path("/proc/cpuinfo")))
    return said if model is None else f"{said}, {model[1].strip()}"


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


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
