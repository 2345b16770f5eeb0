"""What a wheel must hold and may need, and that the check of it finds what is wrong."""

import base64
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))

from wheels import build  # noqa: E402
from wheels.check import (  # noqa: E402
    LICENCES,
    content_problems,
    dist_info,
    library_problems,
    licence_problems,
    machine_of,
    place_problems,
    record_problems,
    source_files,
)
from wheels.repack import repack  # noqa: E402

FOLDER = "servoid-0.7.0.dist-info"
BUILT = ROOT / "target" / "release"
BESIDE = [
    "METADATA", "WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE-MIT",
    "licenses/LICENSE-APACHE", LICENCES, "sboms/servoid-py.cyclonedx.json",
]  # fmt: skip
WHOLE = [*source_files(), "servoid/_native.abi3.so", *(f"{FOLDER}/{name}" for name in BESIDE)]


def test_a_wheel_holds_the_package_and_nothing_else() -> None:
    sources = source_files()
    assert {"servoid/py.typed", "servoid/_native.pyi", "servoid/pick/page.html"} <= sources
    assert not [name for name in sources if "test_" in name or name.endswith((".so", ".pyc"))]
    assert not [name for name in sources if not name.startswith("servoid/")]
    assert list(content_problems(WHOLE, sources, FOLDER)) == []


@pytest.mark.parametrize(
    "name",
    ["servoid/py.typed", "servoid/_native.pyi", "servoid/_native.abi3.so",
     "servoid/shape/body.schema.json", f"{FOLDER}/licenses/LICENSE-MIT", f"{FOLDER}/{LICENCES}"],
)  # fmt: skip
def test_what_is_missing_in_a_wheel_is_found(name: str) -> None:
    held = [one for one in WHOLE if one != name]
    assert list(content_problems(held, source_files(), FOLDER)) == [f"{name} is missing"]


@pytest.mark.parametrize(
    "name",
    ["tests/system/repository/test_wheels.py", "servoid_experiments/__init__.py",
     "servoid/notes.txt", "servoid/__pycache__/words.pyc"],
)  # fmt: skip
def test_what_does_not_belong_in_a_wheel_is_found(name: str) -> None:
    found = list(content_problems([*WHOLE, name], source_files(), FOLDER))
    assert found == [f"{name} does not belong there"]


def test_a_place_of_the_machine_that_built_it_is_found() -> None:
    place = "/" + "home/somebody"
    data = {"a.so": f"...{place}/.cargo/registry...".encode(), "b.so": b"./crates/servoid/src"}
    assert [one.split()[0] for one in place_problems(data, [place, "/"])] == ["a.so"]


def record(data: dict[str, bytes]) -> bytes:
    rows = [
        f"{name},sha256={base64.urlsafe_b64encode(hashlib.sha256(one).digest()).decode()[:43]},"
        for name, one in data.items()
    ]
    return "\n".join([*rows, f"{FOLDER}/RECORD,,"]).encode()


def test_a_list_of_files_that_lies_is_found() -> None:
    data = {"servoid/a.py": b"a", "servoid/b.py": b"b"}
    right = data | {f"{FOLDER}/RECORD": record(data)}
    assert list(record_problems(right, FOLDER)) == []
    changed = list(record_problems(right | {"servoid/a.py": b"c"}, FOLDER))
    assert changed == ["RECORD is wrong about servoid/a.py"]
    unlisted = list(record_problems(right | {"servoid/c.py": b"c"}, FOLDER))
    assert unlisted == ["RECORD is wrong about servoid/c.py"]


def test_a_wheel_that_is_packed_anew_holds_licences_and_no_place(tmp_path: Path) -> None:
    made = tmp_path / "servoid-0.7.0-cp310-abi3-manylinux_2_17_x86_64.whl"
    bill = f'{{"ref": "{ROOT.as_uri()}/crates/servoid"}}'.encode()
    with zipfile.ZipFile(made, "w") as wheel:
        wheel.writestr("servoid/a.py", "a = 1\n")
        wheel.writestr(f"{FOLDER}/sboms/servoid-py.cyclonedx.json", bill)
        wheel.writestr(f"{FOLDER}/METADATA", "Name: servoid\nLicense-File: LICENSE-MIT\n\n")
        wheel.writestr(f"{FOLDER}/licenses/LICENSE-MIT", "as you like")
        wheel.writestr(f"{FOLDER}/RECORD", "")
    (tmp_path / "out").mkdir()
    with zipfile.ZipFile(repack(made, tmp_path / "out", "licences")) as wheel:
        data = {name: wheel.read(name) for name in wheel.namelist()}
    assert data[f"{FOLDER}/{LICENCES}"] == b"licences"
    assert b"file:///crates/servoid" in data[f"{FOLDER}/sboms/servoid-py.cyclonedx.json"]
    assert list(record_problems(data, FOLDER)) == []
    assert list(licence_problems(data, FOLDER)) == []
    assert list(place_problems(data, [str(ROOT)])) == []
    forgotten = data | {f"{FOLDER}/licenses/OTHER": b""}
    assert list(licence_problems(forgotten, FOLDER)) == ["METADATA does not name OTHER"]


def test_the_machine_of_a_wheel_is_what_its_name_ends_in() -> None:
    assert machine_of(Path("servoid-1-cp310-abi3-manylinux2014_aarch64.whl")) == "aarch64"
    with pytest.raises(ValueError, match="no wheel for one of x86_64, aarch64"):
        machine_of(Path("servoid-1-cp310-abi3-win_amd64.whl"))


def test_all_that_a_build_lacks_is_told_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "find_spec", {}.get)
    monkeypatch.setattr(build, "_output_of", lambda *_: "")
    monkeypatch.setattr(build.shutil, "which", lambda name: name)
    problems = build.missing(build.MACHINES)
    assert [line.split(" is missing")[0] for line in problems] == [
        "maturin",
        "ziglang",
        "Rust's standard library for x86_64",
        "Rust's standard library for aarch64",
    ]
    assert problems[-1].endswith("rustup target add aarch64-unknown-linux-gnu")


def test_flags_of_the_builder_do_not_get_into_the_wheel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RUSTFLAGS", "-C target-cpu=native")
    monkeypatch.setenv("CARGO_ENCODED_RUSTFLAGS", "-Ctarget-cpu=native")
    environment = build._environment()
    assert "RUSTFLAGS" not in environment
    assert environment["CARGO_ZIGBUILD_PYTHON_PATH"] == sys.executable
    flags = environment["CARGO_ENCODED_RUSTFLAGS"].split("\x1f")
    assert flags and all(flag.startswith("--remap-path-prefix=") for flag in flags)


def test_the_library_of_another_machine_is_found() -> None:
    pytest.importorskip("elftools", reason="pip install --group wheels brings it")
    library = next((ROOT / "python" / "servoid").glob("_native*.so"), None)
    if library is None or not library.read_bytes().startswith(b"\x7fELF"):
        pytest.skip("the native module is no library of Linux here")
    data = library.read_bytes()
    found = [list(library_problems(data, machine)) for machine in ("x86_64", "aarch64")]
    places = [[line for line in lines if "the native module is for" in line] for lines in found]
    assert sorted(map(len, places)) == [0, 1]


@pytest.mark.extended
@pytest.mark.skipif(not BUILT.is_dir(), reason="nothing was built here that a wheel could reuse")
def test_a_wheel_that_is_built_here_holds_what_it_must(tmp_path: Path) -> None:
    if importlib.util.find_spec("maturin") is None or not shutil.which("cargo"):
        pytest.skip("a wheel needs maturin and Rust")
    command = [sys.executable, "-m", "maturin", "build", "--release", "--out", str(tmp_path)]
    # The interpreter that the Makefile names, for which all is built already.
    environment = os.environ | {"PYO3_PYTHON": sys.executable}
    ran = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=900
    )
    assert ran.returncode == 0, ran.stderr
    [wheel] = tmp_path.glob("*.whl")
    (tmp_path / "out").mkdir()
    with zipfile.ZipFile(repack(wheel, tmp_path / "out", "licences")) as opened:
        names = set(opened.namelist())
    bills = {name for name in names if "/sboms/" in name}
    folder = dist_info(wheel)
    names = names - bills | {f"{folder}/sboms/servoid-py.cyclonedx.json"}
    assert list(content_problems(names, source_files(), folder)) == []
