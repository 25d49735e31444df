"""Photos by others, measured like any recording: `python -m tests.bench.real_photos [--draw]`.

Photos of one hairy yarn (scale from its known length) and plied pipe cleaners (sense, strand
repeat). Prints one line a photo and the yarn's mean and spread; `--draw` writes the overlays of
docs/real. The photos lie beside the project (../shared/real); without them the command says so.
Another folder's (`--photos DIR`, with the same names in it) are measured as far as they are there.

Yarn photos: MIT, (c) 2023 sabetta (stitch-by-stitch). Plied photos: CC0 1.0
(UnstableDesign/PrototypingSmartTextiles).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from tsvision.images.frames import iter_frames, open_recording
from tsvision.measures.recording import Measurer
from tsvision.records import FrameRow
from tsvision.rig import load_rig

ROOT = Path(__file__).resolve().parents[2]
PHOTOS = ROOT / ".." / "shared" / "real"
DRAWN = ROOT / "docs" / "real"
Region = tuple[int, int, int, int]


@dataclass(frozen=True)
class Case:
    """One photo, or a region (x, y, width, height) of it, and what is known by eye."""

    name: str
    photo: str
    length_mm: float | None = None
    roi: Region | None = None
    sense: str = ""
    repeat_px: float = float("nan")


LENGTHS_CM = (10, 15, 20, 25)
YARN = [
    Case(f"{cm}_{n}", f"yarn/{cm}_{n}.jpg", 10.0 * cm) for cm in LENGTHS_CM for n in range(1, 6)
]
_PLIED = "plied/so_yarn_examples.{}.jpeg"
PLIED = [
    Case("002 upper", _PLIED.format("002"), None, (100, 80, 940, 340), "S", 26.2),
    Case("002 lower", _PLIED.format("002"), None, (0, 240, 930, 390), "S", 26.5),
    Case("003", _PLIED.format("003"), None, (180, 90, 740, 330), "S", 68.0),
    Case("004 2x1", _PLIED.format("004"), None, (0, 80, 1024, 300), "S"),
    Case("005 left, blue", _PLIED.format("005"), None, (100, 0, 150, 768), "S", 48.1),
    Case("005 left, orange", _PLIED.format("005"), None, (300, 0, 130, 768), "S"),
    Case("005 left, whole panel", _PLIED.format("005"), None, (0, 0, 590, 768), "S"),
    Case("005 right, crossing", _PLIED.format("005"), None, (850, 250, 130, 240), "Z"),
    Case("005 right, whole panel", _PLIED.format("005"), None, (592, 0, 432, 768), "Z"),
    Case("005 right, single yarn", _PLIED.format("005"), None, (880, 480, 130, 280), "S"),
    Case("005 right, no ground", _PLIED.format("005"), None, (880, 230, 70, 250), "Z"),
    Case("006 right", _PLIED.format("006"), None, (600, 0, 424, 768), "Z"),
    Case("007 right", _PLIED.format("007"), None, (590, 0, 434, 700), "Z"),
    Case("008 right", _PLIED.format("008"), None, (590, 20, 434, 680)),
    Case("009 upper", _PLIED.format("009"), None, (0, 150, 1024, 160), "S", 36.0),
]


def cases_in(photos: Path) -> list[Case]:
    """Those whose photo lies in a folder; says so where none does."""
    cases = [case for case in [*YARN, *PLIED] if (photos / case.photo).is_file()]
    if not cases:
        print(f"{photos}: none of the photos is there: nothing measured")
    return cases


def measure(case: Case, photos: Path) -> tuple[FrameRow, np.ndarray]:
    """The row of one photo and the photo with what was measured drawn on it."""
    told: dict[str, object] = {}
    if case.length_mm is not None:
        told |= {"camera.scale_from": "length", "camera.length_mm": case.length_mm}
    if case.roi is not None:
        told["view.roi_px"] = case.roi
    recording = open_recording(photos / case.photo, load_rig(None, told))
    frame = next(iter(iter_frames(recording)))
    assert frame.pixels is not None
    measurer = Measurer(recording.rig)
    result = measurer.measure(frame)
    canvas = frame.pixels.copy()
    thick = max(round(max(canvas.shape[:2]) / 600), 1)
    profile = result.profile
    if profile is not None:
        if measurer.bowed is not None:
            axis, start = measurer.bowed.curve.axis, measurer.bowed.curve.start_px
        else:
            assert measurer.looks is not None
            axis, start = measurer.looks.sight.axis, measurer.looks.zero_px
        s = profile.s_px + start
        tangent = axis.tangent(s)
        across = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        for offset, colour in (
            (0.0 * s, (0, 255, 0)),
            (profile.upper_px, (255, 0, 255)),
            (profile.lower_px, (255, 0, 255)),
        ):
            known = np.flatnonzero(np.isfinite(offset))
            for part in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
                line = axis.at(s[part]) + offset[part, None] * across[part]
                fixed = [np.round(16 * line).astype(np.int32)]
                cv2.polylines(canvas, fixed, False, colour, thick, cv2.LINE_AA, 4)
    if case.roi is not None:
        x, y, w, h = case.roi
        cv2.rectangle(canvas, (x, y), (x + w - 1, y + h - 1), (0, 255, 255), 1)
        margin = 20
        canvas = canvas[max(y - margin, 0) : y + h + margin, max(x - margin, 0) : x + w + margin]
    return result.row, canvas


def line_of(case: Case, row: FrameRow) -> str:
    """A row of the table: what was measured beside what is known."""
    diameter = f"{row.diameter_px:.1f} ± {row.diameter_px_sd:.1f}"
    mm = f"{row.diameter_mm:.2f} ± {row.diameter_mm_sd:.2f}" if row.diameter_mm > 0 else "–"
    repeat = f"{row.strand_repeat_px:.1f}" if row.strand_repeat_px > 0 else "–"
    by_eye = f"{case.repeat_px:.1f}" if case.repeat_px > 0 else "–"
    sense = f"{row.handedness or '–'} ({row.handedness_confidence:.2f})"
    return " | ".join(
        ["", case.name, diameter, mm, repeat, by_eye, sense, case.sense or "–", row.flags, ""]
    ).strip()


def draw(case: Case, canvas: np.ndarray) -> None:
    """Write the overlay, small enough to travel."""
    longest = 1100 if case.roi is None else 900
    factor = min(longest / max(canvas.shape[:2]), 2.0)
    way = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
    small = cv2.resize(canvas, None, fx=factor, fy=factor, interpolation=way)
    DRAWN.mkdir(parents=True, exist_ok=True)
    name = case.name.replace(", ", "_").replace(" ", "_")
    cv2.imwrite(str(DRAWN / f"{name}.jpg"), small, [cv2.IMWRITE_JPEG_QUALITY, 80])


def main() -> int:
    words = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    words.add_argument("--draw", action="store_true")
    words.add_argument("--photos", type=Path, default=PHOTOS)
    given = words.parse_args()
    cases = cases_in(given.photos)
    if not cases:
        return 0
    print("| photo | D px | D mm | repeat px | by eye | sense | known | flags |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    diameters = []
    for case in cases:
        row, canvas = measure(case, given.photos)
        print(line_of(case, row), flush=True)
        if case.length_mm is not None:
            diameters.append(row.diameter_mm)
        if given.draw:
            draw(case, canvas)
    if len(diameters) < 2:
        return 0
    known = np.array(diameters)
    inside = int(((known > 2.0) & (known < 3.4)).sum())
    print(
        f"\nyarn: mean {known.mean():.2f} mm, spread (sd) {known.std(ddof=1):.2f} mm, "
        f"{known.min():.2f} to {known.max():.2f} mm; {inside} of {known.size} within 2.0 to 3.4 mm"
    )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
