"""A table of bundle diameters against N, as DATA."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tsvision.errors import InputError

USUAL_SD_MM = 0.02
STRING_SD = 0.01  # default relative tolerance of d
LEAST_COUNTS = 3


@dataclass(frozen=True)
class Diameters:
    """Measured bundle diameters: arrays (n,). `lay_rad` is NaN where turns or zone are unknown."""

    count: np.ndarray
    string_mm: np.ndarray
    string_sd_mm: np.ndarray
    value: np.ndarray
    sd: np.ndarray
    lay_rad: np.ndarray
    notes: tuple[str, ...] = ()

    def take(self, keep: np.ndarray) -> Diameters:
        return replace(
            self,
            count=self.count[keep],
            string_mm=self.string_mm[keep],
            string_sd_mm=self.string_sd_mm[keep],
            value=self.value[keep],
            sd=self.sd[keep],
            lay_rad=self.lay_rad[keep],
        )


def is_bundle_table(header: list[str], rows: list[dict]) -> bool:
    """Whether DATA is about diameters alone: no other observable, several N, no nominal D."""
    if "strings" not in header or "bundle_diameter_mm" in header:
        return False
    if "observable" in header:
        kinds = {str(row.get("observable") or "").strip() for row in rows}
        several = len({row.get("strings") for row in rows}) >= LEAST_COUNTS
        return kinds == {"diameter_mm"} and several
    return "diameter_mm" in header and "turns" not in header and "displacement_mm" not in header


def read_diameters(
    header: list[str], rows: list[dict], string_mm: float, zone_mm: float, where: str
) -> Diameters:
    """Rows of text to `Diameters`; d from its column, the rig, or the measured single string."""
    from tsvision.diagnosis.rows import number

    value_key = "value" if "value" in header else "diameter_mm"
    sd_key = next((k for k in ("value_sd", "diameter_sd_mm", "diameter_mm_sd") if k in header), "")

    def column(name: str) -> np.ndarray:
        return np.array([number(row.get(name), name, i, where) for i, row in enumerate(rows, 2)])

    value, count = column(value_key), column("strings")
    keep = np.isfinite(value) & np.isfinite(count)
    if np.any(count[keep] < 1) or np.any(count[keep] % 1):
        raise InputError(f"{where}: 'strings' must be whole numbers of at least 1")
    d = (
        column("string_diameter_mm")
        if "string_diameter_mm" in header
        else np.full(len(rows), string_mm)
    )
    d_sd = column("string_diameter_mm_sd") if "string_diameter_mm_sd" in header else STRING_SD * d
    sd = column(sd_key) if sd_key else np.full(len(rows), USUAL_SD_MM)
    sd = np.where(np.isnan(sd), USUAL_SD_MM, sd)
    notes: tuple[str, ...] = ()
    unknown = np.isnan(d)
    if np.any(unknown[keep]):
        single = keep & (count == 1)
        if not single.any():
            raise InputError(
                f"{where}: the strings' diameter is unknown; add 'string_diameter_mm', a row of "
                "one string, or strings.diameter_mm in --rig"
            )
        d = np.where(unknown, value[single].mean(), d)
        d_sd = np.where(unknown, np.sqrt(np.sum(sd[single] ** 2)) / single.sum(), d_sd)
        # That reading tells d and no more: as a bundle of one it would be right by itself.
        keep &= ~(single & unknown)
        notes = ("d is the measured diameter of the single string",)
    turns = column("turns") if "turns" in header else np.full(len(rows), np.nan)
    zone = (
        column("twisting_zone_mm") if "twisting_zone_mm" in header else np.full(len(rows), zone_mm)
    )
    lay = np.arctan(2 * np.pi * np.abs(turns) * (value - d) / 2 / zone)
    if np.any(value[keep] <= 0):
        raise InputError(f"{where}: a diameter must be above 0 mm")
    return Diameters(
        count[keep],
        d[keep],
        np.where(np.isnan(d_sd), STRING_SD * d, d_sd)[keep],
        value[keep],
        sd[keep],
        lay[keep],
        notes,
    )
