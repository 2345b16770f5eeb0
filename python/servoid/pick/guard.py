"""Says which requests a page on this machine answers: those of its own page, and no others."""

import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from email.message import Message

HOST = "127.0.0.1"
LARGEST_BODY = 4096
_MOST_DIGITS = 40  # of a length; Python reads no number of thousands of them
_NAMES = (HOST, "localhost")
_JSON = "application/json"


@dataclass(frozen=True)
class Refusal:
    """Why a request is not answered: the status of HTTP, and words for a person."""

    status: int
    words: str


@dataclass(frozen=True)
class Request:
    """What a client asks for: `route` is the path behind the token, such as `seek`."""

    method: str
    path: str
    headers: Message

    @property
    def route(self) -> str:
        """Return the path without the token."""
        return self.path.partition("?")[0].removeprefix("/").partition("/")[2]

    @property
    def body_length(self) -> int | None:
        """Return how many bytes follow, None if the request does not say it rightly."""
        text = self.headers.get("Content-Length", "")
        is_number = text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS
        return int(text) if is_number else None


class Guard:
    """Knows the token and the port that a request must name, and what may be asked for.

    Other programs of this machine and pages of other sites in the same browser reach the port as
    well. They do not know the token, and a page that was led here by a name of its own is told by
    Host and Origin.
    """

    def __init__(self, port: int, routes: Mapping[str, str]) -> None:
        """Guard a port; `routes` has the method of each route."""
        self.token: str = secrets.token_urlsafe(24)
        self._authorities = tuple(f"{name}:{port}" for name in _NAMES)
        self._routes = dict(routes)

    def refusal(self, request: Request) -> Refusal | None:
        """Say why a request is refused, None if it is not; its body need not be read for that."""
        headers = request.headers
        if headers.get("Host") not in self._authorities:
            return Refusal(421, "this is not the address that servoid pick has said")
        origin = headers.get("Origin")
        if origin is not None and origin not in [f"http://{name}" for name in self._authorities]:
            return Refusal(403, "another page may not ask here")
        given = request.path.partition("?")[0].removeprefix("/").partition("/")[0]
        if not secrets.compare_digest(given.encode("utf-8", "replace"), self.token.encode()):
            return Refusal(403, "open the whole address that servoid pick has said")
        if request.route not in self._routes:
            return Refusal(404, "there is no such page")
        if request.method != self._routes[request.route]:
            return Refusal(405, f"only {self._routes[request.route]} is answered here")
        return self._refused_body(request) if request.method == "POST" else None

    @staticmethod
    def _refused_body(request: Request) -> Refusal | None:
        if request.headers.get("Origin") is None:
            return Refusal(403, "a page must say where it comes from")
        if request.headers.get("Content-Type", "").partition(";")[0].strip().lower() != _JSON:
            return Refusal(415, f"only {_JSON} is read")
        length = request.body_length
        if length is None or "Transfer-Encoding" in request.headers:
            return Refusal(411, "a request must say how long it is")
        if length > LARGEST_BODY:
            return Refusal(413, f"a request holds {LARGEST_BODY} bytes at most, not {length}")
        return None
