"""What a user would pick without this project: each gives D in px, some an angle in degrees.

They get what a careful user has: the number of strings, the Otsu mask's largest part, and its
direction. None sees the truth.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

NAN = float("nan")
CALIPER_PX = 10


@dataclass(frozen=True)
class Reading:
    """What one peer reads off one picture; NaN for what it does not give."""

    diameter_px: float = NAN
    beta_deg: float = NAN


def otsu_mask(picture: np.ndarray) -> np.ndarray:
    """Largest part of the Otsu mask, uint8 0/1, whichever side of the threshold it lies on."""
    soft = cv2.GaussianBlur(picture, (0, 0), 1.5)
    _, mask = cv2.threshold(soft, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    if mask.mean() > 0.5:
        mask = 1 - mask
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    largest = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA])) if len(stats) > 1 else 0
    return (labels == largest).astype(np.uint8)


def upright(picture: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """The picture turned so that the mask's long direction lies along rows, cut to the bundle."""
    y, x = np.nonzero(mask)
    vx, vy, x0, y0 = np.ravel(
        cv2.fitLine(np.stack([x, y], 1).astype(np.float32), cv2.DIST_HUBER, 0, 0.01, 0.01)
    )
    angle = float(np.rad2deg(np.arctan2(vy, vx)))
    height, width = picture.shape
    turn = cv2.getRotationMatrix2D((float(x0), float(y0)), angle, 1.0)
    turn[:, 2] = turn[:, 2] + np.array([width / 2 - float(x0), height / 2 - float(y0)])
    turned = cv2.warpAffine(picture, turn, (width, height), flags=cv2.INTER_CUBIC,
                            borderMode=cv2.BORDER_REPLICATE)  # fmt: skip
    # Columns near the ends hold replicated border: leave a fifth out.
    return turned[:, width // 10 : -width // 10]


def caliper_widths(picture: np.ndarray, step: int) -> np.ndarray:
    """Distance between the steepest rise and fall across boxes `step` px long (M,)."""
    mask = otsu_mask(picture)
    strip = upright(picture, mask).astype(np.float32)
    count = strip.shape[1] // step
    boxes = strip[:, : count * step].reshape(strip.shape[0], count, step).mean(axis=2)
    slope = np.gradient(cv2.GaussianBlur(boxes, (1, 0), sigmaX=1e-6, sigmaY=1.5), axis=0)
    middle = strip.shape[0] // 2
    reach = (
        int(0.9 * cv2.minAreaRect(_points(mask))[1][0]),
        int(0.9 * cv2.minAreaRect(_points(mask))[1][1]),
    )
    rows = slice(max(middle - min(reach), 1), middle + min(reach))
    part = slope[rows]
    sign = np.sign(np.median(boxes[middle - 3 : middle + 4]) - np.median(boxes[:5]))
    return _peak(-sign * part) - _peak(sign * part)


def _points(mask: np.ndarray) -> np.ndarray:
    y, x = np.nonzero(mask)
    return np.stack([x, y], 1).astype(np.float32)


def _peak(slope: np.ndarray) -> np.ndarray:
    """Sub-pixel row of the largest value of every column, by a parabola."""
    at = np.clip(slope.argmax(axis=0), 1, slope.shape[0] - 2)
    column = np.arange(slope.shape[1])
    a, b, c = (slope[at + i, column] for i in (-1, 0, 1))
    bend = a - 2 * b + c
    shift = np.where(bend < 0, 0.5 * (a - c) / np.where(bend < 0, bend, 1.0), 0.0)
    return at + np.clip(shift, -1, 1)


def calipers(picture: np.ndarray, strings: int) -> Reading:
    """Caliper rectangles 10 px long, largest width."""
    return Reading(float(caliper_widths(picture, CALIPER_PX).max()))


def min_area_rect(picture: np.ndarray, strings: int) -> Reading:
    """Short side of the smallest rectangle round the Otsu mask."""
    return Reading(float(min(cv2.minAreaRect(_points(otsu_mask(picture)))[1])) + 1.0)


def _skeleton_widths(picture: np.ndarray) -> np.ndarray:
    from scipy.ndimage import distance_transform_edt
    from skan import Skeleton
    from skimage.morphology import skeletonize

    mask = otsu_mask(picture)
    distance = distance_transform_edt(mask)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        skeleton = Skeleton(skeletonize(mask > 0), source_image=distance)
        lengths = skeleton.path_lengths()
    at = np.round(skeleton.path_coordinates(int(np.argmax(lengths)))).astype(int)
    return 2.0 * distance[at[:, 0], at[:, 1]]


def skan_largest(picture: np.ndarray, strings: int) -> Reading:
    """skan's longest path, twice the distance transform along it, largest."""
    return Reading(float(_skeleton_widths(picture).max()))


def skan_mean(picture: np.ndarray, strings: int) -> Reading:
    """The same, mean."""
    return Reading(float(_skeleton_widths(picture).mean()))


def width_fft(picture: np.ndarray, strings: int) -> Reading:
    """Peak of the caliper widths' spectrum, with the largest width as D."""
    widths = caliper_widths(picture, 2)
    middle = np.median(widths)
    series = np.clip(widths, 0.4 * middle, 1.6 * middle)
    spectrum = np.abs(np.fft.rfft((series - series.mean()) * np.hanning(series.size), 4096))
    rate = np.fft.rfftfreq(4096, 2.0)
    band = (rate > 1 / 400) & (rate < 1 / 15)
    lobes = 4.0 if strings == 8 else 2.0
    pitch = lobes / rate[band][int(np.argmax(spectrum[band]))]
    diameter = float(caliper_widths(picture, CALIPER_PX).max())
    return Reading(diameter, float(np.rad2deg(np.arctan(np.pi * diameter / pitch))))


def _lay_deg(picture: np.ndarray) -> float:
    """Mean direction of skimage's structure tensor inside the bundle, against the axis."""
    from skimage.feature import structure_tensor

    strip = upright(picture, otsu_mask(picture)).astype(float)
    # Only the innermost quarter: nearer the limbs, shading across the axis outweighs the ridges.
    half = int(0.12 * min(cv2.minAreaRect(_points(otsu_mask(picture)))[1]))
    middle = strip.shape[0] // 2
    inner = strip[middle - half - 4 : middle + half + 5]
    inner = inner - inner.mean(axis=1, keepdims=True)
    rr, rc, cc = (t[4:-4, 4:-4].sum() for t in structure_tensor(inner, sigma=2.0, order="rc"))
    # The stripes run across the strongest gradient.
    return float(abs(np.rad2deg(0.5 * np.arctan2(2.0 * rc, rr - cc))))


def tensor_read(picture: np.ndarray, strings: int) -> Reading:
    """Structure tensor's angle taken for the helix angle."""
    return Reading(beta_deg=_lay_deg(picture))


def tensor_corrected(picture: np.ndarray, strings: int) -> Reading:
    """The same, corrected from the strands' centres to the outer radius."""
    reach = {2: 0.5, 4: np.sqrt(3) / 2, 6: np.sqrt(1.75), 8: np.sqrt(1.75)}[strings]
    outer = (1.0 + 2.0 * reach) / (2.0 * reach)
    return Reading(
        beta_deg=float(np.rad2deg(np.arctan(outer * np.tan(np.deg2rad(_lay_deg(picture))))))
    )


PEERS: dict[str, Callable[[np.ndarray, int], Reading]] = {
    "skan + distance transform, largest": skan_largest,
    "skan + distance transform, mean": skan_mean,
    "caliper rectangles 10 px, largest": calipers,
    "cv2.minAreaRect of the Otsu mask": min_area_rect,
    "FFT of caliper widths": width_fft,
    "structure tensor (skimage), as read": tensor_read,
    "structure tensor, lay angle to helix angle": tensor_corrected,
}
