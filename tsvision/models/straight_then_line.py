"""Shared by the locking models: a straight helix up to a lock, a straight line after it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tsvision.models import constant_radius


def displacement_mm(
    turns: ArrayLike,
    lock_turns: ArrayLike,
    feed_mm_per_turn: ArrayLike,
    **helix: ArrayLike,
) -> np.ndarray:
    """Constant-radius law (keywords `helix`) up to `lock_turns`, then `feed_mm_per_turn` each."""
    wound = np.abs(np.asarray(turns, dtype=float))
    lock = np.asarray(lock_turns, dtype=float)
    straight = constant_radius.displacement_mm(np.minimum(wound, lock), **helix)
    return straight + np.maximum(wound - lock, 0.0) * np.asarray(feed_mm_per_turn, dtype=float)


def slope_mm_per_turn(
    turns: ArrayLike,
    lock_turns: ArrayLike,
    feed_mm_per_turn: ArrayLike,
    **helix: ArrayLike,
) -> np.ndarray:
    """dx/dturns, signed as the turns are; at the lock itself the helix's slope."""
    signed = np.asarray(turns, dtype=float)
    locked = np.abs(signed) > np.asarray(lock_turns, dtype=float)
    sign = np.where(signed < 0, -1.0, 1.0)
    feed = sign * np.asarray(feed_mm_per_turn, dtype=float)
    return np.where(locked, feed, constant_radius.slope_mm_per_turn(signed, **helix))


def turns_for_displacement(
    x_mm: ArrayLike,
    lock_turns: ArrayLike,
    feed_mm_per_turn: ArrayLike,
    **helix: ArrayLike,
) -> np.ndarray:
    """The turns >= 0 that give x; NaN below the displacement at 0 turns."""
    x = np.asarray(x_mm, dtype=float)
    lock = np.asarray(lock_turns, dtype=float)
    at_lock = constant_radius.displacement_mm(lock, **helix)
    straight = constant_radius.turns_for_displacement(x, **helix)
    return np.where(x > at_lock, lock + (x - at_lock) / np.asarray(feed_mm_per_turn), straight)
