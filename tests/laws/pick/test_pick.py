"""`servoid pick`: who is answered, what a mark finds, and how the command ends."""

import http.client
import json
import re
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from conftest import Command
from servoid.capture import open_capture
from servoid.cli.pick import picking
from servoid.errors import OutputError, TargetError
from servoid.pick import PickServer, Question
from servoid.pick.asking import Mark, read_mark
from servoid.pick.guard import LARGEST_BODY
from servoid.pick.server import _MOST_CLIENTS
from servoid.segment import Found, find_object, find_with_doubts, parse_target

BOX = "box:45,35,115,85"


def picture() -> NDArray[np.uint8]:
    image = np.full((120, 160, 3), 90, dtype=np.uint8)
    image[40:80, 50:110] = (200, 40, 30)
    return image


def seek(mark: Mark) -> Found:
    return find_with_doubts(mark, picture())


class Client:
    """Asks as the page does; headers can be changed, or left out by None."""

    def __init__(self, address: str) -> None:
        self.parts = urlsplit(address)
        self.origin = f"http://{self.parts.netloc}"

    def ask(
        self,
        route: str = "",
        body: object = None,
        changed: dict[str, str | None] | None = None,
        path: str | None = None,
        method: str | None = None,
    ) -> tuple[int, bytes, http.client.HTTPMessage]:
        data = body if isinstance(body, bytes) or body is None else json.dumps(body).encode()
        headers: dict[str, str | None] = {"Host": self.parts.netloc}
        if data is not None:
            headers |= {"Origin": self.origin, "Content-Type": "application/json"}
            headers["Content-Length"] = str(len(data))
        headers |= changed or {}
        link = http.client.HTTPConnection(str(self.parts.hostname), self.parts.port, timeout=20)
        with closing(link):
            link.putrequest(
                method or ("GET" if data is None else "POST"),
                self.parts.path + route if path is None else path,
                skip_host=True,
            )
            for name, value in headers.items():
                if value is not None:
                    link.putheader(name, value)
            link.endheaders()
            if data is not None:
                with suppress(OSError):  # refused before all was sent
                    link.send(data)
            answer = link.getresponse()
            return answer.status, answer.read(), answer.headers


@pytest.fixture
def server() -> Iterator[PickServer]:
    with PickServer(Question("eye/0003", picture(), seek)) as one:
        yield one


@pytest.fixture
def client(server: PickServer) -> Client:
    return Client(server.address)


def test_the_page_and_its_image_are_served_to_who_has_the_address(client: Client) -> None:
    status, page, headers = client.ask()
    assert status == 200
    assert b"Which object is meant" in page and b"eye/0003" in page and b"{{" not in page
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["Referrer-Policy"] == "no-referrer"
    status, data, _ = client.ask("image.jpg")
    seen = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert (status, seen.shape) == (200, (120, 160, 3))
    assert np.abs(seen[..., ::-1].astype(int) - picture()).mean() < 3.0


def test_it_listens_on_this_machine_alone(server: PickServer) -> None:
    assert server._http.server_address[0] == "127.0.0.1"
    assert urlsplit(server.address).hostname == "127.0.0.1"


def test_every_server_has_a_secret_of_its_own(server: PickServer) -> None:
    with PickServer(Question("eye/0003", picture(), seek)) as other:
        assert server.guard.token != other.guard.token
        assert len(server.guard.token) >= 32
        foreign = f"/{other.guard.token}/"
        assert Client(server.address).ask(path=foreign)[0] == 403


@pytest.mark.parametrize(
    "path", ["/", "//", "/index.html", "/wrong/", "/wrong/image.jpg", "/%C3%A9/"]
)
def test_who_does_not_know_the_token_is_told_nothing(client: Client, path: str) -> None:
    status, words, _ = client.ask(path=path)
    assert status == 403
    assert b"eye/0003" not in words
    token = client.parts.path.strip("/").encode()
    assert token not in words


@pytest.mark.parametrize("route", ["seek", "choose"])
def test_a_mark_without_the_token_is_refused(client: Client, route: str) -> None:
    assert client.ask(body={"target": BOX}, path=f"/{route}")[0] == 403
    assert client.ask(body={"target": BOX}, path=f"/wrong/{route}")[0] == 403


@pytest.mark.parametrize("host", ["example.com", "127.0.0.1", "evil.test:{port}", "", None])
def test_a_name_that_was_bent_to_this_machine_is_refused(client: Client, host: str | None) -> None:
    named = None if host is None else host.format(port=client.parts.port)
    for body in (None, {"target": BOX}):
        assert client.ask("seek" if body else "", body, {"Host": named})[0] == 421


@pytest.mark.parametrize(
    "origin", ["http://evil.test", "https://127.0.0.1:{port}", "http://127.0.0.1:1", "null", None]
)
@pytest.mark.parametrize("route", ["seek", "choose"])
def test_a_page_of_another_site_may_not_ask(
    client: Client, server: PickServer, route: str, origin: str | None
) -> None:
    named = None if origin is None else origin.format(port=client.parts.port)
    assert client.ask(route, {"target": BOX}, {"Origin": named})[0] == 403
    assert server.wait(0.0) is None
    if named is not None:
        assert client.ask(changed={"Origin": named})[0] == 403


def test_the_same_machine_by_its_other_name_is_answered(client: Client) -> None:
    name = f"localhost:{client.parts.port}"
    assert client.ask(changed={"Host": name})[0] == 200
    changed: dict[str, str | None] = {"Host": name, "Origin": f"http://{name}"}
    assert client.ask("seek", {"target": BOX}, changed)[0] == 200


def test_fifty_megabytes_are_refused_without_being_kept(client: Client) -> None:
    begun = time.perf_counter()
    status, words, _ = client.ask("seek", bytes(50_000_000))
    assert status == 413
    assert str(LARGEST_BODY).encode() in words
    assert time.perf_counter() - begun < 10.0
    assert client.ask("seek", bytes(50_000_000), path="/wrong/seek")[0] == 403
    assert client.ask()[0] == 200


@pytest.mark.parametrize(
    ("changed", "status"),
    [
        ({"Content-Type": "text/plain"}, 415),
        ({"Content-Type": None}, 415),
        ({"Content-Length": None}, 411),
        ({"Content-Length": "-1"}, 411),
        ({"Content-Length": "1e3"}, 411),
        ({"Content-Length": str(10**30)}, 413),
        ({"Content-Length": "9" * 5000}, 411),
        ({"Transfer-Encoding": "chunked"}, 411),
    ],
)
def test_a_body_of_another_kind_is_refused(
    client: Client, changed: dict[str, str | None], status: int
) -> None:
    assert client.ask("seek", {"target": BOX}, changed)[0] == status


@pytest.mark.parametrize(
    ("method", "route", "status"),
    [("GET", "seek", 405), ("POST", "", 405), ("GET", "other", 404), ("PUT", "seek", 501)],
)
def test_only_what_the_page_asks_is_answered(
    client: Client, method: str, route: str, status: int
) -> None:
    body = {"target": BOX} if method != "GET" else None
    assert client.ask(route, body, method=method)[0] == status


@pytest.mark.parametrize(
    "body",
    [b"", b"{", b"[]", b"[" * LARGEST_BODY, b"\xff\xfe", {"target": 3}, {},
     {"target": "hue:10..20"}, {"target": "mask:/etc/hostname"}, {"target": "background:a.png"},
     {"target": "box:1,2"},
     {"target": "click:1,2@eye/0000"}, {"target": "box:5,5,1,1"}, {"target": "click:900,900"}],
)  # fmt: skip
def test_what_is_no_mark_in_the_image_is_refused_with_words(client: Client, body: object) -> None:
    for route in ("seek", "choose"):
        status, answer, _ = client.ask(route, body)
        assert status == 422
        assert json.loads(answer)["error"]


def test_what_a_mark_finds_is_what_the_commands_find(client: Client, server: PickServer) -> None:
    status, answer, _ = client.ask("seek", {"target": BOX})
    assert status == 200
    assert json.loads(answer)["doubt"] is None
    assert server.wait(0.0) is None
    status, answer, _ = client.ask("choose", {"target": BOX})
    assert json.loads(answer) == {"words": f"--target {BOX}@eye/0003"}
    choice = server.wait(10.0)
    assert choice is not None and str(choice.target) == f"{BOX}@eye/0003"
    expected = find_object(parse_target(BOX), picture())
    assert np.array_equal(choice.found.mask, expected)
    assert (expected > 0).sum() == 40 * 60


def wait_for_place(client: Client) -> None:
    """Ask until there is an answer: clients that have gone make place after a while."""
    end = time.monotonic() + 10.0
    while True:
        with suppress(OSError, http.client.HTTPException):
            if client.ask()[0] == 200:
                return
        assert time.monotonic() < end


def test_a_client_that_stalls_or_goes_away_holds_nobody_up(
    client: Client, server: PickServer
) -> None:
    where = str(client.parts.hostname), client.parts.port
    with ExitStack() as stack:
        for index in range(_MOST_CLIENTS - 1):
            link = stack.enter_context(socket.create_connection(where))
            link.sendall(b"POST / HTTP/1.1\r\n"[: index + 1])
        wait_for_place(client)
    wait_for_place(client)
    assert server.wait(0.0) is None


def test_two_hundred_clients_are_not_two_hundred_threads(client: Client) -> None:
    where = str(client.parts.hostname), client.parts.port
    before = threading.active_count()
    with ExitStack() as stack:
        for _ in range(200):
            with suppress(OSError):
                stack.enter_context(socket.create_connection(where, timeout=5.0))
        time.sleep(0.3)
        assert threading.active_count() - before <= _MOST_CLIENTS + 1
    wait_for_place(client)


def test_a_fault_of_servoid_ends_the_wait_and_is_not_swallowed() -> None:
    def broken(mark: Mark) -> Found:
        raise ZeroDivisionError(str(mark))

    with PickServer(Question("eye/0", picture(), broken)) as server:
        with suppress(http.client.HTTPException, OSError):
            Client(server.address).ask("seek", {"target": BOX})
        with pytest.raises(ZeroDivisionError):
            server.wait(10.0)


def test_a_port_that_is_taken_is_told(server: PickServer) -> None:
    with pytest.raises(OutputError, match="choose another port"):
        PickServer(Question("eye/0", picture(), seek), Client(server.address).parts.port or 0)


def test_marks_are_read_as_targets_are() -> None:
    assert read_mark(BOX) == parse_target(BOX)
    assert read_mark("click:3,4.5") == parse_target("click:3,4.5")
    with pytest.raises(TargetError, match="is neither a box nor a click"):
        read_mark("mask:a.png")


# The command.


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Choose at once, in place of a person; return the addresses that were opened."""
    opened: list[str] = []

    def choose(address: str) -> bool:
        opened.append(address)
        client = Client(address)
        threading.Thread(target=client.ask, args=("choose", {"target": "click:80,60"})).start()
        return True

    monkeypatch.setattr(picking, "_has_desktop", lambda: True)
    monkeypatch.setattr(picking.webbrowser, "open", choose)
    return opened


def test_the_words_of_a_choice_are_all_that_is_printed(
    servoid_command: Command, drawn_capture: Path, hasty: list[str], tmp_path: Path
) -> None:
    mask = tmp_path / "cup.png"
    ran = servoid_command("pick", drawn_capture, "--image", 3, "--mask", mask)
    assert (ran.code, ran.out) == (0, "--target click:80,60@eye/0003\n")
    assert hasty[0] in ran.err
    image = open_capture(drawn_capture).all_views()[3].recorded_image()
    found = find_with_doubts(parse_target("click:80,60"), image)
    assert np.array_equal(cv2.imread(str(mask), cv2.IMREAD_GRAYSCALE), found.mask)
    assert f"--target mask:{mask}@eye/0003" in ran.err


def test_the_words_are_what_model_takes(
    servoid_command: Command, drawn_capture: Path, hasty: list[str], tmp_path: Path
) -> None:
    del hasty
    words = servoid_command("pick", drawn_capture, "--image", 0).out.split()
    ran = servoid_command(
        *("model", drawn_capture, "--max-ellipsoids", 1, "--trust-targets"),
        *("--out", tmp_path / "body.json", *words),
    )
    assert ran.code == 0, ran.err


def test_nobody_who_chooses_in_time_ends_it_with_status_1(
    servoid_command: Command, drawn_capture: Path
) -> None:
    ran = servoid_command("pick", drawn_capture, "--no-browser", "--timeout", 0.2)
    assert (ran.code, ran.out) == (1, "")
    assert re.search(r"http://127\.0\.0\.1:\d+/[\w-]{32}/\n", ran.err)
    assert "nobody chose within 0.2 s" in ran.err


def test_a_video_is_shown_without_anything_being_known_of_its_camera(
    servoid_command: Command, hasty: list[str], tmp_path: Path
) -> None:
    del hasty
    film = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (160, 120))
    for _ in range(4):
        writer.write(picture()[..., ::-1])
    writer.release()
    ran = servoid_command("pick", film, "--image", 2)
    assert (ran.code, ran.out) == (0, "--target click:80,60@camera/0002\n")
    ran = servoid_command("pick", f"side-by-side:{film}", "--camera", "right", "--timeout", 0.1)
    assert (ran.code, ran.out) == (1, "")  # the click lies beside the half of the right eye


def test_a_live_source_is_told_to_be_kept_first(servoid_command: Command) -> None:
    ran = servoid_command("pick", "rtsp://127.0.0.1:1/nothing", "--no-browser")
    assert (ran.code, ran.out) == (1, "")
    assert "servoid record" in ran.err


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (("--image", 99), 2, "has no image 99 of camera 'eye', which has 8 images, 0 to 7"),
        (("--camera", "nose"), 2, "has no camera 'nose'; its cameras are eye"),
        (("--mask", "mask.jpg"), 2, "the file of a mask ends in .png"),
        (("--timeout", 0), 2, "is not a duration"),
        (("--port", 70000), 2, "65535"),
    ],
)
def test_what_cannot_be_shown_is_told_before_anything_is_served(
    servoid_command: Command,
    drawn_capture: Path,
    options: tuple[object, ...],
    code: int,
    words: str,
) -> None:
    ran = servoid_command("pick", drawn_capture, "--no-browser", *options)
    assert (ran.code, ran.out) == (code, "")
    assert words in " ".join(ran.err.replace("│", "").split())
    assert "http://" not in ran.err
