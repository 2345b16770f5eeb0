"""A disk that is full in the middle of the work: one sentence that names what was asked for."""

import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest

SMALL = 6_000  # bytes that a file may have: less than any picture of a report takes


@pytest.mark.extended
@pytest.mark.parametrize(
    ("command", "named"),
    [
        (("model", "photos", "--out", "body.json", "--report", "report"), "report"),
        (("sample", "drawn", "--moving", "--size", "small", "--count", "2"), "drawn"),
    ],
)
def test_a_full_disk_is_told_by_the_name_that_was_asked_for_and_leaves_nothing(
    command: tuple[str, ...], named: str, drawn_capture: Path
) -> None:
    folder = drawn_capture.parent
    before = {path.name for path in folder.iterdir()}
    ran = subprocess.run(
        [sys.executable, "-m", "servoid", *command],
        cwd=folder,
        env=os.environ | {"COLUMNS": "80", "NO_COLOR": "1"},
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (SMALL, SMALL)),
    )
    assert ran.returncode == 1, ran.stderr
    line = ran.stderr.splitlines()[-1]  # a busy machine says before how far it is
    assert re.search(rf"cannot write (a report )?(into )?.*{named}.*: file too large", line)
    assert ".servoid-" not in ran.stderr
    assert {path.name for path in folder.iterdir()} == before
