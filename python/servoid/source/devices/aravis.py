"""Calls libaravis, which supports GigE Vision and USB3 Vision: functions, types and errors."""

import ctypes
from ctypes.util import find_library
from functools import lru_cache
from typing import Any

from servoid.errors import CaptureError, MissingExtraError

_NAMES = ("libaravis-0.8.so.0", "libaravis-0.8.dylib", "libaravis-0.8-0.dll")
_POINTER, _TEXT, _WHOLE = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int
_U32, _U64 = ctypes.c_uint32, ctypes.c_uint64
# Return and argument types of each function. Those in the second table also report errors.
_PLAIN: dict[str, tuple[Any, ...]] = {
    "arv_update_device_list": (None,),
    "arv_get_n_devices": (_U32,),
    "arv_get_device_id": (_TEXT, _U32),
    "arv_get_device_address": (_TEXT, _U32),
    "arv_get_device_model": (_TEXT, _U32),
    "arv_get_device_vendor": (_TEXT, _U32),
    "arv_get_device_serial_nbr": (_TEXT, _U32),
    "arv_get_device_protocol": (_TEXT, _U32),
    "arv_camera_get_device": (_POINTER, _POINTER),
    "arv_camera_is_gv_device": (_WHOLE, _POINTER),
    "arv_gv_device_is_controller": (_WHOLE, _POINTER),
    "arv_gv_device_get_device_address": (_POINTER, _POINTER),
    "arv_buffer_new_allocate": (_POINTER, ctypes.c_size_t),
    "arv_buffer_get_status": (_WHOLE, _POINTER),
    "arv_buffer_get_frame_id": (_U64, _POINTER),
    "arv_buffer_get_timestamp": (_U64, _POINTER),
    "arv_buffer_get_image_pixel_format": (_U32, _POINTER),
    "arv_buffer_get_image_width": (_WHOLE, _POINTER),
    "arv_buffer_get_image_height": (_WHOLE, _POINTER),
    "arv_buffer_get_image_padding": (
        None,
        _POINTER,
        ctypes.POINTER(_WHOLE),
        ctypes.POINTER(_WHOLE),
    ),
    "arv_buffer_get_image_data": (_POINTER, _POINTER, ctypes.POINTER(ctypes.c_size_t)),
    "arv_stream_push_buffer": (None, _POINTER, _POINTER),
    "arv_stream_timeout_pop_buffer": (_POINTER, _POINTER, _U64),
    "g_inet_socket_address_get_address": (_POINTER, _POINTER),
    "g_inet_address_to_string": (_TEXT, _POINTER),
    "g_object_unref": (None, _POINTER),
    "g_error_free": (None, _POINTER),
}
_FALLIBLE: dict[str, tuple[Any, ...]] = {
    "arv_camera_new": (_POINTER, _TEXT),
    "arv_camera_create_stream": (_POINTER, _POINTER, _POINTER, _POINTER),
    "arv_camera_start_acquisition": (None, _POINTER),
    "arv_camera_stop_acquisition": (None, _POINTER),
    "arv_camera_get_payload": (_U32, _POINTER),
    "arv_camera_gv_auto_packet_size": (_U32, _POINTER),
    "arv_camera_is_feature_available": (_WHOLE, _POINTER, _TEXT),
    "arv_camera_is_enumeration_entry_available": (_WHOLE, _POINTER, _TEXT, _TEXT),
    "arv_camera_get_string": (_TEXT, _POINTER, _TEXT),
    "arv_camera_set_string": (None, _POINTER, _TEXT, _TEXT),
    "arv_camera_get_integer": (ctypes.c_int64, _POINTER, _TEXT),
    **{
        f"arv_camera_is_{what}_available": (_WHOLE, _POINTER)
        for what in ("exposure_time", "gain", "frame_rate")
    },
    **{
        f"arv_camera_get_{what}": (ctypes.c_double, _POINTER)
        for what in ("exposure_time", "gain", "frame_rate")
    },
    **{
        f"arv_camera_set_{what}": (None, _POINTER, ctypes.c_double)
        for what in ("exposure_time", "gain", "frame_rate")
    },
}


class _GError(ctypes.Structure):
    """GLib's error structure."""

    _fields_ = (("domain", _U32), ("code", _WHOLE), ("message", _TEXT))


class AravisError(CaptureError):
    """Raised when libaravis or a camera refuses an operation."""


class Aravis:
    """The functions of libaravis; errors that they report are raised."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._calls: dict[str, Any] = {}
        for name, (returns, *takes) in _PLAIN.items():
            self._calls[name] = _declared(library, name, returns, takes)
        for name, (returns, *takes) in _FALLIBLE.items():
            error = ctypes.POINTER(ctypes.POINTER(_GError))
            self._calls[name] = _declared(library, name, returns, [*takes, error])

    def call(self, name: str, *arguments: Any) -> Any:
        """Call a function, named without its prefix `arv_`; strings are str.

        Raises:
            AravisError: the function reports an error.

        """
        name = name if name.startswith("g_") else f"arv_{name}"
        given = [one.encode() if isinstance(one, str) else one for one in arguments]
        if name not in _FALLIBLE:
            return _plain(self._calls[name](*given))
        error = ctypes.POINTER(_GError)()
        answer = self._calls[name](*given, ctypes.byref(error))
        if error:
            message = error.contents.message or b"no reason is given"
            self._calls["g_error_free"](error)
            raise AravisError(message.decode("utf-8", "replace"))
        return _plain(answer)


def _plain(answer: Any) -> Any:
    return answer.decode("utf-8", "replace") if isinstance(answer, bytes) else answer


def _declared(library: ctypes.CDLL, name: str, returns: Any, takes: list[Any]) -> Any:
    function = getattr(library, name)
    function.restype, function.argtypes = returns, takes
    return function


@lru_cache(maxsize=1)
def aravis() -> Aravis:
    """Load libaravis.

    Raises:
        MissingExtraError: it is not installed, or it is another version than 0.8.

    """
    for name in filter(None, (*_NAMES, find_library("aravis-0.8"))):
        try:
            return Aravis(ctypes.CDLL(name))
        except (OSError, AttributeError):
            continue
    raise MissingExtraError(
        "cameras of GigE Vision and USB3 Vision need the library Aravis 0.8, which is not "
        "installed; it is a package of the system: apt install libaravis-0.8-0 (Debian, Ubuntu), "
        "dnf install aravis (Fedora), or brew install aravis (macOS)"
    )
