"""Colours that readers with any colour vision can tell apart (Okabe & Ito 2008), as #rrggbb.

One colour, one meaning, in the page, the overlay, the video and the sheet alike.
"""

from __future__ import annotations

ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#999999"

EDGES = SKY
ENVELOPE = ORANGE
AXIS = GREY
NEAR_REGION = GREEN
KNOTS = VERMILLION
SEPARATOR = PURPLE

PHASES: dict[str, str] = {
    "twist": BLUE,
    "overtwist": GREEN,
    "local_overtwist": YELLOW,
    "knotted": VERMILLION,
    "irreversible": PURPLE,
}


def phase_key(phase: str) -> str:
    """The phase's name as PHASES spells it ("local overtwist" and "local_overtwist" are one)."""
    return str(phase).strip().replace(" ", "_")


def bgr(colour: str) -> tuple[int, int, int]:
    """#rrggbb to OpenCV's (blue, green, red)."""
    return int(colour[5:7], 16), int(colour[3:5], 16), int(colour[1:3], 16)
