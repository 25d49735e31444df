"""STRINGS -> NUMBERS: edges, helix fit, knots, budgets, one frame, one recording."""
