"""Batches in processes that are broken off while long trials run."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tiers import tiered

pytest.importorskip("pyarrow", reason="tables of trials need pyarrow")
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are sent to a group")

FIXTURES = Path(__file__).parents[2] / "fixtures" / "batch"
PATIENCE_S = 60.0  # a tenth of a trial


def started(folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, str(FIXTURES / "batch_lingering.py"), str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def output_when_all_ended(process: subprocess.Popen[str]) -> str:
    """Return what was said; trials' processes hold the pipe, too, so it ends with the last one."""
    try:
        return process.communicate(timeout=PATIENCE_S)[0]
    finally:
        if process.stdout is not None and not process.stdout.closed:
            os.killpg(process.pid, signal.SIGKILL)


def wait_for_trials(process: subprocess.Popen[str], folder: Path) -> None:
    for _ in range(600):
        if any(folder.glob("[0-9]")) or process.poll() is not None:
            return
        time.sleep(0.1)


@pytest.mark.parametrize("early", tiered([False, True]))
def test_an_interrupt_ends_all_processes_at_once_and_says_nothing_of_them(
    tmp_path: Path, early: bool
) -> None:
    process = started(tmp_path)
    if early:
        while not (tmp_path / "out" / "trials").exists() and process.poll() is None:
            time.sleep(0.01)
    else:
        wait_for_trials(process, tmp_path)
    os.killpg(process.pid, signal.SIGINT)
    assert output_when_all_ended(process) == "interrupted\n"
    assert process.returncode == 0


@pytest.mark.parametrize("how", tiered([signal.SIGKILL, signal.SIGTERM]))
def test_trials_end_with_the_process_that_asked_for_them(tmp_path: Path, how: int) -> None:
    process = started(tmp_path)
    wait_for_trials(process, tmp_path)
    os.kill(process.pid, how)
    output_when_all_ended(process)
    assert process.returncode == -how
