"""Checks requests to the local page, and answers only those of the page itself."""

import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from email.message import Message

HOST = "127.0.0.1"
LARGEST_BODY = 4096
_MOST_DIGITS = 40  # in a length; Python refuses integers with thousands of digits
_NAMES = (HOST, "localhost")
_JSON = "application/json"


@dataclass(frozen=True)
class Refusal:
    """Why a request is refused: the HTTP status, and a message for the user."""

    status: int
    words: str


@dataclass(frozen=True)
class Request:
    """A client's request: `route` is the path behind the token, such as `seek`."""

    method: str
    path: str
    headers: Message

    @property
    def route(self) -> str:
        """Return the path without the token."""
        return self.path.partition("?")[0].removeprefix("/").partition("/")[2]

    @property
    def body_length(self) -> int | None:
        """Return the number of bytes that follow, None if the request's length is malformed."""
        text = self.headers.get("Content-Length", "")
        is_number = text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS
        return int(text) if is_number else None


class Guard:
    """Checks the token, the port and the route of each request.

    Other programs on this machine, and pages of other sites in the same browser, can also reach the
    port. They do not know the token. A page that reaches the port through a domain name of its own
    is recognised by the Host and Origin headers.
    """

    def __init__(self, port: int, routes: Mapping[str, str]) -> None:
        """Guard a port; `routes` maps each route to its method."""
        self.token: str = secrets.token_urlsafe(24)
        self._authorities = tuple(f"{name}:{port}" for name in _NAMES)
        self._routes = dict(routes)

    def refusal(self, request: Request) -> Refusal | None:
        """Return why a request is refused, or None; its body need not be read for that."""
        headers = request.headers
        if headers.get("Host") not in self._authorities:
            return Refusal(421, "this is not the address that servoid pick printed")
        origin = headers.get("Origin")
        if origin is not None and origin not in [f"http://{name}" for name in self._authorities]:
            return Refusal(403, "requests from other pages are refused")
        given = request.path.partition("?")[0].removeprefix("/").partition("/")[0]
        if not secrets.compare_digest(given.encode("utf-8", "replace"), self.token.encode()):
            return Refusal(403, "open the whole address that servoid pick printed")
        if request.route not in self._routes:
            return Refusal(404, "there is no such page")
        if request.method != self._routes[request.route]:
            return Refusal(405, f"only {self._routes[request.route]} is allowed here")
        return self._refused_body(request) if request.method == "POST" else None

    @staticmethod
    def _refused_body(request: Request) -> Refusal | None:
        if request.headers.get("Origin") is None:
            return Refusal(403, "the Origin header is missing")
        if request.headers.get("Content-Type", "").partition(";")[0].strip().lower() != _JSON:
            return Refusal(415, f"only {_JSON} is accepted")
        length = request.body_length
        if length is None or "Transfer-Encoding" in request.headers:
            return Refusal(411, "a request must state its length")
        if length > LARGEST_BODY:
            return Refusal(413, f"a request may have at most {LARGEST_BODY} bytes, not {length}")
        return None
