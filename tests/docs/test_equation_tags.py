import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TAG = re.compile(r"\bEqs?\.\s+((?:\(\d+\)(?:\s*(?:,\s*and|,|-|–|and|to)\s*(?=\(\d))?)+)")
FOLDERS = (("crates", "rs"), ("python", "py"), ("experiments/servoid_experiments", "py"))
RANGE = re.compile(r"\((\d+)\)\s*(?:-|–|to)\s*\((\d+)\)")


@dataclass(frozen=True)
class Row:
    symbol: str
    equation: str
    code_name: str
    file: str


def tags(text: str) -> set[int]:
    """Return the numbers in `Eq. (7)`, `Eqs. (1), (2)` and `Eqs. (1)-(5)`."""
    found: set[int] = set()
    for match in TAG.finditer(text):
        found |= {int(number) for number in re.findall(r"\d+", match.group(1))}
        for first, last in RANGE.findall(match.group(1)):
            found |= set(range(int(first), int(last) + 1))
    return found


def read_rows(text: str) -> list[Row]:
    lines = [line for line in text.splitlines() if line.startswith("|")][2:]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [Row(row[0], row[1], row[2].strip("`"), row[5].strip("`")) for row in cells if row[5:]]


def test_each_word_of_the_notation_is_in_its_file() -> None:
    section = (ROOT / "NOTATION.md").read_text(encoding="utf-8").split("## Words\n")[1]
    lines = [line for line in section.splitlines() if line.startswith("|")][2:]
    rows = [[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in lines]
    words = [word.lower() for word, _, _ in rows]
    assert words == sorted(set(words))
    wrong = [
        word
        for word, _, file in rows
        if not re.search(rf"\b{word}\b", (ROOT / file).read_text(encoding="utf-8"))
    ]
    assert wrong == []


def tagged_files(root: Path) -> Iterator[tuple[str, set[int]]]:
    for folder, suffix in FOLDERS:
        for path in sorted((root / folder).rglob(f"*.{suffix}")):
            if found := tags(path.read_text(encoding="utf-8")):
                yield path.relative_to(root).as_posix(), found


def drift(root: Path) -> list[str]:
    """Say where NOTATION.md under `root` and the tags in its sources differ."""
    rows = read_rows((root / "NOTATION.md").read_text(encoding="utf-8"))
    listed = {(number, row.file) for row in rows for number in tags(row.equation)}
    tagged = {(number, file) for file, numbers in tagged_files(root) for number in numbers}
    wrong = [f"{file} has Eq. ({number}), NOTATION.md has not" for number, file in tagged - listed]
    wrong += [f"NOTATION.md has Eq. ({number}), {file} has not" for number, file in listed - tagged]
    for row in rows:
        if not (root / row.file).is_file():
            wrong.append(f"{row.symbol}: there is no file {row.file}")
        elif not re.search(rf"\b{row.code_name}\b", (root / row.file).read_text(encoding="utf-8")):
            wrong.append(f"{row.symbol}: {row.file} does not hold {row.code_name}")
    return sorted(wrong)


def test_the_notation_and_the_tags_in_the_sources_agree() -> None:
    assert drift(ROOT) == []


def test_a_symbol_is_listed_once_for_each_file() -> None:
    rows = read_rows((ROOT / "NOTATION.md").read_text(encoding="utf-8"))
    pairs = [(row.code_name, row.file) for row in rows]
    assert len(rows) >= 20
    assert [pair for pair in pairs if pairs.count(pair) > 1] == []


def test_our_own_equations_are_on_the_page_of_the_mathematics() -> None:
    page = (ROOT / "docs" / "mathematics.md").read_text(encoding="utf-8")
    written = re.findall(r"\\tag\{S(\d+)\}", page)
    used = {
        number
        for text in ((ROOT / "NOTATION.md").read_text(encoding="utf-8"), page)
        for number in re.findall(r"\(S(\d+)\)", text)
    }
    assert written == [str(number) for number in range(1, len(written) + 1)]
    assert used - set(written) == set()


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("// Eq. (7)", {7}),
        ("# Eq. (12), damped", {12}),
        ("// Eqs. (1), (2): on and outside", {1, 2}),
        ("// Eqs. (3)-(5)", {3, 4, 5}),
        ("// Eqs. (3)–(5) and (7)", {3, 4, 5, 7}),
        ("// Eq. (7) of a body, (8) others", {7}),
        ("// Equation (7)", set()),
    ],
)
def test_tags_are_read_in_all_their_spellings(text: str, numbers: set[int]) -> None:
    assert tags(text) == numbers


def small_tree(root: Path, source: str, equation: str, code_name: str, file: str) -> Path:
    path = root / "crates" / "a.rs"
    path.parent.mkdir()
    path.write_text(source)
    (root / "NOTATION.md").write_text(
        "| Symbol | Equation | Code name | Unit | Shape | File |\n|---|---|---|---|---|---|\n"
        f"| F | {equation} | `{code_name}` | - | 1 | `{file}` |\n"
    )
    return root


@pytest.mark.parametrize(
    ("source", "equation", "code_name", "file", "fault"),
    [
        ("fn fitness() {} // Eq. (7)", "-", "fitness", "crates/a.rs", "NOTATION.md has not"),
        ("fn fitness() {}", "Eq. (7)", "fitness", "crates/a.rs", "crates/a.rs has not"),
        ("fn fitness() {}", "-", "score", "crates/a.rs", "does not hold score"),
        ("fn fitness() {}", "-", "fitness", "crates/b.rs", "there is no file"),
    ],
)
def test_drift_is_caught(
    tmp_path: Path, source: str, equation: str, code_name: str, file: str, fault: str
) -> None:
    found = drift(small_tree(tmp_path, source, equation, code_name, file))
    assert len(found) == 1
    assert fault in found[0]


def test_agreement_is_let_through(tmp_path: Path) -> None:
    tree = small_tree(
        tmp_path, "fn fitness() {} // Eq. (7)", "Eq. (7), whole", "fitness", "crates/a.rs"
    )
    assert drift(tree) == []
