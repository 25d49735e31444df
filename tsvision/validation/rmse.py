"""Table VI: the measured curves exist only as a figure, so its cells are bounded, not redone.

For any measured curve m, and the two model curves c and v on the same turns, the triangle
inequality of the RMS norm holds: | RMS(v - m) - RMS(v - c) | <= RMS(c - m). RMS(v - c) needs no
measurement, only the turn count at which the recording ended. That one is bounded by the
published largest contraction: the constant-radius model, whose RMSE is published, has to come
within `END_FACTOR` RMSEs of it there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.data import table
from tsvision.models import MODELS
from tsvision.validation.cells import Cell, bounded, recomputed

END_FACTOR = 2.0  # a single end point may be off by this many RMSEs
WHY = (
    "measured curves published as a figure only; bounds from |RMSE_var - RMS(var - const)| <= "
    "RMSE_const at every whole turn, up to an end allowed by the largest contraction"
)


@dataclass(frozen=True)
class EndRange:
    """Last whole turns that a recording may have had, and RMS(variable - constant) there."""

    turns: np.ndarray
    rms_between_models_mm: np.ndarray
    best_turns: float


def end_range(strings: int) -> EndRange:
    """Ends at which the constant-radius model comes near the published largest contraction."""
    shape = table("dimensions").set_index("strings").loc[strings]
    largest = float(table("contraction").set_index("strings")["contraction_mm"][strings])
    rmse = float(table("rmse").set_index("strings")["rmse_constant_radius_mm"][strings])
    geometry = {
        "twisting_zone_mm": shape["twisting_zone_mm"],
        "hole_distance_mm": shape["hole_distance_mm"],
        "radius_mm": shape["bundle_diameter_mm"] / 2,
    }
    constant, variable = MODELS["constant_radius"], MODELS["variable_radius"]
    turns = np.arange(1.0, 200.0)
    near = np.abs(constant.displacement_mm(turns, **geometry) - largest) <= END_FACTOR * rmse
    ends = turns[near]
    gap = [
        np.sqrt(
            np.mean(
                (
                    variable.displacement_mm(steps := np.arange(end + 1), **geometry)
                    - constant.displacement_mm(steps, **geometry)
                )
                ** 2
            )
        )
        for end in ends
    ]
    best = float(constant.turns_for_displacement(largest, **geometry))
    return EndRange(ends, np.array(gap), best)


def rmse_cells() -> list[Cell]:
    """RMSE of the constant model as given; of the variable one, and their ratio, bounded; and
    whether the bounds alone prove the order of the two."""
    cells = []
    for line in table("rmse").itertuples():
        row, name = f"N={line.strings}", "rmse"
        ends = end_range(line.strings)
        constant, variable = line.rmse_constant_radius_mm, line.rmse_variable_radius_mm
        estimate = float(np.interp(ends.best_turns, ends.turns, ends.rms_between_models_mm))
        low = float(ends.rms_between_models_mm.min()) - constant
        high = float(ends.rms_between_models_mm.max()) + constant
        ends_text = f"end between {ends.turns[0]:.0f} and {ends.turns[-1]:.0f} turns"
        cells += [
            Cell(name, row, "rmse_constant_radius_mm", constant, reason=WHY.split(";")[0]),
            bounded(
                name,
                row,
                "rmse_variable_radius_mm",
                variable,
                estimate,
                (low, high),
                WHY,
            ),
            bounded(
                name,
                row,
                "ratio variable:constant",
                variable / constant,
                estimate / constant,
                (low / constant, high / constant),
                f"not printed in the paper; {ends_text}",
            ),
            recomputed(
                name,
                row,
                "constant better (1: yes)",
                float(constant < variable),
                float(low > constant),
                0.0,
            ),
        ]
    return cells
