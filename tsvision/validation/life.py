"""Table VII: contraction of each cycle against the model; contraction endured = the product."""

from __future__ import annotations

from tsvision.data import table
from tsvision.models import MODELS
from tsvision.validation.cells import Cell, recomputed

BASE = "constant_radius"
HALF_MM = 0.5  # the published product is rounded to whole mm
# The two products that the published cycles and contractions do not give.
ERRATA = {
    (3, 40): "published number is not cycles × contraction (it would need 38.05 mm a cycle)",
    (5, 55): "published number is not cycles × contraction (it would need 57.77 mm a cycle)",
}


def life_cells() -> list[Cell]:
    """Contraction per cycle beside the base model; the product recomputed in each row."""
    pair = table("dimensions").set_index("strings").loc[2]
    cells = []
    for line in table("life_cycle").itertuples():
        row, name = f"{line.load_kgf} kgf, {line.turns} turns", "life_cycle"
        predicted = MODELS[BASE].displacement_mm(
            line.turns,
            twisting_zone_mm=pair["twisting_zone_mm"],
            hole_distance_mm=pair["hole_distance_mm"],
            radius_mm=pair["bundle_diameter_mm"] / 2,
        )
        cells += [
            Cell(name, row, "cycles", line.cycles, reason="measured; see `tsvision life`"),
            Cell(
                name,
                row,
                "contraction_mm",
                line.contraction_mm,
                float(predicted),
                status="model",
                reason=f"beside it the {BASE} model, which knows no load",
            ),
            recomputed(
                name,
                row,
                "contraction_endured_mm",
                line.contraction_endured_mm,
                line.cycles * line.contraction_mm,
                HALF_MM,
                ERRATA.get((line.load_kgf, line.turns), ""),
            ),
        ]
    return cells
