"""What single measured frames say, as observables with their standard deviations."""

from __future__ import annotations

import math

import numpy as np

from tsvision.diagnosis.rows import NAN

# Where hardly a lobe is seen, strands that still run apart are easily taken for a bundle.
NO_DIAMETER = {"NO_SCALE", "TOO_FEW_TURNS", "CLIPPED", "FEW_LOBES", "ENVELOPE_ONLY", "NO_PITCH"}
NO_PITCH = {"ENVELOPE_ONLY", "NO_PITCH", "AMBIGUOUS_HARMONIC", "TOO_FEW_TURNS", "FEW_LOBES"}
NO_HELIX = {"ENVELOPE_ONLY", "NO_PITCH", "AMBIGUOUS_HARMONIC", "TOO_FEW_TURNS"}
LEAST_SD = {"diameter_mm": 0.004, "helix_angle_deg": 0.2, "hole_distance_mm": 0.02}
LEAST_TURNS = 0.1  # what a pitch tells of the turns in the strands, at best
COILED_SD = 0.02  # of the turns seen where the bundle coils: 68 in 100 of rendered frames
FEWEST_TURNS = 1.0
STEEPEST_RAD = math.radians(70.0)  # strands side by side cannot be laid steeper
STRAIGHT = "twist"  # the phase in which the zone's mean helix is the one beside the separator
KNOTTED = {"knotted", "irreversible"}  # from here on, knots keep turns that the motor takes back


def seen_in(
    frame: dict, flags: set[str], turns: float, zone_mm: float, straight: bool
) -> list[dict]:
    """What one frame says, as observables with their standard deviations. Where the bundle is not
    `straight`, its pitch does not tell the turns."""
    said = [("displacement_mm", number_of(frame.get("displacement_mm")), NAN)]
    angle, angle_sd = (number_of(frame.get(f"helix_angle_rad{end}")) for end in ("", "_sd"))
    pitch, pitch_sd = (number_of(frame.get(f"pitch_mm{end}")) for end in ("", "_sd"))
    # Before the first turn there is hardly a bundle to see, and what is seen is the legs.
    laid = not angle > STEEPEST_RAD and not turns < FEWEST_TURNS
    if laid and not flags & NO_DIAMETER:
        said.append(
            (
                "diameter_mm",
                number_of(frame.get("diameter_mm")),
                number_of(frame.get("diameter_mm_sd")),
            )
        )
    straight = straight and laid
    least = {**LEAST_SD, "pitch_mm": LEAST_TURNS * pitch**2 / zone_mm}
    if straight and not flags & NO_PITCH and not math.isnan(least["pitch_mm"]):
        said.append(("pitch_mm", pitch, pitch_sd))
    elif straight and not flags & NO_HELIX:
        said.append(("helix_angle_deg", math.degrees(angle), math.degrees(angle_sd)))
    return [
        {
            "observable": name,
            "value": value,
            "value_sd": NAN if math.isnan(sd) else math.hypot(sd, least[name]),
        }
        for name, value, sd in said
        if not math.isnan(value)
    ]


def seen_coiled(frame: dict, flags: set[str]) -> list[dict]:
    """Turns of strands and coils together, where the pitch alone does not tell the turns. Knots
    hide up to a sixth of theirs on small pictures: with them, nothing is said."""
    seen, sd = number_of(frame.get("turns_seen")), number_of(frame.get("turns_seen_sd"))
    if flags & NO_PITCH or math.isnan(seen) or math.isnan(sd):
        return []
    return [
        {"observable": "turns_seen", "value": seen, "value_sd": math.hypot(sd, COILED_SD * seen)}
    ]


def gap_in(frame: dict, constants: dict[str, float]) -> dict:
    """S as the legs show it; nothing where they do not, or where more strings than two leave holes
    of which the legs' outlines tell no single distance."""
    gap, sd = (number_of(frame.get(f"hole_distance_mm{end}")) for end in ("", "_sd"))
    if math.isnan(gap) or math.isnan(sd) or constants["strings"] != 2.0:
        return {}
    least = LEAST_SD["hole_distance_mm"]
    return {"observable": "hole_distance_mm", "value": gap, "value_sd": math.hypot(sd, least)}


def zone_seen_mm(frames: list[dict], turned: list[float], coiled: float) -> float:
    """The zone that turns and pitch of the straight bundle make up; NaN where none is read."""
    made_up = []
    for frame, turns in zip(frames, turned, strict=True):
        seen, pitch, apex = (number_of(frame.get(k)) for k in ("turns_seen", "pitch_mm", "apex_mm"))
        if FEWEST_TURNS < turns < coiled and not math.isnan(seen + pitch + apex):
            made_up.append(apex + (seen - 0.25) * pitch)
    return float(np.median(made_up)) if made_up else NAN


def coiled_from(frames: list[dict], turned: list[float]) -> float:
    """The fewest turns, up to the first knot, at which the bundle was no longer straight: on the
    other branch the same turns may pass as straight, by little."""
    fewest = math.inf
    for frame, turns in zip(frames, turned, strict=True):
        phase = frame.get("phase") or STRAIGHT
        if phase != STRAIGHT:
            fewest = min(fewest, turns)
        if phase in KNOTTED:
            break
    return fewest


def middle_of(frames: list[int], turned: list[float]) -> int:
    """Of some frames, one in the midst of their turns; -1 where there are none."""
    known = sorted((i for i in frames if not math.isnan(turned[i])), key=lambda i: turned[i])
    return known[len(known) // 2] if known else -1


def number_of(text: object) -> float:
    try:
        return float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return NAN
