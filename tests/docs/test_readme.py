import json
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import jsonschema
import pytest
from drawn import Drawn
from recordings import Recording, run_servoid

from servoid.capture import open_capture
from servoid.sim import write_sample

ROOT = Path(__file__).parents[2]
PROGRAMS = Path(sys.executable).parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [page for page in PAGES if "_build" not in page.parts]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
QUICK_EXAMPLE = ROOT / "examples" / "model_a_capture.py"
FENCE = re.compile(r"^(`{3,})([^\n`]*)\n(.*?)^\1$", re.MULTILINE | re.DOTALL)
VARIABLE = re.compile(r"[A-Z_]+=.*")
TARGETS = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))


@dataclass(frozen=True)
class Block:
    language: str
    text: str


def blocks(text: str) -> list[Block]:
    return [Block(match.group(2).strip(), match.group(3)) for match in FENCE.finditer(text)]


TYPED = [
    page
    for page in PAGES
    if any(
        block.language in ("python", "console", "sh") for block in blocks(page.read_text("utf-8"))
    )
]


def commands(block: Block) -> list[str]:
    """Return what a person types: all lines of `sh`, those after `$ ` of `console`."""
    lines = block.text.replace("\\\n", " ").splitlines()
    if block.language == "console":
        lines = [line[2:] for line in lines if line.startswith("$ ")]
    return [line.strip() for line in lines if line.strip() and not line.startswith("#")]


def run(command: list[str], folder: Path) -> str:
    """Run a command, before whose name variables of its environment may be set."""
    environment = os.environ | {"PATH": f"{PROGRAMS}{os.pathsep}{os.environ['PATH']}"}
    environment |= {"MPLBACKEND": "agg", "NO_COLOR": "1"}
    while VARIABLE.fullmatch(command[0]):
        name, _, value = command[0].partition("=")
        environment, command = environment | {name: value}, command[1:]
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, f"{shlex.join(command)}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@cache
def examined() -> str:
    """Run `servoid doctor` once for all pages: it neither reads nor writes a folder."""
    return run(["servoid", "doctor"], ROOT)


def execute(block: Block, folder: Path, *, apart: bool = False) -> None:
    """Run one block in `folder`; of `make`, only check that the target exists.

    Unless `apart`, `servoid` runs in this process, except where a variable stands before it: a
    program that begins takes half a second to import what it needs.
    """
    if block.language == "python":
        run([sys.executable, "-c", block.text], folder)
    elif block.language in ("console", "sh"):
        for command in commands(block):
            words = shlex.split(command)
            if words[0] == "make":
                assert set(words[1:]) <= TARGETS, command
            elif words == ["servoid", "doctor"]:
                examined()
            elif words[0] == "servoid" and not apart:
                run_servoid(folder, *words[1:])
            else:
                run(words, folder)


@pytest.fixture(scope="session")
def sample(tmp_path_factory: pytest.TempPathFactory, drawn: Drawn) -> Path:
    return drawn(tmp_path_factory.mktemp("pages") / "sample", "sample", (), write_sample)


@pytest.fixture(scope="session")
def moving(recording: Callable[[str], Recording]) -> Path:
    return recording("colour").folder


@pytest.fixture
def folder(tmp_path: Path, sample: Path, moving: Path) -> Path:
    """Return a folder that looks like a clone after `make samples`."""
    (tmp_path / ".venv").mkdir()
    (tmp_path / ".venv" / "bin").symlink_to(PROGRAMS)
    shutil.copytree(sample, tmp_path / "out" / "sample")
    (tmp_path / "out" / "moving").symlink_to(moving)
    return tmp_path


def unless(path: Path, quick: Path) -> object:
    """Return a parameter whose test is a quick one for one path only."""
    marks = [] if path == quick else [pytest.mark.extended]
    return pytest.param(path, marks=marks, id=path.relative_to(ROOT).as_posix())


@pytest.mark.extended
@pytest.mark.parametrize("page", TYPED, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_what_a_page_tells_to_type_works(page: Path, folder: Path) -> None:
    for block in blocks(page.read_text(encoding="utf-8")):
        execute(block, folder, apart=page == ROOT / "README.md")


@pytest.mark.parametrize("example", [unless(one, QUICK_EXAMPLE) for one in EXAMPLES])
def test_an_example_runs_and_says_what_it_found(example: Path, folder: Path) -> None:
    assert run([sys.executable, str(example)], folder).strip()


@pytest.mark.parametrize(
    "example",
    [unless(one, QUICK_EXAMPLE) for one in EXAMPLES if "sys.argv" in one.read_text("utf-8")],
)
def test_an_example_whose_folder_is_missing_says_so_without_a_traceback(
    example: Path, tmp_path: Path
) -> None:
    command = [sys.executable, str(example), "none"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert re.fullmatch(r"error: [^\n]*none[^\n]*\n", done.stderr)


def test_the_readme_shows_the_command_and_the_python_interface() -> None:
    shown = blocks((ROOT / "README.md").read_text(encoding="utf-8"))
    typed = [
        command for block in shown if block.language == "console" for command in commands(block)
    ]
    python = [block.text for block in shown if block.language == "python"]
    assert typed[0] == "make demo"
    assert any("servoid model" in command for command in typed)
    assert any("servoid track" in command for command in typed)
    assert ["fit(" in python[0], "Tracker(" in python[1], "Controller(" in python[2]] == [True] * 3
    lines = [[line for line in block.splitlines() if line.strip()] for block in python]
    assert max(len(block) for block in lines) <= 10


@pytest.mark.extended
def test_the_hand_of_the_readme_arrives_as_near_as_the_readme_says(tmp_path: Path) -> None:
    """The recording is the one of `make samples`, longer than that of the other tests."""
    made = re.search(
        r"servoid (sample out/moving .*)", (ROOT / "Makefile").read_text(encoding="utf-8")
    )
    assert made is not None
    (tmp_path / "out").mkdir()
    run_servoid(tmp_path, *shlex.split(made[1]))
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    [shown] = [block for block in blocks(text) if "Controller(" in block.text]
    printed = run([sys.executable, "-c", shown.text], tmp_path)
    parts = re.search(r"translation=\((.*?)\), quaternion=.* not held\n$", printed)
    said = re.search(r"the hand ends less than (\d+) mm from its goal, and is not held", text)
    assert parts is not None and said is not None, printed
    off_mm = 1e3 * math.hypot(*map(float, parts[1].split(",")))
    assert off_mm < float(said[1])


def test_nothing_that_the_readme_writes_replaces_what_it_wrote_before() -> None:
    written = [
        file
        for block in blocks((ROOT / "README.md").read_text(encoding="utf-8"))
        for file in re.findall(r"(?:--(?:out|report|video)[ =]|\.save\(\")([^\s\"]+)", block.text)
    ]
    assert len(written) > 4
    assert sorted(written) == sorted(set(written))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_links_of_a_page_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    inner = [link for link in links if "://" not in link]
    assert [link for link in inner if not (page.parent / link).exists()] == []


def test_the_make_targets_that_pages_name_exist() -> None:
    named = {
        target
        for page in PAGES
        for target in re.findall(r"`make ([a-z-]+)`", page.read_text(encoding="utf-8"))
    }
    assert {"demo", "test"} <= named <= TARGETS


def test_the_capture_on_the_page_of_formats_can_be_opened(tmp_path: Path) -> None:
    toml, poses = blocks((ROOT / "docs" / "formats.md").read_text(encoding="utf-8"))[:2]
    (tmp_path / "capture.toml").write_text(toml.text)
    (tmp_path / "poses.csv").write_text(poses.text)
    for name in ("images/0.jpg", "masks/0.png"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).touch()
    assert [view.name for view in open_capture(tmp_path).views()] == ["eye/0"]


def test_the_body_on_the_page_of_formats_keeps_to_the_schema() -> None:
    shown = blocks((ROOT / "docs" / "formats.md").read_text(encoding="utf-8"))
    schema = ROOT / "python" / "servoid" / "shape" / "body.schema.json"
    [body] = [json.loads(block.text) for block in shown if block.language == "json"]
    jsonschema.validate(body, json.loads(schema.read_text(encoding="utf-8")))


def test_no_figure_is_left_open() -> None:
    assert [page.name for page in PAGES if "@@" in page.read_text(encoding="utf-8")] == []


# The reading of pages is itself checked.


def test_only_what_stands_after_the_prompt_is_typed() -> None:
    block = Block("console", "$ make test\n12 passed\n$ servoid \\\n  --help\n# a word\n")
    assert commands(block) == ["make test", "servoid    --help"]


def test_a_block_that_fails_is_reported(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="no such thing"):
        execute(Block("python", "raise SystemExit('no such thing')"), tmp_path)
    with pytest.raises(AssertionError, match="make nothing"):
        execute(Block("console", "$ make nothing"), tmp_path)
    for apart in (False, True):
        with pytest.raises(AssertionError, match="servoid model nothing"):
            execute(Block("console", "$ servoid model nothing"), tmp_path, apart=apart)


def test_a_variable_before_a_command_is_in_its_environment(tmp_path: Path) -> None:
    command = shlex.join([sys.executable, "-c", "import os; assert os.environ['WORD'] == 'a b'"])
    execute(Block("console", f"$ WORD='a b' {command}\n"), tmp_path)


def test_fenced_blocks_are_found_with_their_language() -> None:
    text = "a\n```python\nx = 1\n```\nb\n```text\ny\n```\n"
    assert blocks(text) == [Block("python", "x = 1\n"), Block("text", "y\n")]
