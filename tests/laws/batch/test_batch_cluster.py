"""Batches on a real Dask scheduler with worker processes of their own."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

pytest.importorskip("pyarrow", reason="tables of trials need pyarrow")
pytest.importorskip("distributed", reason="clusters need dask.distributed")

from batch_trials import DAWDLE, DRAW, Case
from distributed import Client

from servoid.batch import BatchProgress, Work, run_batch, workers_for
from servoid.errors import StudyError

pytestmark = pytest.mark.extended

_SOON_S = 60.0  # in which processes start on a machine that is busy
FIXTURES = Path(__file__).parents[2] / "fixtures" / "batch"


@contextmanager
def started(*arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a program of Dask while the block runs."""
    environment = {**os.environ, "PYTHONPATH": str(FIXTURES)}
    process = subprocess.Popen(
        [sys.executable, "-m", *arguments],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        process.terminate()
        process.wait(20)


@pytest.fixture
def address() -> Iterator[str]:
    """Start a scheduler."""
    with scheduler() as (address, _):
        yield address


@contextmanager
def scheduler() -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Start a scheduler and wait for its port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    options = ("--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    with started("distributed.cli.dask_scheduler", *options) as process:
        for _ in range(200):
            try:
                socket.create_connection(("127.0.0.1", port), 0.2).close()
                break
            except OSError:
                time.sleep(0.1)
        yield f"tcp://127.0.0.1:{port}", process


@contextmanager
def workers(address: str, count: int) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Start worker processes, which nobody starts again when they die, and wait for them."""
    options = (address, "--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
    with ExitStack() as stack:
        processes = [
            stack.enter_context(started("distributed.cli.dask_worker", *options))
            for _ in range(count)
        ]
        with Client(address, timeout=_SOON_S, set_as_default=False) as client:
            client.wait_for_workers(count, timeout=_SOON_S)
        yield processes


def test_a_batch_goes_through_although_one_of_two_workers_is_killed_midway(
    tmp_path: Path, address: str
) -> None:
    marks = tmp_path / "marks"
    marks.mkdir()
    cases = [Case(seed, folder=str(marks)) for seed in range(16)]
    with workers(address, 2) as processes:

        def kill(progress: BatchProgress) -> None:
            if progress.done == 6:
                os.kill(processes[0].pid, signal.SIGKILL)

        done = run_batch([Work(DAWDLE, cases)], tmp_path / "far", workers_for(None, address), kill)
    assert len({mark.name.split(".")[1] for mark in marks.iterdir()}) == 2
    seeds = [Case(seed) for seed in range(16)]
    near = run_batch([Work(DRAW, seeds)], tmp_path / "near")["draw"]
    assert [trial.row for trial in done["dawdle"]] == [trial.row for trial in near]
    assert [trial.failure for trial in done["dawdle"]] == [trial.failure for trial in near]


def test_a_scheduler_that_is_lost_midway_is_told_and_what_was_done_is_kept(tmp_path: Path) -> None:
    cases = [Case(seed) for seed in range(4, 12)]
    with scheduler() as (address, process), workers(address, 1):

        def kill(progress: BatchProgress) -> None:
            if progress.done == 2:
                process.kill()

        with pytest.raises(StudyError, match=r"was lost .* finished trials are kept"):
            run_batch([Work(DAWDLE, cases)], tmp_path, workers_for(None, address), kill)
    reports: list[BatchProgress] = []
    run_batch([Work(DAWDLE, cases)], tmp_path, watch=reports.append)
    assert reports[0].recalled >= 2


def test_a_scheduler_that_does_not_answer_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("servoid.batch.cluster._CONNECT_S", 0.5)
    with pytest.raises(StudyError, match=r"no Dask scheduler at tcp://127\.0\.0\.1:9"):
        run_batch([Work(DRAW, [Case(0)])], tmp_path, workers_for(None, "tcp://127.0.0.1:9"))
    for address in ("nowhere", "127.0.0.1", "tcp://"):
        with pytest.raises(StudyError, match=r"is no address of .* such as tcp://"):
            run_batch([Work(DRAW, [Case(0)])], tmp_path, workers_for(None, address))
