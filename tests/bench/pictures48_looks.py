"""Lights and colours of the benchmark's pictures: front-lit from any side within 45 degrees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from synth.presets import look_named
from synth.settings import Look


def look_of(dark_on_bright: bool, light_deg: float) -> Look:
    """The renderer's look with its key light turned `light_deg` from the camera across the axis."""
    look = look_named("dark_on_bright" if dark_on_bright else "bright_on_dark")
    turn = np.deg2rad(light_deg)
    return replace(look, light=(0.1, float(np.sin(turn)), float(np.cos(turn))))
