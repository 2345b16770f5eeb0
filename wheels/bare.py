"""Tries a wheel in a bare Debian without compiler: `python -m wheels.bare dist/*.whl`.

A Debian with Python and nothing else is laid into a new folder, the wheel and what it needs is
installed there, and `servoid doctor` and `servoid demo` run in it; a wheel for another machine runs
under QEMU, without the demo, which would take an hour. The doctor runs once more on a processor
without AVX, which QEMU plays. Processors of one kind must measure the same errors. It needs root,
debootstrap, qemu-user-static, and Debian's packages.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from wheels.check import machine_of

_DEBIAN = {"x86_64": "amd64", "aarch64": "arm64"}
_OLDEST = "Nehalem"  # the processor of 2008 that NumPy's own wheels need
_COMPILERS = ("cc", "gcc", "clang", "rustc", "cargo")
_PLATFORMS = ("2014", "_2_17", "_2_24", "_2_26", "_2_27", "_2_28")
_PYTHON = "3.11"  # of the Debian below
_SUITE = "bookworm"
_NEEDED = ("debootstrap", "dpkg-deb", "chroot")
_PACKAGES = "packages"  # the folder of what is installed
_SAME = ("iou", "tracked", "error_m")

Measured = tuple[float, ...]


class BareError(Exception):
    """Says what is missing here, or what went wrong in the bare system."""


def missing(machine: str) -> list[str]:
    """Say what a try needs that is not here."""
    names = [*_NEEDED, _qemu(machine)]
    problems = [f"{name} is missing" for name in names if shutil.which(name) is None]
    if os.geteuid() != 0:
        problems.append("only root may change into another system")
    return problems


def try_wheel(wheel: Path, root: Path) -> set[Measured]:
    """Install a wheel in a bare system under `root`, run doctor and demo there, and return figures.

    Raises:
        BareError: something is missing, or does not run.

    """
    machine = machine_of(wheel)
    _lay(root, machine)
    _install(wheel, root, machine)
    found = [name for name in _COMPILERS if _programs(root, name)]
    if found:
        raise BareError(f"the system is not bare: it has {', '.join(found)}")
    emulated = machine != os.uname().machine
    ways = {"": _qemu(machine)} if emulated else {"": "", f" -cpu {_OLDEST}": _qemu(machine)}
    doctors = {way: _doctor(root, qemu, way.split()) for way, qemu in ways.items()}
    for way, report in doctors.items():
        figures = ", ".join(f"{name} {report['self_test'][name]!r}" for name in _SAME)
        print(f"{wheel.name}{way}: {report['system']}, back end {report['back_end']}, {figures}")
    if not emulated:
        print(_in(root, "", (), "demo", "--out", "/demo"))
    return {tuple(report["self_test"][name] for name in _SAME) for report in doctors.values()}


def _qemu(machine: str) -> str:
    return f"qemu-{machine}-static"


def _lay(root: Path, machine: str) -> None:
    """Lay a minimal Debian with Python into a folder."""
    command = ["debootstrap", "--variant=minbase", f"--arch={_DEBIAN[machine]}"]
    command += ["--include=python3", "--foreign", _SUITE, str(root)]
    _do(command)
    # Unpacked and not configured: that would need programs of that machine to start others.
    for package in sorted((root / "var/cache/apt/archives").glob("*.deb")):
        _do(["dpkg-deb", "--extract", str(package), str(root)])
    emulator = shutil.which(_qemu(machine))
    if emulator is not None:
        shutil.copy2(emulator, root / "usr/bin")


def _install(wheel: Path, root: Path, machine: str) -> None:
    """Install the wheel and all that it needs, out of wheels alone, for the machine's Python."""
    options = ["--only-binary=:all:", "--python-version", _PYTHON, "--implementation", "cp"]
    for abi in (f"cp{_PYTHON.replace('.', '')}", "abi3", "none"):
        options += ["--abi", abi]
    for platform in _PLATFORMS:
        options += ["--platform", f"manylinux{platform}_{machine}"]
    _do(
        [sys.executable, "-m", "pip", "install", "--quiet", "--root-user-action=ignore", *options,
         "--target", str(root / _PACKAGES), str(wheel)]
    )  # fmt: skip


def _programs(root: Path, name: str) -> list[Path]:
    return [path for folder in ("usr/bin", "usr/local/bin") for path in (root / folder).glob(name)]


def _doctor(root: Path, qemu: str, options: Sequence[str]) -> Mapping[str, Any]:
    return json.loads(_in(root, qemu, options, "doctor", "--json"))


def _in(root: Path, qemu: str, options: Sequence[str], *arguments: str) -> str:
    """Run servoid in the bare system, with nothing of this one's environment."""
    emulator = [f"/usr/bin/{qemu}", *options] if qemu else []
    command = [
        shutil.which("chroot") or "chroot",
        str(root),
        *emulator,
        f"/usr/bin/python{_PYTHON}",
        "-m",
        "servoid",
    ]
    clean = {"PATH": "/usr/bin:/bin", "HOME": "/root", "PYTHONPATH": f"/{_PACKAGES}"}
    return _do([*command, *arguments], clean)


def _do(command: Sequence[str], environment: Mapping[str, str] | None = None) -> str:
    ran = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if ran.returncode:
        last = (ran.stdout + ran.stderr).strip().splitlines()[-20:]
        what = " ".join(command[:4])
        raise BareError("\n".join([f"{what} ... ended with {ran.returncode}:", *last]))
    return ran.stdout


def main() -> None:
    """Try the wheels that are named, each in a folder of its own that is removed."""
    parser = argparse.ArgumentParser(prog="python -m wheels.bare", description=__doc__)
    parser.add_argument("wheels", type=Path, nargs="+", help="wheels that wheels.build has made")
    options = parser.parse_args()
    lacking = sorted(
        {problem for wheel in options.wheels for problem in missing(machine_of(wheel))}
    )
    if lacking:
        sys.exit("\n".join(lacking))
    for wheel in options.wheels:
        with tempfile.TemporaryDirectory(prefix="servoid-bare-") as folder:
            try:
                measured = try_wheel(wheel, Path(folder))
            except BareError as error:
                sys.exit(f"{wheel.name}: {error}")
        if len(measured) != 1:
            sys.exit(f"{wheel.name}: not every processor gives the same numbers: {measured}")


if __name__ == "__main__":
    main()
