"""A live view made up: pictures as they come, and what a measuring core would make of them."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import cv2
import numpy as np

from tests.timeline.series import Series
from tsvision.records import Actuator, FrameResult, FrameRow, KnotSighting, Rig

RIG = Rig(actuator=Actuator(twisting_zone_mm=23.2, hole_diameter_mm=0.9))


def results_of(series: Series) -> list[FrameResult]:
    """The simulated tables as the frame results that a measuring core would hand over."""
    known = {f.name for f in fields(FrameRow)}
    knot_fields = [f.name for f in fields(KnotSighting) if f.name in series.knots]
    results = []
    for row in series.frames.to_dict("records"):
        sightings = series.knots[series.knots["frame"] == row["frame"]]
        knots = tuple(KnotSighting(**k) for k in sightings[knot_fields].to_dict("records"))
        kept = {str(k): v for k, v in row.items() if k in known}
        results.append(FrameResult(FrameRow(**kept), None, knots))
    return results


def write_picture(path: Path, value: int = 90) -> None:
    assert cv2.imwrite(str(path), np.full((12, 16), value, np.uint8))
