"""Tables with a hidden effect, by formulas of their own.

Nothing is imported from the mechanisms, the models or the diagnosis: if this generator shared
their code, an error there would cancel itself. Most effects come in a `plain` form, as a textbook
would write it, and in `foreign` forms that nobody promised; some resemble no known cause at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

TURN = 2 * np.pi
G = 9.80665
# N: D (mm), most turns of a run
BUNDLES = {2: (0.47, 48.0), 4: (0.70, 34.0), 6: (0.86, 28.0), 8: (0.99, 24.0)}


@dataclass
class World:
    """The actuator as it truly is, at every reading; effects change it stage by stage."""

    turns: np.ndarray
    load: np.ndarray
    back: np.ndarray
    time: np.ndarray
    run: np.ndarray
    count: int
    most: float
    n: np.ndarray = field(init=False)  # turns that reach the bundle
    r: np.ndarray = field(init=False)
    zone: np.ndarray = field(init=False)
    hole: np.ndarray = field(init=False)
    lens: np.ndarray = field(init=False)
    added: np.ndarray = field(init=False)  # mm, on top of the geometry
    beta_added: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        zero = np.zeros_like(self.turns)
        self.n = self.turns.copy()
        self.zone, self.hole, self.r = zero + 23.2, zero + 5.0, zero + 0.0
        self.lens, self.added, self.beta_added = zero + 1.0, zero.copy(), zero.copy()

    def tension(self) -> np.ndarray:
        lay = TURN * self.n * self.r / self.zone
        return self.load / self.count * np.sqrt(1 + lay**2)

    def drawn(self) -> np.ndarray:
        return np.hypot(self.zone, self.hole / 2 + TURN * self.n * self.r) - self.zone


@dataclass(frozen=True)
class Case:
    """One blind table. `truth` is a tuple of names; `kind` says which family it belongs to."""

    rows: list[dict]
    truth: tuple[str, ...]
    kind: str
    form: str
    clean_mm: np.ndarray  # displacement without noise, row by row of the displacement rows
    seed: int


Draw = np.random.Generator
Plan = Callable[[World, Draw], None]
Late = Callable[[World, np.ndarray, Draw], np.ndarray]


def sign(g: Draw) -> float:
    return float(g.choice([-1.0, 1.0]))


def solve_radius(w: World, law: Callable[[np.ndarray], np.ndarray]) -> None:
    """r = r0 law(T), T from r itself, iterated until it stands."""
    start = w.r.copy()
    for _ in range(40):
        w.r = start * law(w.tension())


# ------------------------------------------------------------------ before the geometry: plain


def radius_bias(w: World, g: Draw) -> None:
    w.r = w.r * (1 + sign(g) * g.uniform(0.05, 0.2))


def angle_scale(w: World, g: Draw) -> None:
    w.n = w.n * (1 - g.uniform(0.04, 0.15))


def hole_distance(w: World, g: Draw) -> None:
    w.hole = w.hole + sign(g) * g.uniform(0.8, 2.5)


def zone_length(w: World, g: Draw) -> None:
    w.zone = w.zone + sign(g) * g.uniform(1.2, 4.0)


def lost_turns(w: World, g: Draw) -> None:
    w.n = np.maximum(w.n - g.uniform(0.8, 3.0), 0)


def radial_compression(w: World, g: Draw) -> None:
    k, low = g.uniform(0.03, 0.12), w.load.min() / w.count
    solve_radius(w, lambda tension: (tension / low) ** -k)


def backlash(w: World, g: Draw) -> None:
    play = g.uniform(0.4, 2.0)
    w.n = w.n + np.where(w.back, np.minimum(play, w.most - w.turns), 0)


def radius_step(w: World, g: Draw) -> None:
    w.r = w.r * (1 + sign(g) * g.uniform(0.06, 0.18) * (w.turns > g.uniform(0.25, 0.8) * w.most))


def knot_absorption(w: World, g: Draw) -> None:
    onset = g.uniform(0.45, 0.8) * w.most
    w.n = w.n - g.uniform(0.3, 0.9) * np.maximum(w.n - onset, 0)


def camera_scale(w: World, g: Draw) -> None:
    w.lens = w.lens * (1 + sign(g) * g.uniform(0.03, 0.12))


# ------------------------------------------------------------------ after the geometry: plain


def axial_stretch(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    return x - (w.zone + x) * w.tension() * g.uniform(4e-4, 2e-3)


def creep(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    return x - g.uniform(0.3, 1.2) * np.log10(1 + w.time) * w.load / w.load.mean()


def coiling(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    onset = g.uniform(0.3, 0.65) * w.most
    return coil(w, onset + 0 * w.turns, g.uniform(0.75, 1.2))


def coil(w: World, onset: np.ndarray, times: float) -> np.ndarray:
    past = np.maximum(w.n - onset, 0)
    w.n = w.n - past
    across = w.hole / 2 + TURN * w.n * w.r
    at = w.hole / 2 + TURN * onset * w.r
    slope = TURN * w.r * at / np.hypot(w.zone, at) * times
    return np.hypot(w.zone, across) - w.zone + slope * past


# ------------------------------------------------------------------ foreign forms


def radius_bias_settling(w: World, g: Draw) -> None:
    w.r = w.r * (1 + sign(g) * g.uniform(0.06, 0.2) * (1 - 0.5 * np.exp(-w.turns / 4)))


def radius_bias_drifting(w: World, g: Draw) -> None:
    w.r = w.r * (1 + sign(g) * g.uniform(0.06, 0.18) * (1 + 0.25 * w.turns / w.most))


def angle_scale_with_torque(w: World, g: Draw) -> None:
    share = 0.6 + 0.4 * (w.turns / w.most) * w.load / w.load.max()
    w.n = w.n * (1 - g.uniform(0.05, 0.15) * share)


def angle_scale_saturating(w: World, g: Draw) -> None:
    w.n = w.n * (1 - g.uniform(0.05, 0.15) * (1 - np.exp(-3 * w.turns / w.most)))


def hole_distance_tapered(w: World, g: Draw) -> None:
    w.hole = w.hole + sign(g) * g.uniform(1.2, 2.5) * (0.75 + 0.25 * np.exp(-w.turns / 8))


def zone_length_drifting(w: World, g: Draw) -> None:
    w.zone = w.zone + sign(g) * g.uniform(1.5, 4.0) * (1 + 0.15 * w.turns / w.most)


def lost_turns_hyperbolic(w: World, g: Draw) -> None:
    lost = g.uniform(1.0, 3.0)
    w.n = w.n**2 / (w.n + lost)


def lost_turns_tanh(w: World, g: Draw) -> None:
    lost = g.uniform(0.8, 3.0)
    w.n = w.n - lost * np.tanh(w.n / lost)


def radial_compression_log(w: World, g: Draw) -> None:
    a = g.uniform(0.05, 0.14)
    solve_radius(w, lambda tension: 1 - a * np.log1p(tension / 12))


def radial_compression_tanh(w: World, g: Draw) -> None:
    a, scale = g.uniform(0.1, 0.25), g.uniform(15, 60)
    solve_radius(w, lambda tension: 1 - a * np.tanh(tension / scale))


def radial_compression_root(w: World, g: Draw) -> None:
    a = g.uniform(0.015, 0.035)
    solve_radius(w, lambda tension: 1 / (1 + a * np.sqrt(tension)))


def backlash_tanh(w: World, g: Draw) -> None:
    play, width = g.uniform(0.5, 2.0), g.uniform(1.0, 5.0)
    w.n = w.n + np.where(w.back, play * np.tanh((w.most - w.turns) / width), 0)


def backlash_with_load(w: World, g: Draw) -> None:
    play = g.uniform(0.6, 2.0) * (0.6 + 0.4 * w.load / w.load.max())
    w.n = w.n + np.where(w.back, np.minimum(play, w.most - w.turns), 0)


def radius_step_smooth(w: World, g: Draw) -> None:
    s = np.clip((w.turns / w.most - g.uniform(0.25, 0.65)) / g.uniform(0.05, 0.2), 0, 1)
    w.r = w.r * (1 + sign(g) * g.uniform(0.07, 0.18) * s * s * (3 - 2 * s))


def radius_step_twice(w: World, g: Draw) -> None:
    first, size = g.uniform(0.3, 0.6), sign(g) * g.uniform(0.05, 0.1)
    s = w.turns / w.most
    w.r = w.r * (1 + size * (s > first) + size * (s > first + 0.12))


def knot_absorption_staircase(w: World, g: Draw) -> None:
    onset, knot = g.uniform(0.4, 0.7) * w.most, g.uniform(1.0, 2.0)
    past = np.maximum(w.n - onset, 0)
    w.n = w.n - knot * np.floor(past / (1.6 * knot))


def knot_absorption_growing(w: World, g: Draw) -> None:
    onset = g.uniform(0.35, 0.65) * w.most
    past = np.maximum(w.n - onset, 0)
    w.n = w.n - g.uniform(0.4, 0.9) * past**2 / (past + 0.1 * w.most)


def camera_scale_drifting(w: World, g: Draw) -> None:
    w.lens = w.lens * (1 + sign(g) * g.uniform(0.04, 0.12) * (1 + 0.2 * w.turns / w.most))


def axial_stretch_root(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    return x - (w.zone + x) * g.uniform(0.004, 0.012) * np.sqrt(w.tension())


def axial_stretch_stiffening(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    return x - (w.zone + x) * g.uniform(0.02, 0.06) * (1 - np.exp(-w.tension() / 40))


def creep_power(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    return x - g.uniform(0.8, 2.5) * (w.time / w.time.max()) ** 0.3 * w.load / w.load.mean()


def creep_exponential(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    grown = 1 - np.exp(-w.time / (g.uniform(0.15, 0.5) * w.time.max()))
    return x - g.uniform(0.8, 2.5) * grown * (w.load / w.load.mean()) ** 0.7


def coiling_rounded(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    onset, times = g.uniform(0.3, 0.6) * w.most, g.uniform(0.8, 1.15)
    width = 0.05 * w.most
    past = width * np.logaddexp(0, (w.n - onset) / width)
    past = np.minimum(past, w.n)
    at = w.hole / 2 + TURN * onset * w.r
    slope = TURN * w.r * at / np.hypot(w.zone, at) * times
    w.n = w.n - past
    return w.drawn() + slope * past


def coiling_with_load(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    onset = g.uniform(0.28, 0.45) * w.most * (w.load / w.load.min()) ** g.uniform(0.1, 0.4)
    return coil(w, onset, g.uniform(0.8, 1.15))


# ------------------------------------------------ foreign forms written after all tuning was done


def angle_scale_hyperbolic(w: World, g: Draw) -> None:
    w.n = w.n * (1 - g.uniform(0.07, 0.16) * w.turns / (w.turns + 0.15 * w.most))


def hole_distance_widening(w: World, g: Draw) -> None:
    w.hole = w.hole + sign(g) * g.uniform(1.2, 2.5) * (0.8 + 0.3 * (w.turns / w.most) ** 2)


def lost_turns_root(w: World, g: Draw) -> None:
    lost = g.uniform(1.0, 3.0)
    w.n = np.sqrt(w.n**2 + lost**2) - lost


def radial_compression_cube_root(w: World, g: Draw) -> None:
    a, low = g.uniform(0.05, 0.12), w.load.min() / w.count
    solve_radius(w, lambda tension: 1 - a * ((tension / low) ** (1 / 3) - 1))


def backlash_with_turns(w: World, g: Draw) -> None:
    play = g.uniform(0.7, 2.0) * (0.7 + 0.3 * w.turns / w.most)
    w.n = w.n + np.where(w.back, np.minimum(play, w.most - w.turns), 0)


def radius_step_arctan(w: World, g: Draw) -> None:
    past = (w.turns / w.most - g.uniform(0.3, 0.6)) / g.uniform(0.02, 0.06)
    w.r = w.r * (1 + sign(g) * g.uniform(0.08, 0.18) * (0.5 + np.arctan(past) / np.pi))


def axial_stretch_log(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    return x - (w.zone + x) * g.uniform(0.012, 0.03) * np.log1p(w.tension() / 10)


def creep_late(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    return x - g.uniform(0.6, 1.5) * np.log10(1 + w.time / 20) * (w.load / w.load.mean()) ** 0.8


def coiling_curved(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    onset = g.uniform(0.3, 0.55) * w.most
    past = np.maximum(w.n - onset, 0)
    return coil(w, onset + 0 * w.n, g.uniform(0.75, 0.95)) + 0.06 * past**2 / w.most


# ------------------------------------------------------------------ like none of them


def ripple(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    periods, phase = g.uniform(1.5, 3.5), g.uniform(0, TURN)
    return x + g.uniform(0.6, 2.0) * np.sin(TURN * periods * w.turns / w.most + phase)


def bump(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    centre, width = g.uniform(0.35, 0.65), g.uniform(0.06, 0.12)
    return x + sign(g) * g.uniform(1.2, 3) * np.exp(-(((w.turns / w.most - centre) / width) ** 2))


def load_hump(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    middle = np.abs(w.load - np.median(w.load)) < 1
    s = w.turns / w.most
    return x + sign(g) * g.uniform(1.0, 3.0) * middle * np.sin(np.pi * s) ** 2


def warm_room(w: World, x: np.ndarray, g: Draw) -> np.ndarray:
    clock = w.time / w.time.max() + w.run * 0.37
    return x + g.uniform(0.8, 2.0) * np.sin(TURN * clock * g.uniform(1.5, 2.5))


PLAIN: dict[str, Plan | Late] = {
    f.__name__: f
    for f in (
        radius_bias,
        angle_scale,
        hole_distance,
        zone_length,
        lost_turns,
        axial_stretch,
        radial_compression,
        backlash,
        creep,
        radius_step,
        knot_absorption,
        camera_scale,
        coiling,
    )
}
FOREIGN: dict[str, tuple[Plan | Late, ...]] = {
    "radius_bias": (radius_bias_settling, radius_bias_drifting),
    "angle_scale": (angle_scale_with_torque, angle_scale_saturating),
    "hole_distance": (hole_distance_tapered,),
    "zone_length": (zone_length_drifting,),
    "lost_turns": (lost_turns_hyperbolic, lost_turns_tanh),
    "axial_stretch": (axial_stretch_root, axial_stretch_stiffening),
    "radial_compression": (
        radial_compression_log,
        radial_compression_tanh,
        radial_compression_root,
    ),
    "backlash": (backlash_tanh, backlash_with_load),
    "creep": (creep_power, creep_exponential),
    "radius_step": (radius_step_smooth, radius_step_twice),
    "knot_absorption": (knot_absorption_staircase, knot_absorption_growing),
    "camera_scale": (camera_scale_drifting,),
    "coiling": (coiling_rounded, coiling_with_load),
}
LATER: dict[str, Plan | Late] = {
    "angle_scale": angle_scale_hyperbolic,
    "hole_distance": hole_distance_widening,
    "lost_turns": lost_turns_root,
    "radial_compression": radial_compression_cube_root,
    "backlash": backlash_with_turns,
    "radius_step": radius_step_arctan,
    "axial_stretch": axial_stretch_log,
    "creep": creep_late,
    "coiling": coiling_curved,
}
UNLIKE: tuple[Late, ...] = (ripple, bump, load_hump, warm_room)
LATE = {"axial_stretch", "creep", "coiling"}
RANK = {"coiling": 0, "axial_stretch": 1, "creep": 2}


@dataclass(frozen=True)
class Setting:
    """How the table is taken."""

    observables: tuple[str, ...] = ("displacement_mm", "diameter_mm", "helix_angle_deg")
    loads_kgf: tuple[float, ...] = (1.0, 3.0, 5.0)
    levels: int = 13
    unwind: bool = True
    correlation: float = 0.0
    offsets_mm: float = 0.0
    tolerance_times: float = 1.0  # the inputs' errors in units of the stated tolerance
    tolerance_exact: bool = False  # errors of exactly that size, of random sign
    outliers: float = 0.02
    count: int | None = None


TOLERANCE = {"radius": 0.01, "zone": 0.15, "hole": 0.1, "camera": 0.005}
NOISE = {
    "diameter_mm": (0.005, 0.012),
    "helix_angle_deg": (0.2, 0.5),
    "hole_distance_mm": (0.02, 0.05),
    "twist_turns": (0.05, 0.15),
    "torque_Nmm": (0.05, 0.15),
}


def plant(
    effects: list[tuple[str, Plan | Late]],
    seed: int,
    setting: Setting = Setting(),
    kind: str = "plain",
) -> Case:
    """A table in which the effects act (none: an empty list), with noise and tolerances."""
    g = np.random.default_rng(seed)
    count = setting.count or int(g.choice(list(BUNDLES)))
    w, stated = _world(g, count, setting)
    order = sorted(effects, key=lambda item: RANK.get(item[0], -1))
    early = [e for e in order if e[0] not in LATE and e[1] not in UNLIKE]
    # What tension does to the radius acts on the radius and turns that the others leave.
    for _, plan in sorted(early, key=lambda item: item[0] == "radial_compression"):
        plan(w, g)  # type: ignore[call-arg, arg-type]
    x = w.drawn()
    for name, late in order:
        if name in LATE or late in UNLIKE:
            x = late(w, x, g)  # type: ignore[call-arg, arg-type, assignment]
    seen = {
        "displacement_mm": x,
        "diameter_mm": 2 * w.r * w.lens,
        "helix_angle_deg": np.degrees(np.arctan(TURN * w.n * w.r / w.zone)) + w.beta_added,
        "hole_distance_mm": w.hole * w.lens,
        "twist_turns": w.n,
        "torque_Nmm": w.load
        * w.r
        * (w.hole / 2 + TURN * w.n * w.r)
        / np.hypot(w.zone, w.hole / 2 + TURN * w.n * w.r),
    }
    rows = _rows(g, w, seen, stated, setting)
    truth = tuple(name for name, plan in effects if plan not in UNLIKE)
    form = "+".join(getattr(plan, "__name__", name) for name, plan in effects) or "none"
    return Case(rows, truth, kind, form, x, seed)


def _world(g: Draw, count: int, setting: Setting) -> tuple[World, dict]:
    diameter, most = BUNDLES[count]
    levels = np.linspace(0, most, setting.levels)
    way = np.concatenate([levels, levels[::-1]]) if setting.unwind else levels
    back = np.concatenate([np.zeros(len(levels), bool), np.ones(len(way) - len(levels), bool)])
    runs = len(setting.loads_kgf)
    pause = g.uniform(3, 15)
    w = World(
        turns=np.tile(way, runs),
        load=np.repeat(np.array(setting.loads_kgf) * G, len(way)),
        back=np.tile(back, runs),
        time=np.tile(pause * np.arange(len(way)), runs),
        run=np.repeat(np.arange(runs), len(way)),
        count=count,
        most=most,
    )
    if setting.tolerance_exact:
        off = setting.tolerance_times * g.choice([-1.0, 1.0], 4)
    else:
        off = setting.tolerance_times * g.normal(size=4)
    w.r = 0 * w.r + diameter / 2
    stated = {
        "bundle_diameter_mm": diameter / (1 + TOLERANCE["radius"] * off[0]),
        "bundle_diameter_mm_sd": TOLERANCE["radius"] * diameter,
        "twisting_zone_mm": 23.2 - TOLERANCE["zone"] * off[1],
        "twisting_zone_mm_sd": TOLERANCE["zone"],
        "hole_distance_nominal_mm": 5.0 - TOLERANCE["hole"] * off[2],
        "hole_distance_nominal_mm_sd": TOLERANCE["hole"],
        "camera_scale_sd": TOLERANCE["camera"],
    }
    w.lens = w.lens * (1 + TOLERANCE["camera"] * off[3])
    return w, stated


def _rows(g: Draw, w: World, seen: dict, stated: dict, setting: Setting) -> list[dict]:
    rows: list[dict] = []
    offsets = setting.offsets_mm * g.normal(size=w.run.max() + 1)
    for name in setting.observables:
        low, high = NOISE.get(name, (0.1, 0.3))
        sd = g.uniform(low, high)
        e = g.normal(size=len(w.turns))
        for i in range(1, len(e)):
            if w.run[i] == w.run[i - 1]:
                keep = setting.correlation
                e[i] = keep * e[i - 1] + np.sqrt(1 - keep**2) * e[i]
        wild = g.random(len(e)) < setting.outliers
        e = np.where(wild, e + g.choice([-1, 1], len(e)) * g.uniform(6, 20, len(e)), e)
        value = seen[name] + sd * e
        if name == "displacement_mm":
            value = value + offsets[w.run]
        for i in range(len(value)):
            rows.append(
                {
                    "run": f"run{w.run[i]}",
                    "turns": round(float(w.turns[i]), 4),
                    "load_N": round(float(w.load[i]), 4),
                    "branch": "unwind" if w.back[i] else "wind",
                    "time_s": round(float(w.time[i]), 2),
                    "observable": name,
                    "value": round(float(value[i]), 5),
                    "strings": w.count,
                    **stated,
                }
            )
    return rows


def plain_case(name: str, seed: int, setting: Setting = Setting()) -> Case:
    return plant([(name, PLAIN[name])], seed, setting, "plain")


def foreign_case(name: str, which: int, seed: int, setting: Setting = Setting()) -> Case:
    return plant([(name, FOREIGN[name][which % len(FOREIGN[name])])], seed, setting, "foreign")


def later_case(name: str, seed: int, setting: Setting = Setting()) -> Case:
    return plant([(name, LATER[name])], seed, setting, "later")


def unlike_case(which: int, seed: int, setting: Setting = Setting()) -> Case:
    return plant([("?", UNLIKE[which % len(UNLIKE)])], seed, setting, "unlike")


def pair_case(a: str, b: str, seed: int, setting: Setting = Setting()) -> Case:
    return plant([(a, PLAIN[a]), (b, PLAIN[b])], seed, setting, "pair")
