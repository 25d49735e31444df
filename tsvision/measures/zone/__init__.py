"""HELIX -> NUMBERS along the zone: widths, coils, knots, turns and string, and their doubts."""
