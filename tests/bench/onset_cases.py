"""Seeded recordings for the onset battery: settings, exact truth, and simulated measurements.

Truth comes from the renderer's exact geometry (`synth`), never from the measuring code. The
simulated measurement is a noisy E(s) from which an own, plain reading of the knot criterion makes
sightings; the rendered measurement goes through pictures and the whole chain.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter1d

from synth.actuator import state_at
from synth.phases import phase_of
from synth.presets import preset
from synth.settings import PAPER_ONSET_TURNS, Law, Settings, Strings
from synth.strands import hole_diameter_mm
from synth.truth import envelope_of
from tsvision.errors import InputError

PRESETS = ("clean", "bench", "hard")
COUNTS = (2, 4, 6, 8)
ORDER = ("twist", "overtwist", "local overtwist", "knotted", "irreversible")
# relative noise of E(s), of A and of the unevenness; share of frames lost; false sightings a frame
NOISE = {
    "clean": (0.008, 0.02, 0.05, 0.00, 0.002),
    "bench": (0.020, 0.05, 0.10, 0.02, 0.010),
    "hard": (0.040, 0.10, 0.20, 0.06, 0.040),
}


@dataclass(frozen=True)
class Case:
    """One recording: `truth` one row a frame; `envelopes` E(s) per frame on its own grid."""

    name: str
    settings: Settings
    step_turns: float
    truth: pd.DataFrame
    envelopes: tuple[tuple[np.ndarray, np.ndarray] | None, ...]
    knots: tuple[tuple[tuple[float, float, float], ...], ...]


def plan(seed: int, width_px: int = 1280) -> Settings:
    """Settings of recording `seed`: all N and presets in turn, a random law and frame step."""
    random = np.random.default_rng([seed, 91])
    count, look = COUNTS[seed % 4], PRESETS[(seed // 4) % 3]
    onset = PAPER_ONSET_TURNS[count] * random.uniform(0.85, 1.15)
    local = onset * random.uniform(1.7, 2.2)
    knot = local * random.uniform(1.1, 1.4)
    knots = bool(random.random() < 0.6)
    last = knot * random.uniform(1.12, 1.3) if knots else local * random.uniform(0.9, 1.3)
    step = float(np.exp(random.uniform(np.log(0.25), np.log(2.5))))
    step = max(step, last / 120)
    turns = tuple(float(t) for t in np.arange(0.0, last, step).round(4))
    law = Law(
        overtwist_turns=onset,
        local_turns=local,
        knot_turns=knot,
        knots=knots,
        knot_interval_turns=float(random.uniform(0.06, 0.15) * knot),
        knot_growth_turns=float(random.uniform(0.05, 0.12) * knot),
        drift_mm_per_turn=float(random.uniform(0.0, 0.06)),
    )
    camera, surface, sensor = preset(look, seed)
    camera = dataclasses.replace(camera, width_px=width_px, height_px=width_px * 9 // 16)
    return Settings(
        turns=turns,
        strings=Strings(count=count, handedness="Z" if seed % 2 else "S"),
        law=law,
        camera=camera,
        look=surface,
        sensor=sensor,
        preset=look,
        seed=seed,
    )


def name_of(settings: Settings) -> str:
    """Of the case's folder."""
    return f"{settings.seed:03d}_N{settings.strings.count}_{settings.preset}"


def exact(settings: Settings) -> Case:
    """Truth of every frame from the geometry. Frames that the bundle cannot hold are left out."""
    rows, envelopes, knots = [], [], []
    for index, turns in enumerate(settings.turns):
        try:
            state = state_at(settings, index)
        except InputError:
            break
        envelope = envelope_of(settings, state) if state.has_bundle else None
        amplitude, phase = 0.0, "twist"
        if envelope is not None:
            amplitude = float(np.sqrt(np.mean(state.line.radius_mm**2)))
            phase = phase_of(envelope, amplitude, state.diameter_mm)
        found = envelope.knots if envelope is not None else ()
        if any(k.max_diameter_mm > hole_diameter_mm(settings) for k in found):
            phase = "irreversible"
        rows.append(
            {
                "frame": index,
                "turns": turns,
                "diameter_mm": state.diameter_mm if envelope is not None else np.nan,
                "coil_amplitude_mm": amplitude,
                "unevenness": envelope.unevenness if envelope is not None else np.nan,
                "level": ORDER.index(phase),
            }
        )
        envelopes.append(None if envelope is None else (envelope.s_mm, envelope.envelope_mm))
        knots.append(tuple((k.centre_mm, k.stop_mm - k.start_mm, k.max_diameter_mm) for k in found))
    held = dataclasses.replace(settings, turns=settings.turns[: len(rows)])
    step = float(np.diff(settings.turns[:2])[0])
    return Case(name_of(settings), held, step, pd.DataFrame(rows), tuple(envelopes), tuple(knots))


def onset_truth(case: Case, level: int) -> tuple[float, float]:
    """First frame's turns and those of the frame before, of the last unbroken stretch; else NaN."""
    present = case.truth["level"].to_numpy() >= level
    turns = case.truth["turns"].to_numpy()
    if not len(present) or not present[-1]:
        return np.nan, np.nan
    missing = np.flatnonzero(~present)
    first = 0 if not len(missing) else int(missing[-1]) + 1
    return float(turns[first]), float(turns[max(first - 1, 0)])


def simulated(case: Case) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tables as a measuring core would hand over, from E(s) with smooth noise."""
    noise, of_coil, of_uneven, lost_share, false_share = NOISE[case.settings.preset]
    random = np.random.default_rng([case.settings.seed, 5])
    truth = case.truth
    count = len(truth)
    rows, sightings = [], []
    for index in range(count):
        base, top, found = _read_envelope(case, index, noise, random)
        if random.random() < false_share:
            found = [*found, _false_one(truth["diameter_mm"][index], random)]
        rows.append((base, top, len(found)))
        sightings += [(index, truth["turns"][index], *knot) for knot in found]
    base, top, seen = np.array(rows, dtype=float).T
    frames = truth[["frame", "turns"]].assign(
        file=[f"f{i}" for i in range(count)],
        time_s=np.nan,
        diameter_mm=truth["diameter_mm"] * (1 + 0.004 * random.standard_normal(count)),
        coil_amplitude_mm=np.hypot(truth["coil_amplitude_mm"], 0.015 * truth["diameter_mm"])
        * (1 + of_coil * random.standard_normal(count)),
        unevenness=np.hypot(truth["unevenness"], noise)
        * (1 + of_uneven * random.standard_normal(count)),
        baseline_envelope_mm=base,
        max_envelope_mm=top,
        knot_count=seen,
        turns_seen=truth["turns"] * (1 + 0.01 * random.standard_normal(count)),
        flags="",
    )
    lost = random.random(count) < lost_share
    frames.loc[lost, frames.columns.difference(["frame", "file", "turns", "flags"])] = np.nan
    frames.loc[lost, "flags"] = "UNREADABLE"
    names = ["frame", "turns", "centre_mm", "length_mm", "max_diameter_mm", "confidence"]
    knots = pd.DataFrame(sightings, columns=names)
    return frames, knots[~knots["frame"].isin(frames.loc[lost, "frame"])].reset_index(drop=True)


def _read_envelope(case: Case, index: int, noise: float, random: np.random.Generator):  # type: ignore[no-untyped-def]
    """Baseline, largest E, and the intervals that stand out of a noisy E(s), with confidence."""
    if case.envelopes[index] is None:
        return np.nan, np.nan, []
    s, envelope = case.envelopes[index]  # type: ignore[misc]
    diameter = float(case.truth["diameter_mm"][index])
    step = s[1] - s[0]
    field = gaussian_filter1d(random.standard_normal(len(s)), 0.7 * diameter / step, mode="wrap")
    seen = envelope * (1 + noise * field / max(field.std(), 1e-9))
    base = float(np.percentile(seen, 25))
    above = np.concatenate([[0], (seen >= 1.15 * base).astype(int), [0]])
    edges = np.flatnonzero(np.diff(above))
    found = []
    for first, after in zip(edges[::2], edges[1::2], strict=True):
        top, length = float(seen[first:after].max()), (after - first) * step
        if length < diameter or top < 1.4 * diameter:
            continue
        margin = min(top / base / 1.15, top / diameter / 1.4) - 1 + 0.3 * noise
        chance = float(np.clip(0.5 + 0.5 * margin / (3 * noise + 0.01), 0.4, 0.97))
        found.append((float(s[first:after].mean()), length, top, chance))
    return base, float(seen.max()), found


def _false_one(diameter: float, random: np.random.Generator) -> tuple[float, float, float, float]:
    diameter = diameter if np.isfinite(diameter) else 0.5
    size = diameter * random.uniform(1.45, 1.8)
    return random.uniform(6, 21), 1.2 * diameter, size, random.uniform(0.4, 0.8)
