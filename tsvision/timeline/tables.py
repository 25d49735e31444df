"""Frame results as the two tables that the account takes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, fields

import pandas as pd

from tsvision.records import FrameResult, FrameRow, KnotSighting

FRAME_COLUMNS = [field.name for field in fields(FrameRow)]
KNOT_COLUMNS = ["frame", "turns", *(field.name for field in fields(KnotSighting))]


def tables(results: Iterable[FrameResult]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """(frames, knots): one row a frame, one row a sighting; profiles are let go."""
    rows, sightings = [], []
    for result in results:
        rows.append(asdict(result.row))
        for knot in result.sightings:
            sightings.append({"frame": result.row.frame, "turns": result.row.turns, **asdict(knot)})
    return (
        pd.DataFrame(rows, columns=FRAME_COLUMNS),
        pd.DataFrame(sightings, columns=KNOT_COLUMNS),
    )
