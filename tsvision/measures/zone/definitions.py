"""The definitions of coiling and knots, for all that reads pictures or tells of what was read.

A is the rms swing of the bundle's centre line, D its diameter, E(s) the local diameter of all that
the strings reach, E₀ its baseline.
"""

from __future__ import annotations

COIL_RATIO = 0.05  # A / D from which a bundle coils
UNEVENNESS = 0.08  # coefficient of variation of E(s) from which coiling is local
KNOT_RISE = 1.15  # E / E₀ where a knot begins and ends
KNOT_RATIO = 1.40  # E / D that its largest E must reach
