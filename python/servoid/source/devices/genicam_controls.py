"""Fixes the settings that an industrial camera changes by itself, by GenICam feature names."""

from typing import Any

from servoid.source.controls import Controls
from servoid.source.devices.aravis import Aravis, AravisError

_AUTOMATIC = ("ExposureAuto", "GainAuto", "BalanceWhiteAuto", "FocusAuto")
_CLOSE = 0.01  # cameras round exposure to lines and gain to steps


def apply_controls(library: Aravis, camera: Any, controls: Controls) -> tuple[str, ...]:
    """Set a camera, and return what it refused, as messages for the user."""
    device = _Device(library, camera)
    messages = []
    if controls.lock:
        messages += [device.lock(feature, adapts) for feature, adapts in _locks(controls)]
    settings = (
        ("frame_rate", "rate_hz", controls.rate_hz, 1.0),
        ("exposure_time", "exposure_s", controls.exposure_s, 1e-6),
        ("gain", "gain", controls.gain, 1.0),
    )
    messages += [
        device.set(what, key, value, unit)
        for what, key, value, unit in settings
        if value is not None
    ]
    if controls.focus is not None:
        messages.append(
            "the focus of an industrial camera is set at its lens, so focus is not used"
        )
    return tuple(one for one in messages if one is not None)


def _locks(controls: Controls) -> list[tuple[str, bool]]:
    """Return the automatic controls to turn off, and whether each may adapt once before."""
    given = {"ExposureAuto": controls.exposure_s, "GainAuto": controls.gain}
    return [
        (feature, given.get(feature) is None and feature != "FocusAuto") for feature in _AUTOMATIC
    ]


class _Device:
    """The features of one camera."""

    def __init__(self, library: Aravis, camera: Any) -> None:
        self._library, self._camera = library, camera

    def _call(self, name: str, *arguments: Any) -> Any:
        return self._library.call(f"camera_{name}", self._camera, *arguments)

    def _has(self, feature: str) -> bool:
        try:
            return bool(self._call("is_feature_available", feature))
        except AravisError:
            return False

    def lock(self, feature: str, adapts: bool) -> str | None:
        """Turn off an automatic control, after it adapted once if it can; report a refusal."""
        if not self._has(feature) or self._call("get_string", feature) == "Off":
            return None
        for value in ("Once", "Off") if adapts else ("Off",):
            try:
                if self._call("is_enumeration_entry_available", feature, value):
                    self._call("set_string", feature, value)
                    if self._call("get_string", feature) in ("Once", "Off"):
                        return None
            except AravisError:
                continue
        return f"the camera refuses {feature} = Off, so it continues to change by itself"

    def set(self, what: str, key: str, value: float, unit: float) -> str | None:
        """Set a value in the camera's unit; report if it is unsupported, refused or differs."""
        if not self._call(f"is_{what}_available"):
            return f"the camera allows no {what.replace('_', ' ')} to be set, so {key} is not used"
        try:
            self._call(f"set_{what}", value / unit)
            kept = self._call(f"get_{what}") * unit
        except AravisError as reason:
            return f"the camera refuses {key} = {value:g} ({reason})"
        if abs(kept - value) > _CLOSE * abs(value):
            return f"the camera took {key} = {kept:.6g} in place of {value:g}"
        return None
