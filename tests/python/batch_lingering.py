"""A program with a batch that takes longer than anybody waits; its argument is a folder."""

import signal
import sys
from pathlib import Path

from batch_trials import LINGER, Case

from servoid.batch import Processes, Work, run_batch

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # deaf to it in the background
    folder = Path(sys.argv[1])
    cases = [Case(seed, folder=str(folder)) for seed in range(6)]
    try:
        run_batch([Work(LINGER, cases)], folder / "out", Processes(2))
    except KeyboardInterrupt:
        sys.stdout.write("interrupted\n")
