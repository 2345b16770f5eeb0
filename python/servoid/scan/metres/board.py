"""Determines the scale of a scan from a printed ChArUco board in the scene."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from servoid.config import SQUARE_M, implausible
from servoid.errors import ScanError
from servoid.pose import Floats
from servoid.scan.metres.scale import Scale, triangulate
from servoid.scan.solution import Solution
from servoid.words import number_of

_SPEC = re.compile(r"(\d+)x(\d+),([^,]+)(?:,([^,]+))?(?:,(\w+))?")
_MARKER_SHARE = 0.75
_DICTIONARY = "DICT_4X4_50"
_LEAST_CORNERS = 6
_LEAST_IMAGES = 2
_OFF_PX = 3.0  # at 1000 px of diagonal: a corner with a larger error was misread


@dataclass(frozen=True)
class Board:
    """A ChArUco board of `columns` x `rows` squares; lengths in metres."""

    columns: int
    rows: int
    square_m: float
    marker_m: float
    dictionary: str = _DICTIONARY


def parse_board(text: str) -> Board:
    """Parse `COLUMNSxROWS,SQUARE[,MARKER[,DICTIONARY]]`; lengths are in metres.

    Raises:
        ScanError: it has another form, or no such board can exist.

    """
    found = _SPEC.fullmatch(text)
    try:
        columns, rows, square, marker, dictionary = (
            found.groups() if found else ("", "", "", "", "")
        )
        square_m = number_of(square)
        marker_m = number_of(marker) if marker else _MARKER_SHARE * square_m
        board = Board(int(columns), int(rows), square_m, marker_m, dictionary or _DICTIONARY)
    except ValueError:
        board = None
    if board is None or board.columns < 2 or board.rows < 2:
        raise ScanError(
            f"'{text}' is not a board; write COLUMNSxROWS,SQUARE,MARKER,DICTIONARY: how many "
            "squares, the sides of a square and of a marker in metres, and the markers' "
            f"dictionary, such as 7x5,0.03,0.0225,{_DICTIONARY}; the last two may be left out"
        )
    if not 0.0 < board.marker_m < board.square_m < np.inf:
        raise ScanError(
            f"a board's marker lies inside its square, but not in '{text}'; measure both in metres"
        )
    absurd = implausible("a board's square", board.square_m, SQUARE_M)
    if absurd is not None:
        raise ScanError(absurd)
    _detectors(board)
    return board


def scale_of_board(
    solution: Solution,
    board: Board,
    images: Callable[[], Iterable[tuple[str, NDArray[np.uint8]]]],
) -> Scale:
    """Return the scale for which the board's corners are as far apart as printed.

    `images` yields each image that has a pose, with its name.

    Raises:
        ScanError: too few corners of the board are visible in too few images.

    """
    for detector in _detectors(board):
        marks = _marks(solution, detector, images())
        if sum(len(one) >= _LEAST_IMAGES for one in marks.values()) >= _LEAST_CORNERS:
            return _fitted(solution, board, marks)
    raise ScanError(
        f"the board of {board.columns}x{board.rows} squares with markers of {board.dictionary} is "
        f"not visible well enough: at least {_LEAST_CORNERS} of its corners are needed in "
        f"{_LEAST_IMAGES} images or more; check --board, print it larger, or lay it flat and near "
        "the object"
    )


def printed_corners(board: Board) -> Floats:
    """Return the positions of the inner corners of a board, (N, 3) in metres, by their numbers."""
    down, across = np.mgrid[1 : board.rows, 1 : board.columns]
    flat = np.stack([across.ravel(), down.ravel(), np.zeros(across.size)], axis=1)
    return board.square_m * flat.astype(np.float64)


def _detectors(board: Board) -> list["object"]:
    """Return detectors of the board, in today's layout and in the layout before OpenCV 4.6."""
    import cv2

    number = getattr(cv2.aruco, board.dictionary, None)
    if not isinstance(number, int):
        raise ScanError(
            f"there is no dictionary {board.dictionary} of markers; OpenCV has DICT_4X4_50, "
            "DICT_5X5_100, DICT_6X6_250 and others"
        )
    made = []
    for legacy in (False, True):
        pattern = cv2.aruco.CharucoBoard(
            (board.columns, board.rows),
            board.square_m,
            board.marker_m,
            cv2.aruco.getPredefinedDictionary(number),
        )
        pattern.setLegacyPattern(legacy)
        made.append(cv2.aruco.CharucoDetector(pattern))
    return made


def _marks(
    solution: Solution, detector: object, images: Iterable[tuple[str, NDArray[np.uint8]]]
) -> dict[int, list[tuple[int, Floats]]]:
    """Return for each corner of the board the images in which it is visible, and its pixels."""
    import cv2

    marks: dict[int, list[tuple[int, Floats]]] = {}
    for name, image in images:
        index = solution.index(name)
        if index is None:
            continue
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        corners, numbers, _, _ = detector.detectBoard(grey)  # type: ignore[attr-defined]
        if numbers is None:
            continue
        for corner, number in zip(corners.reshape(-1, 2), numbers.ravel(), strict=True):
            marks.setdefault(int(number), []).append((index, corner.astype(np.float64)))
    return marks


def _fitted(solution: Solution, board: Board, marks: dict[int, list[tuple[int, Floats]]]) -> Scale:
    printed = printed_corners(board)
    limit = _OFF_PX * np.hypot(*solution.lens.size_px) / 1000.0
    numbers, places = [], []
    for number, seen in sorted(marks.items()):
        if len(seen) < _LEAST_IMAGES:
            continue
        point, off = triangulate(
            solution, [index for index, _ in seen], np.array([at for _, at in seen])
        )
        if off < limit:
            numbers.append(number)
            places.append(point)
    if len(numbers) < _LEAST_CORNERS:
        raise ScanError(
            f"the board's corners contradict the scan: only {len(numbers)} of {len(marks)} are "
            "where their rays meet; did the board move while the images were taken?"
        )
    estimated, true = np.array(places), printed[numbers]
    estimated, true = estimated - estimated.mean(axis=0), true - true.mean(axis=0)
    left, sizes, right = np.linalg.svd(true.T @ estimated)
    sign = np.sign(np.linalg.det(left @ right))
    metres = float((sizes * [1.0, 1.0, sign]).sum() / (estimated**2).sum())
    turn = left @ np.diag([1.0, 1.0, sign]) @ right
    off = true - metres * estimated @ turn.T
    spread = float(np.sqrt((true**2).sum()))
    deviation = float(np.sqrt((off**2).sum() / max(1, 3 * len(numbers) - 7))) / spread
    images = len({index for seen in marks.values() for index, _ in seen})
    return Scale(metres, deviation, f"by {len(numbers)} corners of a board in {images} images")
