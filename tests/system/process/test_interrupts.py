"""A shell that runs something in the background lets it ignore Ctrl-C; servoid heeds it still."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import conftest

pytestmark = pytest.mark.skipif(
    os.name != "posix" or not shutil.which("sh"), reason="a POSIX shell ignores the signal"
)

HERE = Path(__file__).parent
PRESSED_WHILE_IT_RUNS = """
import os, signal, time
import servoid.cli.app
assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN

def press(**_):
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(30.0)

servoid.cli.app.app = press
servoid.cli.main([])
"""


PRESSED_AFTER_IT_WROTE = """
import sys
import time
from pathlib import Path
import servoid.cli.app
from servoid.output import write_whole

def write(**_):
    for name in sys.argv[1:]:
        write_whole(Path(name), b"poses")
    Path(sys.argv[1]).unlink()
    raise KeyboardInterrupt

servoid.cli.app.app = write
servoid.cli.main([])
"""
ENDED_WHILE_IT_RUNS = """
import os, signal, sys, time
from servoid.cli import main
from servoid.cli.model import modelling

def stop(*_, **__):
    os.kill(os.getpid(), getattr(signal, sys.argv[1]))
    time.sleep(3.0)

modelling.fit_capture = stop
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup may run the tests
main(sys.argv[2:])
"""
HUNG_UP_WHILE_IT_RUNS = """
import os, signal, sys
from servoid.cli import main
from servoid.cli.model import modelling
fit = modelling.fit_capture

def hang_up(*given, **named):
    os.kill(os.getpid(), signal.SIGHUP)
    return fit(*given, **named)

modelling.fit_capture = hang_up
main(sys.argv[1:])
"""
ENDED_WHILE_IT_SCANS = """
import os, signal, time
from servoid.cli.interrupting import heeded_signals
from servoid.scan.running import pycolmap

with heeded_signals() as came:
    try:
        pycolmap()
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(30.0)
    except KeyboardInterrupt:
        print(came)
"""
PRESSED_AGAIN_WHILE_THREADS_END = """
import threading, time
import servoid.cli.app

def press(**_):
    threading.Thread(target=time.sleep, args=(30.0,)).start()
    raise KeyboardInterrupt

servoid.cli.app.app = press
servoid.cli.program()
"""
FORKED_WHILE_IT_RUNS = """
import multiprocessing, time
import servoid.cli.app

def work(began):
    began.set()
    time.sleep(30.0)

def fork(**_):
    context = multiprocessing.get_context("fork")
    began = context.Event()
    child = context.Process(target=work, args=(began,))
    child.start()
    began.wait()
    child.terminate()
    child.join()
    print(child.exitcode)

servoid.cli.app.app = fork
servoid.cli.main([])
"""


def deaf(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python as a shell starts it in the background: with SIGINT ignored."""
    command = ["sh", "-c", "trap '' INT; exec \"$@\"", "sh", sys.executable, *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=HERE)


def test_a_command_in_the_background_is_interrupted() -> None:
    ran = deaf("-c", PRESSED_WHILE_IT_RUNS)
    assert (ran.returncode, ran.stdout) == (130, "")
    assert ran.stderr == "interrupted; nothing was written\n"


def test_what_an_interrupted_command_wrote_before_is_named(tmp_path: Path) -> None:
    gone, *there = (str(tmp_path / name) for name in "abcdefghi")
    for given, more in ((there[:2], ""), (there, " and 2 more")):
        arguments = [sys.executable, "-c", PRESSED_AFTER_IT_WROTE, gone, *given]
        ran = subprocess.run(arguments, capture_output=True, text=True, cwd=HERE)
        said = f"interrupted; written before: {', '.join(given[:6])}{more}"
        assert (ran.returncode, "".join(ran.stderr.split())) == (130, "".join(said.split()))


def test_a_second_ctrl_c_ends_an_interrupted_command_that_waits_for_threads() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", PRESSED_AGAIN_WHILE_THREADS_END],
        stderr=subprocess.PIPE,
        text=True,
        cwd=HERE,
    )
    assert process.stderr is not None
    with process.stderr as said:
        assert said.readline() == "interrupted; nothing was written\n"
        time.sleep(0.5)  # it waits for its threads by then
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20.0) == -signal.SIGINT
        assert said.read() == ""


@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_command_that_is_terminated_ends_as_after_ctrl_c_and_leaves_nothing(
    name: str, code: int, drawn_capture: Path, tmp_path: Path
) -> None:
    before = conftest.everything_in(tmp_path)
    arguments = ["model", str(drawn_capture), "--out", str(tmp_path / "body.json")]
    ran = subprocess.run(
        [sys.executable, "-c", ENDED_WHILE_IT_RUNS, name, *arguments],
        capture_output=True,
        text=True,
        cwd=HERE,
    )
    assert (ran.returncode, ran.stdout) == (code, ""), ran.stderr
    assert ran.stderr == "interrupted; nothing was written\n"
    assert conftest.everything_in(tmp_path) == before


@pytest.mark.extended
def test_a_command_under_nohup_goes_on_when_its_terminal_closes(
    drawn_capture: Path, tmp_path: Path
) -> None:
    out = tmp_path / "body.json"
    ran = subprocess.run(
        [
            *("sh", "-c", "trap '' HUP; exec \"$@\"", "sh", sys.executable, "-c"),
            *(HUNG_UP_WHILE_IT_RUNS, "model", str(drawn_capture), "--out", str(out)),
        ],
        capture_output=True,
        text=True,
        cwd=HERE,
    )
    assert ran.returncode == 0, ran.stderr
    assert out.is_file()


def test_a_process_that_a_command_forked_ends_when_it_is_terminated() -> None:
    ran = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FORKED_WHILE_IT_RUNS],
        capture_output=True,
        text=True,
        cwd=HERE,
    )
    assert (ran.stdout, ran.stderr) == (f"{-signal.SIGTERM}\n", "")


def test_sigterm_ends_a_scan_as_ctrl_c_does_and_prints_no_stack() -> None:
    pytest.importorskip("pycolmap", reason="pycolmap, which handles signals, is missing")
    ran = subprocess.run(  # its output is compared below
        [sys.executable, "-c", ENDED_WHILE_IT_SCANS], capture_output=True, text=True, check=False
    )
    assert (ran.stdout, ran.stderr) == (f"[{int(signal.SIGTERM)}]\n", "")


def test_ctrl_c_interrupts_these_tests() -> None:
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def test_tests_that_are_deaf_to_ctrl_c_are_made_to_heed_it(pytestconfig: pytest.Config) -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        conftest.pytest_configure(pytestconfig)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.extended
def test_ctrl_c_interrupts_tests_in_the_background() -> None:
    law = f"{Path(__file__).name}::{test_ctrl_c_interrupts_these_tests.__name__}"
    ran = deaf("-m", "pytest", "-p", "no:cacheprovider", law)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "1 passed" in ran.stdout
