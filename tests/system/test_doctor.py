"""`servoid doctor` and the back end that an environment variable forces."""

import os
import platform
import subprocess
import sys

import pytest

from conftest import Command
from servoid import _native
from servoid.cli import doctor
from servoid.cli.doctor import libraries

REQUIREMENTS = [
    "numpy>=1.26",
    "tomli>=2 ; python_full_version < '3.11'",
    "mujoco-core>=4 ; python_full_version >= '3.11' and extra == 'sim'",
    'mujoco>=3.3.7 ; extra == "sim" and python_version < "3.11"',
    "pyopengl>=3.1.7 ; extra == 'gl'",
]


def backend_asked(name: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "servoid", "doctor"],
        env=os.environ | {"SERVOID_BACKEND": name},
        capture_output=True,
        text=True,
    )


def rows(said: str) -> dict[str, str]:
    """Return what stands behind each label, on one line."""
    found: dict[str, str] = {}
    label = ""
    for line in said.splitlines():
        label = line[:15].strip() or label
        found[label] = f"{found.get(label, '')} {line[15:].strip()}".strip()
    return found


def test_it_says_what_servoid_runs_on_in_eighty_columns(servoid_command: Command) -> None:
    ran = servoid_command("doctor")
    assert (ran.code, ran.err) == (0, "")
    assert max(len(line) for line in ran.out.splitlines()) <= 80
    said = rows(ran.out)
    assert said["servoid"] == _native.__version__
    assert said["python"].startswith(platform.python_version())
    assert str(os.cpu_count()) in said["cores"]
    assert said["back end"].startswith(_native.backend())
    assert all(name in said["back end"] for name in _native.backends())
    assert {"numpy", "typer", "rich"} <= set(said["needed"].split())
    assert "missing" not in said["needed"]
    assert {"[sim]", "[servo]", "[view]", "[batch]", "[cluster]"} <= set(said)


def test_a_library_that_is_not_there_is_missing_and_what_brings_it_is_said(
    servoid_command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    version = doctor._version
    monkeypatch.setattr(
        doctor, "_version", lambda name: None if name == "pyopengl" else version(name)
    )
    said = rows(servoid_command("doctor").out)
    assert said["[gl]"] == "pyopengl missing; pip install 'servoid[gl]' brings it"
    assert "missing" not in said["needed"]


@pytest.mark.parametrize(
    ("python", "needed", "sim"),
    [
        ("3.10.14", ["numpy", "tomli"], ["mujoco"]),
        ("3.11.0", ["numpy"], ["mujoco-core"]),
        ("3.14.0rc1", ["numpy"], ["mujoco-core"]),
    ],
)
def test_what_is_for_another_python_is_not_asked_for(
    python: str, needed: list[str], sim: list[str]
) -> None:
    expected = {"needed": needed, "gl": ["pyopengl"], "sim": sim}
    assert libraries(REQUIREMENTS, python) == expected


@pytest.mark.parametrize("name", _native.backends())
def test_each_back_end_of_this_machine_can_be_forced(name: str) -> None:
    ran = backend_asked(name)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert rows(ran.stdout)["back end"].startswith(f"{name} (")


def test_a_back_end_that_is_not_there_is_refused_in_one_line() -> None:
    ran = backend_asked("nonsense")
    assert (ran.returncode, ran.stdout) == (1, "")
    assert ran.stderr.count("\n") == 1
    assert ran.stderr.startswith("error: SERVOID_BACKEND: no back end 'nonsense'")
    assert all(name in ran.stderr for name in _native.backends())
