"""Numbers of the running text that other numbers of the paper allow to check."""

from __future__ import annotations

from tsvision.data import table
from tsvision.validation.cells import Cell, recomputed


def stated_cells() -> list[Cell]:
    """Each stated number against the table that holds it too; the rest is input."""
    life, systems = table("life_cycle"), table("systems")
    earlier = systems[systems["system"] != "this_paper"]
    derived = {
        "lifted_mass_kg": float(life["load_kgf"].min()),
        "overtwist_onset_turns": float(table("overtwist").set_index("strings")["onset_turns"][2]),
        "reversible_limit_turns": float(life["turns"].max()),
        "best_contraction_percent": float(table("contraction")["contraction_percent"].max()),
        "best_previous_contraction_percent": float(earlier["contraction_percent"].max()),
    }
    why = {
        "string_nominal_diameter_mm": "maker's number; the caliper reads 0.24 mm under load",
        "string_strength_N": "maker's number",
    }
    cells = []
    for line in table("stated").itertuples():
        if line.key in derived:
            cell = recomputed("stated", line.key, "value", line.value, derived[line.key], 0.0)
        else:
            cell = Cell("stated", line.key, "value", line.value, reason=why.get(line.key, "given"))
        cells.append(cell)
    return cells
