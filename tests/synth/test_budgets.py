"""Both budgets close: turns by an independent Gauss integral, string length by a spline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numba import njit
from scipy.interpolate import CubicSpline

from synth.actuator import state_at
from synth.build import make_settings
from synth.camera import place
from synth.laying import leg_angle_rad
from synth.settings import PAPER_ONSET_TURNS, Actuator, Hidden, Settings, Strings
from synth.state import State
from synth.strands import StrandPath, arc_length_mm, strand_paths
from synth.truth import frame_truth

FAR_MM = 2.0  # between segments of 0.09 mm: the integrand at their middles is exact to 2e-4 turns


@njit(cache=True)
def _gauss(a, b, far_mm):
    """Sum over segment pairs of the signed solid angle (Klenin and Langowski 2000) / 4 pi.

    Short segments farther apart than `far_mm` count by the integrand at their middles."""
    total = 0.0
    n = np.empty((4, 3))
    c = np.empty((4, 3))
    for i in range(len(a) - 1):
        for j in range(len(b) - 1):
            if 0 < i < len(a) - 2 and 0 < j < len(b) - 2:
                rx = 0.5 * (b[j, 0] + b[j + 1, 0] - a[i, 0] - a[i + 1, 0])
                ry = 0.5 * (b[j, 1] + b[j + 1, 1] - a[i, 1] - a[i + 1, 1])
                rz = 0.5 * (b[j, 2] + b[j + 1, 2] - a[i, 2] - a[i + 1, 2])
                square = rx * rx + ry * ry + rz * rz
                if square > far_mm * far_mm:
                    px, qx = b[j + 1, 0] - b[j, 0], a[i + 1, 0] - a[i, 0]
                    py, qy = b[j + 1, 1] - b[j, 1], a[i + 1, 1] - a[i, 1]
                    pz, qz = b[j + 1, 2] - b[j, 2], a[i + 1, 2] - a[i, 2]
                    volume = (
                        (py * qz - pz * qy) * rx
                        + (pz * qx - px * qz) * ry
                        + (px * qy - py * qx) * rz
                    )
                    total += volume / (square * np.sqrt(square))
                    continue
            for k in range(3):
                c[0, k] = b[j, k] - a[i, k]
                c[1, k] = b[j + 1, k] - a[i, k]
                c[2, k] = b[j + 1, k] - a[i + 1, k]
                c[3, k] = b[j, k] - a[i + 1, k]
            flat = False
            for k in range(4):
                m = (k + 1) % 4
                n[k, 0] = c[k, 1] * c[m, 2] - c[k, 2] * c[m, 1]
                n[k, 1] = c[k, 2] * c[m, 0] - c[k, 0] * c[m, 2]
                n[k, 2] = c[k, 0] * c[m, 1] - c[k, 1] * c[m, 0]
                size = np.sqrt(n[k, 0] ** 2 + n[k, 1] ** 2 + n[k, 2] ** 2)
                if size < 1e-14:
                    flat = True
                    break
                n[k] /= size
            if flat:
                continue
            area = 0.0
            for k in range(4):
                m = (k + 1) % 4
                dot = n[k, 0] * n[m, 0] + n[k, 1] * n[m, 1] + n[k, 2] * n[m, 2]
                area += np.arcsin(min(1.0, max(-1.0, dot)))
            p, q = b[j + 1] - b[j], a[i + 1] - a[i]
            sign = (
                (p[1] * q[2] - p[2] * q[1]) * c[0, 0]
                + (p[2] * q[0] - p[0] * q[2]) * c[0, 1]
                + (p[0] * q[1] - p[1] * q[0]) * c[0, 2]
            )
            total += area if sign > 0 else -area
    return total / (4.0 * np.pi)


def zone_points(path: StrandPath) -> np.ndarray:
    return path.points_mm[path.first : path.last + 1]


def coarser(points: np.ndarray, step_mm: float) -> np.ndarray:
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    marks = np.linspace(0.0, arc[-1], max(int(arc[-1] / step_mm), 2) + 1)
    return np.column_stack([np.interp(marks, arc, points[:, k]) for k in range(3)])


def lengthened(points: np.ndarray, far: float = 4000.0) -> np.ndarray:
    reach = np.array([far, 0.0, 0.0])
    return np.vstack([points[0] - reach, points, points[-1] + reach])


def winding_turns(a: StrandPath, b: StrandPath) -> float:
    """Turns of two strands about each other, right-handed positive; nothing of synth's sums."""
    first, second = (lengthened(coarser(zone_points(p), 0.09)) for p in (a, b))
    return float(_gauss(first, second, FAR_MM))


def end_turns(a: StrandPath, b: StrandPath) -> float:
    """Angle from the pair's direction at the holes to that at the connector, in turns mod 1."""
    start = zone_points(b)[0] - zone_points(a)[0]
    stop = zone_points(b)[-1] - zone_points(a)[-1]
    angle = np.arctan2(stop[2], stop[1]) - np.arctan2(start[2], start[1])
    return float(angle / (2.0 * np.pi))


def random_settings(random: np.random.Generator) -> Settings:
    count = int(random.choice([2, 4, 6, 8]))
    onset = PAPER_ONSET_TURNS[count]
    turns = float(random.uniform(0.0, 3.3) * onset)
    hidden = Hidden()
    if random.random() < 0.3:
        hidden = Hidden(slip=float(random.uniform(0, 0.05)), lost_turns=float(random.uniform(0, 1)))
    settings = make_settings(
        (0.0, turns),
        "clean",
        int(random.integers(1000)),
        None,
        Strings(count=count, handedness=str(random.choice(["Z", "S"]))),
        Actuator(
            holes=int(random.choice([2, 4, 6])),
            hole_distance_mm=float(random.uniform(4.0, 6.0)),
            twisting_zone_mm=float(random.uniform(18.0, 30.0)),
        ),
    )
    return replace(settings, hidden=hidden)


CASES = 200


@pytest.fixture(scope="module")
def states() -> list[tuple[Settings, State, list[StrandPath]]]:
    random = np.random.default_rng(41)
    out = []
    for _ in range(CASES):
        settings = random_settings(random)
        state = state_at(settings, 1)
        out.append((settings, state, strand_paths(settings, state)))
    return out


def test_turn_budget_closes_over_200_random_states(states) -> None:
    """Strand 0 and its antipode wind as often as the motor turned, less what was lost.

    Their direction in the holes of a many-stranded bundle depends on how they lie there, so the
    fraction of a turn comes from the ends and only the count of whole turns from the motor."""
    worst = 0.0
    for settings, state, paths in states:
        counted = state.sign * winding_turns(paths[0], paths[1])
        arrived = abs(state.motor_turns) - state.lost_turns
        part = state.sign * end_turns(paths[0], paths[1])
        expected = part + round(arrived - part)
        if settings.strings.count == 2:
            assert expected == pytest.approx(arrived, abs=1e-3)
        assert abs(counted - arrived) < 0.35
        worst = max(worst, abs(counted - expected))
    assert worst < 0.01  # 0.004 when written


def test_linked_turns_reported_add_up(states) -> None:
    for _, state, _ in states:
        arrived = abs(state.motor_turns) - state.lost_turns
        assert state.leg_turns + state.line.turns == pytest.approx(arrived, abs=1e-4)


def test_string_budget_closes_over_200_random_states(states) -> None:
    """Arc length by quadrature of a spline through every third point agrees with the truth's."""
    for settings, state, paths in states:
        view = place(settings.camera, state.zone_mm)
        row = frame_truth(settings, view, state, 1, paths).row
        lengths = [spline_length_mm(zone_points(path)) for path in paths]
        assert row["string_length_mm"] == pytest.approx(np.mean(lengths), abs=0.01)
        drawn = state.zone_mm + float(row["scene_displacement_mm"])
        assert drawn == pytest.approx(np.mean(lengths), abs=0.01)


def spline_length_mm(points: np.ndarray) -> float:
    kept = np.vstack([points[:-1:3], points[-1]])
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(kept, axis=0), axis=1))])
    curve = CubicSpline(chord, kept).derivative()
    nodes, weights = np.polynomial.legendre.leggauss(4)
    half = 0.5 * np.diff(chord)
    at = chord[:-1, None] + half[:, None] * (nodes + 1.0)
    speed = np.linalg.norm(curve(at), axis=2)
    return float((speed * weights * half[:, None]).sum())


def test_straight_bundle_draws_what_the_closed_form_says() -> None:
    """Two strands before coiling: X = hypot(L, developed length at the centre radius)."""
    settings = make_settings((0.0, 12.0))
    state = state_at(settings, 1)
    radius, legs = 0.12, leg_angle_rad(0.12, 5.0) / (2.0 * np.pi)
    across = 2.0 * np.pi * radius * (12.0 - legs) + np.sqrt(2.5**2 - radius**2)
    path = strand_paths(settings, state)[0]
    assert arc_length_mm(path) == pytest.approx(np.hypot(23.20, across), abs=2e-4)


@pytest.mark.parametrize("count", [2, 4, 6, 8])
def test_a_leg_of_several_strands_is_pulled_straight(count: int) -> None:
    """The middle of its strands runs on a line that meets the axis where the truth's apex is."""
    settings = make_settings((0.0, 7.0), strings=Strings(count=count))
    state = state_at(settings, 1)
    x_mm = np.linspace(0.3, 0.9, 7) * state.apex_mm
    paths = [path.points_mm[path.first : path.last + 1] for path in strand_paths(settings, state)]
    y_mm = np.array([np.interp(x_mm, path[:, 0], path[:, 1]) for path in paths])
    middle_mm = y_mm[y_mm[:, 0] > 0].mean(axis=0)
    slope, start_mm = np.polyfit(x_mm, middle_mm, 1)
    assert np.abs(middle_mm - start_mm - slope * x_mm).max() < 0.002
    assert -start_mm / slope == pytest.approx(state.apex_mm, rel=0.01)


@pytest.mark.parametrize("law", ["constant_radius", "linear"])
def test_a_law_that_can_be_obeyed_is_obeyed(law: str) -> None:
    settings = make_settings((0.0, 15.0), changes={"law.displacement": law, "law.follow": "law"})
    row = frame_truth(settings, place(settings.camera, 23.2), state_at(settings, 1), 1).row
    assert row["followed"] == "law"
    assert abs(float(row["law_minus_scene_mm"])) < 0.01
    assert abs(float(row["turn_budget_error"])) < 1e-4
    alpha_r = 2.0 * np.pi * 15.0 * 0.24
    assert row["law_displacement_mm"] == pytest.approx(np.hypot(23.2, 2.5 + alpha_r) - 23.2)


def test_a_law_that_cannot_be_obeyed_is_named() -> None:
    """The variable radius runs away (the paper's 79 mm): the scene keeps its geometry."""
    changes = {"law.displacement": "variable_radius", "law.follow": "law"}
    settings = make_settings((0.0, 40.0), changes=dict(changes))
    row = frame_truth(settings, place(settings.camera, 23.2), state_at(settings, 1), 1).row
    assert row["followed"] == "geometry"
    assert float(row["law_minus_scene_mm"]) > 50.0
