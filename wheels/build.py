"""Builds the wheels for Linux on x86_64 and aarch64: `python -m wheels.build`.

One wheel serves Python 3.10 and newer (abi3) and every Linux with glibc 2.17 or newer. Zig links
it, whatever this machine is; vector instructions are chosen when it runs. What is missing here is
told all at once, and nothing is built then.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

from wheels.check import GLIBC, ROOT, problems
from wheels.licences import licences_of
from wheels.repack import repack

MACHINES = ("x86_64", "aarch64")


class BuildError(Exception):
    """Says what is missing, or what went wrong."""


def triple(machine: str) -> str:
    """Return what Rust calls Linux on a machine."""
    return f"{machine}-unknown-linux-gnu"


def missing(machines: Sequence[str]) -> list[str]:
    """Say what a build needs that is not here."""
    lacking = [
        f"{module} is missing: install it with: pip install {module}"
        for module in ("maturin", "ziglang")
        if find_spec(module) is None
    ]
    if shutil.which("cargo") is None or shutil.which("rustc") is None:
        return [*lacking, "Rust is missing: install it with rustup"]
    for machine in machines:
        folder = _output_of(
            "rustc", "--print", "target-libdir", "--target", triple(machine)
        ).strip()
        if not folder or not any(Path(folder).glob("libstd-*")):
            lacking.append(
                f"Rust's standard library for {machine} is missing: install it with: "
                f"rustup target add {triple(machine)}"
            )
    return lacking


def build(machine: str, out: Path) -> Path:
    """Build the wheel for one machine into a folder, and return it.

    Raises:
        BuildError: it cannot be built, or is not what it must be.

    """
    with tempfile.TemporaryDirectory() as scratch:
        command = [
            *(sys.executable, "-m", "maturin", "build", "--release", "--locked", "--strip"),
            *("--zig", "--compatibility", f"manylinux_{GLIBC[0]}_{GLIBC[1]}"),
            *("--target", triple(machine), "--out", scratch),
        ]
        if subprocess.run(command, cwd=ROOT, env=_environment(), check=False).returncode:
            raise BuildError(f"the wheel for {machine} was not built; see above")
        [made] = Path(scratch).glob("*.whl")
        out.mkdir(parents=True, exist_ok=True)
        wheel = repack(made, out, licences_of(triple(machine)))
    found = problems(wheel, machine)
    if found:
        raise BuildError("\n".join([f"{wheel.name} must not be handed out:", *found]))
    return wheel


def _environment() -> Mapping[str, str]:
    """Return an environment in which nothing of this machine gets into the library.

    Flags of its owner, such as one that asks for the instructions of its own processor, are
    replaced, and places in messages begin at the repository.
    """
    cargo = Path(os.environ.get("CARGO_HOME", Path.home() / ".cargo"))
    sysroot = _output_of("rustc", "--print", "sysroot").strip()
    places = {cargo / "registry" / "src": "crates", cargo: "cargo", sysroot: "rust", ROOT: "."}
    flags = [f"--remap-path-prefix={place}={name}" for place, name in reversed(places.items())]
    kept = {name: value for name, value in os.environ.items() if "RUSTFLAGS" not in name}
    # Zig is a package of this Python, which need not be the `python3` that a shell finds.
    zig = {"CARGO_ZIGBUILD_PYTHON_PATH": sys.executable}
    return kept | zig | {"CARGO_ENCODED_RUSTFLAGS": "\x1f".join(flags)}


def _output_of(*command: str) -> str:
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return ran.stdout if ran.returncode == 0 else ""


def main() -> None:
    """Build the wheels that are asked for, all by default."""
    parser = argparse.ArgumentParser(prog="python -m wheels.build", description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="the folder to write to")
    parser.add_argument(
        "--machine", choices=MACHINES, action="append", help="one machine only; again for more"
    )
    options = parser.parse_args()
    machines = options.machine or MACHINES
    lacking = missing(machines)
    if lacking:
        sys.exit("\n".join(lacking))
    try:
        for machine in machines:
            wheel = build(machine, options.out)
            print(f"{wheel}: {wheel.stat().st_size / 1e6:.1f} MB")
    except BuildError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
