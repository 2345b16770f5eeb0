import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import servoid
from conftest import Command, everything_in
from servoid.cli.model import modelling
from servoid.errors import MissingExtraError, OutputError
from servoid.model import ModelResult
from servoid.shape import load_body
from servoid.track import learn_appearance

PLAIN_CONSOLE = {**os.environ, "COLUMNS": "80", "NO_COLOR": "1"}


def run_apart(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=PLAIN_CONSOLE | environment,
        timeout=60,
        check=False,
    )


@pytest.fixture
def put_view(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[..., list[Path]]], None]:
    """Put a function in the place of the one that draws reports."""

    def put(write_report: Callable[..., list[Path]]) -> None:
        view = ModuleType("servoid.view")
        vars(view)["write_report"] = write_report
        monkeypatch.setitem(sys.modules, "servoid.view", view)

    return put


def draw_two_files(
    result: ModelResult, directory: Path, *, notes: Sequence[str], source: str
) -> list[Path]:
    assert tuple(notes) == result.all_notes and Path(source).is_dir()
    (directory / "parts").mkdir()
    paths = [directory / "sheet.png", directory / "parts" / "curve.png"]
    for path in paths:
        path.write_text(f"{len(result.body)} ellipsoids")
    return paths


def test_a_capture_becomes_a_body_and_a_summary(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    out = tmp_path / "body.json"
    outcome = servoid_command(
        "model", drawn_capture, "--out", out, "--views", "::2", "--max-ellipsoids", 2, "--delta", 0
    )
    assert (outcome.code, outcome.err) == (0, "")
    body = load_body(out)
    assert len(body.ellipsoids) == 2
    summary = dict(re.findall(r"^  (\S.*?)  +(\S.*)$", outcome.out, re.MULTILINE))
    assert summary["ellipsoids"] == "2"
    assert float(summary["fitness F"]) == pytest.approx(body.fitness, abs=1e-4)
    assert re.fullmatch(
        r"0\.\d{4} over 4 used views, worst 0\.\d{4} \(eye/000[0246]\)", summary["silhouette IoU"]
    )
    assert re.search(
        r"^ +0\.\d{4} over 4 unused views, worst 0\.\d{4} \(eye/000[1357]\)$",
        outcome.out,
        re.MULTILINE,
    )
    assert float(summary["seconds"]) > 0
    assert summary["body"] == str(out)


def test_the_summary_says_what_the_result_says(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    options = {"max_ellipsoids": 2, "delta": 0.0, "seed": 5}
    views = servoid.capture.open_capture(drawn_capture).views()
    result = servoid.model.fit(views, **options)
    outcome = servoid_command(
        "model", drawn_capture, "--out", tmp_path / "body.json",
        "--max-ellipsoids", 2, "--delta", 0, "--seed", 5,
    )  # fmt: skip
    worst = int(np.argmin(result.iou_used))
    assert (
        f"{result.iou_used.mean():.4f} over 8 used views, worst {result.iou_used[worst]:.4f} "
        f"({views[worst].name})"
    ) in outcome.out
    result.save(tmp_path / "by_hand.json", learn_appearance(result))
    assert (tmp_path / "by_hand.json").read_bytes() == (tmp_path / "body.json").read_bytes()


def test_the_summary_fits_a_screen_of_eighty_columns(
    drawn_capture: Path,
    tmp_path: Path,
    servoid_command: Command,
    put_view: Callable[..., None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    put_view(draw_two_files)
    for name in ("images", "masks"):
        for path in (drawn_capture / name).iterdir():
            path.rename(path.with_stem(f"{path.stem}_with_a_name_that_is_longer_than_most_names"))
    monkeypatch.chdir(tmp_path)
    outcome = servoid_command(
        "model", drawn_capture.name, "--out", "body.json", "--views", "::2", "--report", "report"
    )
    assert outcome.code == 0, outcome.err
    lines = outcome.out.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80


def test_the_report_lies_where_it_was_asked_for(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command, put_view: Callable[..., None]
) -> None:
    put_view(draw_two_files)
    report = tmp_path / "report"
    before = everything_in(tmp_path)
    outcome = servoid_command(
        "model", drawn_capture, "--out", report / "body.json", "--report", report,
        "--max-ellipsoids", 1,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert set(everything_in(tmp_path)) - set(before) == {
        "report",
        "report/body.json",
        "report/sheet.png",
        "report/parts",
        "report/parts/curve.png",
    }
    assert (report / "sheet.png").read_text() == "1 ellipsoids"
    for path in (report / "sheet.png", report / "parts" / "curve.png"):
        assert str(path) in outcome.out


def test_a_report_replaces_its_own_pictures_and_leaves_other_files(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command, put_view: Callable[..., None]
) -> None:
    put_view(draw_two_files)
    report = tmp_path / "report"
    report.mkdir()
    (report / "notes.txt").write_text("keep me")
    (report / "sheet.png").write_text("old")
    for _ in range(2):
        outcome = servoid_command(
            "model", drawn_capture, "--out", tmp_path / "body.json", "--report", report
        )
        assert outcome.code == 0, outcome.err
    assert (report / "notes.txt").read_text() == "keep me"
    assert "ellipsoids" in (report / "sheet.png").read_text()


@pytest.mark.extended
def test_a_report_that_fails_leaves_nothing_behind(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command, put_view: Callable[..., None]
) -> None:
    def fail(
        result: ModelResult, directory: Path, *, notes: Sequence[str], source: str
    ) -> list[Path]:
        (directory / "half.png").write_text(f"{result.fitness} {notes} {source}")
        raise MissingExtraError("reports need matplotlib; pip install 'servoid[view]'")

    put_view(fail)
    before = everything_in(tmp_path)
    outcome = servoid_command(
        "model", drawn_capture, "--out", tmp_path / "body.json", "--report", tmp_path / "report"
    )
    assert outcome.code == 1
    assert outcome.err == "error: reports need matplotlib; pip install 'servoid[view]'\n"
    assert everything_in(tmp_path) == before


def test_a_report_that_does_not_fit_is_told_by_the_name_that_was_given(
    drawn_capture: Path,
    tmp_path: Path,
    servoid_command: Command,
    put_view: Callable[..., None],
) -> None:
    def fail(
        result: ModelResult, directory: Path, *, notes: Sequence[str], source: str
    ) -> list[Path]:
        raise OutputError(
            f"cannot write a report into {directory}: no space left {notes} {result} {source}"
        )

    put_view(fail)
    report = tmp_path / "report"
    outcome = servoid_command(
        "model", drawn_capture, "--out", tmp_path / "body.json", "--report", report
    )
    assert outcome.code == 1
    assert f"cannot write a report into {report}: no space left" in outcome.err
    assert ".servoid-" not in outcome.err


def test_an_interrupted_model_exits_with_130_and_writes_nothing(
    drawn_capture: Path,
    tmp_path: Path,
    servoid_command: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(modelling, "fit_capture", interrupt)
    before = everything_in(tmp_path)
    outcome = servoid_command("model", drawn_capture, "--out", tmp_path / "body.json")
    assert outcome.code == 130
    assert outcome.err == "interrupted; nothing was written\n"
    assert everything_in(tmp_path) == before


class PanicError(BaseException):
    """Stands for a panic of the core, which is no Exception."""


@pytest.mark.parametrize("kind", [RuntimeError, PanicError])
def test_a_bug_is_called_a_bug_in_one_line(
    kind: type[BaseException],
    drawn_capture: Path,
    tmp_path: Path,
    servoid_command: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise kind("two\nlines")

    monkeypatch.setattr(modelling, "fit_capture", fail)
    outcome = servoid_command("model", drawn_capture, "--out", tmp_path / "body.json")
    assert outcome.code == 70
    assert outcome.err.count("\n") == 1
    assert f"this is a bug in servoid, please report it: {kind.__name__}: two lines" in outcome.err
    monkeypatch.setenv("SERVOID_TRACEBACK", "1")
    outcome = servoid_command("model", drawn_capture, "--out", tmp_path / "body.json")
    assert "Traceback" in outcome.err
    assert 'raise kind("two' in outcome.err


def test_the_body_is_replaced_through_a_link_and_the_link_stays(
    drawn_capture: Path, tmp_path: Path, servoid_command: Command
) -> None:
    (tmp_path / "real.json").write_text("old")
    (tmp_path / "link.json").symlink_to("real.json")
    outcome = servoid_command("model", drawn_capture, "--out", tmp_path / "link.json")
    assert outcome.code == 0, outcome.err
    assert (tmp_path / "link.json").is_symlink()
    assert load_body(tmp_path / "real.json").version == 1


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("model",),
        ("model", "photos"),
        ("modle", "photos"),
        ("model", "photos", "--out", "b.json", "--view", "::2"),
        ("model", "photos", "--out", "b.json", "--views", "3"),
        ("model", "photos", "--out", "b.json", "--views", "::0"),
        ("model", "photos", "--out", "b.json", "--views", "a:b"),
        ("model", "photos", "--out", "b.json", "--max-ellipsoids", "0"),
        ("model", "photos", "--out", "b.json", "--max-ellipsoids", str(10**30)),
        ("model", "photos", "--out", "b.json", "--threads", "0"),
        ("model", "photos", "--out", "b.json", "--threads", "257"),
        ("model", "photos", "--out", "b.json", "--each", "--workers", "1000000"),
        ("study", "bode", "--workers", "257"),
        ("model", "photos", "--out", "b.json", "--seed", "-1"),
        ("model", "photos", "--out", "b.json", "--seed", str(2**64)),
        ("model", "photos", "--out", "b.json", "--delta", "small"),
    ],
)
def test_wrong_usage_exits_with_2(arguments: tuple[str, ...], servoid_command: Command) -> None:
    outcome = servoid_command(*arguments)
    assert outcome.code == 2
    assert "Traceback" not in outcome.err
    assert "Usage:" in outcome.out + outcome.err


def test_the_version_is_the_packages(servoid_command: Command) -> None:
    outcome = servoid_command("--version")
    assert (outcome.code, outcome.out) == (0, f"servoid {servoid.__version__}\n")


def test_help_shows_examples_and_the_cores_defaults(servoid_command: Command) -> None:
    outcome = servoid_command("model", "--help")
    text = " ".join(re.sub(r"[│╭╮╰╯─]", " ", outcome.out).split())
    defaults = servoid.model.ModelSettings()
    assert outcome.code == 0
    assert f"{defaults.max_ellipsoids} if --delta is given)" in text
    assert f"(default {defaults.delta:g})" in text
    assert f"(default {defaults.seed})" in text
    assert "servoid model photos --out body.json" in text


def test_help_loads_no_large_library() -> None:
    heavy = {"cv2", "matplotlib", "msgspec", "numpy", "scipy"}
    done = run_apart(
        "import sys\n"
        "from servoid.cli import main\n"
        "try:\n"
        "    main(['model', '--help'])\n"
        "except SystemExit:\n"
        "    print('LOADED', *sorted(sys.modules))\n"
    )
    loaded = set(done.stdout.rpartition("LOADED")[2].split())
    assert "servoid.cli.app" in loaded, done.stderr
    assert not heavy & loaded


def test_a_pipe_gets_no_progress_bar_and_no_traceback(drawn_capture: Path, tmp_path: Path) -> None:
    command = ["model", str(drawn_capture / "no"), "--out", str(tmp_path / "body.json")]
    done = run_apart(f"from servoid.cli import main; main({command!r})")
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("error: there is no ")
    assert done.stderr.count("\n") == 1
