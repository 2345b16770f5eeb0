import shutil
from pathlib import Path

import pytest
import rust_source
from architecture import (
    python_arrows,
    python_modules,
    read_floors,
    read_modules,
    read_table,
    rust_arrows,
    wrong_arrows,
)

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
FLOORS = read_floors(TEXT)
MODULES = read_modules(TEXT)
RUST = ROOT / "crates" / "servoid" / "src"
PYTHON = ROOT / "python" / "servoid"


def test_arrows_between_rust_modules_point_down() -> None:
    assert wrong_arrows(FLOORS, rust_arrows(RUST)) == []


def test_arrows_between_python_modules_point_down() -> None:
    assert wrong_arrows(FLOORS, python_arrows(PYTHON)) == []


def test_nothing_that_is_installed_or_shown_imports_the_experiments() -> None:
    files = [*PYTHON.rglob("*.py"), *(ROOT / "examples").rglob("*.py")]
    assert len(files) > 20
    named = [str(file) for file in files if "servoid_experiments" in file.read_text("utf-8")]
    assert named == []


def test_rust_modules_are_those_that_the_architecture_lists() -> None:
    assert rust_source.top_modules(RUST) == {name for name, row in MODULES.items() if row.rust}


def test_python_modules_are_those_that_the_architecture_lists() -> None:
    assert python_modules(PYTHON) == {name for name, row in MODULES.items() if row.python}


def test_every_module_stands_on_one_floor_and_has_one_line() -> None:
    assert set(MODULES) == set(FLOORS)
    assert [name for name, row in MODULES.items() if len(row.line) < 10] == []
    named = [name for row in read_table(TEXT, "Floors") for name in row[1].split()]
    assert len(named) == len(set(named))


def test_the_core_knows_no_python_and_no_files() -> None:
    manifest = (RUST.parent / "Cargo.toml").read_text(encoding="utf-8")
    assert "pyo3" not in manifest and "numpy" not in manifest
    forbidden = [
        "std::fs",
        "std::io",
        "std::env",
        "std::net",
        "std::process",
        "print!",
        "println!",
        "dbg!",
    ]
    found = [
        f"{file.relative_to(RUST)}: {word}"
        for file in sorted(RUST.rglob("*.rs"))
        # A forked child is told by its number; no process is started.
        for code in [rust_source.code(file).replace("std::process::id()", "")]
        for word in forbidden
        if word in code
    ]
    assert found == []


# The check itself is checked: a tree with a known fault must be caught.

A_TABLE = """
## Floors

| Floor | Modules | Note |
|---|---|---|
| 7 | `sim` `view` | siblings |
| 1 | `observe` | |
| 0 | `pose` | |
| ground | `errors` `_native` | |

## Modules
"""


def python_tree(root: Path, file: str, text: str) -> Path:
    package = root / "servoid"
    for name in ("sim", "view", "observe", "pose"):
        (package / name).mkdir(parents=True)
        (package / name / "__init__.py").touch()
    (package / "errors.py").touch()
    (package / "__init__.py").write_text("from .sim import x\n")
    (package / file).write_text(text)
    return package


@pytest.mark.parametrize(
    ("file", "text", "fault"),
    [
        ("pose/a.py", "from servoid.observe import Camera\n", "up"),
        ("pose/a.py", "from ..observe.camera import Camera\n", "up"),
        ("pose/__init__.py", "from ..observe import Camera\n", "up"),
        ("pose/a.py", "import servoid.observe.camera\n", "up"),
        ("pose/a.py", "from servoid import observe\n", "up"),
        ("pose/a.py", "from .. import observe\n", "up"),
        ("pose/a.py", "def f():\n    import servoid.sim\n", "up"),
        ("pose/a.py", "if TYPE_CHECKING:\n    from servoid.observe import Camera\n", "up"),
        ("pose/a.py", "import importlib\nimportlib.import_module('servoid.sim')\n", "up"),
        ("sim/a.py", "from servoid.view import plot\n", "sideways"),
        ("errors.py", "from servoid.pose import Pose\n", "up"),
        ("pose/a.py", "from servoid import Camera\n", "no floor"),
        ("extra.py", "from servoid import pose\n", "no floor"),
    ],
)
def test_a_wrong_import_is_caught(tmp_path: Path, file: str, text: str, fault: str) -> None:
    found = wrong_arrows(read_floors(A_TABLE), python_arrows(python_tree(tmp_path, file, text)))
    assert len(found) == 1
    assert fault in found[0]


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("sim/a.py", "from servoid.observe import Camera\nfrom servoid.errors import E\n"),
        ("sim/a.py", "from .b import c\nfrom servoid.sim import d\nimport numpy\n"),
        ("observe/a.py", '"""from servoid.sim import x"""\n# import servoid.sim\n'),
        ("errors.py", "from servoid._native import __version__\n"),
    ],
)
def test_a_right_import_is_let_through(tmp_path: Path, file: str, text: str) -> None:
    package = python_tree(tmp_path, file, text)
    (package / "_native.pyi").touch()
    assert wrong_arrows(read_floors(A_TABLE), python_arrows(package)) == []


@pytest.mark.parametrize(
    "text",
    [
        "use crate::observe::Camera;",
        "use crate::{observe::Camera};",
        "use crate::{\n    pose::{Pose, PoseError},\n    observe::{Camera},\n};",
        "fn f() -> crate::observe::Camera { todo() }",
        "use super::super::observe::Camera;",
        "pub(in crate::observe) fn f() {}",
    ],
)
def test_a_wrong_path_in_rust_is_caught(tmp_path: Path, text: str) -> None:
    file = tmp_path / "pose" / "se3.rs"
    file.parent.mkdir()
    file.write_text(text)
    assert [arrow.target for arrow in rust_arrows(tmp_path)].count("observe") == 1
    found = wrong_arrows(read_floors(A_TABLE), rust_arrows(tmp_path))
    assert len(found) == 1
    assert "an arrow up" in found[0]


@pytest.mark.parametrize(
    "text",
    [
        "// use crate::observe::Camera;",
        "/// See [`crate::observe::Camera`].\npub struct Pose;",
        'const A: &str = "crate::observe";',
        "use super::PoseError;\nuse crate::pose::Pose;",
        "#[cfg(test)]\nmod tests {\n    use crate::observe::Camera;\n    fn f() { {} }\n}",
    ],
)
def test_what_is_no_arrow_in_rust_is_let_through(tmp_path: Path, text: str) -> None:
    file = tmp_path / "pose" / "se3.rs"
    file.parent.mkdir()
    file.write_text(text)
    assert list(rust_arrows(tmp_path)) == []


def test_one_import_added_to_the_real_tree_is_caught(tmp_path: Path) -> None:
    source = tmp_path / "src"
    shutil.copytree(RUST, source)
    with (source / "pose" / "mod.rs").open("a", encoding="utf-8") as file:
        file.write("\nuse crate::model::progressive;\n")
    found = wrong_arrows(FLOORS, rust_arrows(source))
    assert [line.split(": ", 1)[1] for line in found] == [
        f"pose uses model: an arrow up, from floor 0 to floor {FLOORS['model']}"
    ]
