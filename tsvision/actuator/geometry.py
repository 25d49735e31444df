"""One actuator's known geometry, and the keywords that the models take from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

from tsvision.data import table
from tsvision.errors import InputError
from tsvision.models import SECTIONS
from tsvision.records import NAN, Rig

OPTION = {
    "strings": "--strings",
    "string_diameter_mm": "--string-diameter",
    "twisting_zone_mm": "--zone",
    "hole_distance_mm": "--hole-distance",
    "bundle_diameter_mm": "--diameter",
    "hole_diameter_mm": "--hole-diameter",
    "pitch_mm": "--pitch",
    "load_N": "--load",
}


@dataclass(frozen=True)
class Geometry:
    """What is known of an actuator; NaN (or None for the count) where it is not."""

    strings: int | None = None
    string_diameter_mm: float = NAN
    twisting_zone_mm: float = NAN
    hole_distance_mm: float = NAN
    bundle_diameter_mm: float = NAN
    hole_diameter_mm: float = NAN
    pitch_mm: float = NAN
    load_N: float = NAN


def paper_geometry(strings: int) -> Geometry:
    """The paper's system with N = 2, 4, 6 or 8 strings (its diameters after 5 turns)."""
    systems = table("dimensions").set_index("strings")
    if strings not in systems.index:
        known = ", ".join(map(str, systems.index))
        raise InputError(f"the paper has no system of {strings} strings; choose from {known}")
    row = systems.loc[strings]
    single = table("diameter").set_index("strings")["diameter_mm"][1]
    return Geometry(
        strings=strings,
        string_diameter_mm=float(single),
        twisting_zone_mm=float(row["twisting_zone_mm"]),
        hole_distance_mm=float(row["hole_distance_mm"]),
        bundle_diameter_mm=float(row["bundle_diameter_mm"]),
    )


def rig_geometry(rig: Rig) -> Geometry:
    """The parts of a rig that the models need."""
    return Geometry(
        strings=rig.strings.count,
        string_diameter_mm=rig.strings.diameter_mm,
        twisting_zone_mm=rig.actuator.twisting_zone_mm,
        hole_distance_mm=rig.actuator.hole_distance_mm,
        hole_diameter_mm=rig.actuator.hole_diameter_mm,
        load_N=rig.actuator.load_N,
    )


def override(base: Geometry, **given: float | int | None) -> Geometry:
    """`base` with every given (not None) value in its place; InputError on a senseless one."""
    known = {name: value for name, value in given.items() if value is not None}
    for name, value in known.items():
        smallest_allowed = 0.0 if name in ("hole_distance_mm", "load_N") else math.ulp(0.0)
        if not (math.isfinite(value) and value >= smallest_allowed):
            bound = "at least 0" if smallest_allowed == 0.0 else "above 0"
            raise InputError(f"{OPTION[name]} is {value:g}; give a finite number {bound}")
    return replace(base, **known)  # type: ignore[arg-type]


def with_bundle(geometry: Geometry, section: str = "pair_core") -> Geometry:
    """Fill the bundle diameter from N, d and a bundle section where it was not given."""
    if section not in SECTIONS:
        raise InputError(f"no bundle section '{section}'; there are: {', '.join(SECTIONS)}")
    if not math.isnan(geometry.bundle_diameter_mm):
        return geometry
    if geometry.strings is None or math.isnan(geometry.string_diameter_mm):
        return geometry
    model = SECTIONS[section].bundle_diameter_mm
    diameter = float(model(geometry.strings, geometry.string_diameter_mm))
    return replace(geometry, bundle_diameter_mm=diameter)


def model_keywords(geometry: Geometry) -> dict[str, float]:
    """The models' keywords that are known, derived ones (radius, centre radius) included."""
    diameter, string = geometry.bundle_diameter_mm, geometry.string_diameter_mm
    keywords = {
        "twisting_zone_mm": geometry.twisting_zone_mm,
        "hole_distance_mm": geometry.hole_distance_mm,
        "string_diameter_mm": string,
        "pitch_mm": geometry.pitch_mm,
        "radius_mm": diameter / 2,
        "centre_radius_mm": (diameter - string) / 2,
    }
    return {name: value for name, value in keywords.items() if not math.isnan(value)}


def known_values(geometry: Geometry) -> dict[str, float | int]:
    """Name -> value of everything that is known, for tables and JSON."""
    found = {}
    for item in fields(geometry):
        value = getattr(geometry, item.name)
        if value is not None and not math.isnan(value):
            found[item.name] = value
    return found
