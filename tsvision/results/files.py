"""The files of a measurement's folder, and which of them a new measurement replaces."""

from __future__ import annotations

from tsvision.staging import Kind

SUMMARY = "summary.json"
PROFILES = "profiles.parquet"
ALWAYS_THERE = (
    "frames.parquet",
    "frames.csv",
    PROFILES,
    "knots.parquet",
    "knots.csv",
    SUMMARY,
)
# made from a measurement: they would lie about the one that replaces it
_DERIVED = ("budget.csv", "report.html", "overlay.mp4", "sheet.jpg", "measured.rrd", "verdict.json")
OWN_FILES = frozenset({*ALWAYS_THERE, *_DERIVED})
MEASUREMENT = Kind("measurement", SUMMARY, lambda folder: OWN_FILES)
