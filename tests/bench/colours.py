"""Films of the own renderer in which colour, ground, light, shadow and view are all drawn at once.

`python -m tests.bench.colours [--first 0] [--films 40] [--only SEED …] [--keep DIR]`

Three frames a film, strings of one colour or two before one of seven grounds, a lamp up to 65
degrees aside, full view or close-up, any side, PNG or JPEG, grey or in colour, measured as a user
would. Strings that differ from their ground neither in brightness nor in colour are drawn anew.
Prints a line a film: D less its true value and its sd (px) in every frame, and at its end what is
wrong: frames without D, outside the 95 % interval, off by more than 1.5 px, or of another sense;
then the whole: films in which every frame has a D, errors over films, and what intervals hold.
"""

# ruff: noqa: E402 - the thread counts must be set before numpy and numba are imported
from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import argparse
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from synth.build import make_settings
from synth.settings import Settings, Strings
from tests.bench.scoring import HELD, held, rms
from tests.measures.films import STORED, measured_rows
from tsvision.images.linear import LUMA_BGR

Colour = tuple[float, float, float]
STRANDS: dict[str, Colour] = {
    "orange": (0.62, 0.25, 0.04),
    "red": (0.45, 0.04, 0.04),
    "green": (0.05, 0.28, 0.08),
    "blue": (0.04, 0.09, 0.42),
    "cream": (0.7, 0.62, 0.45),
    "white": (0.75, 0.73, 0.68),
    "grey": (0.3, 0.3, 0.31),
    "black": (0.03, 0.03, 0.035),
    "yellow": (0.7, 0.6, 0.05),
    "pink": (0.7, 0.3, 0.4),
}
GROUNDS: dict[str, Colour] = {
    "dark": (0.03, 0.03, 0.032),
    "black": (0.008, 0.008, 0.009),
    "grey": (0.18, 0.18, 0.19),
    "wood": (0.35, 0.22, 0.11),
    "bright": (0.7, 0.69, 0.66),
    "bluecloth": (0.05, 0.08, 0.2),
    "green": (0.08, 0.2, 0.1),
}
MOST_ASIDE_DEG = 65.0  # the lamp
GROUND_BEHIND_MM = 0.4, 1.6  # the strings
TWO_COLOURS, GREY = 0.15, 0.15  # shares of the films
# Luma and each channel's share of the light, within which of the ground's strands are as it is.
AS_BRIGHT, AS_COLOURED = 0.3, 0.12
FAR_PX = 1.5
ANEW = 100_000  # added to the seed of a film that is drawn anew


@dataclass(frozen=True)
class Film:
    """What is drawn of one, in words, and as the renderer takes it."""

    words: str
    settings: Settings


def drawn(seed: int) -> Film:
    """The film of a seed."""
    random = np.random.default_rng([seed, 77])
    count = int(random.choice([2, 4, 6, 8], p=[0.4, 0.2, 0.2, 0.2]))
    strands = [str(random.choice(list(STRANDS)))]
    if random.random() < TWO_COLOURS:
        strands.append(str(random.choice(list(STRANDS))))
    ground = str(random.choice(list(GROUNDS)))
    aside = np.deg2rad(random.uniform(0.0, MOST_ASIDE_DEG))
    around = random.uniform(0.0, 2.0 * np.pi)
    lamp = np.sin(aside) * np.cos(around), np.sin(aside) * np.sin(around), np.cos(aside)
    view = str(random.choice(["full", "closeup"]))

    def near(colour: Colour) -> Colour:
        red, green, blue = (
            float(np.clip(c * random.uniform(0.8, 1.25), 0.004, 0.9)) for c in colour
        )
        return red, green, blue

    def between(low: float, high: float) -> float:
        return float(random.uniform(low, high))

    def one_of(*values: float) -> float:
        return float(random.choice(values))

    colours = tuple(near(STRANDS[name]) for name in strands)
    beside = near(GROUNDS[ground])
    changes: dict[str, object] = {
        "look.strand_rgb": colours,
        "look.ground_rgb": beside,
        "look.light": tuple(map(float, lamp)),
        "look.ambient": between(0.15, 0.5),
        "look.light_strength": between(0.5, 0.9),
        "look.specular": one_of(0.0, 0.08, 0.3),
        "look.ground_texture": one_of(0.0, 0.06, 0.15),
        "look.ground_gradient": (between(-0.4, 0.4), between(-0.3, 0.3)),
        "look.light_gradient": (between(-0.3, 0.3), between(-0.2, 0.2)),
        "look.shadow": one_of(0.0, 0.0, 0.35, 0.5),
        "look.fibres_per_mm": one_of(0.0, 0.25, 0.6),
        "look.braid": one_of(0.0, 0.25, 0.4),
        "look.occlusion": between(0.2, 0.6),
        "camera.view": view,
        "camera.side": str(random.choice(["left", "right", "top", "bottom"])),
        "camera.blur_px": between(0.5, 1.8),
        "camera.roll_deg": between(-8.0, 8.0),
        "sensor.format": str(random.choice(["png", "jpg"])),
        "sensor.quality": int(random.integers(60, 95)),
        "sensor.full_well_e": one_of(20000.0, 4000.0, 800.0),
        "sensor.grey": bool(random.random() < GREY),
    }
    sizes = (720, 1280) if changes["camera.side"] in ("top", "bottom") else (1280, 720)
    changes["camera.width_px"], changes["camera.height_px"] = sizes
    if view == "closeup":
        changes["camera.px_per_mm"] = between(30.0, 90.0)
    if any(_vanishes(colour, beside, bool(changes["sensor.grey"])) for colour in colours):
        return drawn(seed + ANEW)
    turns = tuple(float(t) for t in np.sort(random.uniform(3.0, 14.0, 3)))
    # A shadow falls away from the lamp, the farther the farther the ground lies behind.
    cast = between(*GROUND_BEHIND_MM) / lamp[2]
    changes["look.shadow_offset_mm"] = -cast * float(lamp[0]), -cast * float(lamp[1])
    strings = Strings(count=count, handedness=str(random.choice(["S", "Z"])))
    settings = make_settings(turns, look="front_lit", strings=strings, changes=STORED | changes)
    words = f"{count} {'+'.join(strands)} before {ground}, {view}, {_stored(changes)}"
    return Film(words, settings)


def _vanishes(strand: Colour, ground: Colour, grey: bool) -> bool:
    """Whether strands are about as bright as their ground and of its colour, or seen without."""
    a, b = np.array(strand), np.array(ground)
    luma = float(a @ LUMA_BGR[::-1] / (b @ LUMA_BGR[::-1]))
    share = np.abs(a / a.sum() - b / b.sum()).max()
    return bool(abs(luma - 1.0) < AS_BRIGHT and (grey or share < AS_COLOURED))


def _stored(changes: Mapping[str, object]) -> str:
    grey = " grey" if changes["sensor.grey"] else ""
    return f"shadow {changes['look.shadow']}, {changes['sensor.format']}{grey}"


def measured(film: Film, folder: Path) -> pd.DataFrame:
    """A row a frame: D, its sd and its error in px, its sense and whether that is right."""
    _, rows, truth = measured_rows(folder, film.settings)
    found = pd.DataFrame([vars(row) for row in rows])[
        ["diameter_px", "diameter_px_sd", "handedness"]
    ]
    found["off_px"] = found["diameter_px"] - truth
    found["sigmas"] = found["off_px"] / found["diameter_px_sd"]
    found["wrong"] = ~found["handedness"].isin(["", film.settings.strings.handedness])
    return found


def faults(found: pd.DataFrame) -> list[str]:
    """What is wrong with a film's rows, in words."""
    said = {
        "no D": bool(found["off_px"].isna().any()),
        "outside": bool((found["sigmas"].abs() > HELD).any()),
        "far": bool((found["off_px"].abs() > FAR_PX).any()),
        "sense": bool(found["wrong"].any()),
    }
    return [word for word, is_so in said.items() if is_so]


def main() -> None:
    """Print a line for every film, and the whole."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--films", type=int, default=40)
    parser.add_argument("--only", type=int, nargs="+", help="these seeds instead")
    parser.add_argument("--keep", type=Path, help="folder in which the films stay")
    given = parser.parse_args()
    every = []
    for seed in given.only or range(given.first, given.first + given.films):
        film = drawn(seed)
        with tempfile.TemporaryDirectory() as aside:
            found = measured(film, (given.keep or Path(aside)) / f"film_{seed}")
        each = [
            f"{off:+.2f} ± {sd:.2f}"
            for off, sd in zip(found["off_px"], found["diameter_px_sd"], strict=True)
        ]
        print(f"{seed} {film.words}: {', '.join(each)}  {', '.join(faults(found))}", flush=True)
        every.append(found)
    whole = sum(bool(found["off_px"].notna().all()) for found in every)
    off = pd.Series([rms(found["off_px"]) for found in every])
    rows = pd.concat(every)
    print(
        f"\n{whole} of {len(every)} films with D in every frame; D off by a median of "
        f"{off.median():.2f} px, {(off > FAR_PX).sum()} by more than {FAR_PX:g}; held "
        f"{held(rows['sigmas']):.2f}; sense wrong in {int(rows['wrong'].sum())} of {len(rows)}"
    )


if __name__ == "__main__":
    main()
