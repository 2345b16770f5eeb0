"""Fetches the images of one live device in a thread of its own."""

import statistics
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from threading import Event, Lock, Thread
from typing import Any, Protocol, runtime_checkable

from servoid.source.delivery import Delivery, EndedError, LostDeviceError
from servoid.source.device_clock import DeviceClock
from servoid.source.host_clock import HostClock, HostTime

_KEPT = 4  # images, from which the nearest in time to the other cameras' is chosen
_RETRY_S = 0.02
_REOPEN_S = 0.1  # between attempts to reopen a device that is gone
TRIES = 50  # consecutive failures, after which a camera is reopened: it may be plugged in again
_CLOSING_S = 2.0  # within which a driver must return from its last image
_STEPS = 31  # between images; their median is the usual period
_LEAST_STEPS = 10
_FEW_STEPS = 3
_PATIENCE = 2.5  # usual periods without an image, after which a camera counts as silent
_MISSED = 1.6  # usual periods between images, from which one counts as missing
_UNDECODED = "the image cannot be decoded"
_AWAITS = "the camera awaits a trigger, or reports no rate"
_MOST_PENDING = 16  # pending notices for the next observation


@runtime_checkable
class Video(Protocol):
    """The interface of a camera: `cv2.VideoCapture` has it, and your driver can implement it.

    A driver whose device may be unplugged raises `LostDeviceError`, and has a method `reopened`
    that returns another `Video` of the same device. One that plays a recording raises `EndedError`.
    One that may wait for long in `grab` has a method `interrupt`, which ends the wait.
    """

    def grab(self) -> bool:
        """Wait for the next image, and return whether there is one."""
        ...

    def retrieve(self) -> tuple[bool, Any]:
        """Return whether it could be decoded, and the image: (H, W) or (H, W, 3) uint8, BGR order.

        A driver with metadata returns a `Delivery` instead of the image.
        """
        ...

    def release(self) -> None:
        """Close the camera."""
        ...


@runtime_checkable
class Reopened(Protocol):
    """A video that can be reopened after its device was gone."""

    def reopened(self) -> Video:
        """Reopen the same device."""
        ...


@runtime_checkable
class Triggered(Protocol):
    """A video that knows whether its camera awaits a trigger, so that silence is not a fault."""

    @property
    def may_be_silent(self) -> bool:
        """Return whether any silence is normal; the driver itself then reports a lost device."""
        ...


@runtime_checkable
class Interruptible(Protocol):
    """A video that can wait for its next image for long, and whose wait can be ended."""

    def interrupt(self) -> None:
        """End a `grab` that another thread waits for; it returns False."""
        ...


@dataclass(frozen=True, eq=False)
class Shot:
    """What a device delivered, and when it was taken or, without a timestamp, arrived, in seconds.

    `images` are those of its eyes, (H, W) or (H, W, 3), in BGR order, None where one is missing,
    and `depths` as in `Delivery`. `number` counts the device's deliveries, from 1. `encoded` is the
    JPEG file as which the image of the only eye arrived, if any.
    """

    time_s: float
    images: tuple[Any, ...]
    number: int
    depths: tuple[Any, ...] = ()
    encoded: bytes | None = None


class Grabber:
    """Fetches images as they arrive, and keeps the last ones; retries after failures.

    A device that is lost, or fails `tries` times in succession, is reopened with `reopen` if that
    is given. A device that awaits a trigger does not fail while it is silent.
    """

    def __init__(
        self,
        name: str,
        device: Video,
        clock: HostClock,
        reopen: Callable[[], Video] | None = None,
        *,
        tries: int = TRIES,
        silent_s: float = 0.2,
    ) -> None:
        """Start fetching; silences longer than `silent_s` are reported when they end.

        A slow camera may be silent for longer, so that one lost image is not a silence.
        """
        self._device: Video | None = device
        self._clock, self._reopen, self._tries = clock, reopen, tries
        self._silent_s = silent_s
        self._shots: deque[Shot] = deque(maxlen=_KEPT)
        self._steps_s: deque[float] = deque(maxlen=_STEPS)
        self._notices: deque[str] = deque(maxlen=_MOST_PENDING)
        self._begun = self._clock.now()  # since when its clock has not gone back
        self._stamps, self._stamped = DeviceClock(), self._begun.jumps
        self._fault: str | None = None
        self._lost = ""
        self._count, self._has_ended = 0, False
        self._damaged = 0  # images since the last one that could be decoded
        self._lock, self._over = Lock(), Event()
        self._last_s = self._begun.time_s
        self._thread = Thread(target=self._run, name=f"camera {name}", daemon=True)
        self._thread.start()

    def shots(self, now: HostTime) -> tuple[Shot, ...]:
        """Return the last images since the clock last went back, oldest first."""
        with self._lock:
            self._heed(now)
            return tuple(self._shots) if now.jumps == self._begun.jumps else ()

    def _heed(self, now: HostTime) -> None:
        """Drop images of before the clock went back."""
        if now.jumps > self._begun.jumps:
            self._begun, self._last_s = now, now.time_s
            self._shots.clear()

    @property
    def usual_s(self) -> float:
        """Return the usual time between images; 0 until some have arrived."""
        with self._lock:
            return self._usual_s()

    def _usual_s(self) -> float:
        return statistics.median(self._steps_s) if len(self._steps_s) >= _FEW_STEPS else 0.0

    @property
    def patience_s(self) -> float:
        """Return the number of seconds without an image after which the camera counts as silent."""
        with self._lock:
            return self._patience_s()

    def _patience_s(self) -> float:
        return max(self._silent_s, _PATIENCE * self._usual_s())

    @property
    def has_ended(self) -> bool:
        """Return whether the device played a recording that has ended."""
        return self._has_ended

    def notices(self) -> tuple[str, ...]:
        """Return the notices since the previous call, oldest first."""
        with self._lock:
            notices = tuple(dict.fromkeys(self._notices))
            self._notices.clear()
        return notices

    def silence(self, now: HostTime) -> tuple[float, str]:
        """Return for how many seconds no image has arrived, and the known reason."""
        with self._lock:
            self._heed(now)
            fault = "" if self._fault is None else f": {self._fault}"
            return now.time_s - self._last_s, fault

    def close(self) -> None:
        """Stop the thread, which closes the device.

        The call does not wait for a driver that hangs; the device is closed once the driver
        returns.
        """
        self._over.set()
        if isinstance(self._device, Interruptible):
            self._device.interrupt()
        self._thread.join(_CLOSING_S)

    def _run(self) -> None:
        try:
            self._grab_on()
        finally:
            if self._device is not None:
                self._device.release()

    def _grab_on(self) -> None:
        failures = 0
        while not self._over.is_set():
            if self._device is None:
                failures = 0
                if not self._is_back():
                    self._over.wait(_REOPEN_S)
                continue
            fault, is_lost = self._fetch(self._device)
            if self._has_ended:
                return
            if fault is None:
                failures = 0
                continue
            failures = 0 if fault == _AWAITS else failures + 1
            self._set_fault(fault)
            # A damaged image is no broken connection: the next one may be whole.
            tries = TRIES if fault == _UNDECODED else self._tries
            if self._reopen is not None and (is_lost or failures >= tries):
                self._give_up(self._device, fault)
            else:
                self._over.wait(_RETRY_S)

    def _give_up(self, device: Video, fault: str) -> None:
        self._device, self._lost = None, fault
        try:
            device.release()
        except Exception as error:  # the device is gone, so closing it may fail
            self._set_fault(_text(error))

    def _is_back(self) -> bool:
        """Try to reopen the device, and return whether it is available."""
        if self._reopen is None:
            return False
        try:
            self._device = self._reopen()
        except Exception:  # the next attempt may succeed
            self._set_fault(f"{self._lost}; it cannot be opened yet")
            return False
        self._set_fault(f"{self._lost}; it was opened anew")
        return True

    def _set_fault(self, fault: str) -> None:
        with self._lock:
            self._fault = fault

    def _fetch(self, device: Video) -> tuple[str | None, bool]:
        """Take one shot; return why there is none, or None, and whether the device is lost."""
        try:
            if not device.grab():
                is_waiting = isinstance(device, Triggered) and device.may_be_silent
                return _AWAITS if is_waiting else "the camera delivers none", False
            arrived = self._clock.now()
            if not isfinite(arrived.time_s):
                return f"the clock of Live returned {arrived.time_s}", False
            found, data = device.retrieve()
        except EndedError as error:
            self._set_fault(_text(error))
            self._has_ended = True
            return _text(error), False
        except LostDeviceError as error:
            return _text(error), True
        except Exception as error:  # to the arm, any error of a driver is silence
            return _text(error), False
        if not found:
            self._damaged += 1
            return _UNDECODED, False
        self._keep(data if isinstance(data, Delivery) else Delivery((data,)), arrived)
        return None, False

    def _keep(self, delivery: Delivery, arrived: HostTime) -> None:
        arrived_s = time_s = arrived.time_s
        fault = None
        if arrived.jumps != self._stamped:
            self._stamps, self._stamped = DeviceClock(), arrived.jumps
        if delivery.stamp_s is not None:
            time_s, fault = self._stamps.time_s(delivery.stamp_s, arrived_s)
        with self._lock:
            if self._damaged:
                self._notices.append(_damaged(self._damaged))
            if delivery.missing:
                self._notices.append(_missing(delivery.missing))
            self._notices.extend(delivery.notices)
            if fault is not None:
                self._notices.append(fault)
            self._heed(arrived)
            if not delivery.images or arrived.jumps < self._begun.jumps:
                return
            self._report_gap(time_s, arrived_s, delivery.missing is not None)
            self._count += 1
            encoded = getattr(delivery, "encoded", None)
            self._shots.append(Shot(time_s, delivery.images, self._count, delivery.depths, encoded))
            self._last_s, self._fault, self._damaged = arrived_s, None, 0

    def _report_gap(self, time_s: float, arrived_s: float, is_numbered: bool) -> None:
        """Report a silence that has ended, and images that must be missing before this one."""
        silent_s = arrived_s - self._last_s
        if not self._shots:
            return
        step_s = time_s - self._shots[-1].time_s
        if silent_s > self._patience_s():
            reason = "" if self._fault is None else f": {self._fault}"
            self._notices.append(f"no image came for {silent_s:.1f} s{reason}")
            return
        usual_s = self._usual_s()
        is_long = len(self._steps_s) >= _LEAST_STEPS and step_s > _MISSED * usual_s
        lost = max(1, round(step_s / usual_s) - 1) - self._damaged if is_long else 0
        if lost > 0 and not is_numbered:
            self._notices.append(_missing(lost))
        self._steps_s.append(step_s)


def _damaged(count: int) -> str:
    what = "image before this one is" if count == 1 else "images before this one are"
    return f"{count} {what} damaged, such as cut short, and left out"


def _missing(count: int) -> str:
    return f"{count} {'image is' if count == 1 else 'images are'} missing before this one"


def _text(error: Exception) -> str:
    return str(error) or type(error).__name__
