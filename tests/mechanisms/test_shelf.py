"""The contract of every mechanism: units, bounds, null value, shapes, composition."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from tsvision.diagnosis.simulate import observe, run_stages, start_state
from tsvision.mechanisms import MECHANISMS, Conditions, Mechanism, Shape, Simulation
from tsvision.mechanisms.shelf import OBSERVABLES, STAGES
from tsvision.mechanisms.state import Reference
from tsvision.models import variable_radius

NAMED = {
    "radius_bias",
    "angle_scale",
    "hole_distance",
    "zone_length",
    "lost_turns",
    "axial_stretch",
    "radial_compression",
    "backlash",
    "creep",
    "radius_step",
    "knot_absorption",
    "camera_scale",
    "coiling",
}
EVERY = [(m, s) for m in MECHANISMS.values() for s in m.shapes]
IDS = [f"{m.name}-{s.name}" for m, s in EVERY]


def conditions() -> Conditions:
    """Two loads, winding and unwinding, 25 readings each."""
    way = np.concatenate([np.linspace(0, 48, 13), np.linspace(44, 0, 12)])
    n = 2 * len(way)
    return Conditions(
        turns=np.tile(way, 2),
        load_N=np.repeat([10.0, 40.0], len(way)),
        strings=np.full(n, 2.0),
        string_diameter_mm=np.full(n, 0.24),
        twisting_zone_mm=np.full(n, 23.2),
        hole_distance_mm=np.full(n, 5.0),
        radius_mm=np.full(n, 0.235),
        unwinding=np.tile(np.arange(len(way)) >= 13, 2),
        peak_turns=np.full(n, 48.0),
        time_s=np.tile(np.arange(len(way)) * 7.0, 2),
        cycle=np.ones(n),
        run=np.repeat([0, 1], len(way)),
    )


def values(mechanism: Mechanism, shape: Shape, share: float | None) -> dict[str, np.ndarray]:
    """Mid-range values, or with the size at its null (share None)."""
    reference = Reference.of(conditions())
    found = {}
    for p in shape.parameters:
        size = getattr(reference, p.of)
        if share is None and p.null is not None:
            value = p.null
        elif p.prior == "normal":
            value = (share or 0.5) * p.typical
        else:
            value = p.low + 0.4 * (p.high - p.low)
        found[f"{mechanism.name}.{p.name}"] = np.full((1, 1), value * size)
    return found


def outcome(simulation: Simulation, numbers: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    at = conditions()
    state = run_stages(start_state(at, Reference.of(at)), simulation, numbers)
    shape = (1, len(at.turns))
    return {n: np.broadcast_to(observe(state, n), shape)[0] for n in OBSERVABLES}


def test_the_mechanisms_of_the_interface_are_on_the_shelf() -> None:
    assert set(MECHANISMS) >= NAMED
    assert all(name == mechanism.name for name, mechanism in MECHANISMS.items())


@pytest.mark.parametrize(("mechanism", "shape"), EVERY, ids=IDS)
def test_parameters_have_units_bounds_and_starts(mechanism: Mechanism, shape: Shape) -> None:
    assert mechanism.claim and mechanism.source and shape.equation
    assert set(shape.effects) <= set(STAGES)
    assert set(mechanism.touches) <= set(OBSERVABLES)
    for p in shape.parameters:
        assert p.unit and p.meaning
        assert p.low < p.high
        for start in p.starts:
            value = start * p.typical if p.prior == "normal" else p.low + start * (p.high - p.low)
            assert p.low <= value <= p.high


@pytest.mark.parametrize(("mechanism", "shape"), EVERY, ids=IDS)
def test_only_what_it_touches_moves(mechanism: Mechanism, shape: Shape) -> None:
    plain = outcome(Simulation(), {})
    moved = outcome(mechanism.extend(Simulation(), shape.name), values(mechanism, shape, 1.0))
    for name, seen in moved.items():
        assert seen.shape == plain[name].shape
        assert np.all(np.isfinite(seen))
        changed = not np.allclose(seen, plain[name], rtol=1e-9, atol=1e-9)
        assert changed <= (name in mechanism.touches), name
    assert any(not np.allclose(moved[name], plain[name]) for name in mechanism.touches)


SIZED = [(m, s) for m, s in EVERY if s.parameters[0].null is not None]


@pytest.mark.parametrize(
    ("mechanism", "shape"), SIZED, ids=[f"{m.name}-{s.name}" for m, s in SIZED]
)
def test_at_its_null_it_is_the_base_model(mechanism: Mechanism, shape: Shape) -> None:
    plain = outcome(Simulation(), {})
    null = outcome(mechanism.extend(Simulation(), shape.name), values(mechanism, shape, None))
    for name in OBSERVABLES:
        np.testing.assert_allclose(null[name], plain[name], rtol=1e-9, atol=1e-9)


def test_coiling_from_the_last_turn_on_is_the_base_model() -> None:
    coiling = MECHANISMS["coiling"]
    numbers = {"coiling.onset_turns": np.full((1, 1), 48.0)}
    moved = outcome(coiling.extend(Simulation(), "locked_slope"), numbers)
    plain = outcome(Simulation(), {})
    np.testing.assert_allclose(moved["displacement_mm"], plain["displacement_mm"], atol=1e-9)


def test_the_order_in_which_mechanisms_are_added_does_not_matter() -> None:
    for a, b in itertools.combinations(MECHANISMS.values(), 2):
        numbers = values(a, a.shapes[0], 1.0) | values(b, b.shapes[0], 1.0)
        one = outcome(b.extend(a.extend(Simulation())), numbers)
        other = outcome(a.extend(b.extend(Simulation())), numbers)
        for name in OBSERVABLES:
            np.testing.assert_allclose(one[name], other[name], rtol=1e-12, atol=1e-12)


def test_extend_leaves_the_simulation_as_it_was() -> None:
    plain = Simulation()
    longer = MECHANISMS["creep"].extend(plain)
    assert plain.parts == () and longer.names == ("creep",)


def test_an_unknown_shape_names_those_that_exist() -> None:
    with pytest.raises(KeyError, match="shift"):
        MECHANISMS["zone_length"].extend(Simulation(), "no such shape")


def test_composes_with_another_base_model() -> None:
    base = outcome(Simulation(base="variable_radius"), {})
    mechanism = MECHANISMS["lost_turns"]
    numbers = values(mechanism, mechanism.shapes[0], 1.0)
    moved = outcome(mechanism.extend(Simulation(base="variable_radius")), numbers)
    assert np.all(moved["displacement_mm"] <= base["displacement_mm"] + 1e-9)


def test_the_variable_radius_shows_in_all_that_is_observed() -> None:
    """Eq. (3) of the paper: the radius that draws is the one that D, β and the torque show."""
    at = conditions()
    geometry = {"twisting_zone_mm": 23.2, "hole_distance_mm": 5.0, "radius_mm": 0.235}
    x = variable_radius.displacement_mm(at.turns, **geometry)
    radius = 0.235 * np.sqrt((23.2 + x) / 23.2)
    slope = variable_radius.slope_mm_per_turn(at.turns, **geometry) / (2 * np.pi)
    lay = 2 * np.pi * at.turns * radius / 23.2
    half = {"variable_radius.exponent": np.full((1, 1), 0.5)}
    mechanism = MECHANISMS["variable_radius"].extend(Simulation())
    for seen in (outcome(Simulation(base="variable_radius"), {}), outcome(mechanism, half)):
        np.testing.assert_allclose(seen["displacement_mm"], x, rtol=1e-9)
        np.testing.assert_allclose(seen["diameter_mm"], 2 * radius, rtol=1e-9)
        np.testing.assert_allclose(seen["helix_angle_deg"], np.degrees(np.arctan(lay)), rtol=1e-9)
        np.testing.assert_allclose(seen["torque_Nmm"], at.load_N * slope, rtol=1e-9)


@pytest.mark.parametrize("exponent", [0.0, 0.2, 0.5])
def test_a_thick_bundle_of_many_turns_swells_as_its_law_says(exponent: float) -> None:
    at = replace(conditions(), radius_mm=np.full(50, 1.5), turns=np.linspace(0, 90, 50))
    numbers = {"variable_radius.exponent": np.full((1, 1), exponent)}
    simulation = MECHANISMS["variable_radius"].extend(Simulation())
    state = run_stages(start_state(at, Reference.of(at)), simulation, numbers)
    grown = (23.2 + state.displacement_mm) / 23.2
    np.testing.assert_allclose(state.radius_mm, 1.5 * grown**exponent, rtol=1e-9)


def test_compression_by_hand() -> None:
    """Without turns T = F/N, so r = r0 (40/10)^-k at the higher of the two loads."""
    numbers = {"radial_compression.exponent": np.full((1, 1), 0.1)}
    seen = outcome(MECHANISMS["radial_compression"].extend(Simulation()), numbers)["diameter_mm"]
    at = conditions()
    still = (at.turns == 0) & (at.load_N == 40.0)
    np.testing.assert_allclose(seen[still], 0.47 * 4.0**-0.1, rtol=1e-12)


def test_stretch_by_hand() -> None:
    """Untwisted: strain 1/EA · F/N on the way √(L² + S²/4)."""
    numbers = {"axial_stretch.compliance_1_N": np.full((1, 1), 1e-3)}
    plain = outcome(Simulation(), {})["displacement_mm"]
    seen = outcome(MECHANISMS["axial_stretch"].extend(Simulation()), numbers)["displacement_mm"]
    way = np.hypot(23.2, 2.5)
    np.testing.assert_allclose((plain - seen)[0], 1e-3 * 5.0 * way, rtol=1e-9)


def test_pitch_by_hand() -> None:
    """A leg from a hole S/2 off the axis meets the helix at its lay, tan = 2π a/p; it turns by a
    quarter, and the rest of the zone holds the other turns at the pitch p."""
    at = conditions()
    centre, pitch = 0.5 * 0.235, outcome(Simulation(), {})["pitch_mm"]
    apex = 2.5 / (2 * np.pi * centre / pitch)
    np.testing.assert_allclose(0.25 + (23.2 - apex) / pitch, at.turns, atol=1e-9)
