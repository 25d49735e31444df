"""A table made ready for fitting: nuisances, scales, and the prediction of its rows.

Every model, the base too, carries the same nuisances: the inputs' tolerances (radius, zone, hole
distance, camera scale, and the gain of gauges such as that of torque), and a zero offset per run
of the displacement. All are Gaussian with known standard deviations, as unit normal numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tsvision.diagnosis.observations import Table
from tsvision.diagnosis.simulate import ONE, check_questionable, observe, run_stages, start_state
from tsvision.mechanisms.shelf import Parameter, Simulation
from tsvision.mechanisms.state import Reference

OFFSET_SD_MM = 0.1
ZEROED = 0.5  # how often a lab's readings begin at 0 where the formula does not
LEGS_SD = 0.1  # relative: no separator leads the strings quite straight to where they meet
TAIL = 4.0
WANDER_NODES = 5
RUN_GAIN = "run gain "  # begins the names of nuisances that are one run's own
# Nothing is read better than this; keeps noise-free (simulated) data from infinite certainty.
LEAST_NOISE = {
    "displacement_mm": 0.02,
    "diameter_mm": 0.001,
    "helix_angle_deg": 0.05,
    "hole_distance_mm": 0.005,
    "twist_turns": 0.01,
    "pitch_mm": 0.003,
    "turns_seen": 0.05,
    "torque_Nmm": 0.02,
}

# What such readings are usually good to: the centre of a wide prior (a factor e either way) that
# keeps a handful of rows from calling a gross misfit noise. Stated value_sd replace it.
USUAL_NOISE = {
    "displacement_mm": 0.15,
    "diameter_mm": 0.01,
    "helix_angle_deg": 0.4,
    "hole_distance_mm": 0.03,
    "twist_turns": 0.1,
    "pitch_mm": 0.02,
    "turns_seen": 0.5,
    "torque_Nmm": 0.15,
}
USUAL_SD = 1.0  # of the log of (noise / usual noise)
STATED_SD = 0.4  # of the log of (noise / stated value_sd)


@dataclass(frozen=True)
class Chain:
    """How rows follow each other, arrays (n,): `before` the row before (0 for a `first` one),
    `follows` 1 where there is one, `ratio` of the rows' relative noise: a row's own also weighs its
    predecessor, so that value_sd may vary along a run."""

    first: np.ndarray
    follows: np.ndarray
    before: np.ndarray
    ratio: np.ndarray


@dataclass(frozen=True)
class Problem:
    """What all fits to one table share. `columns` names the nuisances in their order."""

    table: Table
    reference: Reference
    radius_group: np.ndarray
    zone_group: np.ndarray
    hole_group: np.ndarray
    columns: tuple[str, ...]
    offsets: np.ndarray  # (n, R), mm per unit normal number
    row_scale: np.ndarray  # (n,), relative noise of the rows within an observable
    noise_usual: np.ndarray  # (K,), value_sd's mean where every row has one, else USUAL_NOISE
    noise_sd: np.ndarray  # (K,), how surely, as standard deviation of the log
    tail: float  # degrees of freedom of the Student-t noise
    wander: np.ndarray  # (n, W), relative change of the rows per unit normal number
    base: str = "constant_radius"
    rho_mean: np.ndarray = field(default_factory=lambda: np.zeros(0))
    rho_sd: np.ndarray = field(default_factory=lambda: np.zeros(0))
    rho_tested: bool = False  # whether the rows told of the correlation at all

    @property
    def nuisances(self) -> int:
        return len(self.columns)

    @cached_property
    def chain(self) -> Chain:
        """How the rows follow each other within runs."""
        first = self.table.before < 0
        before = np.where(first, 0, self.table.before)
        return Chain(first, 1.0 - first, before, self.row_scale / self.row_scale[before])

    @cached_property
    def _rows_of(self) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """Each observable with its rows and their conditions."""
        table = self.table
        rows = [np.flatnonzero(table.observable == k) for k in range(len(table.observables))]
        return [(n, r, table.condition[r]) for n, r in zip(table.observables, rows, strict=True)]

    @cached_property
    def _inputs(self) -> list[np.ndarray]:
        """Where the nuisances of radius, zone and hole distance stand."""
        return [
            np.flatnonzero([c.startswith(kind) for c in self.columns])
            for kind in ("radius", "zone", "hole")
        ]

    def predict(self, simulation: Simulation, u: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Rows (B, n) for mechanism parameters u (B, P) in prior units and nuisances z (B, Z)."""
        values = {
            key: to_value(p, u[:, i : i + 1], self.reference)
            for i, (key, p) in enumerate(parameters(simulation))
        }
        return self.predict_values(simulation, values, z)

    def predict_values(
        self, simulation: Simulation, values: dict[str, np.ndarray], z: np.ndarray
    ) -> np.ndarray:
        """Rows (B, n) for parameters in their own units, each (B, 1)."""
        table = self.table
        state = run_stages(self.state(z), simulation, values)
        many = max(len(z), 1)
        seen = np.empty((many, table.rows))
        for name, rows, condition in self._rows_of:
            found = observe(state, name)
            found = np.broadcast_to(found, (many, len(table.at.turns)))[:, condition]
            if f"gain {name}" in self.columns:
                gain = z[:, self.columns.index(f"gain {name}")][:, None]
                found = found * (1.0 + table.gain_sd[name] * gain)
            seen[:, rows] = found
        if self.wander.shape[1]:
            seen = seen * (1.0 + z[:, -self.wander.shape[1] :] @ self.wander.T)
        return seen

    def state(self, z: np.ndarray):
        """The start state with the inputs moved by their tolerances, z (B, Z)."""
        at, table = self.table.at, self.table
        radii, zones, holes = self._inputs
        camera = ONE
        if "camera" in self.columns:
            camera = 1.0 + table.camera_sd * z[:, self.columns.index("camera")][:, None]
        legs = ONE
        if "legs" in self.columns:
            legs = 1.0 + LEGS_SD * z[:, self.columns.index("legs")][:, None]
        return start_state(
            at,
            self.reference,
            radius_mm=_moved(at.radius_mm, table.radius_sd_mm, z[:, radii], self.radius_group),
            zone_mm=_moved(at.twisting_zone_mm, table.zone_sd_mm, z[:, zones], self.zone_group),
            hole_mm=_moved(at.hole_distance_mm, table.hole_sd_mm, z[:, holes], self.hole_group),
            camera=camera,
            legs=legs,
        )


def _moved(mean: np.ndarray, sd: np.ndarray, z: np.ndarray, group: np.ndarray) -> np.ndarray:
    """An input moved by its tolerance, (B, m); (B, 1) where there is but one of it."""
    if not group.any():
        return mean[:1] + sd[:1] * z[:, :1]
    return mean + sd * z[:, group]


def prepare(table: Table, base: str = "constant_radius") -> Problem:
    """Group the inputs (one tolerance per distinct part) and lay out the nuisances.

    InputError where `base` is no model that can be questioned.
    """
    check_questionable(base)
    at = table.at
    used = np.unique(table.condition)
    radius_group = _groups(at.radius_mm, at.strings, table.radius_sd_mm)
    zone_group = _groups(at.twisting_zone_mm, table.zone_sd_mm)
    hole_group = _groups(at.hole_distance_mm, table.hole_sd_mm)
    columns = [f"radius{g}" for g in range(radius_group.max() + 1)]
    columns += [f"zone{g}" for g in range(zone_group.max() + 1)]
    columns += [f"hole{g}" for g in range(hole_group.max() + 1)]
    if {"diameter_mm", "hole_distance_mm", "pitch_mm", "turns_seen"} & set(table.observables):
        columns.append("camera")
    if "pitch_mm" in table.observables:
        columns.append("legs")
    columns += [f"gain {name}" for name in table.gain_sd]
    moves = _wander(table)
    columns += moves
    wander = np.array(list(moves.values())).reshape(len(moves), table.rows).T
    scale, usual, sure = _row_scale(table)
    return Problem(
        table=table,
        reference=Reference.of(at.take(used)),
        radius_group=radius_group,
        zone_group=zone_group,
        hole_group=hole_group,
        columns=tuple(columns),
        offsets=_offsets(table),
        wander=wander,
        row_scale=scale,
        noise_usual=usual,
        noise_sd=sure,
        tail=_tail(table.rows),
        base=base,
        rho_mean=np.zeros(len(table.observables)),
        rho_sd=np.full(len(table.observables), 0.3),
    )


def _tail(rows: int) -> float:
    """4 for a long table; more for a short one, which holds hardly an outlier and could not tell
    one from a reading that matters."""
    return TAIL * (1.0 + 6.0 * (12.0 / rows) ** 2)


def _groups(*columns: np.ndarray) -> np.ndarray:
    """Index of the distinct combination that each condition belongs to."""
    joined = np.round(np.column_stack(columns), 9)
    return np.unique(joined, axis=0, return_inverse=True)[1].reshape(-1)


def _offsets(table: Table) -> np.ndarray:
    """A column per run that has displacements, and a common one: x(0) of the formula is not 0,
    but a lab often zeroes the reading at 0 turns.

    Then all of x(0) is missing, else none of it: the column has the root mean square of that. A
    wider one would take up what a wrong S or L does to the displacement.
    """
    if "displacement_mm" not in table.observables:
        return np.zeros((table.rows, 0))
    moved = table.observable == table.observables.index("displacement_mm")
    at = table.at
    zeroing = np.hypot(at.twisting_zone_mm, at.hole_distance_mm / 2) - at.twisting_zone_mm
    runs = [r for r in range(len(table.runs)) if np.any(moved & (table.run == r))]
    own = [np.where(moved & (table.run == r), OFFSET_SD_MM, 0.0) for r in runs]
    common = np.sqrt(ZEROED) * zeroing[table.condition]
    return np.column_stack([*own, np.where(moved, common, 0.0)])


def _wander(table: Table) -> dict[str, np.ndarray]:
    """What moves rows beside noise and an instrument's common gain, relative to the value (n,).

    Hat functions of turns, alike in all runs, in units of half of `drifts` (more where value_sd
    is more), then a gain of each run's own.
    """
    turns = table.at.turns[table.condition]
    scale = _row_scale(table)[0]
    columns: dict[str, np.ndarray] = {}
    for name, size in table.drifts.items():
        rows = table.observable == table.observables.index(name)
        nodes = np.unique(np.quantile(np.unique(turns[rows]), np.linspace(0.0, 1.0, WANDER_NODES)))
        if len(nodes) < 2:
            continue
        share = np.where(rows, 0.5 * size * scale, 0.0) / np.where(rows, table.value, 1.0)
        for i, unit in enumerate(np.eye(len(nodes))):
            columns[f"wander {name} {i}"] = share * np.interp(turns, nodes, unit)
    if len(table.runs) > 1:
        for name, sd in table.run_gain_sd.items():
            rows = table.observable == table.observables.index(name)
            for r, run in enumerate(table.runs):
                columns[f"{RUN_GAIN}{name} {run}"] = np.where(rows & (table.run == r), sd, 0.0)
    return columns


def _row_scale(table: Table) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    scale = np.ones(table.rows)
    usual = np.array([USUAL_NOISE[name] for name in table.observables])
    sure = np.full(len(usual), USUAL_SD)
    for k in range(len(usual)):
        rows = table.observable == k
        sd = table.value_sd[rows]
        if rows.any() and np.all(np.isfinite(sd)):
            usual[k], sure[k] = np.exp(np.mean(np.log(sd))), STATED_SD
            scale[rows] = sd / usual[k]
    return scale, usual, sure


# ------------------------------------------------------------------ parameters in prior units


def parameters(simulation: Simulation) -> Iterator[tuple[str, Parameter]]:
    """(key, parameter) of every part, in the order of the parameter vector."""
    for part in simulation.parts:
        for parameter in part.shape.parameters:
            yield part.key(parameter.name), parameter


def to_value(p: Parameter, u: np.ndarray, reference: Reference) -> np.ndarray:
    """Prior units to the parameter's own unit: normal about 0, or a share of the range."""
    size = getattr(reference, p.of)
    if p.prior == "normal":
        return u * (p.typical * size)
    if p.prior == "uniform":
        return (p.low + u * (p.high - p.low)) * size
    return p.low * size * (p.high / p.low) ** u


def from_value(p: Parameter, value: float, reference: Reference) -> float:
    """Inverse of `to_value`."""
    size = getattr(reference, p.of)
    if p.prior == "normal":
        return value / (p.typical * size)
    if p.prior == "uniform":
        return (value / size - p.low) / (p.high - p.low)
    return float(np.log(value / (p.low * size)) / np.log(p.high / p.low))


def bounds(p: Parameter) -> tuple[float, float]:
    """The bounds in prior units."""
    if p.prior == "normal":
        return p.low / p.typical, p.high / p.typical
    return 0.0, 1.0
