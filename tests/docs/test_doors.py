"""A room of the package is entered through its door."""

from pathlib import Path

import pytest
from doors import from_drawers, kept_for_nobody, taken_from_others

PYTHON = Path(__file__).parents[2] / "python" / "servoid"


def test_nothing_is_imported_from_a_drawer_of_another_room() -> None:
    assert len(list(taken_from_others(PYTHON))) > 500
    assert from_drawers(PYTHON) == []


def test_a_door_holds_nothing_that_is_neither_public_nor_used_by_another_room() -> None:
    assert kept_for_nobody(PYTHON) == []


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
    ("text", "drawer"),
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
def test_an_import_from_a_drawer_is_caught(package: Path, text: str, drawer: str) -> None:
    (package / "pose" / "a.py").write_text(text)
    assert [line.split(": ")[1] for line in from_drawers(package)] == ([drawer] if drawer else [])


def test_a_room_may_use_its_own_drawers(package: Path) -> None:
    (package / "camera" / "a.py").write_text("from servoid.camera.lens.pinhole import Pinhole")
    assert from_drawers(package) == []


def test_what_a_door_binds_for_nobody_is_caught(package: Path) -> None:
    assert kept_for_nobody(package) == ["servoid.camera.read"]
    (package / "pose" / "a.py").write_text("from servoid.camera import read")
    assert kept_for_nobody(package) == []
