"""Reads the floors in ARCHITECTURE.md, and the arrows between modules in the sources."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import rust_source

FACADE = "servoid"


@dataclass(frozen=True)
class Arrow:
    """One module names another, at one line of one file."""

    source: str
    target: str
    file: Path
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.source} uses {self.target}"


@dataclass(frozen=True)
class Row:
    """What ARCHITECTURE.md says of one module: where it exists, and its one line."""

    rust: bool
    python: bool
    line: str


def read_table(text: str, heading: str) -> list[list[str]]:
    """Return the cells of the first table under `## heading`, without its head."""
    section = re.split(r"^## ", text, flags=re.MULTILINE)
    chosen = [part for part in section if part.splitlines()[:1] == [heading]]
    if not chosen:
        raise ValueError(f"ARCHITECTURE.md has no section '## {heading}'")
    rows = [line.strip().strip("|") for line in chosen[0].splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row.split("|")] for row in rows[2:]]


def read_floors(text: str) -> dict[str, int]:
    """Map each module to its floor; the ground, which has no number, is -1."""
    floors: dict[str, int] = {}
    for number, modules, *_ in read_table(text, "Floors"):
        for module in re.findall(r"`(\w+)`", modules):
            floors[module] = -1 if number == "ground" else int(number)
    return floors


def read_modules(text: str) -> dict[str, Row]:
    """Map each module to what is said of it."""
    return {
        name.strip("`"): Row(rust == "yes", python == "yes", line)
        for name, rust, python, line in read_table(text, "Modules")
    }


def python_modules(package: Path) -> set[str]:
    """Name the top-level modules of a Python package, its native one included."""
    files = {path.stem for path in [*package.glob("*.py"), *package.glob("*.pyi")]}
    folders = {
        path.name for path in package.iterdir() if path.is_dir() and any(path.glob("**/*.py"))
    }
    return (files | folders) - {"__init__", "__main__"}


def rust_arrows(source: Path) -> Iterator[Arrow]:
    """Yield every path from one top-level module of the crate to another."""
    for file in sorted(source.rglob("*.rs")):
        module = file.relative_to(source).parts[0].removesuffix(".rs")
        if module in ("lib", "main"):
            continue
        for line, target in rust_source.used_modules(file, source):
            if target != module:
                yield Arrow(module, target, file.relative_to(source), line)


def python_arrows(package: Path) -> Iterator[Arrow]:
    """Yield every import from one top-level module of the package to another.

    Imports inside functions and under TYPE_CHECKING count. The package's own `__init__` shows
    what others may use, so it may import everything; who imports from it gets the arrow to it.
    """
    known = python_modules(package)
    for file in sorted(package.rglob("*.py")):
        parts = file.relative_to(package).with_suffix("").parts
        if parts[0] in ("__init__", "__main__"):
            continue
        for line, target in _imported(file, parts, known):
            if target != parts[0]:
                yield Arrow(parts[0], target, file.relative_to(package), line)


def wrong_arrows(floors: dict[str, int], arrows: Iterator[Arrow]) -> list[str]:
    """Say which arrows do not point to a lower floor, or to a module that has none."""
    wrong = []
    for arrow in arrows:
        source, target = floors.get(arrow.source), floors.get(arrow.target)
        if source is None or target is None:
            unknown = arrow.source if source is None else arrow.target
            wrong.append(f"{arrow}, but `{unknown}` stands on no floor of ARCHITECTURE.md")
        elif source == target == -1:
            continue
        elif target >= source:
            way = "up" if target > source else "sideways"
            wrong.append(f"{arrow}: an arrow {way}, from floor {source} to floor {target}")
    return wrong


def _imported(file: Path, parts: tuple[str, ...], known: set[str]) -> Iterator[tuple[int, str]]:
    tree = ast.parse(file.read_text(encoding="utf-8"), filename=str(file))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield from _top(node.lineno, alias.name.split("."), [], known)
        elif isinstance(node, ast.ImportFrom):
            dotted = node.module.split(".") if node.module else []
            if node.level:
                # A package's `__init__` counts itself as the first level.
                here = [FACADE, *parts]
                dotted = here[: len(here) - node.level] + dotted
            yield from _top(node.lineno, dotted, [alias.name for alias in node.names], known)
        elif isinstance(node, ast.Call) and _called(node.func) == "import_module":
            for argument in node.args[:1]:
                if isinstance(argument, ast.Constant) and isinstance(argument.value, str):
                    yield from _top(node.lineno, argument.value.split("."), [], known)


def _called(function: ast.expr) -> str:
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


def _top(
    line: int, dotted: list[str], names: list[str], known: set[str]
) -> Iterator[tuple[int, str]]:
    if dotted[:1] != [FACADE]:
        return
    if len(dotted) > 1:
        yield line, dotted[1]
        return
    for name in names or [FACADE]:
        yield line, name if name in known else FACADE
