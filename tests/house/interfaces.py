"""Reads what each part of the package imports from another, and whether by its interface.

The interface of a part is its `__init__`: what that binds, others may import. A folder or a module
inside a part that lists its names in `__all__` is an interface too. All else is internal.
"""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path


@dataclass(frozen=True)
class Import:
    """One name that a file imports from another part; empty for a whole module."""

    file: Path
    line: int
    module: str
    name: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.module}.{self.name}".rstrip(".")


def imports_of_others(package: Path) -> Iterator[Import]:
    """Yield each name that a file of a package imports from another of its parts."""
    for file in sorted(package.rglob("*.py")):
        inside = file.relative_to(package)
        for line, module, names in _imports(_text(file)):
            parts = module.split(".")
            is_other = len(parts) > 1 and parts[0] == package.name and parts[1] != inside.parts[0]
            if is_other and (package / parts[1]).is_dir():
                yield from (Import(inside, line, module, name) for name in names or [""])


def past_interfaces(package: Path) -> list[str]:
    """Name the imports of what is internal to another part."""
    return [
        str(one)
        for one in imports_of_others(package)
        if one.name not in {"", *_shown(package, one.module)}
        or (not one.name and not _is_interface(package, one.module))
    ]


def exposed_for_nobody(package: Path) -> list[str]:
    """Name what an interface binds, but neither makes public nor gives to another part."""
    imported = {(one.module, one.name) for one in imports_of_others(package)}
    return [
        f"{module}.{name}"
        for folder in sorted(path.parent for path in package.glob("*/**/__init__.py"))
        for module in [".".join((package.name, *folder.relative_to(package).parts))]
        for text in [_text(folder / "__init__.py")]
        for name in sorted(_bound(text, module))
        if name not in _listed(text) and (module, name) not in imported
        if not _is_used(text, name)
    ]


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


@cache
def _imports(text: str) -> list[tuple[int, str, list[str]]]:
    found: list[tuple[int, str, list[str]]] = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module:
            found.append((node.lineno, node.module, [alias.name for alias in node.names]))
        elif isinstance(node, ast.Import):
            found += [(node.lineno, alias.name, []) for alias in node.names]
    return found


def _shown(package: Path, module: str) -> set[str]:
    """Return what a module shows to other parts."""
    text = _text(_init(package, module))
    is_part = module.count(".") == 1
    return (_bound(text) | _listed(text)) if is_part or _is_interface(package, module) else set()


def _is_interface(package: Path, module: str) -> bool:
    return module.count(".") == 1 or bool(_listed(_text(_init(package, module))))


def _init(package: Path, module: str) -> Path:
    place = package.joinpath(*module.split(".")[1:])
    return place / "__init__.py" if place.is_dir() else place.with_suffix(".py")


@cache
def _bound(text: str, own: str = "") -> set[str]:
    """Return the names that a file imports, those from the module `own` only if it is given."""
    return {
        alias.asname or alias.name
        for node in ast.parse(text).body
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(own)
        for alias in node.names
    }


@cache
def _listed(text: str) -> set[str]:
    """Return the names in the `__all__` of a file."""
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return set(ast.literal_eval(node.value))
    return set()


def _is_used(text: str, name: str) -> bool:
    return any(isinstance(node, ast.Name) and node.id == name for node in ast.walk(ast.parse(text)))
