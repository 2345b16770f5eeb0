"""Finds arithmetic in the sources whose last bits hang on the processor."""

import ast
from collections.abc import Iterator
from pathlib import Path

# What feeds a result. What only draws, plots, writes or reads may compute as it likes.
EXACT = (
    "pose", "config", "camera", "capture", "segment", "stereo", "shape", "source", "model", "track",
    "servo", "sim/world", "sim/serial_arm.py",
    "sim/arm_file.py", "sim/trial/servoing.py", "sim/trial/truth.py",
)  # fmt: skip
MODULES = {"np": "numpy", "numpy": "numpy", "math": "math", "cmath": "math"}
BOTH = "sin cos tan sinh cosh tanh exp expm1 exp2 log log2 log10 log1p hypot cbrt"
FORBIDDEN = {
    "numpy": frozenset(
        f"{BOTH} arcsin arccos arctan arctan2 arcsinh arccosh arctanh power float_power logaddexp "
        "sinc angle unwrap geomspace logspace dot vdot inner outer matmul matvec vecmat vecdot "
        "tensordot einsum convolve correlate corrcoef cov polyfit polyval linalg fft".split()
    ),
    "math": frozenset(f"{BOTH} asin acos atan atan2 asinh acosh atanh pow dist sumprod".split()),
}
ADVICE = "its last bits hang on the processor; see servoid.pose.exact"
POSES = ("pose", "poses", "Pose")


def inexact(package: Path, exact: tuple[str, ...] = EXACT) -> list[str]:
    """Say where the files and folders of a package compute by what is not exact."""
    found = []
    for place in exact:
        path = package / place
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            tree = ast.parse(file.read_text(encoding="utf-8"), filename=str(file))
            lines = sorted({(node.lineno, what) for node, what in _faults(tree)})
            name = file.relative_to(package).as_posix()
            found += [f"{name}:{line}: {what}: {ADVICE}" for line, what in lines]
    return found


def _faults(tree: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            module = MODULES.get(node.value.id) if isinstance(node.value, ast.Name) else None
            if module is not None and node.attr in FORBIDDEN[module]:
                yield node, ast.unparse(node)
            elif module is None and node.attr == "dot" and ast.unparse(node.value) != "exact":
                yield node, ".dot"
        elif isinstance(node, ast.ImportFrom):
            first, *inner = (node.module or "").split(".")
            forbidden = FORBIDDEN.get(MODULES.get(first, ""), frozenset())
            of_these = not forbidden.isdisjoint(inner)
            names = [one.name for one in node.names if of_these or one.name in forbidden]
            yield from ((node, f"from {node.module} import {name}") for name in names)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id == "pow":
                yield node, "pow"
        elif isinstance(node, ast.BinOp | ast.AugAssign):
            yield from _operators(node)


def _operators(node: ast.BinOp | ast.AugAssign) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    sides = [node.left, node.right] if isinstance(node, ast.BinOp) else [node.target, node.value]
    if isinstance(node.op, ast.Pow) and not all(_is_whole(side) for side in sides):
        yield node, "** (write x * x, np.square or exact.power)"
    if isinstance(node.op, ast.MatMult) and not any(_is_pose(side) for side in sides):
        yield node, "@ between arrays"


def _is_whole(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


def _is_pose(node: ast.expr) -> bool:
    """Say if what is multiplied is a `Pose` by its name: one of `a_from_b`, a call that makes it.

    Sources have no types, so an array by such a name is not found.
    """
    if isinstance(node, ast.BinOp):
        return isinstance(node.op, ast.MatMult) and (_is_pose(node.left) or _is_pose(node.right))
    if isinstance(node, ast.Call):
        called = node.func
        if isinstance(called, ast.Attribute) and called.attr == "inverse":
            return True
        return ast.unparse(called).split(".")[0] == "Pose"
    if isinstance(node, ast.Subscript):
        # One of several poses, and no part of a matrix.
        return isinstance(node.slice, ast.Name) and _is_pose(node.value)
    name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")
    return name.lstrip("_") in POSES or "_from_" in name
