"""Small drawings as SVG text: a scatter panel along turns, and bars."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

WIDTH, HEIGHT = 340, 230
LEFT, RIGHT, TOP, BOTTOM = 52, 10, 26, 34
TICKS = 5
BAR_HEIGHT, BAR_LABEL = 22, 330
FONT = 'font-family="system-ui, sans-serif" font-size="12"'


@dataclass(frozen=True)
class Panel:
    """Points (n,) with a group (its colour) each; `open` ones are drawn as circles, `joined` ones
    as lines along each run."""

    title: str
    x: np.ndarray
    y: np.ndarray
    group: tuple[str, ...]
    open: np.ndarray
    run: tuple[str, ...]
    joined: bool = False
    along: str = "turns"


def panel(drawn: Panel, colour: Mapping[str, str]) -> str:
    """One panel with axes, a zero line and its title."""
    x_low, x_high, x_ticks = _axis(drawn.x)
    y_low, y_high, y_ticks = _axis(np.append(drawn.y, 0.0))
    inner_w, inner_h = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

    def across(value: np.ndarray | float) -> np.ndarray | float:
        return LEFT + inner_w * (value - x_low) / (x_high - x_low)

    def down(value: np.ndarray | float) -> np.ndarray | float:
        return TOP + inner_h * (y_high - value) / (y_high - y_low)

    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" role="img" {FONT}>',
        f"<title>{html.escape(drawn.title)}</title>",
        f'<text x="4" y="15" font-weight="600">{html.escape(drawn.title)}</text>',
    ]
    for tick in x_ticks:
        parts.append(
            f'<text x="{across(tick):.1f}" y="{HEIGHT - 18}" text-anchor="middle">{tick:g}</text>'
        )
    for tick in y_ticks:
        y = down(tick)
        shade = "#777" if tick == 0 else "#e4e4e4"
        parts.append(
            f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}" stroke="{shade}"/>'
            f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{tick:g}</text>'
        )
    parts.append(
        f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - 4}" text-anchor="end">{drawn.along}</text>'
    )
    xs, ys = np.atleast_1d(across(drawn.x)), np.atleast_1d(down(drawn.y))
    draw = _lines if drawn.joined else _points
    return "".join([*parts, *draw(drawn, xs, ys, colour), "</svg>"])


def _points(drawn: Panel, xs: np.ndarray, ys: np.ndarray, colour: Mapping[str, str]) -> list[str]:
    marks = []
    for x, y, group, hollow in zip(xs, ys, drawn.group, drawn.open, strict=True):
        paint = colour[group]
        fill = "none" if hollow else paint
        marks.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.6" fill="{fill}" stroke="{paint}"/>')
    return marks


def _lines(drawn: Panel, xs: np.ndarray, ys: np.ndarray, colour: Mapping[str, str]) -> list[str]:
    lines = []
    for run in dict.fromkeys(drawn.run):
        own = [i for i, name in enumerate(drawn.run) if name == run]
        own.sort(key=lambda i: drawn.x[i])
        points = " ".join(f"{xs[i]:.1f},{ys[i]:.1f}" for i in own)
        dash = ' stroke-dasharray="5 4"' if drawn.open[own[0]] else ""
        lines.append(
            f'<polyline points="{points}" fill="none" stroke="{colour[drawn.group[own[0]]]}" '
            f'stroke-width="1.6"{dash}/>'
        )
    return lines


def bars(named: Sequence[tuple[str, float]]) -> str:
    """Horizontal bars with their numbers; values below 0 have none."""
    most = max([value for _, value in named if value > 0], default=1.0)
    height = BAR_HEIGHT * len(named) + 4
    room = 2 * WIDTH - 60
    parts = [
        f'<svg viewBox="0 0 {BAR_LABEL + room + 60} {height}" width="{BAR_LABEL + room + 60}" '
        f'role="img" {FONT}><title>evidence</title>'
    ]
    for i, (name, value) in enumerate(named):
        y = BAR_HEIGHT * i + 2
        length = room * max(value, 0.0) / most
        parts.append(
            f'<text x="{BAR_LABEL - 8}" y="{y + 15}" text-anchor="end">{html.escape(name)}</text>'
            f'<rect x="{BAR_LABEL}" y="{y + 3}" width="{length:.1f}" height="{BAR_HEIGHT - 7}" '
            f'fill="#0072b2"/>'
            f'<text x="{BAR_LABEL + length + 6:.1f}" y="{y + 15}">{value:.1f}</text>'
        )
    return "".join([*parts, "</svg>"])


def _axis(values: np.ndarray) -> tuple[float, float, list[float]]:
    """Low, high and round ticks that hold the finite values."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    if high - low < 1e-12:
        low, high = low - 0.5, high + 0.5
    rough = (high - low) / TICKS
    power = 10.0 ** np.floor(np.log10(rough))
    step = float(power * min((m for m in (1, 2, 5, 10) if m * power >= rough), default=10))
    first, last = np.floor(low / step), np.ceil(high / step)
    ticks = [round(float(k * step), 10) for k in np.arange(first, last + 1)]
    return ticks[0], ticks[-1], ticks
