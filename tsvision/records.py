"""Every noun of the pipeline on one page.

Constructors store; functions elsewhere compute and return. Lengths are in mm unless the name
says `_px`; angles in rad; pixel centres lie at integer coordinates, x right, y down.
Unknown numbers are NaN, never 0.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

NAN = float("nan")


# ------------------------------------------------------------------ what is known of the rig


@dataclass(frozen=True)
class Strings:
    """N strings of diameter d under load."""

    count: int | None = None
    diameter_mm: float = NAN


@dataclass(frozen=True)
class Actuator:
    """The paper's L, S, hole and load."""

    twisting_zone_mm: float = NAN
    hole_distance_mm: float = NAN
    hole_diameter_mm: float = NAN
    load_N: float = NAN


@dataclass(frozen=True)
class Camera:
    """Scale as given, or the recipe to find it (`scale_from`)."""

    mm_per_px: float = NAN
    mm_per_px_sd: float = NAN
    scale_from: str | None = None  # hole_distance | length | charuco | ruler
    length_mm: float = NAN
    points_px: tuple[tuple[float, float], ...] = ()
    board: str | None = None
    gamma: float = NAN  # exponent that encodes the picture; NaN: as its noise tells, else sRGB
    lens: tuple[float, ...] = ()  # fx, fy, cx, cy, k1, k2, p1, p2, k3; empty: no distortion known


@dataclass(frozen=True)
class View:
    """Where to look. `roi_px` is x, y, width, height; `axis_px` two points on the bundle's axis,
    the first on the separator's exit face (empty: both are found)."""

    separator_side: str = "auto"  # left | right | top | bottom | none | auto
    roi_px: tuple[int, int, int, int] | None = None
    axis_px: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Rig:
    """All of rig.toml; `source` tells where each value came from."""

    strings: Strings = Strings()
    actuator: Actuator = Actuator()
    camera: Camera = Camera()
    view: View = View()
    source: dict[str, str] = field(default_factory=dict)


# ------------------------------------------------------------------ pictures


@dataclass(frozen=True)
class Frame:
    """One picture as decoded: `pixels` is (H, W) grey or (H, W, 3) BGR, uint8 or uint16.

    `pixels` is None when it could not be decoded; `problem` then says why, in words.
    """

    index: int
    file: str
    pixels: np.ndarray | None
    problem: str = ""


@dataclass(frozen=True)
class Recording:
    """A sequence of frames with what is known of each. Pixels are read when iterated, not here.

    `turns`, `time_s`, `displacement_mm`, `load_N`, `cycle` are float arrays of length
    `len(files)`, NaN where unknown. `kind` is folder | tiff | video.
    """

    source: Path
    kind: str
    files: tuple[str, ...]
    turns: np.ndarray
    time_s: np.ndarray
    displacement_mm: np.ndarray
    load_N: np.ndarray
    cycle: np.ndarray
    rig: Rig
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Scale:
    """mm per px on the bundle's axis with its standard uncertainty and where it came from."""

    mm_per_px: float = NAN
    mm_per_px_sd: float = NAN
    source: str = "none"


# ------------------------------------------------------------------ what was measured


@dataclass(frozen=True)
class KnotSighting:
    """One knot in one frame: an interval of the envelope that stands out (see measurands).

    Lengths in mm are NaN without a scale; those in px stand in any case."""

    centre_mm: float
    length_mm: float
    max_diameter_mm: float
    centre_x_px: float
    centre_y_px: float
    confidence: float = NAN
    coils: float = NAN
    centre_px: float = NAN
    length_px: float = NAN
    max_diameter_px: float = NAN

    @property
    def ends_px(self) -> tuple[float, float]:
        """Where it begins and ends along the axis."""
        half = 0.5 * self.length_px
        return self.centre_px - half, self.centre_px + half


@dataclass(frozen=True)
class Profile:
    """Silhouette along the axis: all arrays (M,). `upper_px`/`lower_px` are signed distances of
    the two edges from the axis along n = (-u_y, u_x), u from the separator to the connector, NaN
    where an edge is not seen; `envelope_mm` is E(s), the outer diameter about the zone's straight
    axis. Where the axis itself bows, `axis_x_px` and `axis_y_px` are its points in the picture;
    None where it is straight."""

    s_mm: np.ndarray
    s_px: np.ndarray
    upper_px: np.ndarray
    lower_px: np.ndarray
    width_mm: np.ndarray
    envelope_mm: np.ndarray
    axis_x_px: np.ndarray | None = None
    axis_y_px: np.ndarray | None = None


@dataclass(frozen=True)
class FrameRow:
    """One row of `frames.csv`; the field order is the column order. Names and units are fixed."""

    frame: int
    file: str
    turns: float = NAN
    time_s: float = NAN
    diameter_mm: float = NAN
    diameter_mm_sd: float = NAN
    diameter_px: float = NAN
    diameter_px_sd: float = NAN
    pitch_mm: float = NAN
    pitch_mm_sd: float = NAN
    pitch_px: float = NAN
    pitch_px_sd: float = NAN
    strand_repeat_px: float = NAN
    helix_angle_rad: float = NAN
    helix_angle_rad_sd: float = NAN
    lay_angle_rad: float = NAN
    lay_angle_rad_sd: float = NAN
    handedness: str = ""
    handedness_confidence: float = NAN
    strand_count: float = NAN
    strand_count_confidence: float = NAN
    midspan_diameter_mm: float = NAN
    midspan_diameter_mm_sd: float = NAN
    midspan_helix_angle_rad: float = NAN
    coil_amplitude_mm: float = NAN
    coil_amplitude_px: float = NAN
    coil_pitch_mm: float = NAN
    unevenness: float = NAN
    baseline_envelope_mm: float = NAN
    baseline_envelope_px: float = NAN
    max_envelope_mm: float = NAN
    max_envelope_px: float = NAN
    knot_count: float = NAN
    phase: str = ""
    turns_seen: float = NAN
    turns_seen_sd: float = NAN
    turn_budget_error: float = NAN
    string_length_mm: float = NAN
    string_length_mm_sd: float = NAN
    displacement_mm: float = NAN
    load_N: float = NAN
    cycle: float = NAN
    mm_per_px: float = NAN
    mm_per_px_sd: float = NAN
    axis_x0_px: float = NAN
    axis_y0_px: float = NAN
    axis_x1_px: float = NAN
    axis_y1_px: float = NAN
    apex_mm: float = NAN
    apex_x_px: float = NAN
    apex_y_px: float = NAN
    separator_x_px: float = NAN
    separator_y_px: float = NAN
    hole_distance_mm: float = NAN
    hole_distance_mm_sd: float = NAN
    gamma: float = NAN
    blur_px: float = NAN
    fit_rms_px: float = NAN
    diameter_px_sd_noise: float = NAN
    diameter_px_sd_light: float = NAN
    diameter_px_sd_blur: float = NAN
    diameter_px_sd_section: float = NAN
    flags: str = ""


@dataclass(frozen=True)
class FrameResult:
    """All that one frame yields. `profile` is None when nothing was found; `lobes` reach as far as
    a knot, but over less than a knot's length."""

    row: FrameRow
    profile: Profile | None = None
    knots: tuple[KnotSighting, ...] = ()
    lobes: tuple[KnotSighting, ...] = ()

    @property
    def sightings(self) -> tuple[KnotSighting, ...]:
        """What the account takes: knots, and lobes that may turn out to be a knot's."""
        return self.knots + self.lobes


# ------------------------------------------------------------------ events


@dataclass(frozen=True)
class Onset:
    """First turn count of a phase that then persists; `last_turns` is where the data end.

    status: observed | not_observed (right-censored) | undetermined.
    """

    status: str
    turns: float | None
    low: float | None
    high: float | None
    last_turns: float
    level: float = 0.95
