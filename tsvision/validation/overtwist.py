"""Table III: start of overtwist. Seen by eye; the contraction there can be bounded."""

from __future__ import annotations

from tsvision.actuator.onset import predict_onset
from tsvision.data import table
from tsvision.models import MODELS
from tsvision.validation.cells import Cell, bounded, recomputed


def overtwist_cells() -> list[Cell]:
    """Diameter from table V; contraction % from the base model and, at N = 2, table VII."""
    diameter = table("diameter").set_index("strings")["diameter_mm"]
    cells = []
    for line in table("overtwist").itertuples():
        row, name = f"N={line.strings}", "overtwist"
        estimate, bounds, why = _contraction_percent(line.strings, line.onset_turns)
        cells += [
            recomputed(
                name,
                row,
                "bundle_diameter_mm",
                line.bundle_diameter_mm,
                float(diameter[line.strings]),
                0.0,
            ),
            bounded(
                name, row, "contraction_percent", line.contraction_percent, estimate, bounds, why
            ),
            _onset_cell(name, row, line.strings, line.onset_turns),
        ]
    return cells


def _onset_cell(name: str, row: str, strings: int, observed: float) -> Cell:
    shape = table("dimensions").set_index("strings").loc[strings]
    sd = float(table("diameter").set_index("strings")["diameter_sd_mm"][strings])
    onset = predict_onset(
        strings, float(shape["twisting_zone_mm"]), float(shape["bundle_diameter_mm"]), sd
    )
    return Cell(
        name,
        row,
        "onset_turns",
        observed,
        onset.turns,
        low=onset.low,
        high=onset.high,
        status="model",
        reason="seen by eye; beside it the zero-twist rule of rope geometry, no fitted constant",
    )


def _contraction_percent(strings: int, turns: float) -> tuple[float, tuple[float, float], str]:
    """Best estimate, bounds (the half percent of rounding included) and where they come from."""
    total = table("contraction").set_index("strings")["total_string_length_mm"][strings]
    life = table("life_cycle")
    seen = life[life["turns"] == turns]["contraction_mm"] if strings == 2 else life[:0]["turns"]
    if len(seen):
        percent = 100 * seen / total
        why = "the life tests' contraction at this turn count, under 2, 3 and 5 kgf"
        return float(percent.iloc[0]), (percent.min() - 0.5, percent.max() + 0.5), why
    shape = table("dimensions").set_index("strings").loc[strings]
    rmse = float(table("rmse").set_index("strings")["rmse_constant_radius_mm"][strings])
    model = float(
        MODELS["constant_radius"].displacement_mm(
            turns,
            twisting_zone_mm=shape["twisting_zone_mm"],
            hole_distance_mm=shape["hole_distance_mm"],
            radius_mm=shape["bundle_diameter_mm"] / 2,
        )
    )
    bounds = (100 * (model - rmse) / total - 0.5, 100 * (model + rmse) / total + 0.5)
    why = "constant-radius model at this turn count, give or take its published RMSE"
    return 100 * model / total, bounds, why
