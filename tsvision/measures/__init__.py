"""STRINGS -> NUMBERS: edges, helix fit, knots, budgets, one frame, one recording.

In the order in which a frame flows: `edges` of a strip cut along the axis; a `helix` fitted to
them; what `light` makes of edges, learnt over a recording; the `ends` of the strings; all that
stands still in a recording (`looks`); what lies along the `zone`; one `frame`, one `recording`.
`cords` are measured without a section; `numeric` holds what any of them does with a line of
numbers. Each knows those before it only (tests/test_layout.py).
"""
