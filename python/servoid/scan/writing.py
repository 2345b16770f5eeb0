"""Writes a scan as a capture: images, camera, poses, and their uncertainty."""

from collections.abc import Callable
from pathlib import Path

import msgspec

from servoid.capture import POSES_HEADER, SCAN_FIGURES
from servoid.output import FolderKind
from servoid.scan.result import Scan
from servoid.scan.staging import Staged

MARK = "# servoid's own scan"
IMAGES, MASKS = "images", "masks"
REPORT, FIGURES = "report.html", SCAN_FIGURES
CAMERA = "camera"

_CAPTURE = """{mark}: {found} of {keys} images have a pose
version = 1
{metric}
[[camera]]
name = "{camera}"
images = "{images}/*"
{masks}size_px = [{width}, {height}]
model = "brown_conrady"
focal_px = [{focal:.6f}, {focal:.6f}]        # standard deviation {deviation:.2g}
center_px = [{u:.4f}, {v:.4f}]
distortion = [{k:.8g}, 0.0, 0.0, 0.0]

[rig]
poses = "poses.csv"            # world_from_rig; the world is where the first image was taken
"""
_NO_SCALE = "metric = false  # lengths are in units of the median distance to what is seen\n"


class _Image(msgspec.Struct):
    name: str


class _Named(msgspec.Struct):
    """What scan.json says of its images."""

    by_image: list[_Image]


def _own(directory: Path) -> set[str]:
    """Return the paths that writing the scan in a folder left there: its images are in scan.json.

    Of two images of one name, somebody added one.
    """
    own = {"capture.toml", "poses.csv", REPORT, FIGURES, IMAGES, MASKS}
    names = _names(directory / FIGURES)
    images = [path.name for path in (directory / IMAGES).glob("*")]
    stems = [Path(file).stem for file in images]
    own |= {
        f"{IMAGES}/{file}"
        for file, stem in zip(images, stems, strict=True)
        if stem in names and stems.count(stem) == 1
    }
    if f'"{MASKS}/*.png"' in (directory / "capture.toml").read_text(encoding="utf-8"):
        own |= {f"{MASKS}/{name}.png" for name in names}
    return own


def _names(figures: Path) -> set[str]:
    """Return the names of the images that have a pose; none if scan.json does not tell."""
    try:
        return {one.name for one in msgspec.json.decode(figures.read_bytes(), type=_Named).by_image}
    except (OSError, msgspec.MsgspecError):
        return set()


FOLDER = FolderKind("a scan", MARK, _own)


def write_capture(
    draft: Path, scan: Scan, staged: Staged, page: Callable[[Scan, Path], bytes] | None
) -> None:
    """Write a scan into the folder of its images; images without a pose are deleted."""
    if page is not None:
        (draft / REPORT).write_bytes(page(scan, draft / IMAGES))
    found = set(scan.solution.names)
    for file in staged.files:
        if Path(file).stem not in found:
            (draft / IMAGES / file).unlink()
            (draft / MASKS / f"{Path(file).stem}.png").unlink(missing_ok=True)
    has_masks = (draft / MASKS).is_dir() and any((draft / MASKS).iterdir())
    _write(draft / "capture.toml", _capture(scan, has_masks=has_masks))
    _write(draft / "poses.csv", _poses(scan))
    figures = msgspec.json.format(msgspec.json.encode(scan.numbers()), indent=2)
    (draft / FIGURES).write_bytes(figures + b"\n")


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def _capture(scan: Scan, *, has_masks: bool) -> str:
    solution = scan.solution
    (width, height), (u, v) = solution.lens.size_px, solution.lens.center_px
    return _CAPTURE.format(
        mark=MARK,
        found=len(solution.names),
        keys=scan.keys,
        metric=_NO_SCALE if scan.scale is None else "",
        camera=CAMERA,
        images=IMAGES,
        masks=f'masks = "{MASKS}/*.png"\n' if has_masks else "",
        width=width,
        height=height,
        focal=solution.focal_px,
        deviation=solution.focal_std_px,
        u=u,
        v=v,
        k=solution.lens.distortion[0],
    )


def _poses(scan: Scan) -> str:
    lines = [",".join(POSES_HEADER)]
    for index, pose in enumerate(scan.solution.world_from_camera):
        numbers = (*pose.translation, *pose.quaternion)
        lines.append(",".join([str(index), *(f"{number:.12g}" for number in numbers)]))
    return "\n".join(lines) + "\n"
