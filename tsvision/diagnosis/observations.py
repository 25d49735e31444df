"""What a table holds: observations and the conditions under which they were made."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tsvision.diagnosis.rows import NAN
from tsvision.mechanisms.state import Conditions


@dataclass(frozen=True)
class Sighting:
    """What the pictures of one run showed of a mechanism: it set in between `low` and `high` turns,
    or was not seen (`observed` False) although it would have been."""

    mechanism: str
    observed: bool
    low: float = NAN
    high: float = NAN


@dataclass(frozen=True)
class Table:
    """Observations and the conditions under which they were made.

    Row arrays have shape (n,): `observable` indexes `observables`, `condition` indexes `at`,
    `run` indexes `runs`, `before` is the row that precedes it in its run (-1: none).
    `radius_sd_mm`, `zone_sd_mm`, `hole_sd_mm` have shape (m,), like `at`'s arrays.
    """

    at: Conditions
    observables: tuple[str, ...]
    observable: np.ndarray
    condition: np.ndarray
    run: np.ndarray
    before: np.ndarray
    value: np.ndarray
    value_sd: np.ndarray
    runs: tuple[str, ...]
    radius_sd_mm: np.ndarray
    zone_sd_mm: np.ndarray
    hole_sd_mm: np.ndarray
    camera_sd: float
    load_recorded: bool
    gain_sd: dict[str, float] = field(default_factory=dict)  # observable -> sd of its gauge's gain
    # observable -> size of slow errors that its instrument is known to make along a recording
    drifts: dict[str, float] = field(default_factory=dict)
    # observable -> sd of a gain that differs from run to run
    run_gain_sd: dict[str, float] = field(default_factory=dict)
    sightings: tuple[Sighting, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        return len(self.value)

    def select(self, keep: np.ndarray) -> Table:
        """The rows where `keep` (n,) is true; conditions stay, so that indices hold."""
        picked = np.flatnonzero(keep)
        return Table(
            **{
                **{name: getattr(self, name) for name in self.__dataclass_fields__},
                **{
                    name: getattr(self, name)[picked]
                    for name in ("observable", "condition", "run", "value", "value_sd")
                },
                "before": _renumbered(self.before, picked),
            }
        )


def _renumbered(before: np.ndarray, picked: np.ndarray) -> np.ndarray:
    """`before` among the picked rows; a row whose predecessor is gone starts anew."""
    new = np.full(len(before) + 1, -1)
    new[picked] = np.arange(len(picked))
    return new[before[picked]]
