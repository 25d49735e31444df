"""Pictures that cannot be read: how many and why, so that nobody looks for the reason elsewhere."""

from __future__ import annotations

import numpy as np
import pandas as pd

from tsvision.errors import InputError
from tsvision.flags import Flag, flags_from_text
from tsvision.images.frames import iter_frames
from tsvision.records import Recording


def unread(recording: Recording, rows: pd.DataFrame) -> list[str]:
    """A note on the frames flagged UNREADABLE; InputError where there are no others.

    The first of them is read once more for its reason: parts of a recording that were measured
    apart hand on rows, which hold none.
    """
    bad = np.flatnonzero([Flag.UNREADABLE in flags_from_text(text) for text in rows["flags"]])
    if not bad.size:
        return []
    index = int(bad[0])
    (frame,) = iter_frames(recording, index, index + 1)
    example = f"e.g. {frame.file}: {frame.problem or 'it could not be read before'}"
    if bad.size == len(rows):
        raise InputError(
            f"{recording.source}: none of its {len(rows)} pictures can be read, {example}"
        )
    return [f"{bad.size} of {len(rows)} pictures cannot be read, {example}"]
