"""All tables of the paper that are checked, in the paper's order: one explicit dict."""

from __future__ import annotations

from collections.abc import Callable

from tsvision.errors import InputError
from tsvision.validation import diameter, dimensions, life, overtwist, rmse, stated
from tsvision.validation.cells import Cell

TABLES: dict[str, Callable[[], list[Cell]]] = {
    "dimensions": dimensions.dimension_cells,
    "contraction": dimensions.contraction_cells,
    "overtwist": overtwist.overtwist_cells,
    "systems": dimensions.system_cells,
    "diameter": diameter.diameter_cells,
    "rmse": rmse.rmse_cells,
    "life_cycle": life.life_cells,
    "stated": stated.stated_cells,
}


def all_cells(names: tuple[str, ...] = ()) -> list[Cell]:
    """Cells of the named tables (all when none is named), in the paper's order."""
    unknown = [name for name in names if name not in TABLES]
    if unknown:
        raise InputError(f"no table '{unknown[0]}' in the paper; there are: {', '.join(TABLES)}")
    return [cell for name, make in TABLES.items() if not names or name in names for cell in make()]
