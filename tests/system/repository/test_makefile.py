import os
import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(
    os.name != "posix" or not shutil.which("make"), reason="there is no make"
)

ROOT = Path(__file__).parents[3]


def make(*arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if "MAKE" not in name}
    command = ["make", "--no-print-directory", *arguments]
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)


def program(path: Path, version: str, code: int) -> str:
    """Write a program that answers `--version` and ends so otherwise."""
    path.write_text(f'#!/bin/sh\n[ "$1" = --version ] && echo "{version}" && exit 0\nexit {code}\n')
    path.chmod(0o755)
    return str(path)


def test_all_that_is_missing_is_told_at_once() -> None:
    ran = make("prerequisites", "PYTHON=no-such-python", "CARGO=no-such-cargo")
    assert ran.returncode != 0
    lines = [line for line in ran.stderr.splitlines() if not line.startswith("make")]
    assert [line.split(":")[0] for line in lines[:2]] == ["Python is missing", "Rust is missing"]


def test_what_is_too_old_is_told_with_what_is_needed(tmp_path: Path) -> None:
    python = program(tmp_path / "python", "Python 3.8.1", 1)
    cargo = program(tmp_path / "cargo", "cargo 1.50.0", 0)
    ran = make("prerequisites", f"PYTHON={python}", f"CARGO={cargo}")
    assert ran.returncode != 0
    assert "Python 3.8.1 is too old: servoid needs 3.10 or newer" in ran.stderr
    assert "Rust 1.50.0 is too old: servoid needs 1." in ran.stderr


def test_the_two_tiers_are_all_tests() -> None:
    dry = ("--dry-run", "--assume-old=.venv/.package", "--assume-old=.venv/.tools")
    quick, late, whole = (
        [line for line in make(*dry, target).stdout.splitlines() if "-m pytest" in line]
        for target in ("test", "test-extended", "test-all")
    )
    assert whole == quick + late
    [some], [others] = quick, late
    assert some.split(" -m ")[0] == others.split(" -m ")[0]
    assert some.endswith("-m 'not extended'")
    assert others.endswith("-m extended")


def test_help_lists_every_target_that_is_explained() -> None:
    lines = (ROOT / "Makefile").read_text(encoding="utf-8").splitlines()
    explained = [line.split(":")[0] for line in lines if ": " in line and " ## " in line]
    listed = [line.split()[1] for line in make("help").stdout.splitlines()]
    assert listed == [name for name in explained if not name.startswith(("\t", "@"))]
    assert {"test", "test-extended", "test-all"} <= set(listed)
