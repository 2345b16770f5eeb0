"""Scan images with known poses and calibration, without using these, and compare.

The skull's photographs, and the left camera of a bottle's recording as a film, also with a board
drawn beside it. Prints the estimates, their errors, and the CPU seconds of the scan. Missing
captures are skipped: they are expected beside the repository.

Run it with: python benches/model/scan.py [skull] [bottle] [board]
"""

import csv
import json
import sys
import tempfile
import time
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
import trimesh
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "fixtures" / "shape"))

from rooms_to_scan import off_after_similarity

from servoid import scan
from servoid._native import Lens, Paint, Scene
from servoid.capture import open_capture
from servoid.model import Request, fit_capture
from servoid.pose import Pose
from servoid.segment import parse_target

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
SKULL, BOTTLE = DATA / "photos" / "skull", DATA / "stereo" / "mustard_hand"
CLICK = "click:365,270@camera/0000"
BOARD = scan.parse_board("7x5,0.03,0.0225")
BOARD_AWAY_M = 0.17  # from the bottle, to its left
FINER = 4  # resolution of the board relative to the images

Array = NDArray[np.float64]


def main() -> None:
    """Run the requested measurements, or all."""
    known: dict[str, tuple[Path, Callable[[Path], None]]] = {
        "skull": (SKULL, skull),
        "bottle": (BOTTLE, bottle),
        "board": (BOTTLE, board),
    }
    for name in sys.argv[1:] or known:
        data, measure = known[name]
        if not data.is_dir():
            print(f"{name:8} skipped: not in shared/data beside the repository")
            continue
        with tempfile.TemporaryDirectory() as folder:
            measure(Path(folder))


def scanned(name: str, source: Path, out: Path, request: scan.Request) -> scan.Scan:
    """Scan, and print the estimates."""
    start = time.process_time()
    made = scan.scan(source, out, request)
    seconds = time.process_time() - start
    solution = made.solution
    print(
        f"{name:8} {len(solution.names)} of {made.keys} found, focal length "
        f"{solution.focal_px:.1f} px (deviation {solution.focal_std_px:.1f}), "
        f"{solution.rms_px:.2f} px off, parallax "
        f"{np.degrees(solution.parallax_rad):.1f} degrees, {seconds:.0f} CPU s"
    )
    return made


def focal_off(name: str, made: scan.Scan, capture: Path) -> None:
    """Print the error of the focal length."""
    true = open_capture(capture).cameras[0].lens.focal_px
    off = ", ".join(f"{100 * (made.solution.focal_px / one - 1):+.2f} %" for one in true)
    print(f"{name:8} focal length off by {off}")


def places_off(name: str, made: scan.Scan, true: Array) -> None:
    """Print the errors of the camera's positions after the best similarity, and of its scale."""
    off_m, by = off_after_similarity(made.solution.places, true)
    way_m = np.linalg.norm(np.diff(true, axis=0), axis=1).sum()
    words = "" if made.scale is None else f", scale {100 * (1 / by - 1):+.2f} % off"
    if made.scale is not None:
        words += f" (deviation {100 * made.scale.deviation:.2f} %)"
    print(f"{name:8} places {1000 * off_m:.2f} mm RMS off on a way of {1000 * way_m:.0f} mm{words}")


def skull(folder: Path) -> None:
    """Scan the photographs of the skull, and model with every second of their masks."""
    request = scan.Request(masks=SKULL / "masks", threads=1)
    made = scanned("skull", SKULL / "images", folder / "out", request)
    focal_off("skull", made, SKULL)
    capture = open_capture(SKULL)
    names = [picture.stem for picture in capture.cameras[0].pictures if picture]
    poses = dict(zip(names, capture.world_from_rig, strict=True))
    places_off("skull", made, np.array([poses[one].translation for one in made.solution.names]))
    fitted = fit_capture(
        open_capture(made.path), Request(max_ellipsoids=6, delta=0.0), views=slice(None, None, 2)
    )
    print(
        f"skull    IoU {fitted.iou_used.mean():.4f} on used views, "
        f"{fitted.iou_unused.mean():.4f} on unused"
    )


def bottle(folder: Path) -> None:
    """Scan the bottle's film, click once, and compare the body with the true silhouettes."""
    film = write_film(folder / "film.mp4", images())
    made = scanned("bottle", film, folder / "out", scan.Request(threads=1))
    focal_off("bottle", made, BOTTLE)
    places_off("bottle", made, true_places(made))
    start = time.process_time()
    fitted = fit_capture(open_capture(made.path), Request(), targets=[parse_target(CLICK)])
    seconds = time.process_time() - start
    ious = [
        overlap(
            fitted.body.silhouette(view.camera, view.world_from_camera),
            view.ideal.maps().mask(true_mask(int(view.picture.stem))),
        )
        for view in open_capture(made.path).all_views()
    ]
    print(
        f"bottle   IoU {np.mean(ious):.4f} with the true silhouettes, worst {np.min(ious):.4f}; "
        f"{seconds:.0f} CPU s for the body"
    )


def board(folder: Path) -> None:
    """Scan the bottle's film with a board drawn beside it, which determines the scale."""
    drawn = [with_board(image, index) for index, image in enumerate(images())]
    film = write_film(folder / "film.mp4", drawn)
    made = scanned("board", film, folder / "out", scan.Request(threads=1, board=BOARD))
    focal_off("board", made, BOTTLE)
    places_off("board", made, true_places(made))
    print(f"board    {json.dumps(made.numbers()['scale'])}")


def images() -> list[NDArray[np.uint8]]:
    """Read the left eye's images, BGR."""
    files = sorted((BOTTLE / "left").glob("*.jpg"))
    return [np.asarray(cv2.imread(str(file)), np.uint8) for file in files]


def write_film(path: Path, pictures: list[NDArray[np.uint8]]) -> Path:
    """Write BGR images as a film."""
    height, width = pictures[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 30.0, (width, height))
    for picture in pictures:
        writer.write(picture)
    writer.release()
    return path


def true_places(made: scan.Scan) -> Array:
    """Return the left camera's true positions at the images with poses, (V, 3)."""
    poses = open_capture(BOTTLE).world_from_rig
    return np.array([poses[int(name)].translation for name in made.solution.names])


def left_from_object(index: int) -> Pose:
    """Return the bottle's pose in an image of the left camera."""
    with (BOTTLE / "truth" / "left_from_object.csv").open() as file:
        row = list(csv.DictReader(file))[index]
    numbers = [float(row[key]) for key in ("x", "y", "z", "qw", "qx", "qy", "qz")]
    return Pose.from_parts(numbers[:3], numbers[3:])


@lru_cache
def true_mesh() -> trimesh.Trimesh:
    """Read the bottle's surface."""
    return trimesh.load_mesh(BOTTLE / "truth" / "mesh.obj", process=False)


def true_mask(index: int) -> NDArray[np.uint8]:
    """Draw the true silhouette of the bottle in an image."""
    mesh = true_mesh()
    stage = Scene()
    vertices, faces = np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int64)
    stage.add_mesh(vertices, faces, Paint(color=(1.0, 1.0, 1.0)))
    pose = left_from_object(index)
    _, things = stage.depth(
        lens=lens(),
        world_from_lens=np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        world_from_visual=np.array([[*pose.quaternion, *pose.translation]]),
    )
    return np.where(things >= 0, 255, 0).astype(np.uint8)


def lens() -> Lens:
    """Return the left camera's true lens."""
    return open_capture(BOTTLE).cameras[0].lens


def overlap(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> float:
    """Return the intersection over union of two masks."""
    return float(((one > 0) & (other > 0)).sum() / ((one > 0) | (other > 0)).sum())


def with_board(image: NDArray[np.uint8], index: int) -> NDArray[np.uint8]:
    """Draw a board beside the bottle, over the background."""
    side = 60  # pixels of a square, as it is printed
    pattern = cv2.aruco.CharucoBoard(
        (BOARD.columns, BOARD.rows),
        BOARD.square_m,
        BOARD.marker_m,
        cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, BOARD.dictionary)),
    )
    size = (BOARD.columns * side, BOARD.rows * side)
    printed = cv2.cvtColor(pattern.generateImage(size), cv2.COLOR_GRAY2BGR)
    corners = board_corners()
    seen = lens().project(left_from_object(index).transform(corners))
    flat = np.array([[0, 0], [size[0], 0], size, [0, size[1]]], np.float32) - 0.5
    fine = ((seen + 0.5) * FINER - 0.5).astype(np.float32)
    turn = cv2.getPerspectiveTransform(flat, fine)
    height, width = image.shape[:2]
    shape = (width * FINER, height * FINER)
    cover = cv2.warpPerspective(np.ones(printed.shape[:2], np.float32), turn, shape)
    drawn = cv2.warpPerspective(printed.astype(np.float32) * 0.85, turn, shape)
    cover, drawn = (
        cv2.resize(one, (width, height), interpolation=cv2.INTER_AREA) for one in (cover, drawn)
    )
    return np.asarray(image * (1.0 - cover[:, :, None]) + drawn, np.uint8)


def board_corners() -> Array:
    """Return the corners of the board, (4, 3) in the bottle's frame."""
    vertices = np.asarray(true_mesh().vertices)
    eye = np.array(left_from_object(60).inverse().translation)
    floor = float(vertices[:, 2].min())
    toward = np.array([eye[0], eye[1], 0.0]) / np.hypot(eye[0], eye[1])
    up = np.array([0.0, 0.0, 1.0])
    across = np.cross(up, toward)
    half_wide, half_high = BOARD.square_m * np.array([BOARD.columns, BOARD.rows]) / 2.0
    foot = np.append(vertices[:, :2].mean(axis=0), floor) - BOARD_AWAY_M * across
    middle = foot + half_high * up
    signs = [(-1, 1), (1, 1), (1, -1), (-1, -1)]  # from its left upper corner on
    return np.array([middle + a * half_wide * across + b * half_high * up for a, b in signs])


if __name__ == "__main__":
    main()
