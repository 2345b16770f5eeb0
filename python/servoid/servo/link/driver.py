"""The loop's side of the connection to an arm's driver."""

import select
import time
from dataclasses import dataclass

from servoid.errors import ServoError
from servoid.servo.link.lines import Address, Lines, connected, shown
from servoid.servo.link.messages import (
    VERSION,
    Busy,
    FromDriver,
    FromLoop,
    Phase,
    Start,
    State,
    Welcome,
    from_driver,
    line_of,
)
from servoid.servo.link.settings import LinkSettings
from servoid.words import reason_of

_RETRY_S = 0.05
_MOST = 4096  # maximum number of lines read at once


@dataclass(frozen=True, eq=False)
class ReceivedState:
    """A state that the driver sent, and the time of this process's clock at which it was read."""

    state: State
    read_s: float


class Driver:
    """A connection to a driver."""

    def __init__(self, address: Address, settings: LinkSettings) -> None:
        """Connect to a driver, which may still be starting.

        Raises:
            ServoError: no driver answers, it is busy, or has another protocol version.

        """
        self.place: str = shown(address)
        self._settings = settings
        self._lines = _connected(address, settings.patience_s)
        try:
            self.welcome: Welcome = self._welcomed(self._messages()[0])
            self.received: ReceivedState = self.listen()
        except ServoError:
            self._lines.close()
            raise

    def start(self) -> str:
        """Start a session once the joints are at rest, and return its name.

        Raises:
            ServoError: the driver does not start in time, or is gone.

        """
        until, session = time.monotonic() + self._settings.patience_s, ""
        while True:
            state = self.listen().state
            if state.phase is Phase.RUNNING and state.session == session:
                return session
            ready = state.phase is Phase.WAITING and state.resting and state.session != session
            if ready and self.send(Start(state.session)):
                session = state.session
            if time.monotonic() > until:
                if state.stopped:
                    raise ServoError(
                        f"the arm at {self.place} is in a protective stop; remove what it hit, and "
                        "reset it on its own controller"
                    )
                raise ServoError(
                    f"the arm's driver at {self.place} did not start within "
                    f"{self._settings.patience_s:g} s; its joints must be at rest for a start"
                )

    def send(self, message: FromLoop) -> bool:
        """Send a message; return False if the driver is gone or lags far behind."""
        return self._lines.send(line_of(message))

    def listen(self) -> ReceivedState:
        """Wait for a state, and return the newest that has arrived.

        Raises:
            ServoError: none arrives, or the connection is closed.

        """
        while True:
            states = [one for one in self._messages() if isinstance(one, State)]
            if states:
                self.received = ReceivedState(states[-1], time.monotonic())
                return self.received

    def newest(self) -> ReceivedState:
        """Return the newest state that has arrived, without waiting.

        Raises:
            ServoError: the connection is closed.

        """
        while not self._lines.closed and select.select([self._lines.socket], [], [], 0.0)[0]:
            self.listen()
        return self.received

    def close(self) -> None:
        """Close the connection."""
        self._lines.close()

    def _messages(self) -> list[FromDriver]:
        """Wait for messages, and return those since the last call, at least one."""
        until = time.monotonic() + self._settings.silence_s
        while not (lines := self._lines.taken(_MOST)):
            left = until - time.monotonic()
            if self._lines.closed:
                raise ServoError(
                    f"the connection to the arm's driver at {self.place} is closed: "
                    f"{self._lines.closed}; check the driver, and connect again"
                )
            if not select.select([self._lines.socket], [], [], max(left, 0.0))[0] and left <= 0.0:
                raise ServoError(
                    f"the arm's driver at {self.place} has sent nothing for "
                    f"{self._settings.silence_s:g} s; check whether it hangs"
                )
        return [from_driver(line) for line in lines]

    def _welcomed(self, message: FromDriver) -> Welcome:
        if isinstance(message, Busy):
            raise ServoError(
                f"the arm's driver at {self.place} is driven by another loop; end that first"
            )
        if not isinstance(message, Welcome) or message.version != VERSION:
            raise ServoError(
                f"the arm's driver at {self.place} does not speak version {VERSION} of servoid's "
                "protocol; give both sides the same version of servoid"
            )
        return message


def _connected(address: Address, patience_s: float) -> Lines:
    until = time.monotonic() + patience_s
    while True:
        try:
            return Lines(connected(address, patience_s))
        except OSError as reason:
            if time.monotonic() > until:
                raise ServoError(
                    f"no arm's driver answers at {shown(address)}: {reason_of(reason)}; "
                    "start it first"
                ) from reason
        time.sleep(_RETRY_S)
