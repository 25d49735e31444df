"""`python -m tests.bench.sighting`: how often the bundle and its ends are found, fresh recordings.

Renders `--each` recordings of every preset (N = 2, 4, 6, 8 in turn, seeds from `--seed` on, 9
frames from 0 turns to beyond the onsets), measures them as a user would, and counts how often each
of these is right: the axis (within 0.25 D at both ends), the separator's face and the connector's
(within 0.3 mm along the axis), D and pitch (median of the frames from 3 turns on within 3 %).
`--folder DIR` looks at recordings that lie there instead, a few frames of each.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from synth.build import make_settings
from synth.recording import write_recording
from synth.settings import Settings, Strings
from tsvision.images.frames import iter_frames, open_recording
from tsvision.measures.numeric.spread import pick_samples
from tsvision.measures.recording import Measurer, sample_pictures
from tsvision.rig import load_rig

PRESETS = ("clean", "bench", "hard")
COUNTS = (2, 4, 6, 8)
ONSET = {2: 20.0, 4: 11.0, 6: 10.0, 8: 8.0}  # turns at which coiling begins (the paper's)
FRAMES = 9
END_MM = 0.3
SHARE = 0.03
AXIS_D = 0.25
FEWEST_TURNS = 3.0
NAN = float("nan")


@dataclass(frozen=True)
class Sighted:
    """One recording: errors of ends in mm and of the axis in D, ratios to truth, shares."""

    name: str
    separator_mm: float
    known: bool
    connector_mm: float
    axis_d: float
    width: float
    diameter: float
    diameter_good: float
    pitch: float
    pitch_good: float
    early_false: int
    flags: str

    def right(self) -> dict[str, bool]:
        return {
            "axis": self.axis_d < AXIS_D,
            "separator": self.known and abs(self.separator_mm) < END_MM,
            "connector": abs(self.connector_mm) < END_MM,
            "D": abs(self.diameter - 1.0) < SHARE,
            "pitch": abs(self.pitch - 1.0) < SHARE,
            "nothing at 0": self.early_false == 0,
        }


def settings_of(index: int, preset: str, seed: int, look: str | None) -> Settings:
    """The `index`-th recording of a preset: N, side, sense and largest turns vary; the look too,
    unless it is given."""
    random = np.random.default_rng([seed, index, PRESETS.index(preset)])
    count = COUNTS[index % len(COUNTS)]
    last = float(random.uniform(1.2, 3.4)) * ONSET[count]
    turns = tuple(round(float(t), 3) for t in np.linspace(0.0, last, FRAMES))
    changes: dict[str, object] = {
        "camera.width_px": 960,
        "camera.height_px": 540,
        "camera.side": str(random.choice(["left", "right"])),
    }
    strings = Strings(count=count, handedness=str(random.choice(["Z", "S"])))
    seed_of_recording = int(random.integers(1, 10**6))
    made = make_settings(
        turns, preset, seed_of_recording, look=look, strings=strings, changes=changes
    )
    return replace(made, seed=seed_of_recording)


def look_at(source: Path, most: int = FRAMES) -> Sighted:
    """Prime on the recording's sampled pictures and measure up to `most` frames of it."""
    truth = pd.read_parquet(source / "truth.parquet")
    recording = open_recording(source, load_rig(source / "rig.toml"))
    measurer = Measurer(recording.rig)
    measurer.prime(sample_pictures(recording))
    rows = []
    for i in pick_samples(len(recording.files), most):
        for frame in iter_frames(recording, i, i + 1):
            rows.append(measurer.measure(frame, float(recording.turns[i])).row)
    measured = pd.DataFrame([vars(row) for row in rows]).set_index("frame")
    known = truth.set_index("frame").loc[measured.index]
    return _compare(source.name, measurer, measured, known)


def _compare(name: str, measurer: Measurer, rows: pd.DataFrame, truth: pd.DataFrame) -> Sighted:
    turned = (truth["turns"].abs() >= FEWEST_TURNS) & truth["has_bundle"]
    d = rows["diameter_px"] / pd.to_numeric(truth["diameter_px"])
    p = rows["pitch_px"] / pd.to_numeric(truth["pitch_px"])
    early = rows["diameter_px"][truth["turns"].abs() < 0.4]
    flags = rows["flags"][turned].str.split("|").explode().value_counts()
    separator, connector, axis = NAN, NAN, NAN
    width, zero_known = NAN, False
    looks = measurer.looks
    if looks is not None:
        first = truth.iloc[-1]
        line = looks.sight.axis
        ends = [
            np.array([first[f"axis_x{i}_px"], first[f"axis_y{i}_px"]], dtype=float) for i in (0, 1)
        ]
        u = line.tangent(np.array(0.0))
        origin = line.at(np.array(0.0))
        along = [float((e - origin) @ u) for e in ends]
        across = [abs(float((e - origin) @ np.array([-u[1], u[0]]))) for e in ends]
        scale = float(first["mm_per_px"])
        d_px = float(np.nanmedian(pd.to_numeric(truth["diameter_px"])))
        separator = (looks.zero_px - along[0]) * scale
        connector = (looks.ends.connector_px - along[1]) * scale
        axis = max(across) / d_px
        width, zero_known = looks.sight.width_px / d_px, looks.zero_known
    return Sighted(
        name=name,
        separator_mm=separator,
        known=zero_known,
        connector_mm=connector,
        axis_d=axis,
        width=width,
        diameter=float(np.nanmedian(d[turned])) if d[turned].notna().any() else NAN,
        diameter_good=float((np.abs(d[turned] - 1.0) < SHARE).mean()),
        pitch=float(np.nanmedian(p[turned])) if p[turned].notna().any() else NAN,
        pitch_good=float((np.abs(p[turned] - 1.0) < SHARE).mean()),
        early_false=int(early.notna().sum()),
        flags=" ".join(f"{k}:{v}" for k, v in flags.items() if k)[:60],
    )


def line_of(s: Sighted) -> str:
    return (
        f"{s.name:16s} sep {s.separator_mm:+6.2f}{' ' if s.known else '?'} con "
        f"{s.connector_mm:+6.2f} axis {s.axis_d:5.2f} width {s.width:4.2f} D {s.diameter:5.3f} "
        f"({s.diameter_good:3.0%}) p {s.pitch:5.3f} ({s.pitch_good:3.0%}) "
        f"0:{s.early_false} {s.flags}"
    )


def table(found: dict[str, list[Sighted]]) -> str:
    """Markdown: one row a preset, how many of its recordings have each thing right."""
    names = list(next(iter(found.values()))[0].right())
    lines = [
        f"| preset | recordings | {' | '.join(names)} | frames D | frames pitch | D off, median |"
    ]
    lines.append("| --- " * (len(names) + 5) + "|")
    for preset, some in found.items():
        right = [sum(s.right()[n] for s in some) for n in names]
        frames = [np.mean([getattr(s, k) for s in some]) for k in ("diameter_good", "pitch_good")]
        off = np.nanmedian([abs(s.diameter - 1.0) for s in some])
        cells = [preset, str(len(some)), *map(str, right), *(f"{100 * f:.0f} %" for f in frames)]
        cells.append(f"{100 * off:.1f} %")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--each", type=int, default=8, help="recordings of every preset")
    parser.add_argument("--seed", type=int, default=1, help="first seed")
    parser.add_argument("--presets", default=",".join(PRESETS))
    parser.add_argument("--look", help="of all recordings, such as side_lit; default: presets'")
    parser.add_argument("--keep", type=Path, help="folder in which the recordings stay")
    parser.add_argument("--folder", type=Path, help="look at the recordings in here instead")
    parser.add_argument("--only", default="", help="names must hold one of these, comma-separated")
    parser.add_argument("--frames", type=int, default=FRAMES, help="frames measured of each")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as aside:
        sources = _sources(options, options.keep or Path(aside))
        found: dict[str, list[Sighted]] = {}
        for preset, source in sources:
            if options.only and not any(o in source.name for o in options.only.split(",")):
                continue
            if not source.exists():
                index = int(source.name.split("_")[0])
                write_recording(source, settings_of(index, preset, options.seed, options.look))
            seen = look_at(source, options.frames)
            print(line_of(seen), file=sys.stderr, flush=True)
            found.setdefault(preset, []).append(seen)
    print(table(found))


def _sources(options: argparse.Namespace, keep: Path) -> list[tuple[str, Path]]:
    if options.folder:
        folders = sorted(p.parent for p in options.folder.glob("*/truth.parquet"))
        return [(p.name.rsplit("_", 1)[-1], p) for p in folders]
    return [
        (preset, keep / f"{i:03d}_N{COUNTS[i % len(COUNTS)]}_{preset}")
        for preset in options.presets.split(",")
        for i in range(options.each)
    ]


if __name__ == "__main__":
    main()
