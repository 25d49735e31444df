"""Run a simulation (base model and parts) under given conditions, many parameter sets at once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from tsvision.errors import InputError
from tsvision.mechanisms.shelf import STAGES, Simulation
from tsvision.mechanisms.state import Conditions, Reference, State
from tsvision.mechanisms.variable_radius import swelling
from tsvision.models import SECTIONS, constant_radius
from tsvision.models.choose import choose_model
from tsvision.units import RAD_PER_TURN

# Models that can be questioned. All draw by the constant-radius law, whose zone, radius and holes
# are what causes act on; what sets them apart is done to the state (`run_stages`).
QUESTIONABLE = ("constant_radius", "variable_radius", "separator_no_offset")
PAPERS_EXPONENT = {"exponent": np.full((1, 1), 0.5)}  # eq. (3): r = r₀ √((L + x)/L)

ONE = np.ones((1, 1))
ZERO = np.zeros((1, 1))


def check_questionable(base: str) -> None:
    """InputError where causes could not act on that model, or where there is none of the name."""
    if base not in QUESTIONABLE:
        raise InputError(
            f"model '{choose_model(base).name}' cannot be questioned, for it lacks what causes act "
            f"on (zone, radius, holes); choose one of {', '.join(QUESTIONABLE)}"
        )


def start_state(
    at: Conditions,
    reference: Reference,
    radius_mm: np.ndarray | None = None,
    zone_mm: np.ndarray | None = None,
    hole_mm: np.ndarray | None = None,
    camera: np.ndarray = ONE,
    legs: np.ndarray = ONE,
) -> State:
    """The actuator as stated, before any mechanism; arrays broadcast to (B, m)."""
    return State(
        at=at,
        reference=reference,
        alpha_rad=at.turns[None, :] * RAD_PER_TURN,
        reached_rad=at.turns[None, :] * RAD_PER_TURN,
        radius_mm=at.radius_mm[None, :] if radius_mm is None else radius_mm,
        zone_mm=at.twisting_zone_mm[None, :] if zone_mm is None else zone_mm,
        hole_mm=at.hole_distance_mm[None, :] if hole_mm is None else hole_mm,
        displacement_mm=ZERO,
        camera=camera,
        torque_extra_Nmm=ZERO,
        coiled_rad=ZERO,
        legs=legs,
    )


def run_stages(state: State, simulation: Simulation, values: Mapping[str, np.ndarray]) -> State:
    """Apply every part at its stage and the base model between; returns the final state.

    Within a stage parts act in alphabetical order, so that nothing depends on which came first.
    """
    if simulation.base == "separator_no_offset":
        # What was stated of S is left out; its tolerance stays, and so does what is wrong with it.
        state = _changed(state, {"hole_mm": state.hole_mm - state.at.hole_distance_mm[None, :]})
    scoped = [
        (part, {p.name: values[part.key(p.name)] for p in part.shape.parameters})
        for part in sorted(simulation.parts, key=lambda part: part.mechanism)
    ]
    for stage in STAGES:
        if stage == "draw":
            if simulation.base == "variable_radius":
                # The radius that the law draws by is the one that all else shows, D and β too.
                state = _changed(state, swelling(state, PAPERS_EXPONENT))
            state = _changed(state, {"displacement_mm": _law(state, "displacement_mm")})
        for part, own in scoped:
            effect = part.shape.effects.get(stage)
            if effect is not None:
                state = _changed(state, effect(state, own))
        if stage == "motor":
            state = _changed(state, {"reached_rad": state.alpha_rad})
    return state


def _changed(state: State, fields: Mapping[str, np.ndarray]) -> State:
    """`dataclasses.replace` without its checks; this is the innermost loop."""
    new = object.__new__(State)
    new.__dict__.update(state.__dict__)
    new.__dict__.update(fields)
    return new


def _law(state: State, what: str) -> np.ndarray:
    return getattr(constant_radius, what)(
        state.alpha_rad / RAD_PER_TURN,
        twisting_zone_mm=state.zone_mm,
        hole_distance_mm=state.hole_mm,
        radius_mm=state.radius_mm,
    )


def observe(state: State, observable: str) -> np.ndarray:
    """One observable of a final state, shape (B, m), in its own unit."""
    if observable == "displacement_mm":
        return state.displacement_mm
    if observable == "diameter_mm":
        return 2.0 * state.radius_mm * state.camera
    if observable == "helix_angle_deg":
        return np.degrees(np.arctan2(state.alpha_rad * state.radius_mm, state.zone_mm))
    if observable == "hole_distance_mm":
        return state.hole_mm * state.camera
    if observable == "twist_turns":
        return state.alpha_rad / RAD_PER_TURN
    if observable == "pitch_mm":
        return _pitch_mm(state) * state.camera
    if observable == "turns_seen":
        return _turns_seen(state)
    if observable == "torque_Nmm":
        slope = _law(state, "slope_mm_per_turn") / RAD_PER_TURN
        return state.at.load_N * slope + state.torque_extra_Nmm
    raise KeyError(f"no observable '{observable}'")


def _turns_seen(state: State) -> np.ndarray:
    """Turns of strands, coils and knots in a picture. The zone is taken to end the stated L from
    the holes by the camera's scale: what is wrong with either adds turns or cuts them off."""
    shown = state.at.twisting_zone_mm[None, :] / (state.zone_mm * state.camera)
    return state.reached_rad / RAD_PER_TURN * shown


def _pitch_mm(state: State) -> np.ndarray:
    """The pitch beside the separator. The strands run straight from their holes, S/2 away, to the
    apex, where they touch the bundle (centre radius a) at its lay: S p/(4π a) of the zone holds no
    bundle, and they turn by a quarter on the way. So n = 1/4 + (L − S p/(4π a))/p."""
    centre = state.radius_mm * centre_share(state.at.strings)
    way = state.hole_mm / (2.0 * RAD_PER_TURN * centre) - 0.25
    laid = state.alpha_rad / RAD_PER_TURN
    return state.zone_mm / np.maximum(laid + np.maximum(way, 0.05) * state.legs, 0.05)


def centre_share(strings: np.ndarray) -> np.ndarray:
    """Mean distance of the strand centres from the axis over the bundle's radius, by N (m,)."""
    counts, which = np.unique(strings, return_inverse=True)
    return np.array([_centre_share(int(n)) for n in counts])[which.reshape(-1)]


@cache
def _centre_share(count: int) -> float:
    if count < 2:
        return 1.0
    section = SECTIONS["pair_core" if count <= 10 else "ring"]
    assert section.centres is not None
    away = np.hypot(*np.asarray(section.centres(count)).T)
    return float(2.0 * away.mean() / section.bundle_diameter_mm(count, 1.0))
