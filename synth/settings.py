"""Every parameter of a synthetic recording, as frozen nouns. Functions elsewhere use them.

Lengths in mm, angles in rad where the name does not say `_deg`, turns are motor turns.
"""

from __future__ import annotations

from dataclasses import dataclass, field

# The paper's rig by N: twisting zone L (mm), turns at which overtwist was seen to begin.
PAPER_ZONE_MM = {2: 23.20, 4: 23.42, 6: 22.85, 8: 23.30}
PAPER_ONSET_TURNS = {2: 20.0, 4: 11.0, 6: 10.0, 8: 8.0}


@dataclass(frozen=True)
class Strings:
    """N strings of diameter d; `section` is pair_core or ring; handedness Z or S at turns > 0."""

    count: int = 2
    diameter_mm: float = 0.24
    section: str = "pair_core"
    handedness: str = "Z"


@dataclass(frozen=True)
class Actuator:
    """The rig. `twisting_zone_mm` None takes the paper's L for this N."""

    twisting_zone_mm: float | None = None
    hole_distance_mm: float = 5.0
    hole_diameter_mm: float | None = None
    holes: int = 2
    load_N: float = 19.61


@dataclass(frozen=True)
class Law:
    """How the bundle goes from twist to knots. Turn counts None scale with the paper's onset.

    `coil_pitch_D`, `knot_pitch_D`, `knot_radius_D`, `knot_length_D` are in units of D.
    `displacement` names the law written to turns.csv (geometry | constant_radius |
    variable_radius | linear); `follow` says whether the scene is laid by its own geometry
    (pitch locked at the onset) or so that its string length obeys the law.
    """

    overtwist_turns: float | None = None
    local_turns: float | None = None
    knot_turns: float | None = None
    knots: bool = True
    knot_count: int = 3
    knot_interval_turns: float | None = None
    knot_growth_turns: float | None = None
    coil_pitch_D: float = 1.9
    knot_pitch_D: float = 1.4
    knot_radius_D: float = 1.15
    knot_length_D: float = 3.6
    drift_mm_per_turn: float = 0.03
    local_depth: float = 0.75
    stuck_knot: bool = False
    displacement: str = "geometry"
    follow: str = "geometry"


@dataclass(frozen=True)
class Hidden:
    """Effects to be found. Every default is the null; none of them leaves the truth file."""

    slip: float = 0.0  # share of every turn that is lost
    lost_turns: float = 0.0
    backlash_turns: float = 0.0
    stretch_per_N: float = 0.0  # strain per N of string tension
    compression_exponent: float = 0.0  # d shrinks as (tension / 10 N) ** -exponent
    creep_mm_per_decade: float = 0.0
    radius_step: float = 0.0  # relative step of the section's radius
    radius_step_turns: float = 0.0
    knot_absorption: float = 0.0  # share of the turns past the first knot that draw no string
    hole_distance_error_mm: float = 0.0  # true minus stated
    zone_length_error_mm: float = 0.0
    diameter_error_mm: float = 0.0
    camera_scale_error: float = 0.0  # true over stated scale, minus 1
    unequal_diameters: float = 0.0  # relative spread over the strands
    flattening: float = 0.0  # radial axis shrinks by this share, the other grows alike
    slack_pair: float = 0.0  # relative extra radius of one pair, waxing and waning along s
    taper: float = 0.0  # relative change of the section from separator to connector
    diameter_drift: float = 0.0  # relative change of the section over the turns up to the onset


@dataclass(frozen=True)
class Camera:
    """`px_per_mm` None fits the view. `distance_mm` 0 means telecentric."""

    width_px: int = 1280
    height_px: int = 720
    view: str = "full"  # full | closeup
    side: str = "left"  # where the separator lies: left | right | top | bottom
    px_per_mm: float | None = None
    distance_mm: float = 0.0
    roll_deg: float = 0.0
    yaw_deg: float = 0.0
    tilt_deg: float = 0.0
    k1: float = 0.0  # radial distortion, in units of the half diagonal: r' = r (1 + k1 r^2 + ...)
    k2: float = 0.0
    shift_x_px: float = 0.0
    shift_y_px: float = 0.0
    blur_px: float = 0.7
    defocus_px_per_mm: float = 0.0  # extra blur sigma per mm away from the focal plane
    focus_mm: float = 0.0  # height of the focal plane above the axis at mid zone
    turning_blur_turns: float = 0.0  # motor turns during one exposure
    rolling_turns: float = 0.0  # motor turns from the first row read to the last


@dataclass(frozen=True)
class Look:
    """Colours are linear-light RGB in 0..1 reflectance; lights come from unit directions."""

    strand_rgb: tuple[tuple[float, float, float], ...] = ((0.75, 0.75, 0.72),)
    ground_rgb: tuple[float, float, float] = (0.05, 0.045, 0.04)
    plate_rgb: tuple[float, float, float] = (0.12, 0.22, 0.45)
    metal_rgb: tuple[float, float, float] = (0.35, 0.35, 0.37)
    light: tuple[float, float, float] = (0.1, 0.45, 0.9)  # x right, y up, z to the camera
    light_strength: float = 0.8
    ambient: float = 0.25
    specular: float = 0.08
    gloss: float = 24.0
    occlusion: float = 0.45  # darkening of the grooves between strands
    backlight: bool = False  # strands before a bright screen
    ground_gradient: tuple[float, float] = (0.0, 0.0)  # relative change over width, height
    light_gradient: tuple[float, float] = (0.0, 0.0)  # the same for the light on the strands
    ground_texture: float = 0.0
    shadow: float = 0.0
    shadow_offset_mm: tuple[float, float] = (0.6, -0.9)
    vignetting: float = 0.0
    braid: float = 0.0  # depth of the strands' braided texture
    fibres_per_mm: float = 0.0
    dust: int = 0
    cable: bool = False  # another cable in view


@dataclass(frozen=True)
class Sensor:
    """Photon noise from `full_well_e` (0: none), read noise in electrons, gamma encoding."""

    full_well_e: float = 20000.0
    read_noise_e: float = 8.0
    exposure: float = 1.0
    gamma: float = 2.2
    grey: bool = False
    bits: int = 8
    format: str = "png"  # png | jpg | tif | mp4
    quality: int = 90  # JPEG quality, or H.264 crf for mp4


@dataclass(frozen=True)
class Settings:
    """All of one recording. `turns` in motor turns, one a frame; equal seeds give equal bytes."""

    turns: tuple[float, ...] = ()
    strings: Strings = field(default_factory=Strings)
    actuator: Actuator = field(default_factory=Actuator)
    law: Law = field(default_factory=Law)
    hidden: Hidden = field(default_factory=Hidden)
    camera: Camera = field(default_factory=Camera)
    look: Look = field(default_factory=Look)
    sensor: Sensor = field(default_factory=Sensor)
    preset: str = "clean"
    seconds_per_turn: float = 1.0
    displacement_noise_mm: float = 0.0  # sd of the recorded displacement
    seed: int = 0
