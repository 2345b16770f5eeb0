"""What is public is listed, documented and typed."""

import inspect
import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
from stub_docs import STUB, documented

import servoid

ROOT = Path(__file__).parents[2]
PACKAGE = Path(servoid.__file__).parents[1]
PARTS = [name for name in servoid.__all__ if name != "__version__"]
NAMED = pytest.mark.parametrize("part", PARTS)


def public(part: str) -> list[tuple[str, object]]:
    """Return what a part of the package makes public, with its names."""
    module = import_module(f"servoid.{part}")
    names = getattr(module, "__all__", None) or [
        name for name, one in vars(module).items() if _is_own(one, module) and name[0] != "_"
    ]
    return [(f"{part}.{name}", getattr(module, name)) for name in names]


def _is_own(one: object, module: ModuleType) -> bool:
    return inspect.isclass(one) and one.__module__ == module.__name__


def undocumented(name: str, one: object) -> list[str]:
    """Return the names of what has no sentence that begins with a capital, members too."""
    members = vars(one) if inspect.isclass(one) else ()
    named = [key for key in members if key[0] != "_"]
    own = [(name, one), *((f"{name}.{key}", getattr(one, key)) for key in named)]
    documented_ones = [pair for pair in own if inspect.isclass(pair[1]) or callable(pair[1])]
    return [
        key for key, value in documented_ones if not (inspect.getdoc(value) or " ")[0].isupper()
    ]


def test_each_package_but_the_internal_ones_is_a_public_part() -> None:
    packages = {file.parent.name for file in (PACKAGE / "servoid").glob("*/__init__.py")}
    assert packages - {"cli", "config"} == set(PARTS) - {"errors"}


def test_each_part_is_an_attribute_of_the_package() -> None:
    script = f"import servoid; print([getattr(servoid, part).__name__ for part in {PARTS}])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.strip() == str([f"servoid.{part}" for part in PARTS]), done.stderr


@NAMED
def test_each_part_lists_what_is_public_once_and_in_order(part: str) -> None:
    names = [name for name, _ in public(part)]
    assert len(set(names)) == len(names)
    if part not in ("errors", "exchange"):
        ordered = sorted(names, key=lambda name: (not name.split(".")[1].isupper(), name))
        classes = [name for name in ordered if name.split(".")[1][0].isupper()]
        assert names == [*classes, *(name for name in ordered if name not in classes)]


@NAMED
def test_each_public_class_and_function_has_a_docstring(part: str) -> None:
    kinds = (type, type(undocumented), type(len))
    found = [(name, one) for name, one in public(part) if isinstance(one, kinds)]
    assert [bad for name, one in found for bad in undocumented(name, one)] == []


def test_a_name_means_the_same_in_every_part() -> None:
    meanings: dict[str, set[int]] = {}
    for part in PARTS:
        for name, one in public(part):
            meanings.setdefault(name.split(".")[1], set()).add(id(one))
    shared = {name for name, ones in meanings.items() if len(ones) > 1}
    assert shared <= {"Request"}  # of a model, and of a track


def test_each_part_is_on_the_page_of_the_interface() -> None:
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    named = set(re.findall(r"servoid\.(\w+)", page))
    assert set(PARTS) - named <= {"errors", "sim"}  # pages of their own


def test_native_classes_are_where_they_are_public() -> None:
    for part in PARTS:
        for name, one in public(part):
            if inspect.isclass(one) and getattr(one, "__module__", "").startswith("servoid._"):
                raise AssertionError(f"{name} says that it is of {one.__module__}")


def test_the_stub_has_the_docstrings_of_the_binding() -> None:
    text = STUB.read_text(encoding="utf-8")
    assert documented(text) == text, "run: python tests/house/stub_docs.py"


def test_another_docstring_in_the_binding_is_noticed() -> None:
    source = SimpleNamespace(f=SimpleNamespace(__doc__="New."), C=ModuleType("C", "Is it."))
    source.C.g = SimpleNamespace(__doc__="A word. " * 20)  # type: ignore[attr-defined]
    stub = 'def f() -> int:\n    """Old."""\n\nclass C:\n    def g(self) -> None: ...\n'
    made = documented(stub, source)
    assert '"""New."""' in made
    assert '"""Is it."""' in made
    assert documented(made, source) == made
    with pytest.raises(ValueError, match="f has no docstring"):
        documented(stub, SimpleNamespace(f=SimpleNamespace(__doc__=None)))


@pytest.mark.extended
def test_every_public_type_is_known() -> None:
    programs = Path(sys.executable).parent
    checker = shutil.which("basedpyright", path=str(programs))
    assert checker is not None
    # It asks the first Python of PATH where packages lie, and calls what it does not find complete.
    places = {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": str(PACKAGE)}
    done = subprocess.run(
        [checker, "--verifytypes", "servoid", "--ignoreexternal"],
        cwd=ROOT,
        env=os.environ | places,
        capture_output=True,
        text=True,
        timeout=600,
    )
    wrong = [line for line in done.stdout.splitlines() if " - error: " in line]
    assert wrong == []
    assert "Type completeness score: 100%" in done.stdout, done.stdout[-1000:] + done.stderr
