"""The extended model as a model: predict and invert with the causes that a verdict names."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tsvision.diagnosis.simulate import ONE, check_questionable, run_stages, start_state
from tsvision.errors import InputError
from tsvision.mechanisms import MECHANISMS, Conditions, Simulation
from tsvision.mechanisms.state import NOMINAL, Reference
from tsvision.records import NAN

NEEDED = ("twisting_zone_mm", "hole_distance_mm", "radius_mm")
KEYWORDS = (*NOMINAL, "time_s", "unwinding", "peak_turns")
GRID = 4001  # turns at which the displacement is worked out for its inverse
BEYOND = 1.25  # the inverse looks so far past the largest turns of the data


@dataclass(frozen=True)
class Shift:
    """How far the fit moved the inputs of one bundle within their tolerances."""

    strings: float
    radius_mm: float
    radius_share: float
    zone_change_mm: float
    hole_change_mm: float


@dataclass(frozen=True)
class ExtendedModel:
    """A base model with the parts of a verdict; it has a `DisplacementModel`'s face.

    Keywords that are not given come from the data of the verdict (`nominal`), where all of it had
    the same; the inputs' shifts within their tolerances, as fitted, are added to them: those of the
    data's bundle of that N and nearest radius, else the mean. Winding at time 0 unless told
    otherwise.
    """

    name: str
    simulation: Simulation
    values: Mapping[str, np.ndarray]
    reference: Reference
    nominal: Mapping[str, float]
    shifts: tuple[Shift, ...]
    zeroed_share: float
    title: str = "Extended model"
    parameters: tuple[str, ...] = field(default=NEEDED)
    separator: bool = True  # as all models that can be questioned

    def geometry(self, known: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
        """This model's keywords: those that are known, the others from the verdict.

        InputError where one is needed of which the data had several.
        """
        given = {name: known[name] for name in KEYWORDS if name in known}
        common = {k: v for k, v in self.nominal.items() if k in KEYWORDS and v == v}
        lacking = [name for name in self.parameters if name not in {**common, **given}]
        if lacking:
            raise InputError(
                f"the data of model '{self.name}' had several {', '.join(lacking)}; say which"
            )
        return {**common, **given}

    def displacement_mm(self, turns: ArrayLike, **geometry: ArrayLike) -> np.ndarray:
        """x in mm; `turns` broadcasts against every keyword. InputError where it depends on what
        is not known."""
        known = self.geometry(geometry)
        n, *columns = np.broadcast_arrays(
            np.abs(np.asarray(turns, dtype=float)),
            *(np.asarray(known.get(k, self._default(k)), dtype=float) for k in KEYWORDS),
        )
        at = self._conditions(n.ravel(), dict(zip(KEYWORDS, map(np.ravel, columns), strict=True)))
        share, zone, hole = self._moved(at)
        state = start_state(
            at,
            self.reference,
            radius_mm=at.radius_mm[None] * (1.0 + share),
            zone_mm=at.twisting_zone_mm[None] + zone,
            hole_mm=at.hole_distance_mm[None] + hole,
            camera=ONE,
        )
        at_rest = np.hypot(at.twisting_zone_mm, at.hole_distance_mm / 2) - at.twisting_zone_mm
        drawn = run_stages(state, self.simulation, self.values).displacement_mm
        x = np.broadcast_to(drawn + self.zeroed_share * at_rest, (1, n.size))[0].reshape(n.shape)
        open_ones = [name for name in ("strings", "load_N") if np.isnan(known.get(name, NAN)).any()]
        if open_ones and np.isnan(x[np.isfinite(n)]).any():
            raise InputError(
                f"model '{self.name}' depends on {' and '.join(open_ones)}, of which its data had "
                "several or none; say which"
            )
        return x.copy()

    def _moved(self, at: Conditions) -> np.ndarray:
        """The shifts that hold for each condition, (3, m): radius's share, zone, hole distance."""
        known = [(s.radius_share, s.zone_change_mm, s.hole_change_mm) for s in self.shifts]
        same = at.strings[:, None] == np.array([s.strings for s in self.shifts])
        radii = np.array([s.radius_mm for s in self.shifts])
        away = np.where(same, np.abs(np.log(at.radius_mm[:, None] / radii)), np.inf)
        counts = (away <= away.min(axis=1, keepdims=True) + 1e-9).astype(float)
        return (counts @ np.array(known) / counts.sum(axis=1, keepdims=True)).T

    def slope_mm_per_turn(self, turns: ArrayLike, **geometry: ArrayLike) -> np.ndarray:
        """Central difference of x over a thousandth of a turn."""
        n = np.asarray(turns, dtype=float)
        step = 1e-3
        low = np.maximum(np.abs(n) - step, 0.0)
        high = np.abs(n) + step
        rise = self.displacement_mm(high, **geometry) - self.displacement_mm(low, **geometry)
        return np.where(n < 0, -1.0, 1.0) * rise / (high - low)

    def turns_for_displacement(
        self, displacement_mm: ArrayLike, **geometry: ArrayLike
    ) -> np.ndarray:
        """The first turn count that gives x, NaN where the model does not get there. Scalars only
        as keywords: the inverse is read off one curve."""
        grid = np.linspace(0.0, BEYOND * self.reference.span_turns, GRID)
        x = self.displacement_mm(grid, **geometry)
        reached = np.maximum.accumulate(x)
        wanted = np.asarray(displacement_mm, dtype=float)
        keep = np.concatenate([[True], np.diff(reached) > 0])
        found = np.interp(wanted, reached[keep], grid[keep])
        return np.where((wanted >= x[0] - 1e-9) & (wanted <= reached[-1]), found, np.nan)

    def _default(self, keyword: str) -> float:
        return {"time_s": 0.0, "unwinding": 0.0}.get(keyword, NAN)

    def _conditions(self, turns: np.ndarray, known: dict[str, np.ndarray]) -> Conditions:
        peak = known["peak_turns"]
        return Conditions(
            turns=turns,
            load_N=known["load_N"],
            strings=known["strings"],
            string_diameter_mm=known["string_diameter_mm"],
            twisting_zone_mm=known["twisting_zone_mm"],
            hole_distance_mm=known["hole_distance_mm"],
            radius_mm=known["radius_mm"],
            unwinding=known["unwinding"] > 0,
            peak_turns=np.where(np.isnan(peak), turns.max(initial=0.0), peak),
            time_s=known["time_s"],
            cycle=np.ones_like(turns),
            run=np.zeros(len(turns), dtype=int),
        )


def load_model(path: Path) -> ExtendedModel:
    """The extended model of a verdict's JSON; InputError when the file holds none."""
    try:
        answer = json.loads(Path(path).read_text(encoding="utf-8"))
        model = answer["model"]
    except (OSError, ValueError) as problem:
        raise InputError(f"cannot read a verdict from '{path}' ({problem})") from problem
    except (KeyError, TypeError):
        raise InputError(f"'{path}' is no verdict: write one with diagnose --json") from None
    return build_model(model, str(path))


def build_model(model: Mapping[str, Any], where: str = "the verdict") -> ExtendedModel:
    """From the `model` of a verdict's JSON."""
    check_questionable(model["base"])
    simulation = Simulation(base=model["base"])
    values: dict[str, np.ndarray] = {}
    try:
        for part in model["parts"]:
            mechanism = MECHANISMS[part["mechanism"]]
            simulation = mechanism.extend(simulation, part["shape"])
            for name, value in part["values"].items():
                values[f"{mechanism.name}.{name}"] = np.full((1, 1), float(value))
    except (KeyError, TypeError) as problem:
        raise InputError(f"{where} names an unknown part ({problem}); diagnose anew") from problem
    numbers = {k: float("nan") if v is None else float(v) for k, v in model["reference"].items()}
    return ExtendedModel(
        name="+".join((simulation.base, *simulation.names)),
        simulation=simulation,
        values=values,
        reference=Reference(**numbers),
        nominal={k: float("nan") if v is None else float(v) for k, v in model["nominal"].items()},
        shifts=tuple(Shift(**{k: float(v) for k, v in s.items()}) for s in model["shifts"]),
        zeroed_share=float(model["zeroed_share"]),
    )
