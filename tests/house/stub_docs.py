"""Writes the docstrings of the native module into its stub, so that editors show them.

Run it after a docstring in the binding changed: `python tests/house/stub_docs.py`.
"""

import ast
import inspect
import textwrap
from pathlib import Path

from servoid import _native

STUB = Path(__file__).parents[2] / "python" / "servoid" / "_native.pyi"
_WIDTH = 100


def documented(text: str, source: object = _native) -> str:
    """Return a stub in which each class and function has the docstring that `source` has."""
    lines = text.splitlines()
    edits: list[tuple[int, int, list[str]]] = []
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef):
            owner = getattr(source, node.name)
            edits.append(_edit(lines, node, inspect.getdoc(owner)))
            members = [one for one in node.body if isinstance(one, ast.FunctionDef)]
            edits += [
                _edit(lines, one, inspect.getdoc(getattr(owner, one.name)))
                for one in members
                if not one.name.startswith("__")
            ]
        elif isinstance(node, ast.FunctionDef) and not node.decorator_list:
            edits.append(_edit(lines, node, inspect.getdoc(getattr(source, node.name))))
    for first, last, new in sorted(edits, reverse=True):
        lines[first:last] = new
    return "\n".join(lines) + "\n"


def _edit(
    lines: list[str], node: ast.ClassDef | ast.FunctionDef, doc: str | None
) -> tuple[int, int, list[str]]:
    """Return the lines from which to which a node's docstring is, or goes, and the new ones."""
    if doc is None:
        raise ValueError(f"{node.name} has no docstring; write one in the binding")
    inner = " " * (node.col_offset + 4)
    written = _written(doc, inner)
    first = node.body[0]
    old = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    if old and isinstance(first.value.value, str):  # type: ignore[attr-defined]
        return first.lineno - 1, first.end_lineno or first.lineno, written
    head = lines[first.lineno - 1]
    if isinstance(node, ast.FunctionDef) and head.rstrip().endswith(": ..."):
        return first.lineno - 1, first.lineno, [head.rstrip().removesuffix(" ..."), *written]
    if isinstance(node, ast.FunctionDef):
        raise ValueError(f"{node.name} in the stub has a body; leave three dots")
    return node.lineno, node.lineno, [*written, ""]


def _written(doc: str, indent: str) -> list[str]:
    paragraphs = [" ".join(part.split()) for part in doc.split("\n\n")]
    wrap = textwrap.TextWrapper(
        _WIDTH, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False
    )
    body = [line for part in paragraphs for line in ("", *wrap.wrap(part))][1:]
    body[0] = f'{indent}"""{body[0].strip()}'
    if len(body[0]) > _WIDTH or (len(body) == 1 and len(body[0]) + 3 > _WIDTH):
        body = [f'{indent}"""', *wrap.wrap(paragraphs[0]), *body[len(wrap.wrap(paragraphs[0])) :]]
    return [*body[:-1], body[-1] + '"""'] if len(body) == 1 else [*body, f'{indent}"""']


if __name__ == "__main__":
    STUB.write_text(documented(STUB.read_text(encoding="utf-8")), encoding="utf-8")
