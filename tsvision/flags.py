"""Why a number may be bad.

One list drives the code, the decoder and the documentation: a new flag is one line in `Flag` and
one in `MEANING`, in the same order (importing this module fails when they differ).
"""

from __future__ import annotations

from enum import IntFlag, auto


class Flag(IntFlag):
    """Reasons, combined with `|`; `MEANING` tells each in words."""

    UNREADABLE = auto()
    WRONG_SIZE = auto()
    BLANK = auto()
    NO_BUNDLE = auto()
    NO_SEPARATOR = auto()
    NO_APEX = auto()
    NO_CONNECTOR = auto()
    NO_SCALE = auto()
    NO_TURNS = auto()
    SCALE_LOCAL = auto()
    STRAND_COUNT_GUESSED = auto()
    GAMMA_GUESSED = auto()
    ENVELOPE_ONLY = auto()
    NO_PITCH = auto()
    NO_HANDEDNESS = auto()
    FEW_LOBES = auto()
    TOO_FEW_TURNS = auto()
    EDGE_POOR = auto()
    FIBRES = auto()
    CURVED_AXIS = auto()
    CAMERA_MOVED = auto()
    KNOT_UNSURE = auto()
    COIL_UNSURE = auto()
    COIL_UNEVEN = auto()
    LIMB_UNSEEN = auto()
    CLIPPED = auto()
    OVEREXPOSED = auto()
    TURNS_DISAGREE = auto()
    FAILED = auto()


MEANING: dict[str, str] = {
    "UNREADABLE": "the picture could not be decoded; nothing was measured",
    "WRONG_SIZE": "the picture's size differs from the first frame's",
    "BLANK": "the picture holds no contrast (blank or saturated)",
    "NO_BUNDLE": "no bundle of strings was found, or none as wide as the stated strings make",
    "NO_SEPARATOR": "the separator was not found; s = 0 lies at the picture's edge or the apex",
    "NO_APEX": "the legs' meeting point was not found or lies out of view",
    "NO_CONNECTOR": "the motor connector was not found or lies out of view: no turn budget",
    "NO_SCALE": "no scale is known: mm columns are empty, px columns stand",
    "NO_TURNS": "the motor turns of this frame are unknown",
    "SCALE_LOCAL": "the scale along the axis is not the one given; pitches in mm are less sure",
    "STRAND_COUNT_GUESSED": "N was not given and was estimated from the picture",
    "GAMMA_GUESSED": "by its noise the file is not sRGB, gamma is its guess; state camera.gamma",
    "ENVELOPE_ONLY": "the helix fit did not hold; D is the silhouette's width between knots",
    "NO_PITCH": "pitch and angles could not be measured",
    "NO_HANDEDNESS": "the strands' ridges were too weak to tell S from Z",
    "FEW_LOBES": "fewer than two silhouette periods were in view",
    "TOO_FEW_TURNS": "the strands are hardly twisted; the helix is not defined yet",
    "EDGE_POOR": "the edges were weak or disagreed with the edge model",
    "FIBRES": "loose fibres or dust beside the bundle were cut away",
    "CURVED_AXIS": "the axis is curved; lengths follow the curve",
    "CAMERA_MOVED": "the camera or rig moved against the frame before",
    "KNOT_UNSURE": "an interval stands out but does not surely meet the knot criterion",
    "COIL_UNSURE": "neither outline nor light is sure of strands and coil; sds are larger for it",
    "COIL_UNEVEN": "no even coil fits; D and pitch are held near those of the frames before",
    "LIMB_UNSEEN": "one side of the strands is dark: D rests on the outline's shape; light it too",
    "CLIPPED": "the strings leave the picture sideways: what is seen of them is cut off there",
    "OVEREXPOSED": "part of the bundle is saturated",
    "TURNS_DISAGREE": "far more or fewer turns seen than the motor made: pitch or turns are wrong",
    "FAILED": "the program failed on this picture; the log says how, please report it",
}

REMARKS = frozenset({"FIBRES", "NO_CONNECTOR", "GAMMA_GUESSED"})
"""Flags that say what was done or is not in view, not that a number may be bad."""

if list(MEANING) != [flag.name for flag in Flag]:
    raise ImportError("tsvision.flags: Flag and MEANING list different names")


def flags_to_text(flags: int) -> str:
    """Names joined by `|`, in the order of the list; empty when nothing is wrong."""
    return "|".join(name for i, name in enumerate(MEANING) if int(flags) >> i & 1)


def doubtful(text: object) -> bool:
    """Whether a row's flags, as text, cast doubt on its numbers; no text, as NaN, does not."""
    return isinstance(text, str) and bool(set(filter(None, text.split("|"))) - REMARKS)


def flags_from_text(text: str) -> Flag:
    """Inverse of `flags_to_text`; raises KeyError on a name that is not in the list."""
    value = Flag(0)
    for name in filter(None, text.split("|")):
        value |= Flag[name]
    return value
