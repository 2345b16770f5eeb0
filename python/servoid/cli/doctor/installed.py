"""Lists the libraries that servoid declares, by extra, and which of them are installed."""

import ast
import operator
import platform
import re
from collections.abc import Callable, Iterable, Mapping
from importlib.metadata import PackageNotFoundError, metadata, version

NEEDED = "needed"
"""The key of the libraries that are always needed; the other keys are names of extras."""

_NAME = re.compile(r"[\w.-]+")
_EXTRA = re.compile(r"extra == ['\"](?P<extra>[\w-]+)['\"]")
_PYTHON = re.compile(
    r"python_(?P<full>full_)?version (?P<sign><=|>=|==|!=|<|>) ['\"](?P<numbers>[\d.]+)['\"]"
)
_MACHINE = re.compile(r"platform_machine (?P<sign>==|!=) ['\"](?P<machine>\w+)['\"]")
_OTHER = re.compile(r"\w+ (?:<=|>=|==|!=|<|>|in|not in) ['\"][^'\"]*['\"]")
_Numbers = tuple[int, ...]
_SIGNS: dict[str, Callable[[_Numbers, _Numbers], bool]] = {
    "<=": operator.le,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    ">": operator.gt,
}


def installed_libraries() -> dict[str, dict[str, str | None]] | None:
    """Return the version of each library, None where it is missing, by extra.

    The result is None where servoid is not installed as a package, so that nothing is known.
    """
    try:
        requirements = metadata("servoid").get_all("Requires-Dist") or ()
    except PackageNotFoundError:
        return None
    named = libraries(requirements, platform.python_version(), platform.machine())
    return {
        extra: {name: installed_version(name) for name in names} for extra, names in named.items()
    }


def libraries(
    requirements: Iterable[str], python: str, machine: str = ""
) -> Mapping[str, list[str]]:
    """Return the names of the libraries by extra, without those for other Pythons and machines.

    The libraries that are always needed come first. `requirements` have the form of a package's
    metadata; an extra without a library for this machine has an empty list.
    """
    found: dict[str, set[str]] = {NEEDED: set()}
    for requirement in requirements:
        what, _, marker = requirement.partition(";")
        name, extra = _NAME.match(what.strip()), _EXTRA.search(marker)
        names = found.setdefault(NEEDED if extra is None else extra["extra"], set())
        if name is not None and _applies(marker, python, machine):
            names.add(name[0])
    return {extra: sorted(names) for extra, names in sorted(found.items(), key=_needed_first)}


def installed_version(name: str) -> str | None:
    """Return the version of an installed library, None if it is not installed."""
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _needed_first(item: tuple[str, object]) -> tuple[bool, str]:
    return item[0] != NEEDED, item[0]


def _applies(marker: str, python: str, machine: str) -> bool:
    """Return whether a marker holds here; its parts on extras and other systems count as true."""
    if not marker.strip():
        return True

    def of_python(one: re.Match[str]) -> str:
        here = _numbers(python, 3 if one["full"] else 2)
        return str(_SIGNS[one["sign"]](here, _numbers(one["numbers"], 3)))

    def of_machine(one: re.Match[str]) -> str:
        return str((one["machine"] == machine) == (one["sign"] == "=="))

    decided = _MACHINE.sub(of_machine, _PYTHON.sub(of_python, marker))
    return _holds(ast.parse(_OTHER.sub("True", decided).strip(), mode="eval").body)


def _holds(part: ast.expr) -> bool:
    if isinstance(part, ast.BoolOp):
        joined = all if isinstance(part.op, ast.And) else any
        return joined(map(_holds, part.values))
    return isinstance(part, ast.Constant) and part.value is True


def _numbers(written: str, count: int) -> _Numbers:
    parts = [int(part) for part in re.findall(r"\d+", written)[:count]]
    return (*parts, 0, 0)[:3]
