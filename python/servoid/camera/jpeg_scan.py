"""Finds damage in the coded pixels of a JPEG, which decoders repair without an error.

In coded pixels the byte FF is followed by 00, or by a marker that may stand there. Damage breaks
this rule where it writes another byte after FF; damage without the byte FF is not noticed.
"""

import re

_LEAD = 0xFF
_TABLES = (0xC4, 0xCC)  # Huffman and arithmetic
_RESTARTS = range(0xD0, 0xD8)
_END, _SCAN, _INTERVAL = 0xD9, 0xDA, 0xDD
_BETWEEN = (*_TABLES, *range(0xDA, 0xDE), *range(0xE0, 0xF0), 0xFE)
"""The markers of the segments that may stand between two scans."""
_MARKER = re.compile(rb"\xff[^\x00\xff]")


def is_scan_damaged(data: bytes) -> bool:
    """Return whether bytes among the coded pixels of a JPEG contradict its format."""
    at, has_scan, has_restarts = 2, False, False
    while True:
        while data[at : at + 2] == b"\xff\xff":  # fill bytes
            at += 1
        if len(data) < at + 4 and data[at : at + 2] != b"\xff\xd9":
            return False  # cut short, which is another error
        lead, marker = data[at : at + 2]
        if lead != _LEAD:
            return has_scan
        if marker == _END:
            return False
        if has_scan and marker not in _BETWEEN:
            return True
        length = int.from_bytes(data[at + 2 : at + 4], "big")
        if marker == _INTERVAL:
            has_restarts = data[at + 4 : at + 6] != b"\0\0"
        at += 2 + length
        if marker == _SCAN:
            has_scan = True
            found = _next_marker(data, at, has_restarts=has_restarts)
            if found is None:
                return False
            at = found


def _next_marker(data: bytes, at: int, *, has_restarts: bool) -> int | None:
    """Return where coded pixels end, behind their restart markers; None if they do not end."""
    for found in _MARKER.finditer(data, at):
        if not (has_restarts and data[found.start() + 1] in _RESTARTS):
            return found.start()
    return None
