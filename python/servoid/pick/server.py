"""Serves the page on 127.0.0.1 until the user has chosen."""

import json
import secrets
import socket
import sys
import threading
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from socketserver import TCPServer
from typing import Any

from servoid.errors import OutputError, ServoidError, TargetError
from servoid.pick.asking import Asking, Choice, Question
from servoid.pick.guard import HOST, Guard, Request
from servoid.words import reason_of

_ROUTES = {"": "GET", "image.jpg": "GET", "seek": "POST", "choose": "POST"}
_MOST_CLIENTS = 16
_SLOWEST_S = 10.0  # for which the server waits for a client
_DRAIN_S = 1.0
_POLICY = (
    "default-src 'none'; img-src 'self' data:; connect-src 'self'; style-src 'nonce-{nonce}'; "
    "script-src 'nonce-{nonce}'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class PickServer:
    """Asks a question on a web page; use it in a `with` statement, which stops the server.

    Raises:
        OutputError: the port is taken.

    """

    def __init__(self, question: Question, port: int = 0) -> None:
        self._done = threading.Event()
        self._choice: Choice | None = None
        self._failure: BaseException | None = None
        self.asking: Asking = Asking(question)
        try:
            self._http = _Http(self, port)
        except OSError as error:
            raise OutputError(
                f"cannot listen on port {port} of {HOST}: {reason_of(error)}"
                "; choose another port, or leave the port out"
            ) from error
        self.guard: Guard = Guard(self._http.server_port, _ROUTES)
        self._thread = threading.Thread(
            target=self._http.serve_forever, args=(0.05,), name="pick", daemon=True
        )

    @property
    def address(self) -> str:
        """Return the address of the page, with its secret token."""
        return f"http://{HOST}:{self._http.server_port}/{self.guard.token}/"

    def wait(self, timeout_s: float) -> Choice | None:
        """Return the user's choice, None if there is none within `timeout_s`."""
        self._done.wait(timeout_s)
        if self._failure is not None:
            raise self._failure
        return self._choice

    def end(self, choice: Choice | None, failure: BaseException | None = None) -> None:
        """Let `wait` return a choice, or raise the error `failure`."""
        self._choice, self._failure = choice, failure
        self._done.set()

    def __enter__(self) -> "PickServer":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._http.shutdown()
        self._http.server_close()
        self._thread.join()


class _Http(ThreadingHTTPServer):
    """Accepts requests, each in a thread, up to a maximum number."""

    daemon_threads = True
    request_queue_size = 128  # surplus clients are refused at once and do not hang

    def __init__(self, server: PickServer, port: int) -> None:
        super().__init__((HOST, port), _Handler)
        self.pick = server
        self._places = threading.BoundedSemaphore(_MOST_CLIENTS)

    def server_bind(self) -> None:
        """Bind the port, without looking up this machine's name."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, int(self.server_address[1])

    def process_request(self, request: Any, client_address: Any) -> None:
        """Start a thread for a client, or refuse it while there are too many."""
        if self._places.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve a client, and free its slot."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report errors of servoid; a client that disconnects or stalls is not one."""
        del request, client_address
        error = sys.exc_info()[1]
        if isinstance(error, ServoidError) or not isinstance(error, OSError):
            self.pick.end(None, error)


class _Handler(BaseHTTPRequestHandler):
    """Answers one request."""

    server: _Http  # type: ignore[assignment]
    timeout = _SLOWEST_S
    server_version = "servoid"
    sys_version = ""

    def do_GET(self) -> None:
        """Send the page or its image."""
        if not self._refused():
            route = self._request().route
            answer: Callable[[], None] = self._page if route == "" else self._image
            answer()

    def do_POST(self) -> None:
        """Send what a mark finds, or accept the choice."""
        if self._refused():
            return
        asking = self.server.pick.asking
        try:
            text = self._target()
            if self._request().route == "seek":
                self._send_json(200, asking.seek(text))
                return
            choice = asking.choose(text)
        except TargetError as error:
            self._send_json(422, {"error": str(error)})
            return
        try:
            self._send_json(200, {"words": f"--target {choice.target}"})
        finally:  # the choice counts even if the page was closed meanwhile
            self.server.pick.end(choice)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Print nothing: only the command line does."""

    def _request(self) -> Request:
        return Request(self.command, self.path, self.headers)

    def _refused(self) -> bool:
        refusal = self.server.pick.guard.refusal(self._request())
        if refusal is None:
            return False
        self._send(refusal.status, "text/plain; charset=utf-8", refusal.words.encode())
        self._drain()
        return True

    def _drain(self) -> None:
        """Read part of a refused request: closing earlier would lose the message to the client."""
        end = time.monotonic() + _DRAIN_S
        try:
            self.connection.shutdown(socket.SHUT_WR)
            self.connection.settimeout(_DRAIN_S)
            while time.monotonic() < end and self.connection.recv(65536):
                pass
        except OSError:
            pass

    def _target(self) -> str:
        """Return the target in the body of a request.

        Raises:
            TargetError: there is none.

        """
        try:
            body = json.loads(self.rfile.read(self._request().body_length or 0))
        except (ValueError, RecursionError):
            body = None
        text = body.get("target") if isinstance(body, dict) else None
        if not isinstance(text, str):
            raise TargetError('the request has no target; send {"target": "click:320,240"}')
        return text

    def _page(self) -> None:
        nonce = secrets.token_urlsafe(12)
        question = self.server.pick.asking.question
        height, width = question.image.shape[:2]
        data = {"view": question.view, "width": width, "height": height}
        page = files("servoid.pick").joinpath("page.html").read_text(encoding="utf-8")
        page = page.replace("{{nonce}}", nonce)
        page = page.replace("{{data}}", json.dumps(data).replace("<", "\\u003c"))
        policy = {"Content-Security-Policy": _POLICY.format(nonce=nonce)}
        self._send(200, "text/html; charset=utf-8", page.encode(), policy)

    def _image(self) -> None:
        self._send(200, "image/jpeg", self.server.pick.asking.image)

    def _send_json(self, status: int, data: Any) -> None:
        self._send(status, "application/json", json.dumps(data).encode())

    def _send(
        self, status: int, kind: str, data: bytes, more: dict[str, str] | None = None
    ) -> None:
        self.send_response(status)
        headers = {"Content-Type": kind, "Content-Length": str(len(data))} | _HEADERS
        for name, value in (headers | (more or {})).items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(data)
