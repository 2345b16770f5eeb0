"""A part of the package is imported by its interface."""

from pathlib import Path

import pytest
from interfaces import exposed_for_nobody, imports_of_others, past_interfaces

PYTHON = Path(__file__).parents[2] / "python" / "servoid"


def test_nothing_internal_is_imported_from_another_part() -> None:
    assert len(list(imports_of_others(PYTHON))) > 500
    assert past_interfaces(PYTHON) == []


def test_an_interface_holds_nothing_that_is_neither_public_nor_used_by_another_part() -> None:
    assert exposed_for_nobody(PYTHON) == []


# The check itself is checked.


@pytest.fixture
def package(tmp_path: Path) -> Path:
    package = tmp_path / "servoid"
    for folder in ("pose", "camera/lens", "camera/open"):
        (package / folder).mkdir(parents=True)
        (package / folder / "__init__.py").touch()
    (package / "__init__.py").touch()
    (package / "camera" / "__init__.py").write_text(
        "from servoid.camera.lens.pinhole import Pinhole\nfrom servoid.camera.images import read\n"
        "__all__ = ['Pinhole']\n"
    )
    (package / "camera" / "open" / "__init__.py").write_text("__all__ = ['opened']\n")
    for module in ("images", "lens/pinhole"):
        (package / "camera" / f"{module}.py").touch()
    return package


@pytest.mark.parametrize(
    ("text", "internal"),
    [
        ("from servoid.camera import Pinhole, read", ""),
        ("from servoid.camera.open import opened", ""),
        ("import servoid.camera", ""),
        ("from servoid.errors import Fault", ""),
        ("from servoid.camera.images import read", "servoid.camera.images.read"),
        ("def f():\n    from servoid.camera.images import read", "servoid.camera.images.read"),
        ("from servoid.camera import images", "servoid.camera.images"),
        ("from servoid.camera.lens.pinhole import Pinhole", "servoid.camera.lens.pinhole.Pinhole"),
        ("from servoid.camera.lens import pinhole", "servoid.camera.lens.pinhole"),
        ("from servoid.camera.open import other", "servoid.camera.open.other"),
        ("import servoid.camera.images", "servoid.camera.images"),
    ],
)
def test_an_import_of_something_internal_is_caught(package: Path, text: str, internal: str) -> None:
    (package / "pose" / "a.py").write_text(text)
    assert [line.split(": ")[1] for line in past_interfaces(package)] == (
        [internal] if internal else []
    )


def test_a_part_may_import_what_is_internal_to_it(package: Path) -> None:
    (package / "camera" / "a.py").write_text("from servoid.camera.lens.pinhole import Pinhole")
    assert past_interfaces(package) == []


def test_what_an_interface_binds_for_nobody_is_caught(package: Path) -> None:
    assert exposed_for_nobody(package) == ["servoid.camera.read"]
    (package / "pose" / "a.py").write_text("from servoid.camera import read")
    assert exposed_for_nobody(package) == []
