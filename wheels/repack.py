"""Puts into a wheel what its builder leaves out, and takes out where it was built."""

import base64
import csv
import hashlib
import io
import zipfile
from pathlib import Path

from wheels.check import LICENCES, ROOT, dist_info

_ALSO = f"\nLicense-File: {Path(LICENCES).name}\nLicense-File: ".encode()


def repack(made: Path, out: Path, licences: str) -> Path:
    """Write a wheel anew into a folder, with the licences of its crates; return it."""
    target = out / made.name
    folder = dist_info(made)
    with zipfile.ZipFile(made) as old, zipfile.ZipFile(target, "w") as new:
        rows: list[tuple[str, str, str]] = []
        for info in old.infolist():
            if info.filename == f"{folder}/RECORD":
                continue
            data = old.read(info)
            if info.filename.startswith(f"{folder}/sboms/"):
                data = data.replace(ROOT.as_uri().encode(), b"file://")
            if info.filename == f"{folder}/METADATA":
                data = data.replace(b"\nLicense-File: ", _ALSO, 1)
            _add(new, info, data, rows)
        _add(new, _info(f"{folder}/{LICENCES}"), licences.encode(), rows)
        _add_record(new, folder, rows)
    return target


def _add(
    wheel: zipfile.ZipFile, info: zipfile.ZipInfo, data: bytes, rows: list[tuple[str, str, str]]
) -> None:
    wheel.writestr(info, data, zipfile.ZIP_DEFLATED, compresslevel=9)
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    rows.append((info.filename, f"sha256={digest}", str(len(data))))


def _add_record(wheel: zipfile.ZipFile, folder: str, rows: list[tuple[str, str, str]]) -> None:
    written = io.StringIO()
    csv.writer(written, lineterminator="\n").writerows([*rows, (f"{folder}/RECORD", "", "")])
    wheel.writestr(_info(f"{folder}/RECORD"), written.getvalue(), zipfile.ZIP_DEFLATED)


def _info(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)  # of 1980, so that the same source gives the same wheel
    info.external_attr = 0o644 << 16
    return info
