"""A shelf of displacement and bundle models, one a file.

`MODELS[name].displacement_mm(turns, **geometry)` (also `.slope_mm_per_turn` and
`.turns_for_displacement`), geometry keywords as in `shelf.GEOMETRY`;
`SECTIONS[name].bundle_diameter_mm(count, string_diameter_mm)`.
"""

from __future__ import annotations

from tsvision.models import constant_radius, variable_radius
from tsvision.models.sections import SECTIONS
from tsvision.models.shelf import GEOMETRY, BundleSection, DisplacementModel

MODELS: dict[str, DisplacementModel] = {
    model.name: model for model in (constant_radius.MODEL, variable_radius.MODEL)
}

__all__ = ["GEOMETRY", "MODELS", "SECTIONS", "BundleSection", "DisplacementModel"]
