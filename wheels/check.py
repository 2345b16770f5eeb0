"""Says what is wrong with a wheel: `python -m wheels.check dist/*.whl`."""

import base64
import csv
import hashlib
import io
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
GLIBC = (2, 17)
"""The oldest C library that the wheels run with."""

LICENCES = "licenses/THIRD-PARTY.txt"

_LIBRARY = "servoid/_native.abi3.so"
_PACKAGE = ROOT / "python"
_LEAST = ("servoid/py.typed", "servoid/_native.pyi", "servoid/__main__.py", _LIBRARY)
_BESIDE = (
    *("METADATA", "WHEEL", "RECORD", "entry_points.txt"),
    *("licenses/LICENSE-MIT", "licenses/LICENSE-APACHE", LICENCES),
    "sboms/servoid-py.cyclonedx.json",
)
_SYSTEM = re.compile(r"lib(c|m|dl|pthread|rt|util|gcc_s)\.so\.\d+|ld-linux[\w-]*\.so\.\d+")
_ELF_MACHINES = {"EM_X86_64": "x86_64", "EM_AARCH64": "aarch64"}
_VERSION = re.compile(r"GLIBC_(\d+)\.(\d+)")


def problems(wheel: Path, machine: str) -> list[str]:
    """Say what is wrong with a wheel for a machine, one line each; none if nothing is."""
    with zipfile.ZipFile(wheel) as opened:
        data = {name: opened.read(name) for name in opened.namelist()}
    folder = dist_info(wheel)
    library = data.get(_LIBRARY, b"")
    return [
        *_tag_problems(wheel.name, machine),
        *content_problems(data, source_files(), folder),
        *record_problems(data, folder),
        *licence_problems(data, folder),
        *place_problems(data, [str(ROOT), str(Path.home())]),
        *(library_problems(library, machine) if library else ()),
        *_abi_problems(wheel),
    ]


def dist_info(wheel: Path) -> str:
    """Return the name of the folder in which a wheel says what it is."""
    name, version = wheel.name.split("-")[:2]
    return f"{name}-{version}.dist-info"


def source_files() -> set[str]:
    """Return the files of the package that belong into a wheel, but for the native module."""
    if shutil.which("git") and (ROOT / ".git").exists():
        command = ["git", "ls-files", "-z", "python/servoid"]
        listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout.decode()
        return {name.removeprefix("python/") for name in listed.split("\0") if name}
    files = (_PACKAGE / "servoid").rglob("*")
    kept = (path for path in files if path.is_file() and path.suffix not in (".pyc", ".so"))
    return {path.relative_to(_PACKAGE).as_posix() for path in kept}


def content_problems(names: Iterable[str], sources: set[str], folder: str) -> Iterator[str]:
    """Say what is missing, and what is there that does not belong there."""
    held, wanted = set(names), {*sources, _LIBRARY, *(f"{folder}/{one}" for one in _BESIDE)}
    yield from (f"{name} is missing" for name in sorted((wanted | set(_LEAST)) - held))
    yield from (f"{name} does not belong there" for name in sorted(held - wanted))


def record_problems(data: dict[str, bytes], folder: str) -> Iterator[str]:
    """Say where the list of files differs from the files."""
    written = data.get(f"{folder}/RECORD", b"").decode()
    rows = {row[0]: row[1] for row in csv.reader(io.StringIO(written)) if row}
    for name in sorted(set(data) | set(rows)):
        digest = hashlib.sha256(data.get(name, b"")).digest()
        true = f"sha256={base64.urlsafe_b64encode(digest).rstrip(b'=').decode()}"
        if name != f"{folder}/RECORD" and rows.get(name) != true:
            yield f"RECORD is wrong about {name}"


def licence_problems(data: dict[str, bytes], folder: str) -> Iterator[str]:
    """Say which texts of licences the wheel's own description does not name."""
    metadata = data.get(f"{folder}/METADATA", b"").decode().splitlines()
    for name in sorted(data):
        path = name.removeprefix(f"{folder}/licenses/")
        if path != name and f"License-File: {path}" not in metadata:
            yield f"METADATA does not name {path}"


def place_problems(data: dict[str, bytes], places: Sequence[str]) -> Iterator[str]:
    """Say which files tell where the wheel was built."""
    for name, content in data.items():
        for place in places:
            if len(place) > 1 and f"{place}/".encode() in content:
                yield f"{name} names {place}, a folder of the machine that built it"


def library_problems(library: bytes, machine: str) -> Iterator[str]:
    """Say what the native module needs that a Linux of its kind may not have."""
    from elftools.elf.elffile import ELFFile

    opened = ELFFile(io.BytesIO(library))
    found = _ELF_MACHINES.get(opened["e_machine"], opened["e_machine"])
    if found != machine:
        yield f"the native module is for {found}, not for {machine}"
    dynamic = opened.get_section_by_name(".dynamic")
    needed = [tag.needed for tag in dynamic.iter_tags("DT_NEEDED")]
    yield from (
        f"the native module needs {name}, which may not be there"
        for name in needed
        if _SYSTEM.fullmatch(name) is None
    )
    versions = opened.get_section_by_name(".gnu.version_r")
    names = [one.name for _, auxiliaries in versions.iter_versions() for one in auxiliaries]
    for name in sorted(set(names)):
        match = _VERSION.match(name)
        if match is not None and (int(match[1]), int(match[2])) > GLIBC:
            yield f"the native module needs {name}, newer than {GLIBC[0]}.{GLIBC[1]}"


def _tag_problems(name: str, machine: str) -> Iterator[str]:
    tags = name.removesuffix(".whl").split("-")[2:]
    if tags[:2] != ["cp310", "abi3"]:
        yield f"the wheel is for {'-'.join(tags[:2])}, not for every Python from 3.10 on"
    wanted = f"manylinux_{GLIBC[0]}_{GLIBC[1]}_{machine}"
    if wanted not in tags[-1].split("."):
        yield f"the wheel is for {tags[-1]}, not for {wanted}"


def _abi_problems(wheel: Path) -> list[str]:
    """Say what of Python the native module uses that newer ones may not have."""
    command = [sys.executable, "-m", "abi3audit", "--strict", str(wheel)]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    return [] if ran.returncode == 0 else [f"abi3audit: {(ran.stdout + ran.stderr).strip()}"]


def machine_of(wheel: Path) -> str:
    """Return the machine that the name of a wheel ends in."""
    found = [name for name in _ELF_MACHINES.values() if wheel.stem.endswith(name)]
    if not found:
        raise ValueError(f"{wheel} is no wheel for one of {', '.join(_ELF_MACHINES.values())}")
    return found[0]


def main() -> None:
    """Check the wheels that are named, and end with 1 if one is wrong."""
    wheels = [Path(name) for name in sys.argv[1:]]
    found = [f"{one}: {problem}" for one in wheels for problem in problems(one, machine_of(one))]
    print("\n".join(found) or f"{len(wheels)} checked, nothing is wrong")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
