"""Damages bytes as disks, editors and attackers do, by a seed."""

import random
import re
from collections.abc import Callable

Mutation = Callable[[random.Random, bytes], bytes]

_NUMBER = re.compile(rb"-?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?")
_NUMBERS = (
    b"0", b"-0", b"-1", b"1e308", b"-1e308", b"1e-320", b"nan", b"inf", b"2147483648",
    b"18446744073709551616", b"9" * 400, b"1_0", b"0x1p3", b"1e", b"",
)  # fmt: skip
_PIECES = (
    b"\0", b"\r", b"\n", b"\xff\xfe", b"\xef\xbb\xbf", b"[" * 500, b'{"a":' * 500, b'"', b"'",
    b"..", b"/", b"~", b"%s", b"{}", b"#", b",,,,", b"\xe2\x80\xa8", b"a." * 200, b"null", b"true",
)  # fmt: skip
_LONGEST = 1 << 18


def mutate(rng: random.Random, data: bytes, others: tuple[bytes, ...]) -> bytes:
    """Return the data with one to four damages; pieces of `others` may get into it."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        kind = rng.choice((*_KINDS, None))
        data = _splice(rng, data, rng.choice(others)) if kind is None else kind(rng, data)
    return data[:_LONGEST]


def _flip(rng: random.Random, data: bytes) -> bytes:
    if not data:
        return data
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]


def _overwrite(rng: random.Random, data: bytes) -> bytes:
    at, count = _span(rng, data, 8)
    return data[:at] + rng.randbytes(count) + data[at + count :]


def _cut(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _cut_little(rng: random.Random, data: bytes) -> bytes:
    return data[: -rng.randint(1, 4)]


def _drop(rng: random.Random, data: bytes) -> bytes:
    at, count = _span(rng, data, 64)
    return data[:at] + data[at + count :]


def _double(rng: random.Random, data: bytes) -> bytes:
    at, count = _span(rng, data, 256)
    return data[:at] + data[at : at + count] * rng.choice((2, 3, 50)) + data[at + count :]


def _insert(rng: random.Random, data: bytes) -> bytes:
    at, _ = _span(rng, data, 1)
    return data[:at] + rng.choice(_PIECES) + data[at:]


def _renumber(rng: random.Random, data: bytes) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return _flip(rng, data)
    one = rng.choice(found)
    return data[: one.start()] + rng.choice(_NUMBERS) + data[one.end() :]


def _swap_lines(rng: random.Random, data: bytes) -> bytes:
    lines = data.split(b"\n")
    first, second = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[first], lines[second] = lines[second], lines[first]
    return b"\n".join(lines)


def _splice(rng: random.Random, data: bytes, other: bytes) -> bytes:
    at, (start, count) = _span(rng, data, 1)[0], _span(rng, other, 128)
    return data[:at] + other[start : start + count] + data[at:]


def _span(rng: random.Random, data: bytes, most: int) -> tuple[int, int]:
    at = rng.randrange(len(data) + 1)
    return at, min(rng.randint(1, most), len(data) - at)


_KINDS: tuple[Mutation, ...] = (
    _flip,
    _overwrite,
    _cut,
    _cut_little,
    _drop,
    _double,
    _insert,
    _renumber,
    _renumber,
    _renumber,
    _swap_lines,
)
