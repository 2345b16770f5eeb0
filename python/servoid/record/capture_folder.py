"""Records a live source as a capture whose replay is bit-identical."""

import csv
import glob
import io
import json
import secrets
import shutil
import statistics
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from servoid.config import name_fault
from servoid.errors import OutputError
from servoid.output import check_folder, make_folder, move_to, write_whole
from servoid.pose import Pose
from servoid.source import MountedCamera, RawImage, RawInstant
from servoid.words import reason_of

MARK = "# recorded by servoid"
IMAGES_HEADER = ("observation", "camera", "file", "time_s", "number")
_TABLES = ("capture.toml", "images.csv", "poses.csv")
_POSES_HEADER = "time_s,x,y,z,qw,qx,qy,qz"
_PNG_EFFORT = 1  # lowest compression: images must be written as fast as they come


class FolderRecorder:
    """Writes observations into a capture folder, image by image; `close` completes it.

    Images are stored losslessly: as the received JPEG files, or else as PNG. `poses.csv` holds the
    exact times, `images.csv` the image of each camera in each observation and when it was taken.
    Until `close`, the folder has a hidden name beside its final path.
    """

    def __init__(
        self,
        folder: str | Path,
        rig: Sequence[MountedCamera],
        *,
        began: str = "",
        is_calibrated: bool = True,
    ) -> None:
        """Begin a recording; `began` is the time of day of its time 0, for people.

        Unless the rig `is_calibrated`, only the image sizes of its lenses are written.

        Raises:
            OutputError: the folder is not empty, or cannot be made, or a camera's name is none of
                a folder.

        """
        self._folder, self._rig = Path(folder), tuple(rig)
        self._began, self._is_calibrated = began, is_calibrated
        check_recording(self._folder)
        _check_names(self._folder, [camera.name for camera in self._rig])
        self._times_s: list[float] = []
        self._poses: list[Pose] = []
        self._rows: list[tuple[str | int, ...]] = []
        self._has_depth = [False] * len(self._rig)
        self._draft = self._folder.resolve().with_name(f".servoid-{secrets.token_hex(6)}.part")
        make_folder(self._draft)
        for camera in self._rig:
            make_folder(self._draft / camera.name)

    def __len__(self) -> int:
        return len(self._times_s)

    def add(self, raw: RawInstant, world_from_rig: Pose | None = None) -> None:
        """Write one observation; without a pose the rig rests at the world's origin.

        Raises:
            OutputError: a file cannot be written.

        """
        index = len(self._times_s)
        written: list[Path] = []
        rows: list[tuple[str | int, ...]] = []
        try:
            for place, image in enumerate(raw.images):
                rows += self._add_image(index, place, image, written)
        except OSError as error:
            for path in written:  # remove the incomplete files, which also frees disk space
                path.unlink(missing_ok=True)
            raise OutputError(f"cannot record into {self._folder}: {reason_of(error)}") from error
        self._rows += rows
        self._times_s.append(raw.time_s)
        self._poses.append(world_from_rig or Pose.identity())

    def close(self) -> Path:
        """Write the tables of all observations, and move the folder to its path; return it.

        Raises:
            OutputError: a file cannot be written, or something else is there by now.

        """
        if not self._times_s:
            self.discard()
            raise OutputError(f"cannot record into {self._folder}: no image came")
        rows = io.StringIO()
        csv.writer(rows, lineterminator="\n").writerows([IMAGES_HEADER, *self._rows])
        write_whole(self._draft / "images.csv", rows.getvalue().encode())
        both = zip(self._times_s, self._poses, strict=True)
        poses = [_POSES_HEADER, *(_row(time_s, pose) for time_s, pose in both)]
        write_whole(self._draft / "poses.csv", ("\n".join(poses) + "\n").encode())
        write_whole(self._draft / "capture.toml", self._capture().encode())
        check_recording(self._folder)
        try:
            move_to(self._folder, self._draft)  # an empty folder may be there
        except OSError as error:
            raise OutputError(
                f"cannot record into {self._folder}: {reason_of(error)}; "
                f"the recording is in {self._draft}"
            ) from error
        return self._folder

    def discard(self) -> None:
        """Delete the recording."""
        shutil.rmtree(self._draft, ignore_errors=True)

    def _add_image(
        self, index: int, place: int, image: RawImage | None, written: list[Path]
    ) -> list[tuple[str | int, ...]]:
        """Write the files of one camera; return its table in capture.toml."""
        camera = self._rig[place].name
        if image is None:  # an empty file represents an image that did not come
            _write(self._draft / camera / f"{index:06d}.png", b"", written)
            return []
        suffix, data = _file_of(image)
        file = f"{camera}/{index:06d}{suffix}"
        _write(self._draft / file, data, written)
        if image.depth_m is not None:
            self._has_depth[place] = True
            depth = io.BytesIO()
            np.save(depth, image.depth_m)
            folder = self._draft / _depths(camera)
            folder.mkdir(exist_ok=True)
            _write(folder / f"{index:06d}.npy", depth.getvalue(), written)
        return [(index, camera, file, repr(image.time_s), image.number)]

    def _capture(self) -> str:
        steps = [after - before for before, after in pairwise(self._times_s)]
        usual_s = statistics.median(steps) if steps else 0.0
        rate = f"\nrate_hz = {1.0 / usual_s!r}  # the median" if usual_s > 0.0 else ""
        when = f"; time 0 was {self._began}" if self._began else ""
        tables = [f"{MARK}{when}\nversion = 1{rate}\n"]
        for camera, has_depth in zip(self._rig, self._has_depth, strict=True):
            tables.append(_table(camera, self._is_calibrated, has_depth=has_depth))
        is_at_rest = all(pose == Pose.identity() for pose in self._poses)
        remark = "the times; the rig is at rest" if is_at_rest else "world_from_rig at each time"
        return "\n".join([*tables, f'[rig]\nposes = "poses.csv"  # {remark}\n'])


def record_folder(
    folder: str | Path,
    rig: Sequence[MountedCamera],
    observations: Iterable[RawInstant],
    *,
    began: str = "",
    is_calibrated: bool = True,
) -> int:
    """Record observations into a folder as they come, as `FolderRecorder`; return their number.

    If one cannot be written, the earlier ones are kept. If `observations` raise, nothing is.

    Raises:
        OutputError: the folder is not empty, a file cannot be written, or there is no observation.
        Whatever `observations` raise.

    """
    recorder = FolderRecorder(folder, rig, began=began, is_calibrated=is_calibrated)
    try:
        for raw in observations:
            try:
                recorder.add(raw)
            except OutputError:
                if len(recorder):
                    recorder.close()
                raise
    except BaseException:
        recorder.discard()
        raise
    recorder.close()
    return len(recorder)


def check_recording(folder: Path) -> None:
    """Check that a recording can be written to `folder`, which must be empty or not exist.

    Raises:
        OutputError: something is there, or nothing can be written there.

    """
    check_folder(folder)
    if folder.exists() and any(folder.iterdir()):
        raise OutputError(
            f"cannot record into {folder}: the folder is not empty; name one that is empty or "
            "does not exist yet"
        )


def _check_names(folder: Path, names: Sequence[str]) -> None:
    """Check that each camera gets folders of its own inside the recording.

    Raises:
        OutputError: a name leads elsewhere, or to the files of another camera.

    """
    taken = set(_TABLES)
    for name in names:
        fault = name_fault(name)
        if fault is not None:
            raise OutputError(f"cannot record into {folder}: {fault}")
        folders = {name, _depths(name)}
        if taken & folders:
            raise OutputError(
                f"cannot record into {folder}: the files of camera '{name}' would be mixed with "
                "others; give it another name"
            )
        taken |= folders


def _row(time_s: float, pose: Pose) -> str:
    return ",".join(repr(float(one)) for one in (time_s, *pose.translation, *pose.quaternion))


def _file_of(image: RawImage) -> tuple[str, bytes]:
    """Return the suffix and the content of a lossless file of an image."""
    import cv2

    if image.encoded is not None:
        return ".jpg", image.encoded
    effort = [cv2.IMWRITE_PNG_COMPRESSION, _PNG_EFFORT]
    done, data = cv2.imencode(".png", image.pixels[..., ::-1], effort)
    if not done:
        raise OutputError("an image cannot be stored as PNG")
    return ".png", data.tobytes()


def _write(path: Path, data: bytes, written: list[Path]) -> None:
    written.append(path)
    path.write_bytes(data)


def _depths(name: str) -> str:
    return f"{name}-depth"


def _table(camera: MountedCamera, is_calibrated: bool, *, has_depth: bool) -> str:
    lens = camera.lens
    lines = [
        "[[camera]]",
        f"name = {json.dumps(camera.name)}",
        f"images = {json.dumps(f'{glob.escape(camera.name)}/*')}",
        f"size_px = {list(lens.size_px)}",
    ]
    if is_calibrated:
        lines += [
            f'model = "{lens.model}"',
            f"focal_px = {list(lens.focal_px)}",
            f"center_px = {list(lens.center_px)}",
            f"distortion = {list(lens.distortion)}",
            f"rig_from_camera = {camera.rig_from_camera.matrix().tolist()}",
        ]
    else:
        lines.append("# not calibrated: focal_px or fov_deg, and rig_from_camera, are to be added")
    if has_depth:
        lines += [
            f"depths = {json.dumps(f'{_depths(glob.escape(camera.name))}/*.npy')}",
            "depth_scale_m = 1.0",
        ]
    return "\n".join(lines) + "\n"
