"""Tables I, II and IV: geometry, achieved contraction, comparison with earlier systems."""

from __future__ import annotations

from tsvision.actuator.reversible import limit_errors
from tsvision.data import table
from tsvision.validation.cells import Cell, recomputed

HALF_MM = 0.005  # rounding of two decimals
HALF_PERCENT = 0.5


def dimension_cells() -> list[Cell]:
    """Table I: L and D stand in other tables too and must agree; S is given once."""
    diameter = table("diameter").set_index("strings")["diameter_mm"]
    zone = table("contraction").set_index("strings")["twisting_zone_mm"]
    cells = []
    for line in table("dimensions").itertuples():
        row, name = f"N={line.strings}", "dimensions"
        known = float(zone[line.strings])
        cells += [
            recomputed(name, row, "twisting_zone_mm", line.twisting_zone_mm, known, 0.0),
            Cell(name, row, "hole_distance_mm", line.hole_distance_mm, reason="measured"),
            recomputed(
                name,
                row,
                "bundle_diameter_mm",
                line.bundle_diameter_mm,
                float(diameter[line.strings]),
                0.0,
            ),
        ]
    return cells


def contraction_cells() -> list[Cell]:
    """Table II: total length = L + x; contraction % = x / total."""
    limits = limit_errors()
    cells = []
    for line in table("contraction").itertuples():
        row, name = f"N={line.strings}", "contraction"
        total = line.twisting_zone_mm + line.contraction_mm
        percent = 100 * line.contraction_mm / total
        cells += [
            Cell(
                name,
                row,
                "contraction_mm",
                line.contraction_mm,
                limits[line.strings][0],
                status="model",
                reason="measured; beside it what the zone holds when coiled evenly (no knots)",
            ),
            recomputed(
                name,
                row,
                "total_string_length_mm",
                line.total_string_length_mm,
                total,
                3 * HALF_MM,
            ),
            recomputed(
                name, row, "contraction_percent", line.contraction_percent, percent, HALF_PERCENT
            ),
        ]
    return cells


def system_cells() -> list[Cell]:
    """Table IV: % = stroke / length, within the rounding of both; the own row from table II."""
    best = table("contraction").sort_values("contraction_percent").iloc[-1]
    own = {
        "system_length_mm": best["total_string_length_mm"],
        "displacement_mm": best["contraction_mm"],
    }
    cells = []
    for line in table("systems").itertuples():
        row, name = line.system, "systems"
        for column in ("system_length_mm", "displacement_mm"):
            published = float(getattr(line, column))
            if row == "this_paper":
                cells.append(recomputed(name, row, column, published, float(own[column]), 0.5))
            else:
                cells.append(Cell(name, row, column, published, reason="another publication's"))
        percent = 100 * line.displacement_mm / line.system_length_mm
        cells.append(
            recomputed(
                name, row, "contraction_percent", line.contraction_percent, percent, HALF_PERCENT
            )
        )
    return cells
