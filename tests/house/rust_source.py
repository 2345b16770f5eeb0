"""Reads Rust files: what is code, what is only for tests, and what a path names."""

import re
from collections.abc import Iterator
from pathlib import Path

_NOT_CODE = re.compile(
    r"""//[^\n]*                      # line comment
    |   /\*.*?\*/                     # block comment
    |   b?r(\#*)".*?"\1               # raw string
    |   b?"(?:\\.|[^"\\])*"           # string
    |   b?'(?:\\.[^']*|[^'\\])'       # character, but not a lifetime
    """,
    re.VERBOSE | re.DOTALL,
)
_TEST_ONLY = re.compile(r"#\[cfg\(test\)\]")
_PATH = re.compile(r"\b(crate|super)((?:\s*::\s*super)*)\s*::\s*(\w+|\{|\*)")


def without_comments(text: str) -> str:
    """Blank comments and literals, keeping every line where it was."""
    return _NOT_CODE.sub(lambda match: re.sub(r"[^\n]", " ", match.group()), text)


def code(path: Path) -> str:
    """Return what `path` compiles to outside its tests; blanks stand for the rest."""
    if is_test_file(path):
        return ""
    text = without_comments(path.read_text(encoding="utf-8"))
    for match in reversed(list(_TEST_ONLY.finditer(text))):
        stop = _end_of_item(text, match.end())
        text = (
            text[: match.start()] + re.sub(r"[^\n]", " ", text[match.start() : stop]) + text[stop:]
        )
    return text


def is_test_file(path: Path) -> bool:
    """Tell whether a parent declares `path` as `#[cfg(test)] mod name;`."""
    declaration = re.compile(rf"#\[cfg\(test\)\]\s*(?:pub(?:\(\w+\))?\s+)?mod\s+{path.stem}\s*;")
    parents = [*path.parent.glob("*.rs"), path.parent.with_suffix(".rs")]
    return any(
        declaration.search(parent.read_text(encoding="utf-8"))
        for parent in parents
        if parent != path and parent.is_file()
    )


def top_modules(source: Path) -> set[str]:
    """Name the modules directly under the crate's root."""
    files = {path.stem for path in source.glob("*.rs")} - {"lib", "main"}
    return files | {
        path.name for path in source.iterdir() if path.is_dir() and any(path.glob("**/*.rs"))
    }


def used_modules(path: Path, source: Path) -> Iterator[tuple[int, str]]:
    """Yield (line, top-level module) for each path of the crate that `path` writes out."""
    text = code(path)
    here = [
        part
        for part in path.relative_to(source).with_suffix("").parts
        if part not in ("mod", "lib")
    ]
    for match in _PATH.finditer(text):
        ups = (match.group(1) == "super") + match.group(2).count("super")
        base = here[: len(here) - ups] if match.group(1) == "super" else []
        line = text.count("\n", 0, match.start()) + 1
        if base:
            yield line, base[0]
        elif match.group(3) == "{":
            yield from ((line, name) for name in _first_names(text, match.end() - 1))
        else:
            yield line, match.group(3)


def _end_of_item(text: str, start: int) -> int:
    """Find where the item after an attribute ends: at its `;` or its closing brace."""
    opening = re.compile(r"[;{]").search(text, start)
    if opening is None:
        return len(text)
    return opening.end() if opening.group() == ";" else _matching_brace(text, opening.start())


def _matching_brace(text: str, start: int) -> int:
    depth = 0
    for match in re.compile(r"[{}]").finditer(text, start):
        depth += 1 if match.group() == "{" else -1
        if depth == 0:
            return match.end()
    return len(text)


def _first_names(text: str, start: int) -> Iterator[str]:
    """Yield `a` and `c` of `{a::b, c::{d, e}}`."""
    inside = text[start + 1 : _matching_brace(text, start) - 1]
    while "{" in inside:
        inside = re.sub(r"\{[^{}]*\}", "", inside)
    for part in inside.split(","):
        if name := re.match(r"\s*(\w+)", part):
            yield name.group(1)
