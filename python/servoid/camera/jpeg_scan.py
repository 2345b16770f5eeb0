"""Finds damage in the coded pixels of a JPEG, which decoders repair without an error.

In coded pixels the byte FF is followed by 00, or by a marker that may stand there. Damage breaks
this rule where it writes another byte after FF. Other damage is not noticed, except for long runs
of zeros, such as a lost sector: they are no code of pixels where a code of zeros alone continues a
block instead of ending it.
"""

import re

_LEAD = 0xFF
_TABLES = (0xC4, 0xCC)  # Huffman and arithmetic
_RESTARTS = range(0xD0, 0xD8)
_END, _SCAN, _INTERVAL = 0xD9, 0xDA, 0xDD
_SEQUENTIAL = (0xC0, 0xC1)  # frames whose blocks are coded whole, by Huffman's codes
_END_OF_BLOCK = 0
_ZEROS = bytes(64)  # more bits than a block of zeros that continues, and the others around it
_BETWEEN = (*_TABLES, *range(0xDA, 0xDE), *range(0xE0, 0xF0), 0xFE)
"""The markers of the segments that may stand between two scans."""
_MARKER = re.compile(rb"\xff[^\x00\xff]")


def is_scan_damaged(data: bytes) -> bool:
    """Return whether bytes among the coded pixels of a JPEG contradict its format."""
    at, has_scan, has_restarts, is_sequential = 2, False, False, False
    zero_codes: dict[int, int] = {}
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
        segment = data[at + 4 : at + 2 + length]
        is_sequential = is_sequential or marker in _SEQUENTIAL
        if marker == _TABLES[0]:
            zero_codes.update(_zero_codes(segment))
        at += 2 + length
        if marker == _SCAN:
            has_scan = True
            found = _next_marker(data, at, has_restarts=has_restarts)
            if found is None:
                return False
            has_zeros = is_sequential and data.find(_ZEROS, at, found) >= 0
            if has_zeros and _takes_no_zeros(segment, zero_codes):
                return True
            at = found


def _next_marker(data: bytes, at: int, *, has_restarts: bool) -> int | None:
    """Return where coded pixels end, behind their restart markers; None if they do not end."""
    for found in _MARKER.finditer(data, at):
        if not (has_restarts and data[found.start() + 1] in _RESTARTS):
            return found.start()
    return None


def _zero_codes(segment: bytes) -> dict[int, int]:
    """Return what a code of zeros means in each of the AC tables in a segment of tables."""
    found, at = {}, 0
    while at + 17 < len(segment):
        kind, number = divmod(segment[at], 16)
        if kind == 1:
            found[number] = segment[at + 17]  # the first and shortest code is all zeros
        at += 17 + sum(segment[at + 1 : at + 17])
    return found


def _takes_no_zeros(header: bytes, zero_codes: dict[int, int]) -> bool:
    """Return whether a scan has a component of whose blocks none is coded by zeros alone."""
    tables = header[2 : 1 + 2 * header[0] : 2] if header else b""
    return any(zero_codes.get(table % 16, _END_OF_BLOCK) != _END_OF_BLOCK for table in tables)
