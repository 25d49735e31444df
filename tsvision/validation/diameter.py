"""Table V: errors of the two bundle sections against the caliper."""

from __future__ import annotations

from tsvision.data import table
from tsvision.models import SECTIONS
from tsvision.validation.cells import Cell, recomputed

# Each published error is a rounded difference of a model value and a diameter that is itself
# rounded: +-0.005 mm for the one and +-0.005 mm for the other.
TOLERANCE_MM = 0.005 + 0.005
COLUMNS = {"proposed_error_mm": "pair_core", "existing_error_mm": "ring"}


def diameter_cells() -> list[Cell]:
    """Both models with d = the diameter of one string in the same table; error = model - D."""
    data = table("diameter")
    string_diameter_mm = float(data.set_index("strings")["diameter_mm"][1])
    cells = []
    for line in data.itertuples():
        row, name = f"N={line.strings}", "diameter"
        cells.append(Cell(name, row, "diameter_mm", line.diameter_mm, reason="measured"))
        cells.append(Cell(name, row, "diameter_sd_mm", line.diameter_sd_mm, reason="measured"))
        for column, section in COLUMNS.items():
            model = SECTIONS[section].bundle_diameter_mm(line.strings, string_diameter_mm)
            error = float(model) - line.diameter_mm
            published = float(getattr(line, column))
            cells.append(recomputed(name, row, column, published, error, TOLERANCE_MM))
    return cells
