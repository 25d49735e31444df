"""Calibration inside a recording: a board or a ruler in its own frames, and undistorted frames."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

import cv2
import numpy as np

from tsvision.errors import InputError
from tsvision.images.calibration import Calibration
from tsvision.images.calibration_charuco import (
    calibrate_charuco,
    parse_board,
    see_board,
    undistort_maps,
)
from tsvision.images.calibration_ruler import from_ruler
from tsvision.records import Camera, Frame, Recording

_FRAMES_TRIED = 50


def with_scale_from_pictures(recording: Recording, frames: Iterator[Frame]) -> Recording:
    """The recording with camera.mm_per_px from the first of its frames that shows the board or the
    ruler; raises InputError when none of the first fifty does."""
    camera = recording.rig.camera
    problem = "no picture can be read"
    for frame in islice(frames, _FRAMES_TRIED):
        if frame.pixels is None:
            continue
        try:
            found = _calibrate(frame.pixels, camera)
        except InputError as error:
            problem = str(error)
            continue
        return _with_scale(recording, found, frame)
    raise InputError(
        f"{recording.source}: camera.scale_from = '{camera.scale_from}', but {problem}; show it in "
        "the first frames, or calibrate on a picture of its own with `tsvision calibrate`"
    )


def undistorted(frames: Iterator[Frame], lens: tuple[float, ...]) -> Iterator[Frame]:
    """The frames without the lens's distortion (cubic interpolation; black beyond the edge)."""
    maps: dict[tuple[int, int], tuple[np.ndarray, np.ndarray]] = {}
    for frame in frames:
        if frame.pixels is None:
            yield frame
            continue
        height_px, width_px = frame.pixels.shape[:2]
        if (width_px, height_px) not in maps:
            maps[(width_px, height_px)] = undistort_maps(lens, width_px, height_px)
        pixels = cv2.remap(frame.pixels, *maps[(width_px, height_px)], cv2.INTER_CUBIC)
        yield replace(frame, pixels=pixels)


def _calibrate(pixels: np.ndarray, camera: Camera) -> Calibration:
    if camera.scale_from == "charuco":
        view = see_board(pixels, parse_board(camera.board or ""))
        return calibrate_charuco([view] if view else [])
    if len(camera.points_px) != 2:
        raise InputError("a ruler needs camera.points_px, two points of a line across its ticks")
    return from_ruler(pixels, *camera.points_px, division_mm=camera.length_mm, gamma=camera.gamma)


def _with_scale(recording: Recording, found: Calibration, frame: Frame) -> Recording:
    camera = replace(
        recording.rig.camera,
        mm_per_px=found.mm_per_px,
        mm_per_px_sd=found.mm_per_px_sd,
        scale_from=None,
    )
    told = f"{found.source} in frame {frame.index}"
    source = {**recording.rig.source, "camera.mm_per_px": told, "camera.mm_per_px_sd": told}
    rig = replace(recording.rig, camera=camera, source=source)
    spread = found.mm_per_px_sd / found.mm_per_px if found.mm_per_px > 0 else math.nan
    note = f"scale {found.mm_per_px:.6g} mm/px (± {100 * spread:.2g} %) from the {told}"
    return replace(recording, rig=rig, notes=(*recording.notes, note, *found.notes))
