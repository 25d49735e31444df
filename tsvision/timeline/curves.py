"""Survival curves as one self-contained page."""

from __future__ import annotations

import pandas as pd

COLOURS = ("#3366aa", "#cc7711", "#2a8f5c", "#aa3377", "#777777", "#bbaa22")


def survival_page(survival: pd.DataFrame, phase: str) -> str:
    """HTML with one step curve per group and its interval as a band; plotly is written in."""
    import plotly.graph_objects as go

    figure = go.Figure()
    by = survival.columns[0]
    for number, (value, curve) in enumerate(survival.groupby(by, sort=True)):
        colour = COLOURS[number % len(COLOURS)]
        name = f"{by} {value:g}" if isinstance(value, float | int) else str(value)
        _add_band(figure, curve, colour)
        figure.add_scatter(
            x=curve["turns"],
            y=curve["without"],
            mode="lines",
            line={"shape": "hv", "color": colour, "width": 2},
            name=name,
        )
    word = phase.replace("_", " ")
    figure.update_layout(
        template="plotly_white",
        xaxis_title="motor turns",
        yaxis_title=f"share without {word}",
        yaxis_range=[-0.02, 1.02],
        title=f"How long recordings stay without {word} (Kaplan–Meier, 95 % bands)",
    )
    return str(figure.to_html(include_plotlyjs=True, full_html=True))


def _add_band(figure: object, curve: pd.DataFrame, colour: str) -> None:
    shape = {"shape": "hv", "width": 0}
    for side, fill in (("low", None), ("high", "tonexty")):
        figure.add_scatter(  # type: ignore[attr-defined]
            x=curve["turns"],
            y=curve[side],
            mode="lines",
            line=shape,
            fill=fill,
            fillcolor=_pale(colour),
            showlegend=False,
            hoverinfo="skip",
        )


def _pale(colour: str) -> str:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},0.15)"
