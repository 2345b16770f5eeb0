"""Sockets that carry lines."""

import socket
from pathlib import Path

from servoid.errors import ServoError
from servoid.words import reason_of

Address = tuple[str, int] | str | Path
_CHUNK = 1 << 16
_LONGEST = 1 << 16  # maximum bytes of a line
_WAITING = 1 << 18  # bytes that the other side has not received yet


def listening(address: Address) -> socket.socket:
    """Return a socket that listens at a host and port, or at the path of a Unix socket.

    Raises:
        ServoError: it cannot listen there.

    """
    kind, place = _resolved(address)
    server = socket.socket(kind, socket.SOCK_STREAM)
    try:
        if kind == socket.AF_INET:
            server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        else:
            _remove_stale(kind, str(place))
        server.bind(place)
        server.listen()
    except OSError as reason:
        server.close()
        raise ServoError(
            f"an arm's driver cannot listen at {shown(address)}: {reason_of(reason)}; choose "
            "another address, or end the program that uses it"
        ) from reason
    server.setblocking(False)
    return server


def connected(address: Address, timeout_s: float) -> socket.socket:
    """Return a socket that is connected to an address.

    Raises:
        OSError: no process answers there.

    """
    kind, place = _resolved(address)
    found = socket.socket(kind, socket.SOCK_STREAM)
    try:
        found.settimeout(timeout_s)
        found.connect(place)
        if kind == socket.AF_INET:
            found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    except OSError:
        found.close()
        raise
    return found


def shown(address: Address) -> str:
    """Return an address as text."""
    return f"{address[0]}:{address[1]}" if isinstance(address, tuple) else str(address)


class Lines:
    """Receives and sends lines over a socket, without blocking."""

    def __init__(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        self.socket = connection
        self.closed: str = ""  # the reason, once it is closed
        self._come, self._going = bytearray(), bytearray()

    def taken(self, most: int) -> list[bytes]:
        """Return received lines, the oldest first, at most `most`; the others stay queued."""
        self.flush()  # also sends what is still queued
        while not self.closed and len(self._come) < _LONGEST:
            try:
                chunk = self.socket.recv(_CHUNK)
            except (BlockingIOError, InterruptedError):
                break
            except OSError as reason:
                self._close(reason_of(reason))
                break
            if not chunk:
                self._close("the other side closed the connection")
            self._come += chunk
        found: list[bytes] = []
        while len(found) < most and (end := self._come.find(b"\n")) >= 0:
            found.append(bytes(self._come[:end]))
            del self._come[: end + 1]
        if not found and len(self._come) >= _LONGEST:
            self._close("a line was too long")
        return found

    def send(self, line: bytes) -> bool:
        """Send a line; return False if the other side receives too slowly."""
        self.flush()
        if self.closed or len(self._going) > _WAITING:
            return False
        self._going += line
        self.flush()
        return True

    def flush(self) -> None:
        """Send what could not be sent yet."""
        while self._going and not self.closed:
            try:
                sent = self.socket.send(self._going)
            except (BlockingIOError, InterruptedError):
                return
            except OSError as reason:
                self._close(reason_of(reason))
                return
            del self._going[:sent]

    def close(self) -> None:
        """Close the socket; lines received before remain available."""
        self._close("it was closed on this side")

    def _close(self, why: str) -> None:
        self.closed = self.closed or why
        self.socket.close()


def _resolved(address: Address) -> tuple[socket.AddressFamily, tuple[str, int] | str]:
    if isinstance(address, tuple):
        return socket.AF_INET, address
    if not hasattr(socket, "AF_UNIX"):
        raise ServoError(f"this system has no Unix sockets; give a host and port, not '{address}'")
    return socket.AF_UNIX, str(address)


def _remove_stale(kind: socket.AddressFamily, path: str) -> None:
    """Remove the socket of a driver that was killed."""
    if not Path(path).is_socket():
        return
    with socket.socket(kind, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(path)
        except ConnectionRefusedError:
            Path(path).unlink()
