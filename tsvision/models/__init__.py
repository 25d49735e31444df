"""A shelf of displacement and bundle models, one a file.

`MODELS[name].displacement_mm(turns, **geometry)` (also `.slope_mm_per_turn` and
`.turns_for_displacement`), geometry keywords as in `shelf.GEOMETRY`;
`SECTIONS[name].bundle_diameter_mm(count, string_diameter_mm)`.
"""

from __future__ import annotations

from tsvision.models import (
    coil_at_pitch,
    constant_radius,
    helix_then_coil,
    locked_pitch,
    no_separator,
    offset_no_separator,
    separator_no_offset,
    variable_radius,
    volume_conserving,
)
from tsvision.models.sections import SECTIONS
from tsvision.models.shelf import GEOMETRY, BundleSection, DisplacementModel

MODELS: dict[str, DisplacementModel] = {
    model.name: model
    for model in (
        no_separator.MODEL,
        offset_no_separator.MODEL,
        volume_conserving.MODEL,
        separator_no_offset.MODEL,
        variable_radius.MODEL,
        constant_radius.MODEL,
        locked_pitch.MODEL,
        helix_then_coil.MODEL,
        coil_at_pitch.MODEL,
    )
}

__all__ = ["GEOMETRY", "MODELS", "SECTIONS", "BundleSection", "DisplacementModel"]
