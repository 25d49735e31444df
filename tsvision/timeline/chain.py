"""A hidden two-state chain over the frames: is the phase there, frame by frame, and how surely?

States: 0 absent, 1 there, 2 there but hidden from this view. The chain is filtered forward, and
whole histories are drawn backward from its posterior, so that every question about a history
(when did it begin and then persist? did it end? how often?) is answered by counting draws, with
its uncertainty, and an interval needs no formula of its own.
Reference: Frühwirth-Schnatter 1994, forward filtering, backward sampling.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tsvision.timeline.criteria import RATES
from tsvision.timeline.order import Order

DRAWS = 1000
SEED = 20_231
LEAST_WEIGHT = 0.1
HIDDEN_SEEN_PENALTY = -3.0  # log chance of seeing, in a frame where it is hidden, what is not it


@dataclass(frozen=True)
class Histories:
    """`there` (n,) posterior probability that the phase holds; `drawn` (DRAWS, n) bool."""

    there: np.ndarray
    drawn: np.ndarray


def infer(
    evidence: np.ndarray,
    order: Order,
    can_hide: bool,
    ready: np.ndarray | None = None,
) -> Histories:
    """Histories of one phase from its evidence (n,), given in the order of `order.rows`; `ready`
    (n,): frames in which it begins the more readily."""
    count = len(evidence)
    if count == 0:
        return Histories(np.zeros(0), np.zeros((DRAWS, 0), dtype=bool))
    weight = independence(np.abs(np.gradient(order.wind))) if count > 1 else np.ones(1)
    emission = emissions(evidence * weight, can_hide)
    turned = np.abs(np.diff(order.wind))
    times = np.ones(count) if ready is None else np.where(ready, RATES.ready_times, 1.0)
    steps = [
        transition(turned[i], order.direction[i + 1] > 0, can_hide, times[i + 1])
        for i in range(count - 1)
    ]
    forward = _filter(emission, steps, start(float(order.wind[0])))
    drawn = _draw(forward, steps)
    return Histories(drawn.mean(axis=0), drawn)


def independence(step_turns: np.ndarray) -> np.ndarray:
    """Weight of each frame's evidence: frames closer together than `independent_turns` show much
    the same view, and share what one of them would say."""
    step = np.where(np.isfinite(step_turns), step_turns, RATES.independent_turns)
    return np.clip(step / RATES.independent_turns, LEAST_WEIGHT, 1.0)


def emissions(evidence: np.ndarray, can_hide: bool) -> np.ndarray:
    """(n, 3) likelihood of each frame under absent, there, hidden, up to a factor a frame."""
    result = np.zeros((len(evidence), 3))
    result[:, 1] = evidence
    result[:, 2] = np.where(evidence > 0, HIDDEN_SEEN_PENALTY, 0.0) if can_hide else -np.inf
    return np.exp(result)


def start(wind: float) -> np.ndarray:
    """(3,) belief before the first frame: a recording that begins near zero turns begins
    untwisted; elsewhere the phase may be under way."""
    begun = 1.0 - np.exp(-RATES.rise_per_turn * max(wind, 0.0)) + 1e-3
    begun = begun if np.isfinite(begun) else 0.5
    return np.array([1.0 - begun, begun, 0.1 * begun])


def transition(
    step_turns: float, winding: bool, can_hide: bool, readily: float = 1.0
) -> np.ndarray:
    """(3, 3) chance of each state after each, over `step_turns` turns; `readily`: by how much the
    phase begins more readily than as a rule."""
    step = max(step_turns if np.isfinite(step_turns) else 1.0, RATES.step_floor_turns)
    per_turn = readily * RATES.rise_per_turn if winding else RATES.unwind_rise_per_turn
    rise = 1 - np.exp(-step * per_turn)
    fall = 1 - np.exp(-step * (RATES.fall_per_turn if winding else RATES.unwind_fall_per_turn))
    changing = 1 - np.exp(-step / RATES.hidden_turns)
    hide = RATES.hide * changing if can_hide else 0.0
    reveal = min(changing, RATES.reveal_most)
    late = RATES.hidden_at_start if can_hide else 0.0
    return np.array(
        [
            [1 - rise, rise * (1 - late), rise * late],
            [fall, (1 - fall) * (1 - hide), (1 - fall) * hide],
            [fall, (1 - fall) * reveal, (1 - fall) * (1 - reveal)],
        ]
    )


def _filter(emission: np.ndarray, steps: list[np.ndarray], prior: np.ndarray) -> np.ndarray:
    forward = np.empty_like(emission)
    belief = prior * emission[0]
    forward[0] = belief / belief.sum()
    for i, step in enumerate(steps):
        belief = (forward[i] @ step) * emission[i + 1]
        forward[i + 1] = belief / belief.sum()
    return forward


def _draw(forward: np.ndarray, steps: list[np.ndarray]) -> np.ndarray:
    """(DRAWS, n) whether the phase holds, in histories drawn from the joint posterior."""
    random = np.random.default_rng(SEED)
    state = np.searchsorted(np.cumsum(forward[-1]), random.random(DRAWS)).clip(0, 2)
    drawn = np.empty((DRAWS, len(forward)), dtype=bool)
    drawn[:, -1] = state > 0
    for i in range(len(steps) - 1, -1, -1):
        weight = np.cumsum(forward[i][:, None] * steps[i], axis=0)
        bound = (weight / np.maximum(weight[-1], 1e-300))[:, state]
        share = random.random(DRAWS)
        state = (share > bound[0]).astype(int) + (share > bound[1])
        drawn[:, i] = state > 0
    return drawn
