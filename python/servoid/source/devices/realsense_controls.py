"""Keeps a RealSense camera's emitter off and its exposure locked, and reports failures."""

import time
from typing import Any

from servoid.source.controls import Controls

_SETTLING = 30  # images in which the exposure may adapt before it is locked
_CLOSE = 0.02  # relative change of an exposure or a gain that counts as none
_QUERY_S = 1.0  # between queries of a device whose images lack the emitter's state
_EMITTER = "the emitter is on: its dots would be taken for the object's surface"
# Keys of an image's metadata: each is 0 while the emitter is off.
_EMITTING = ("frame_laser_power_mode", "frame_emitter_mode")


class RealSenseControls:
    """Sets the options of a sensor, and monitors them while it runs.

    `library` is pyrealsense2. `sensor` is its sensor, None for a recording, which cannot be set.
    `notices` are what the device refused.
    """

    def __init__(self, library: Any, sensor: Any | None, controls: Controls) -> None:
        self._library, self._sensor, self._controls = library, sensor, controls
        self._count, self._queried_s = 0, -float("inf")
        self._usual: dict[str, float] = {}
        self._is_settled = controls.exposure_s is not None or not controls.lock
        self.notices: tuple[str, ...] = () if sensor is None else self._begin()

    def _begin(self) -> tuple[str, ...]:
        """Apply the controls; return what is refused."""
        controls = self._controls
        messages = [self._set("emitter_enabled", 0.0)]
        if controls.exposure_s is not None or controls.gain is not None:
            messages.append(self._set("enable_auto_exposure", 0.0))
            messages.append(self._set("exposure", controls.exposure_s, 1e6))
            messages.append(self._set("gain", controls.gain))
        if controls.focus is not None:
            messages.append("the focus of a RealSense camera is fixed, so focus is not used")
        return tuple(one for one in messages if one is not None)

    def watch(self, frame: Any) -> tuple[str, ...]:
        """Return what is wrong with an image that arrived, as messages for the user."""
        self._count += 1
        messages = [_EMITTER] if self._emits(frame) else []
        if self._sensor is None:
            return tuple(messages)
        if messages and self._set("emitter_enabled", 0.0) is not None:
            messages.append("the device refuses to switch the emitter off")
        values = {name: _known(self._library, frame, name) for name in _MEASURED}
        known = {name: value for name, value in values.items() if value is not None}
        if not self._is_settled:
            return (*messages, *self._settle(known))
        return (*messages, *self._changes(known)) if self._controls.lock else tuple(messages)

    def _emits(self, frame: Any) -> bool:
        """Return whether the emitter was on in an image, from its metadata or by query."""
        modes = [_known(self._library, frame, name) for name in _EMITTING]
        if any(mode is not None for mode in modes):
            return any(modes)
        if self._sensor is None:
            return False
        now_s = time.monotonic()
        if now_s - self._queried_s < _QUERY_S:
            return False
        self._queried_s = now_s
        return bool(self._get("emitter_enabled"))

    def _settle(self, known: dict[str, float]) -> tuple[str, ...]:
        """Lock the exposure once it has adapted, at its current values."""
        if self._count < _SETTLING or not self._controls.lock:
            return ()
        self._is_settled = True
        if not self._get("enable_auto_exposure"):
            return ()
        messages = [
            self._set("enable_auto_exposure", 0.0),
            self._set("exposure", known.get("actual_exposure")),
            self._set("gain", known.get("gain_level")),
        ]
        return tuple(one for one in messages if one is not None)

    def _changes(self, known: dict[str, float]) -> tuple[str, ...]:
        """Report values that changed since the previous image, though they are locked."""
        messages = [
            f"its {_MEASURED[name]} changed from {self._usual[name]:g} to {value:g}, though locked"
            for name, value in known.items()
            if name in self._usual
            and abs(value - self._usual[name]) > _CLOSE * abs(self._usual[name])
        ]
        self._usual = known
        return tuple(messages)

    def _get(self, name: str) -> float | None:
        option, sensor = getattr(self._library.option, name), self._sensor
        return None if sensor is None or not sensor.supports(option) else sensor.get_option(option)

    def _set(self, name: str, value: float | None, units: float = 1.0) -> str | None:
        """Set an option if the sensor has it and it differs; report if it refuses or lacks it."""
        sensor = self._sensor
        if sensor is None or value is None or self._get(name) == value * units:
            return None
        shown = f"{name} = {value * units:g}"
        if self._get(name) is None:
            return f"the device has no option for {shown}"
        try:
            sensor.set_option(getattr(self._library.option, name), value * units)
        except RuntimeError as reason:
            return f"the device refuses {shown}: {reason}"
        kept = self._get(name)
        return None if kept == value * units else f"the device took {name} = {kept} for {shown}"


_MEASURED = {"actual_exposure": "exposure (µs)", "gain_level": "gain"}


def _known(library: Any, frame: Any, name: str) -> float | None:
    """Return a value from an image's metadata, or None."""
    value = getattr(library.frame_metadata_value, name)
    return float(frame.get_frame_metadata(value)) if frame.supports_frame_metadata(value) else None
