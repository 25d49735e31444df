"""Photos by others once more, changed in ways that change no cord: what moves?

`python -m tests.bench.photos_changed [--photos DIR] [NAME …]`

A photo, or its region cut out, is measured as it is, mirrored, turned by a quarter and a half, at
half and at one and a half times its size, in noise and coded hard. One line a photo: by how much D
differs from that of the photo as it is, in per cent of it, and whether the sense is told alike (a
mirror's is the other one; `-` where none is told). Last: the rms of all, beside the median of the
standard uncertainties stated.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from tests.bench.real_photos import PHOTOS, Case, cases_in
from tsvision.images.frames import iter_frames, open_recording
from tsvision.measures.recording import Measurer
from tsvision.records import Frame, FrameRow, Rig

NOISE = 8.0  # sd, of 255
QUALITY = 50  # of a JPEG
SENSES = {"S": -1, "Z": 1, "": 0}


@dataclass(frozen=True)
class Change:
    """A way to change a picture; sizes: how much larger what it shows becomes; sense: -1 where it
    is mirrored."""

    name: str
    made: Callable[[np.ndarray], np.ndarray]
    sizes: float = 1.0
    sense: int = 1


def sized(factor: float) -> Callable[[np.ndarray], np.ndarray]:
    way = cv2.INTER_AREA if factor < 1.0 else cv2.INTER_CUBIC
    return lambda picture: cv2.resize(picture, None, fx=factor, fy=factor, interpolation=way)


def noisy(picture: np.ndarray) -> np.ndarray:
    noise = NOISE * np.random.default_rng(1).standard_normal(picture.shape)
    return np.clip(picture + noise, 0, 255).astype(np.uint8)


def coded(picture: np.ndarray) -> np.ndarray:
    _, file = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    return np.asarray(cv2.imdecode(file, cv2.IMREAD_COLOR))


CHANGES = (
    Change("mirrored", lambda picture: picture[:, ::-1], sense=-1),
    Change("quarter turn", lambda picture: np.rot90(picture)),
    Change("half turn", lambda picture: np.rot90(picture, 2)),
    Change("x 0.5", sized(0.5), 0.5),
    Change("x 1.5", sized(1.5), 1.5),
    Change("noise", noisy),
    Change("JPEG", coded),
)


def measured(picture: np.ndarray) -> FrameRow:
    """The row of one picture that nothing is known of."""
    return Measurer(Rig()).measure(Frame(0, "photo", np.ascontiguousarray(picture))).row


def cut_out(case: Case, photos: Path) -> np.ndarray:
    """The photo, or its region."""
    frame = next(iter(iter_frames(open_recording(photos / case.photo))))
    assert frame.pixels is not None
    x, y, w, h = case.roi or (0, 0, *frame.pixels.shape[1::-1])
    return frame.pixels[y : y + h, x : x + w]


def compared(case: Case, photos: Path) -> tuple[str, list[float], float]:
    """A row of the table; by how much D differs (K,) and the uncertainty stated, shares of D."""
    picture = cut_out(case, photos)
    whole = measured(picture)
    words, shares = [], []
    for change in CHANGES:
        row = measured(change.made(picture))
        share = row.diameter_px / change.sizes / whole.diameter_px - 1.0
        alike = SENSES[row.handedness] * change.sense == SENSES[whole.handedness]
        words.append(f"{100 * share:+.1f}" + ("" if alike else " *" if row.handedness else " -"))
        shares.append(share)
    stated = whole.diameter_px_sd / whole.diameter_px
    d = f"{whole.diameter_px:.1f} ± {whole.diameter_px_sd:.1f} {whole.handedness or '-'}"
    return " | ".join(["", case.name, d, *words, ""]).strip(), shares, stated


def main() -> int:
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    words.add_argument("names", nargs="*", metavar="NAME", help="photos; all without")
    words.add_argument("--photos", type=Path, default=PHOTOS)
    given = words.parse_args()
    cases = cases_in(given.photos)
    cases = [case for case in cases if not given.names or case.name in given.names]
    if not cases:
        return 0
    print("D in px as it is, then its change in %; * the other sense, - none told")
    print(" | ".join(["| photo | D", *(change.name for change in CHANGES), ""]).strip())
    print("| --- " * (len(CHANGES) + 2) + "|")
    moved, stated = [], []
    for case in cases:
        line, shares, sd = compared(case, given.photos)
        print(line, flush=True)
        moved += shares
        stated.append(sd)
    known = np.array(moved)[np.isfinite(moved)]
    print(
        f"\nrms of {known.size} changes {100 * np.sqrt(np.mean(known**2)):.1f} %, median of their "
        f"sizes {100 * np.median(np.abs(known)):.1f} %; stated (sd, median) "
        f"{100 * np.median(stated):.1f} %"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
