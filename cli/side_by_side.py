"""A measured frame beside the renderer's best reconstruction of it, and their difference."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from synth.reconstruct import Reconstruction, Rope, likeness, reconstruct
from tsvision.errors import InputError
from tsvision.images.frames import iter_frames, open_recording
from tsvision.images.linear import LUMA_BGR, project, to_linear
from tsvision.results.read import read_measurement

STRIP_D = 32.0  # px that D takes in the strip
PITCHES = 2.5  # length of the strip
LEAST_D, MOST_D = 4.0, 12.0  # the same in units of D, whatever the pitch
PLACES = (0.4, 0.5, 0.6, 0.7, 0.8)  # along the axis: where the strands meet is not always known
HALF_D = 1.3  # to either side of the axis
FRAMES = 3  # shown unless they are named
ENLARGED = 3
DIFFERENCE = 2.0  # how much the difference is amplified
NEEDED = ("diameter_px", "pitch_px", "axis_x0_px", "axis_y0_px", "axis_x1_px", "axis_y1_px")
WORDS = {
    "taper": "a taper from separator to connector",
    "flattening": "strands flattened towards the outside",
    "looseness": "strands that lie apart",
}


@dataclass(frozen=True)
class Shown:
    """One frame: what was fitted, and where the picture is."""

    frame: int
    turns: float
    found: Reconstruction
    scale: float  # strip px per picture px
    file: Path


def side_by_side(
    measured: Path, recording: Path, out: Path, frames: Sequence[int] = ()
) -> list[Shown]:
    """Write `frame_K.png` for each frame and `reconstruction.csv`; InputError when none can be."""
    measurement = read_measurement(measured)
    records = measurement.frames.to_dict("records")
    rows = {int(r["frame"]): {str(k): v for k, v in r.items()} for r in records}
    wanted = list(frames) or _spread(rows)
    unknown = [k for k in frames if k not in rows]
    if unknown:
        raise InputError(f"--frame {unknown[0]}: '{measured}' has frames 0 to {len(rows) - 1}")
    rig = measurement.summary.get("rig") or {}
    count = rig.get("strings.count")
    if not count:
        raise InputError(f"'{measured}': strings.count is unknown; measure with a rig.toml")
    film = open_recording(recording)
    shown = []
    out.mkdir(parents=True, exist_ok=True)
    for k in wanted:
        row = rows[k]
        if not all(math.isfinite(row[name]) for name in NEEDED):
            continue
        frame = next(iter(iter_frames(film, k, k + 1)), None)
        if frame is None or frame.pixels is None:
            continue
        light = to_linear(frame.pixels, float(rig.get("camera.gamma") or math.nan))
        blur = row.get("blur_px")
        blur_px = float(blur if blur is not None and math.isfinite(blur) else 0.8)
        found, strip, scale = _drawn_again(project(light, LUMA_BGR), row, int(count), blur_px)
        file = out / f"frame_{k:05d}.png"
        cv2.imwrite(str(file), _sheet(strip, found, _caption(k, row, found, scale)))
        shown.append(Shown(k, float(row["turns"]), found, scale, file))
    if not shown:
        raise InputError(f"'{measured}': no frame has a diameter, a pitch and an axis to draw")
    _write_table(out / "reconstruction.csv", shown)
    return shown


def told(shown: Shown) -> str:
    """One line: how far drawing and photograph are apart, and what would bring them closer."""
    found = shown.found
    best = min(found.extras, key=lambda name: found.extras[name].rms)
    extra = found.extras[best]
    gone = 1.0 - extra.rms / found.rms
    said = (
        f"frame {shown.frame} ({shown.turns:.4g} turns): off by "
        f"{100 * found.rms / max(found.contrast, 1e-9):.1f} % of the contrast"
    )
    if gone > 0.03:
        said += f"; {WORDS[best]} ({extra.value:+.3f}) would take {100 * gone:.0f} % of that away"
    return said


def _drawn_again(
    light: np.ndarray, row: dict[str, Any], count: int, blur_px: float
) -> tuple[Reconstruction, np.ndarray, float]:
    """The piece that looks most like a bundle, drawn again."""
    strips = [_strip(light, row, place) for place in PLACES]
    scale = strips[0][1]
    hand = str(row.get("handedness") or "Z")
    start = Rope(count, STRIP_D, row["pitch_px"] * scale, hand, blur_px=blur_px * scale)
    best = min((strip for strip, _ in strips), key=lambda strip: likeness(strip, start))
    return reconstruct(best, start), best, scale


def _spread(rows: dict[int, dict[str, Any]]) -> list[int]:
    """A few frames, evenly over the turns of those that can be drawn."""
    able = [k for k, r in rows.items() if all(math.isfinite(r[name]) for name in NEEDED)]
    able.sort(key=lambda k: abs(rows[k]["turns"]) if math.isfinite(rows[k]["turns"]) else k)
    if not able:
        return []
    places = np.linspace(0, len(able) - 1, min(FRAMES, len(able))).round().astype(int)
    return sorted({able[i] for i in places})


def _strip(light: np.ndarray, row: dict[str, Any], place: float) -> tuple[np.ndarray, float]:
    """A piece about `place` (share of the axis), enlarged so that D is STRIP_D px."""
    start = np.array([row["axis_x0_px"], row["axis_y0_px"]])
    end = np.array([row["axis_x1_px"], row["axis_y1_px"]])
    whole = float(np.linalg.norm(end - start))
    along = (end - start) / whole
    d = float(row["diameter_px"])
    length = np.clip(PITCHES * row["pitch_px"], LEAST_D * d, MOST_D * d)
    length = min(float(length), 0.5 * whole)
    middle = start + along * np.clip(place * whole, 0.5 * length, whole - 0.5 * length)
    scale = STRIP_D / d
    width, height = round(length * scale), 2 * round(HALF_D * STRIP_D) + 1
    across = np.array([-along[1], along[0]])
    # Strip px (i, j) to picture px; cv2 wants the map from the strip to the picture as it is.
    turn = np.stack([along, across], axis=1) / scale
    move = middle - turn @ np.array([(width - 1) / 2, (height - 1) / 2])
    strip = cv2.warpAffine(
        light.astype(np.float32), np.column_stack([turn, move]), (width, height),
        flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    return strip, scale


def _sheet(photo: np.ndarray, found: Reconstruction, caption: str) -> np.ndarray:
    """Photograph, drawing and difference, one below the other, with words."""
    top = max(float(np.percentile(photo, 99.8)), 1e-6)

    def shade(light: np.ndarray) -> np.ndarray:
        grey = (255 * np.clip(light / top, 0, 1) ** (1 / 2.2)).astype(np.uint8)
        return cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)

    off = np.clip(DIFFERENCE * (photo - found.picture) / max(found.contrast, 1e-6), -1, 1)
    white = np.full((*photo.shape, 3), 255.0)
    white[..., :2] -= 255 * np.clip(off, 0, 1)[..., None]  # brighter than drawn: red
    white[..., 1:] -= 255 * np.clip(-off, 0, 1)[..., None]  # darker than drawn: blue
    parts = [
        ("photograph", shade(photo)),
        ("the renderer's best", shade(found.picture)),
        ("photograph - drawing (red: brighter, blue: darker)", white.astype(np.uint8)),
    ]
    width = max(ENLARGED * photo.shape[1], 900)
    blocks = [_words(caption, width)]
    for name, picture in parts:
        size = (ENLARGED * photo.shape[1], ENLARGED * photo.shape[0])
        large = cv2.resize(picture, size, interpolation=cv2.INTER_CUBIC)
        padded = np.full((large.shape[0], width, 3), 255, np.uint8)
        padded[:, : large.shape[1]] = large
        blocks += [_words(name, width), padded]
    return np.vstack(blocks)


def _words(text: str, width: int) -> np.ndarray:
    line = np.full((30, width, 3), 255, np.uint8)
    cv2.putText(line, text, (6, 21), cv2.FONT_HERSHEY_SIMPLEX, 0.55, (30, 30, 30), 1, cv2.LINE_AA)
    return line


def _caption(frame: int, row: dict[str, Any], found: Reconstruction, scale: float) -> str:
    rope = found.rope
    return (
        f"frame {frame}, {row['turns']:.4g} turns: D {row['diameter_px']:.2f} px measured, "
        f"{rope.diameter_px / scale:.2f} drawn; pitch {row['pitch_px']:.1f} and "
        f"{rope.pitch_px / scale:.1f}; off by {100 * found.rms / found.contrast:.1f} % of contrast"
    )


def _write_table(path: Path, shown: list[Shown]) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        extras = [f"{name}{end}" for name in WORDS for end in ("", "_rms_share")]
        head = ["frame", "turns", "diameter_px", "pitch_px", "rms_over_contrast", *extras]
        writer.writerow(head)
        for item in shown:
            found = item.found
            numbers = [
                found.rope.diameter_px / item.scale,
                found.rope.pitch_px / item.scale,
                found.rms / max(found.contrast, 1e-9),
            ]
            for name in WORDS:
                extra = found.extras[name]
                numbers += [extra.value, extra.rms / found.rms]
            writer.writerow([item.frame, item.turns, *(f"{n:.5g}" for n in numbers)])
