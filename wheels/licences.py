"""Gathers the licences of the crates that become part of the native module."""

import json
import subprocess
from pathlib import Path
from typing import Any

from wheels.check import ROOT

_BINDING = "servoid-py"
_NAMES = ("licen[cs]e*", "LICEN[CS]E*", "COPYING*", "NOTICE*", "UNLICENSE*")
_HEAD = """\
servoid's native module holds the crates below, each under its own licence, and parts of Rust's
standard library, which is under MIT OR Apache-2.0.
"""


def licences_of(triple: str) -> str:
    """Return the names, licences and licence texts of all crates in the library for a target.

    Raises:
        ValueError: a crate names no licence.

    """
    crates: list[str] = []
    owners: dict[str, list[str]] = {}
    kept: dict[str, str] = {}
    for package in _linked(_metadata(triple)):
        name = f"{package['name']} {package['version']}"
        if package["license"] is None and package["license_file"] is None:
            raise ValueError(f"{name} names no licence; it must not be part of a wheel")
        crates.append(f"{name}: {package['license'] or 'the text below'}")
        for text in _texts(Path(package["manifest_path"]).parent):
            same = " ".join(text.split())  # many differ in their line breaks alone
            kept.setdefault(same, text)
            owners.setdefault(same, []).append(name)
    parts = [
        "\n".join([f"Of {', '.join(owners[same])}:", "", text, ""]) for same, text in kept.items()
    ]
    return f"\n{'=' * 80}\n\n".join([_HEAD, "\n".join([*crates, ""]), *parts])


def _metadata(triple: str) -> dict[str, Any]:
    command = ["cargo", "metadata", "--format-version", "1", "--locked"]
    command += ["--filter-platform", triple]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return json.loads(ran.stdout)


def _linked(metadata: dict[str, Any]) -> list[dict[str, Any]]:
    """List the packages that the binding is linked with, by name: no tools of the build."""
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    [start] = [one["id"] for one in metadata["packages"] if one["name"] == _BINDING]
    found, left = set[str](), [start]
    while left:
        package = left.pop()
        if package in found:
            continue
        found.add(package)
        left += [
            link["pkg"]
            for link in nodes[package]["deps"]
            if any(kind["kind"] is None for kind in link["dep_kinds"])
            and not _is_macro(packages[link["pkg"]])
        ]
    others = found - set(metadata["workspace_members"])
    return sorted((packages[one] for one in others), key=lambda one: (one["name"], one["version"]))


def _is_macro(package: dict[str, Any]) -> bool:
    return any("proc-macro" in target["kind"] for target in package["targets"])


def _texts(folder: Path) -> list[str]:
    files = {path for name in _NAMES for path in folder.glob(name) if path.is_file()}
    return [path.read_text(encoding="utf-8", errors="replace").strip() for path in sorted(files)]
