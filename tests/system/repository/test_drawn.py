from pathlib import Path

import pytest
from drawn import Drawn, sources

from conftest import Drawing, everything_in


def scribble(folder: Path) -> None:
    (folder / "inner").mkdir(parents=True)
    (folder / "inner" / "a.txt").write_text("drawn")


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "source.py"
    path.write_text("one way to draw")
    return path


@pytest.fixture
def shelf(tmp_path: Path) -> Path:
    path = tmp_path / "shelf"
    path.mkdir()
    return path


class Counted:
    def __init__(self) -> None:
        self.times = 0

    def __call__(self, folder: Path) -> None:
        self.times += 1
        scribble(folder)


def test_what_was_drawn_by_an_earlier_run_is_copied(
    tmp_path: Path, shelf: Path, source: Path
) -> None:
    draw = Counted()
    for name in ("first", "second"):
        assert Drawn(shelf, [source])(tmp_path / name, "scribble", (1, 2), draw) == tmp_path / name
        assert (tmp_path / name / "inner" / "a.txt").read_text() == "drawn"
    assert draw.times == 1


def test_other_settings_other_names_and_other_sources_are_drawn_anew(
    tmp_path: Path, shelf: Path, source: Path
) -> None:
    draw = Counted()
    Drawn(shelf, [source])(tmp_path / "a", "scribble", 1, draw)
    Drawn(shelf, [source])(tmp_path / "b", "scribble", 2, draw)
    Drawn(shelf, [source])(tmp_path / "c", "scrabble", 1, draw)
    source.write_text("another way to draw")
    Drawn(shelf, [source])(tmp_path / "d", "scribble", 1, draw)
    assert draw.times == 4


def test_what_a_test_spoils_is_whole_for_the_next(
    tmp_path: Path, shelf: Path, source: Path
) -> None:
    drawn = Drawn(shelf, [source])
    drawn(tmp_path / "a", "scribble", (), scribble)
    (tmp_path / "a" / "inner" / "a.txt").write_text("spoilt")
    drawn(tmp_path / "b", "scribble", (), scribble)
    assert (tmp_path / "b" / "inner" / "a.txt").read_text() == "drawn"


def test_a_drawing_that_breaks_off_leaves_nothing(
    tmp_path: Path, shelf: Path, source: Path
) -> None:
    def break_off(folder: Path) -> None:
        scribble(folder)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Drawn(shelf, [source])(tmp_path / "a", "scribble", (), break_off)
    assert list(shelf.iterdir()) == []
    assert not (tmp_path / "a").exists()


def test_without_a_shelf_each_is_drawn(tmp_path: Path) -> None:
    draw = Counted()
    for name in "ab":
        Drawn(None, [])(tmp_path / name, "scribble", (), draw)
    assert draw.times == 2


def test_the_key_knows_all_that_draws_and_the_binding() -> None:
    names = {path.name for path in sources()}
    assert {"snail.py", "moving.py", "sample.py", "patterns.py", "output.py"} <= names
    assert any(name.startswith("_native") and not name.endswith((".py", ".pyi")) for name in names)
    assert not {"app.py", "report.py"} & names


def test_a_drawing_that_was_remembered_is_the_drawing(tmp_path: Path) -> None:
    drawing = Drawing(views=2)
    write = Drawing.write.__wrapped__  # type: ignore
    anew = everything_in(write(drawing, tmp_path / "anew"))
    assert anew
    for name in "ab":
        assert everything_in(drawing.write(tmp_path / name)) == anew
