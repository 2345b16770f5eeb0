import re
import shutil
import subprocess
from pathlib import Path

import pytest
import rust_source

ROOT = Path(__file__).parents[2]
DRAWERS = {"utils", "util", "helpers", "helper", "common", "misc", "manager"}
MACHINE_PATH = re.compile(r"(?<![\w.~*/-])/(?:work|root|home|Users|tmp)/\w")
# Written in two parts, so that this file passes its own test.
REGISTRY = re.compile("|".join(rf"\b{name}\.{end}\b" for name, end in (
    ("crates", "io"), ("pypi", "org"), ("pythonhosted", "org"), ("npmjs", "org"),
    ("golang", "org"), ("debian", "org"), ("maven", "org"),
)))  # fmt: skip
STOPS = re.compile(
    r"\.(?:unwrap|expect|unwrap_err|expect_err)\s*\("
    r"|\b(?:panic|unreachable|todo|unimplemented|print|println|eprint|eprintln|dbg)!"
)


def project_files() -> list[Path]:
    """List what git tracks or would track; without git, what lies in the source folders."""
    if shutil.which("git") and (ROOT / ".git").exists():
        command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
        names = subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout.decode()
        return [
            ROOT / name for name in sorted(set(names.split("\0")) - {""}) if (ROOT / name).is_file()
        ]
    folders = (
        *("crates", "python", "experiments", "tests", "docs", "examples", "benches", "fuzz"),
        "wheels",
        ".ci",
    )
    inner = [path for folder in folders for path in (ROOT / folder).rglob("*") if path.is_file()]
    return sorted([*ROOT.glob("*.*"), ROOT / "Makefile", *inner])


FILES = project_files()


def text_of(path: Path) -> str | None:
    """Return a file's text, or None if it is a picture or another binary file."""
    data = path.read_bytes()
    return None if b"\0" in data else data.decode("utf-8", errors="replace")


def matches(pattern: re.Pattern[str], files: list[Path]) -> list[str]:
    return [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in files
        for number, line in enumerate((text_of(path) or "").splitlines(), 1)
        if pattern.search(line)
    ]


def test_no_source_file_is_longer_than_400_lines() -> None:
    sources = [path for path in FILES if path.suffix in (".rs", ".py", ".pyi")]
    lengths = {str(path.relative_to(ROOT)): len(path.read_bytes().splitlines()) for path in sources}
    # The native module is one module, so it has one stub.
    lengths.pop("python/servoid/_native.pyi")
    assert len(sources) > 20
    assert {name: length for name, length in lengths.items() if length > 400} == {}


def test_no_folder_or_module_is_a_drawer() -> None:
    names = {
        (part, path) for path in FILES for part in path.relative_to(ROOT).with_suffix("").parts
    }
    assert [str(path.relative_to(ROOT)) for part, path in names if part.lower() in DRAWERS] == []


def test_no_file_names_a_path_of_one_machine() -> None:
    assert matches(MACHINE_PATH, FILES) == []


def test_no_file_names_a_registry_host() -> None:
    # The lock file's sources are checked below; Cargo writes them.
    assert matches(REGISTRY, [path for path in FILES if path.name != "Cargo.lock"]) == []


def test_the_lock_file_knows_one_registry() -> None:
    lock = (ROOT / "Cargo.lock").read_text(encoding="utf-8")
    sources = set(re.findall(r'^source = "(.*)"$', lock, flags=re.MULTILINE))
    assert len(sources) == 1
    assert sources.pop().startswith("registry+")


def test_the_crates_neither_panic_nor_print_outside_tests() -> None:
    sources = sorted((ROOT / "crates").glob("*/src/**/*.rs"))
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in sources
        for number, line in enumerate(rust_source.code(path).splitlines(), 1)
        if STOPS.search(line)
    ]
    assert len(sources) > 5
    assert found == []


def test_only_the_command_line_prints() -> None:
    folders = (ROOT / "python", ROOT / "experiments" / "servoid_experiments")
    sources = [path for folder in folders for path in folder.rglob("*.py")]
    files = [path for path in sources if "cli" not in path.with_suffix("").parts]
    assert matches(re.compile(r"\b(?:print|sys\.exit|exit|quit)\("), files) == []


def test_the_version_is_written_the_same_everywhere() -> None:
    manifest = (ROOT / "Cargo.toml").read_text(encoding="utf-8")
    versions = re.findall(r'^version = "(.*)"$', manifest, flags=re.MULTILINE)
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    entries = re.findall(r"^## (\S+)", changes, flags=re.MULTILINE)
    assert len(versions) == 1
    assert next(entry for entry in entries if entry != "Unreleased") == versions[0]
    experiments = (ROOT / "experiments" / "pyproject.toml").read_text(encoding="utf-8")
    assert re.findall(r'^version = "(.*)"$', experiments, flags=re.MULTILINE) == versions
    assert re.findall(r'"servoid\[.*\]==(.*)"', experiments) == versions


def test_both_licences_name_the_holder_and_the_year() -> None:
    for name in ("LICENSE-MIT", "LICENSE-APACHE"):
        text = (ROOT / name).read_text(encoding="utf-8")
        assert "2026 the servoid developers" in text


def test_the_continuous_check_is_executable() -> None:
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111


# The checks themselves are checked.


@pytest.mark.parametrize("line", ["see /{}/a.txt", 'open("/{}/x")', "`/{}/a`"])
@pytest.mark.parametrize("folder", ["home", "tmp", "root"])
def test_a_machine_path_is_found(line: str, folder: str) -> None:
    assert MACHINE_PATH.search(line.format(folder))


@pytest.mark.parametrize("line", ["docs/root/a", "../work/a", "a/tmp/b", "at home / at work /"])
def test_a_relative_path_is_no_machine_path(line: str) -> None:
    assert not MACHINE_PATH.search(line)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("fn f() { a.unwrap(); }", True),
        ('fn f() { a\n.expect("") }', True),
        ('fn f() { panic!("no") }', True),
        ("fn f() { a.unwrap_or(1); }", False),
        ("// a.unwrap()\n/// b.unwrap()\nfn f() {}", False),
        ('fn f() { "a.unwrap()"; r#"panic!("#; \'"\'; }', False),
        ("fn f<'a>(x: &'a str) {}\n#[cfg(test)]\nmod t { fn g() { a.unwrap() } }", False),
        ("#[cfg(test)]\nmod t { fn g() { if a {} } }\nfn f() { a.unwrap() }", True),
    ],
)
def test_a_stop_in_rust_is_found_outside_tests_only(tmp_path: Path, text: str, found: bool) -> None:
    path = tmp_path / "a.rs"
    path.write_text(text)
    assert bool(STOPS.search(rust_source.code(path))) == found


def test_a_file_that_is_declared_for_tests_only_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "mod.rs").write_text("#[cfg(test)]\nmod laws;\nmod a;\n")
    for name in ("laws", "a"):
        (tmp_path / f"{name}.rs").write_text("fn f() { b.unwrap() }")
    assert rust_source.code(tmp_path / "laws.rs") == ""
    assert "unwrap" in rust_source.code(tmp_path / "a.rs")
