"""Coils that widen along the bundle, drawn as spheres swept along two strands in space.

The truth is counted on the centre line: the strands' twist about it and the line's own writhe.
"""

from __future__ import annotations

import numpy as np

from tsvision.measures.edges.edges import Edges

D = 20.0
TWIST = 2.0 * np.pi / 40.0  # rad per px of bundle
COIL_PX = 38.0
LENGTH_PX = 640


def bundle(radius: np.ndarray, rate: float = 2.0 * np.pi / COIL_PX) -> tuple[Edges, np.ndarray]:
    """Edges (M,) of two strands about a line that coils with a radius (M,) at a rate, and the turns
    from the first column to each (M,)."""
    fine = 8
    s = np.arange(radius.size * fine) / fine
    r = np.interp(s, np.arange(radius.size), radius)
    angle = rate * s
    line = np.stack([s, r * np.cos(angle), r * np.sin(angle)], axis=1)
    along = np.gradient(line, axis=0)
    step = np.linalg.norm(along, axis=1)
    tangent = along / step[:, None]
    across = np.empty_like(line)  # carried along the line without turning about it
    across[0] = np.cross(tangent[0], [0.0, 0.0, 1.0])
    for i in range(1, len(line)):
        across[i] = across[i - 1] - (across[i - 1] @ tangent[i]) * tangent[i]
        across[i] /= np.linalg.norm(across[i])
    twist = TWIST * np.cumsum(step)[:, None]
    away = 0.25 * D * (np.cos(twist) * across + np.sin(twist) * np.cross(tangent, across))
    x = np.arange(radius.size, dtype=float)
    upper, lower = np.full(x.size, -np.inf), np.full(x.size, np.inf)
    for strand in (line + away, line - away):
        for column in range(-6, 7):
            at = np.round(strand[:, 0]).astype(int) + column
            reach = np.sqrt(np.maximum((0.25 * D) ** 2 - (at - strand[:, 0]) ** 2, 0.0))
            seen = (at >= 0) & (at < x.size) & (reach > 0.0)
            np.maximum.at(upper, at[seen], (strand[:, 1] + reach)[seen])
            np.minimum.at(lower, at[seen], (strand[:, 1] - reach)[seen])
    lead = 1.0 - 1.0 / (step * fine)
    turns = (twist[:, 0] + np.cumsum(lead * np.gradient(angle))) / (2.0 * np.pi)
    ones = np.ones(x.size)
    return Edges(x, upper, lower, ones, ones), turns[::fine]


def from_the_axis(radius: np.ndarray) -> np.ndarray:
    """A radius (M,) that legs and connector hold at 0 at either end."""
    s = np.arange(radius.size)
    grown = np.clip(np.minimum(s, s[-1] - s) / 30.0, 0.0, 1.0)
    return np.asarray(radius * grown**2 * (3.0 - 2.0 * grown))
