"""Scale, tilt and lens distortion from a ChArUco board (cv2.aruco)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from tsvision.errors import InputError
from tsvision.images.calibration import NAN, Calibration
from tsvision.images.frames_picture import to_luma

_SPEC = re.compile(
    r"(?P<x>\d+)\s*[x×]\s*(?P<y>\d+)\s+square=(?P<square>[\d.]+)\s+marker=(?P<marker>[\d.]+)"
    r"\s+dict=(?P<dict>\w+)(?P<legacy>\s+legacy)?"
)
_FEWEST_CORNERS = 6
_FEWEST_VIEWS = 3


@dataclass(frozen=True)
class Board:
    """Squares across and down, sides in mm, the marker dictionary, and OpenCV's older layout."""

    squares_x: int
    squares_y: int
    square_mm: float
    marker_mm: float
    dictionary: str
    legacy: bool = False

    def made(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's object for it."""
        known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        size = (self.squares_x, self.squares_y)
        board = cv2.aruco.CharucoBoard(size, self.square_mm, self.marker_mm, known)
        board.setLegacyPattern(self.legacy)
        return board


@dataclass(frozen=True)
class View:
    """The board's corners in one picture: (n, 2) in px and in mm on the board."""

    corners_px: np.ndarray
    corners_mm: np.ndarray
    size_px: tuple[int, int]  # width, height


def parse_board(text: str) -> Board:
    """`7x5 square=5 marker=3.7 dict=DICT_4X4_50` (also `... legacy`); raises InputError."""
    match = _SPEC.fullmatch(" ".join(text.replace(",", " ").split()))
    if not match:
        raise InputError(
            f"camera.board {text!r}: write it as '7x5 square=5 marker=3.7 dict=DICT_4X4_50'"
        )
    name = match["dict"] if match["dict"].startswith("DICT_") else f"DICT_{match['dict']}"
    if not isinstance(getattr(cv2.aruco, name, None), int):
        known = ", ".join(n for n in dir(cv2.aruco) if n.startswith("DICT_"))
        raise InputError(f"camera.board {text!r}: no dictionary {name}; choose of {known}")
    try:
        square_mm, marker_mm = float(match["square"]), float(match["marker"])
    except ValueError:
        raise InputError(f"camera.board {text!r}: the sides must be numbers in mm") from None
    x, y = int(match["x"]), int(match["y"])
    if not (3 <= x <= 100 and 3 <= y <= 100 and 0 < marker_mm < square_mm):
        raise InputError(
            f"camera.board {text!r}: needs 3 to 100 squares each way and 0 < marker < square"
        )
    return Board(x, y, square_mm, marker_mm, name, bool(match["legacy"]))


def see_board(pixels: np.ndarray, board: Board) -> View | None:
    """The board's inner corners in a picture; None when fewer than six are seen."""
    grey = to_luma(pixels)
    if grey.dtype != np.uint8:
        grey = cv2.convertScaleAbs(grey, alpha=255.0 / max(1, int(grey.max())))
    made = board.made()
    corners, ids, _, _ = cv2.aruco.CharucoDetector(made).detectBoard(grey)
    if ids is None or len(ids) < _FEWEST_CORNERS:
        return None
    on_board = np.asarray(made.getChessboardCorners())[np.asarray(ids).ravel(), :2]
    seen = _sharpened(grey, np.asarray(corners, np.float32).reshape(-1, 1, 2), on_board, board)
    if np.linalg.matrix_rank(on_board - on_board.mean(0), tol=1e-6) < 2:
        return None  # all in one row: no plane
    return View(seen, on_board.astype(float), (grey.shape[1], grey.shape[0]))


def _sharpened(
    grey: np.ndarray, corners: np.ndarray, on_board_mm: np.ndarray, board: Board
) -> np.ndarray:
    """Corners to sub-pixel from the largest window that holds no marker (detection's own window
    is small, which costs a factor of three on large squares); (n, 2)."""
    places = corners.reshape(-1, 2).astype(float)
    spread_px = np.linalg.norm(places - places.mean(0), axis=1).mean()
    spread_mm = np.linalg.norm(on_board_mm - on_board_mm.mean(0), axis=1).mean()
    gap_px = 0.5 * (board.square_mm - board.marker_mm) * spread_px / max(spread_mm, 1e-9)
    half_px = int(np.clip(0.7 * gap_px, 2, 15))
    stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-4)
    moved = cv2.cornerSubPix(grey, corners.copy(), (half_px, half_px), (-1, -1), stop)
    shift = np.linalg.norm(moved.reshape(-1, 2) - places, axis=1)
    good = (shift < 0.5 * half_px)[:, None]
    return np.where(good, moved.reshape(-1, 2), places).astype(float)


def calibrate_charuco(
    views: Sequence[View], at_px: tuple[float, float] | None = None
) -> Calibration:
    """Scale on the plane of the FIRST view's board at `at_px` (default: the board's middle).

    With three or more views that differ in tilt the lens is calibrated too, and the scale holds
    for undistorted frames. Isotropic scale is √|det J|, J the map from px to mm there; what J
    stretches most by over what it stretches least by tells the board's tilt, about whichever axis.
    Uncertainty: jackknife over corners (it feels distortion that the model lacks). Raises
    InputError without a view.
    """
    if not views:
        raise InputError("no board was seen: at least 6 inner corners must be sharp and in view")
    lens, rms_px, distance_mm = _lens(views)
    first = views[0]
    corners_px = _undistorted(first.corners_px, lens)
    where = np.array(at_px) if at_px is not None else corners_px.mean(0)
    jacobian = _mm_per_px_at(first.corners_mm, corners_px, where)
    along_x, along_y = np.linalg.norm(jacobian, axis=0)
    most, least = np.linalg.svd(jacobian, compute_uv=False)
    drops = [
        _isotropic(
            _mm_per_px_at(np.delete(first.corners_mm, i, 0), np.delete(corners_px, i, 0), where)
        )
        for i in range(len(corners_px))
    ]
    n = len(drops)
    jackknife = float(np.sqrt((n - 1) / n * np.sum((np.array(drops) - np.mean(drops)) ** 2)))
    residual_px = _residual_px(first.corners_mm, corners_px)
    found = {
        "corners": float(n),
        "views": float(len(views)),
        "residual_px": residual_px,
        "reprojection_rms_px": rms_px,
        "mm_per_px_x": float(along_x),
        "mm_per_px_y": float(along_y),
        "tilt_deg": float(np.degrees(np.arccos(least / most))),
        "distance_mm": distance_mm,
    }
    notes = () if lens else ("the lens was not calibrated: that takes 3 views, tilted differently",)
    scale = _isotropic(jacobian)
    return Calibration(scale, {"corners": jackknife}, "charuco", lens, found, notes)


def undistort_maps(
    lens: Sequence[float], width_px: int, height_px: int
) -> tuple[np.ndarray, np.ndarray]:
    """Maps for cv2.remap that undo the lens's distortion and keep its camera matrix."""
    matrix, distortion = _matrices(lens)
    return cv2.initUndistortRectifyMap(
        matrix, distortion, np.eye(3), matrix, (width_px, height_px), cv2.CV_32FC1
    )


def _matrices(lens: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    fx, fy, cx, cy, *distortion = lens
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return matrix, np.array(distortion)


def _lens(views: Sequence[View]) -> tuple[tuple[float, ...], float, float]:
    """Lens parameters, reprojection rms in px, distance to the first board; empty and NaN when
    the views do not suffice."""
    if len(views) < _FEWEST_VIEWS:
        return (), NAN, NAN
    flat = [np.column_stack([v.corners_mm, np.zeros(len(v.corners_mm))]) for v in views]
    objects = [points.astype(np.float32) for points in flat]
    images = [v.corners_px.astype(np.float32) for v in views]
    flags = cv2.CALIB_FIX_K3 if len(views) < 8 else 0
    try:
        rms_px, matrix, distortion, turns, shifts = cv2.calibrateCamera(
            objects, images, views[0].size_px, None, None, flags=flags
        )
    except cv2.error as error:
        raise InputError(
            f"the lens cannot be calibrated ({error.err}); tilt the board more"
        ) from None
    numbers = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion.ravel()[:5]]
    rotation = cv2.Rodrigues(turns[0])[0]
    middle = rotation @ np.append(views[0].corners_mm.mean(0), 0.0) + shifts[0].ravel()
    return tuple(float(v) for v in numbers), float(rms_px), float(middle[2])


def _undistorted(points_px: np.ndarray, lens: tuple[float, ...]) -> np.ndarray:
    if not lens:
        return points_px
    matrix, distortion = _matrices(lens)
    shaped = points_px.reshape(-1, 1, 2)
    return cv2.undistortPoints(shaped, matrix, distortion, P=matrix).reshape(-1, 2)


def _plane(corners_mm: np.ndarray, corners_px: np.ndarray) -> np.ndarray:
    plane, _ = cv2.findHomography(corners_mm, corners_px, 0)
    if plane is None:
        raise InputError("the board's corners do not span a plane; show more of it")
    return plane


def _mm_per_px_at(corners_mm: np.ndarray, corners_px: np.ndarray, at_px: np.ndarray) -> np.ndarray:
    """(2, 2) mm on the board per px along x and y (columns), at a place in the picture."""
    back = np.linalg.inv(_plane(corners_mm, corners_px))  # px to mm
    u, v, w = back @ np.array([at_px[0], at_px[1], 1.0])
    return (back[:2, :2] * w - np.outer([u, v], back[2, :2])) / (w * w)


def _isotropic(mm_per_px: np.ndarray) -> float:
    """The scale of a square as large as what a pixel covers."""
    return float(np.sqrt(abs(np.linalg.det(mm_per_px))))


def _residual_px(corners_mm: np.ndarray, corners_px: np.ndarray) -> float:
    plane = _plane(corners_mm, corners_px)
    mapped = cv2.perspectiveTransform(corners_mm.reshape(-1, 1, 2), plane).reshape(-1, 2)
    return float(np.sqrt(np.mean(np.sum((mapped - corners_px) ** 2, axis=1)) / 2))
