"""Reads the header of a PLY file, and checks its counts against the file's size."""

from dataclasses import dataclass
from pathlib import Path

from servoid.errors import MeshError

FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_LONGEST_HEADER = 1 << 16


@dataclass(frozen=True)
class PlyProperty:
    """One property: its name, NumPy's code of its type, and for a list the code of its length."""

    name: str
    code: str
    length_code: str | None = None

    @property
    def least_bytes(self) -> int:
        """Return the least number of bytes of one value: a list may be empty."""
        return int((self.length_code or self.code)[1:])


@dataclass(frozen=True)
class PlyElement:
    """One element: its number of rows, and their properties in order."""

    name: str
    count: int
    properties: tuple[PlyProperty, ...]


@dataclass(frozen=True)
class PlyHeader:
    """A validated header: `order` is NumPy's byte order character, empty for text."""

    order: str
    elements: tuple[PlyElement, ...]
    size: int

    def element(self, name: str) -> PlyElement | None:
        """Return the element with a name."""
        return next((element for element in self.elements if element.name == name), None)


def read_ply_header(path: Path, data: bytes) -> PlyHeader:
    """Read the header at the beginning of `data`, the content of the file at `path`.

    Raises:
        MeshError: it is not a PLY header, or it promises more rows than the file can contain.

    """
    if not data.startswith((b"ply\n", b"ply\r")):
        raise MeshError(f"{path} is not a PLY file: it does not begin with the line 'ply'")
    end = data.find(b"end_header", 0, _LONGEST_HEADER)
    line_end = data.find(b"\n", end)
    if end < 0 or line_end < 0:
        raise MeshError(
            f"{path} is not a complete PLY file: its header has no line 'end_header'; copy it again"
        )
    lines = data[:end].decode("latin-1").splitlines()[1:]
    order: str | None = None
    elements: list[PlyElement] = []
    for number, line in enumerate(lines, start=2):
        words, place = line.split(), f"{path}, line {number}"
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words[0] == "format" and len(words) == 3:
            order = FORMATS.get(words[1])
        elif words[0] == "element" and len(words) == 3:
            elements.append(PlyElement(words[1], _count(words[2], place), ()))
        elif words[0] == "property" and elements:
            last = elements[-1]
            properties = (*last.properties, _property(words, place))
            elements[-1] = PlyElement(last.name, last.count, properties)
        else:
            raise MeshError(f"{place}: '{line[:60]}' is not a line of a PLY header")
    if order is None:
        raise MeshError(f"{path}: the header has no format; known ones: {', '.join(FORMATS)}")
    header = PlyHeader(order, tuple(elements), line_end + 1)
    _check_room(path, header, len(data))
    return header


def _count(word: str, place: str) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 19):
        raise MeshError(
            f"{place}: the count is '{word[:30]}'; it must be a whole number, 0 or more"
        )
    return int(word)


def _property(words: list[str], place: str) -> PlyProperty:
    kinds = words[1:-1]
    if kinds[:1] == ["list"] and len(kinds) == 3:
        length, kind = TYPES.get(kinds[1], ""), TYPES.get(kinds[2])
        if kind and length[:1] in ("i", "u"):
            return PlyProperty(words[-1], kind, length)
    elif len(kinds) == 1 and kinds[0] in TYPES:
        return PlyProperty(words[-1], TYPES[kinds[0]])
    raise MeshError(
        f"{place}: '{' '.join(words)[:60]}' is not a property; write its type "
        f"({', '.join(list(TYPES)[::2])}) and its name"
    )


def _check_room(path: Path, header: PlyHeader, size: int) -> None:
    room = size - header.size
    for element in header.elements:
        # In text, each value takes a digit and a separator; the last line may lack its end.
        row = (
            sum(one.least_bytes for one in element.properties)
            if header.order
            else 2 * len(element.properties)
        )
        need = element.count * max(1, row)
        if need > room + (0 if header.order else 1):
            raise MeshError(
                f"{path}: the header promises {element.count} rows of '{element.name}', at least "
                f"{need} bytes, but only {max(0, room)} are left in the file; it is cut short or "
                "damaged, copy it again"
            )
        room -= need
