"""D of coloured strings, told by the luma that files store, beside that of the same files as grey.

`python -m tests.bench.tinted [--strings 2 4] [--pairs ...] [--front] [--each]`

Files store the luma of encoded values, which is no sum of light: where a strand's edge is mixed
with the ground, channels that differ do not encode alike. Bundles of the benchmark (D 40 to 62 px,
15 to 35 degrees, noise of 2 %) are drawn in colour, channel by channel, at a blur of 1 px, and
stored as PNG and as JPEG (quality 85, 4:2:0). Each is measured cold, knowing N, and the PNG once
more as a grey file, of which nobody can tell what was mixed. Strands are as bright at the limb as
in the middle, or with `--front` lit by the benchmark's lamps; what either makes of grey strands is
in rows of their own, for colour to be compared with: light on the ground counts by itself.
"""

# ruff: noqa: E402 - the thread counts must be set before numpy and numba are imported
from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import argparse
import sys
from dataclasses import replace

import cv2
import numpy as np
import pandas as pd

from tests.bench.pictures48_draw import Case, draw
from tests.bench.pictures48_looks import look_of
from tests.bench.scoring import held, rms
from tests.bench.silhouettes import FLAT, bundles, measured_cold

# Linear red, green, blue of strands and ground.
PAIRS = {
    "grey on dark": ((0.40, 0.40, 0.40), (0.04, 0.04, 0.04)),
    "grey, five of ground": ((0.15, 0.15, 0.15), (0.03, 0.03, 0.03)),  # as blue and yellow have
    "grey, two of ground": ((0.15, 0.15, 0.15), (0.07, 0.07, 0.07)),  # as red has
    "grey, 1.7 of ground": ((0.15, 0.15, 0.15), (0.09, 0.09, 0.09)),
    "red on dark": ((0.65, 0.07, 0.07), (0.05, 0.06, 0.05)),
    "blue on dark": ((0.06, 0.12, 0.60), (0.03, 0.03, 0.03)),
    "yellow on blue": ((0.70, 0.55, 0.05), (0.06, 0.10, 0.30)),
    "grey on white": ((0.20, 0.20, 0.20), (0.75, 0.75, 0.75)),
    "red on white": ((0.45, 0.05, 0.05), (0.75, 0.75, 0.75)),
}
QUALITY = 85
KINDS = ("PNG", "JPEG", "grey")
EVERY = 2  # of the bundles


def picture(case: Case, pair: str, front: bool) -> np.ndarray:
    """The case (540, 960, 3) in a pair's colours, uint8, blue, green, red."""
    strand, ground = PAIRS[pair]
    channels = []
    for channel in (2, 1, 0):
        look = FLAT
        if front:
            look = look_of(case.dark_on_bright, case.light_deg)
        look = replace(
            look, strand_rgb=((strand[channel],) * 3,), ground_rgb=(ground[channel],) * 3
        )
        noisy = replace(case, seed=case.seed + channel)
        channels.append(draw(noisy, 1.0, look))
    return np.stack(channels, axis=2)


def kept(pixels: np.ndarray, kind: str) -> np.ndarray:
    """The picture as a file of this kind gives it back."""
    flag = cv2.IMREAD_GRAYSCALE if kind == "grey" else cv2.IMREAD_COLOR
    lossy = [cv2.IMWRITE_JPEG_QUALITY, QUALITY]
    stored = cv2.imencode(".jpg", pixels, lossy) if kind == "JPEG" else cv2.imencode(".png", pixels)
    return np.asarray(cv2.imdecode(stored[1], flag))


def error_px(case: Case, pixels: np.ndarray) -> tuple[float, float]:
    """Of D, and in units of its sd; the picture measured as a recording of one frame."""
    row, _ = measured_cold(case.strings, pixels)
    off = row.diameter_px - case.diameter_px
    return off, off / row.diameter_px_sd


def main() -> None:
    """Print a row for every pair of colours and how it was stored."""
    cv2.setNumThreads(1)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--strings", type=int, nargs="+", default=[2, 4, 6, 8])
    parser.add_argument("--pairs", nargs="+", default=list(PAIRS), choices=list(PAIRS))
    parser.add_argument("--front", action="store_true", help="lit from the front by lamps")
    parser.add_argument("--each", action="store_true", help="every bundle, on stderr")
    given = parser.parse_args()
    print("| strings on ground | file | D bias px | rms | worst | in 95 % |")
    print("| --- " * 6 + "|")
    listed = [case for strings in given.strings for case in bundles(strings)[::EVERY]]
    for pair in given.pairs:
        strand, ground = PAIRS[pair]
        lit = [replace(c, dark_on_bright=sum(strand) < sum(ground), noise=0.02) for c in listed]
        pictures = [picture(case, pair, given.front) for case in lit]
        for kind in KINDS:
            both = zip(lit, pictures, strict=True)
            off = pd.DataFrame(
                [error_px(case, kept(pixels, kind)) for case, pixels in both],
                columns=["px", "sds"],
            )
            if given.each:
                print(pair, kind, off["px"].round(2).to_list(), file=sys.stderr)
            print(
                f"| {pair} | {kind} | {off['px'].mean():+.2f} | {rms(off['px']):.2f} | "
                f"{off['px'].abs().max():.2f} | {100.0 * held(off['sds']):.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
