"""Reads the constants of the Rust tracker, and what its table of tuning constants says of them.

The table holds what the code does not: the unit of each, and what became of the courses of trust
when it was made smaller and larger. `benches/trust/tuning.py` measures and writes it.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from rust_source import code, is_test_file

ROOT = Path(__file__).resolve().parents[2]
TRACK = ROOT / "crates" / "servoid" / "src" / "track"
TABLE = ROOT / "benches" / "trust" / "tuning.tsv"
FACTORS = (0.8, 1.25)
COLUMNS = ("file", "constant", "unit", *(f"times {factor:g}" for factor in FACTORS))
HEAD = """\
# The tracker's tuning constants: their units, and what became of the courses of trust with each of
# them smaller and larger, all else equal: images tracked rightly and, after the stroke, wrong and
# trusted, less those of the usual value. benches/trust/tuning.py measures it and writes it anew;
# empty is what was not swept.
"""

_CONSTANT = re.compile(
    r"((?:^[ \t]*///[^\n]*\n)*)(?:^[ \t]*#\[[^\n]*\n)*"
    r"^(?:pub(?:\([a-z]+\))? )?const ([A-Z_0-9]+): [^=]+ =\s*([^;]+);",
    re.MULTILINE,
)
_NUMBER = re.compile(r"(?<![\w.])\d[\d_]*(?:\.\d+)?(?:e-?\d+)?(?![\w.])")

Key = tuple[str, str]


@dataclass(frozen=True)
class Constant:
    """A constant as the code has it; `meaning` is empty where the one above speaks for both."""

    file: str
    name: str
    value: str
    meaning: str

    @property
    def key(self) -> Key:
        """Return what names it."""
        return self.file, self.name

    def scaled(self, factor: float) -> "Constant | None":
        """Return it with all its numbers that many times as large, None where that changes nothing.

        Whole numbers stay whole.
        """

        def times(match: re.Match[str]) -> str:
            number = match[0].replace("_", "")
            whole = number.isdigit()
            return str(round(int(number) * factor)) if whole else f"{float(number) * factor:.9e}"

        value = _NUMBER.sub(times, self.value)
        return None if value == self.value else replace(self, value=value)


@dataclass(frozen=True)
class Tuned:
    """What the table says of a constant."""

    unit: str
    swept: tuple[str, ...] = ("",) * len(FACTORS)


def constants() -> Iterator[Constant]:
    """Read the constants of the tracker, file by file."""
    for path in sorted(TRACK.rglob("*.rs")):
        if is_test_file(path):
            continue
        shown = code(path)
        for match in _CONSTANT.finditer(path.read_text(encoding="utf-8")):
            if shown[match.start(2) : match.end(2)] != match[2]:
                continue  # in a test
            meaning = " ".join(line.strip()[3:].strip() for line in match[1].splitlines())
            value = re.sub(r"\s+", " ", match[3].strip())
            yield Constant(path.relative_to(TRACK).as_posix(), match[2], value, meaning)


def changed(text: str, constant: Constant, other: Constant) -> str:
    """Give a file's text with another value of a constant."""
    pattern = re.compile(rf"(const {constant.name}: [^=]+ =\s*)[^;]+;")
    return pattern.sub(lambda match: f"{match[1]}{other.value};", text, count=1)


def tuned() -> dict[Key, Tuned]:
    """Read the table."""
    rows = [line.split("\t") for line in TABLE.read_text(encoding="utf-8").splitlines()]
    rows = [row for row in rows if not row[0].startswith("#")][1:]
    return {(row[0], row[1]): Tuned(row[2], tuple(row[3:])) for row in rows}


def written(rows: Mapping[Key, Tuned]) -> str:
    """Write the table."""
    lines = [COLUMNS, *((*key, row.unit, *row.swept) for key, row in rows.items())]
    return HEAD + "".join("\t".join(line) + "\n" for line in lines)
