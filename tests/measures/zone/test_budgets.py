"""Turns and string seen along a straight bundle between two ends, and what their uncertainty
holds of the scale's."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tsvision.images.strip import Axis
from tsvision.measures.edges.edges import Edges
from tsvision.measures.ends.legs import Face
from tsvision.measures.helix.bundle import BundleFit
from tsvision.measures.helix.fit import HelixFit
from tsvision.measures.helix.section import pair_core
from tsvision.measures.helix.silhouette import PARAMETERS, RHO, K, model_edges
from tsvision.measures.looks import Looks
from tsvision.measures.zone.budgets import add_budgets
from tsvision.measures.zone.envelope import Envelope
from tsvision.records import FrameRow, Scale

D, LENGTH, APEX = 20.0, 500, 80.0
MM_PER_PX = 0.03
EXITS = Face(0.0, 1.0, 60.0, 0.0)


def looks(mm_per_px: float, relative_sd: float, face: Face | None) -> Looks:
    """L and S are stated, in mm; the connector is seen where L puts it at the usual scale."""
    axis = Axis(np.array([[0.0, 100.0], [LENGTH, 100.0]]), np.array([0.0, LENGTH]))
    fake: Any = SimpleNamespace(
        diameter_px=D,
        strand_count=2,
        face=face,
        zero_px=0.0,
        zero_known=True,
        zone_px=(LENGTH - 1.0) * MM_PER_PX / mm_per_px,
        hole_distance_mm=2.0 * EXITS.half_gap_px * MM_PER_PX,
        ends=SimpleNamespace(connector_px=LENGTH - 1.5, connector_seen=False),
        scale=Scale(mm_per_px, relative_sd * mm_per_px, "given"),
        sight=SimpleNamespace(axis=axis, end_px=float(LENGTH)),
    )
    return cast(Looks, fake)


def string_mm(mm_per_px: float, relative_sd: float, face: Face | None) -> tuple[float, float]:
    """Its length and uncertainty."""
    row = budgets(looks(mm_per_px, relative_sd, face))
    return row.string_length_mm, row.string_length_mm_sd


def budgets(known: Looks, knots_px: tuple[tuple[float, float], ...] = ()) -> FrameRow:
    """Of a straight bundle; `knots_px` are where something stands out by half of D."""
    section = pair_core(2)
    p = np.zeros(PARAMETERS)
    p[RHO], p[K] = 0.5 * D / section.diameter_d, 2.0 * np.pi / 60.0
    found = BundleFit(HelixFit(p, np.eye(9), 0.1, 0.1, 400, section, (0.0, 400.0)), APEX, 400.0)
    s, ones = np.arange(float(LENGTH)), np.ones(LENGTH)
    edges = Edges(s, *model_edges(p, section, 0.0, LENGTH), ones, ones)
    reach = np.full(LENGTH, D)
    for low, high in knots_px:
        reach[int(low) : int(high)] = 1.5 * D
    row = FrameRow(frame=0, file="", turns=9.0)
    return add_budgets(row, known, found, None, APEX, edges, knots_px, Envelope(reach, D))


def test_between_ends_that_are_seen_a_string_is_no_surer_than_its_scale() -> None:
    """The face told by the plate, the connector by motion: by how much a scale that is 1 % larger
    lengthens the string, by so much it is less sure."""
    usual, _ = string_mm(MM_PER_PX, 0.01, None)
    larger, _ = string_mm(1.01 * MM_PER_PX, 0.01, None)
    _, sd = string_mm(MM_PER_PX, 0.01, None)
    _, without = string_mm(MM_PER_PX, 0.0, None)
    assert np.sqrt(sd**2 - without**2) == pytest.approx(larger - usual, rel=0.02)


def test_an_end_that_the_zone_tells_leaves_nothing_to_the_scale() -> None:
    usual, sd = string_mm(MM_PER_PX, 0.01, EXITS)
    larger, _ = string_mm(1.01 * MM_PER_PX, 0.01, EXITS)
    assert larger == pytest.approx(usual, rel=1e-3)
    assert sd == string_mm(MM_PER_PX, 0.0, EXITS)[1]


def test_what_stands_out_of_a_straight_bundle_winds_no_turns_but_may() -> None:
    """Black strings whose dark limb was lost in places (`wild 1463`): a "knot" of 54 px, which no
    other frame showed, held 3.2 of 15.4 turns stated to 0.6, where the motor had made 11.6."""
    known = looks(MM_PER_PX, 0.01, None)
    plain, lone = budgets(known), budgets(known, ((200.0, 240.0),))
    assert lone.turns_seen == pytest.approx(plain.turns_seen)
    assert lone.turns_seen_sd > plain.turns_seen_sd + 0.2
