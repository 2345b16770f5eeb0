"""Runs trials on a Dask cluster, and so on Slurm, Kubernetes or wherever Dask is deployed."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from servoid._native import __version__
from servoid.batch.attempt import attempt, failed
from servoid.batch.workers import Entries, Task
from servoid.errors import MissingExtraError, StudyError

if TYPE_CHECKING:
    from distributed import Client, Future

_CONNECT_S = 10.0
_WORKERS_S = 60.0


@dataclass(frozen=True)
class Cluster:
    """Runs trials on the workers of a Dask scheduler at an address, such as `tcp://host:8786`.

    Each worker needs the same version of servoid. Trials of a worker that dies are run again on
    others. If several workers died at one trial, Dask gives up on it, and it is recorded as failed.
    """

    address: str

    @property
    def words(self) -> str:
        """Return where trials run."""
        return f"the cluster {self.address}"

    def entries(self, tasks: Sequence[Task]) -> Entries:
        """Run tasks.

        Raises:
            MissingExtraError: Dask is not installed.
            StudyError: the scheduler does not answer or is lost midway, has no workers, or they
                have
                another version of servoid.

        """
        if find_spec("distributed") is None:
            raise MissingExtraError.of("clusters", "dask.distributed", "cluster")
        from distributed import as_completed

        with _connected(self.address) as client:
            _check_workers(client, self.address)
            places = {
                client.submit(attempt, task.experiment, task.case, pure=False): task
                for task in tasks
            }
            for future in as_completed(places, loop=client.loop):
                yield places[future].place, _entry(future, places[future], self.address)
                future.release()


def _entry(future: "Future[bytes]", task: Task, address: str) -> bytes:
    """Return the entry of a task that has ended.

    Raises:
        StudyError: the result is unknown, as the scheduler was lost.

    """
    from distributed import CancelledError

    try:
        error = future.exception()
        if error is None:
            return future.result()
    except (CancelledError, OSError) as lost:
        raise StudyError(
            f"the Dask scheduler at {address} was lost ({_line(lost)}); finished trials are kept: "
            "start the scheduler again, and rerun the same command to resume"
        ) from lost
    return failed(task.case, f"the cluster gave it up: {error}")


def _check_address(address: str) -> None:
    """Check an address before a client is made, which leaves a traceback behind if it is wrong."""
    from distributed.comm.addressing import parse_address, parse_host_port

    try:
        kind, place = parse_address(address)
        if kind in ("tcp", "tls"):
            parse_host_port(place)
    except ValueError as error:
        raise StudyError(
            f"'{address}' is no address of a Dask scheduler ({_line(error)}); name the one that "
            "'dask scheduler' prints, such as tcp://127.0.0.1:8786"
        ) from error


def _connected(address: str) -> "Client":
    from distributed import Client

    _check_address(address)
    try:
        return Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise StudyError(
            f"there is no Dask scheduler at {address} ({_line(error)}); start one with 'dask "
            "scheduler' and name the address that it prints, such as tcp://127.0.0.1:8786"
        ) from error


def _check_workers(client: "Client", address: str) -> None:
    """Check that there are workers, and that they have this version of servoid."""
    try:
        client.wait_for_workers(1, timeout=_WORKERS_S)
    except TimeoutError as error:
        raise StudyError(
            f"the Dask scheduler at {address} had no worker after {_WORKERS_S:.0f} s; start some "
            f"with 'dask worker {address} --nthreads 1'"
        ) from error
    versions: Any = client.run(_version, on_error="return")
    for worker, version in versions.items():
        if version != __version__:
            found = f"servoid {version}" if isinstance(version, str) else "no servoid"
            raise StudyError(
                f"the worker {worker} has {found}, but this is servoid {__version__}; install "
                "the same on all workers"
            )


def _version() -> str:
    """Return the version of servoid in the process that runs this."""
    return __version__


def _line(error: BaseException) -> str:
    return str(error).replace("\n", " ")
