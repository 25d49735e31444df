"""The options by which every verb of the models learns an actuator's geometry."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tsvision.errors import InputError

if TYPE_CHECKING:
    import numpy as np

MOST_VALUES = 100_000

PaperOption = Annotated[
    int | None, typer.Option("--paper", help="Take the paper's system of N = 2, 4, 6 or 8 strings.")
]
RigOption = Annotated[Path | None, typer.Option("--rig", help="rig.toml to take values from.")]
StringsOption = Annotated[
    int | None, typer.Option("--strings", "--count", "-N", help="Number of strings.")
]
StringDiameterOption = Annotated[
    float | None,
    typer.Option("--string-diameter", "--diameter-mm", help="d, one string under load, mm."),
]
ZoneOption = Annotated[
    float | None, typer.Option("--zone", "--twisting-zone-mm", help="L, twisting zone, mm.")
]
HoleDistanceOption = Annotated[
    float | None,
    typer.Option(
        "--hole-distance", "--hole-distance-mm", help="S, between the separator's holes, mm."
    ),
]
HoleDiameterOption = Annotated[
    float | None,
    typer.Option("--hole-diameter", "--hole-diameter-mm", help="Diameter of a separator hole, mm."),
]
DiameterOption = Annotated[
    float | None,
    typer.Option("--diameter", help="D, bundle, mm; else from N, d and --section."),
]
SectionOption = Annotated[
    str, typer.Option("--section", help="Bundle model that gives D when it is not known.")
]
PitchOption = Annotated[
    float | None, typer.Option("--pitch", help="p beside the separator, mm (locked_pitch needs it)")
]
LoadOption = Annotated[float | None, typer.Option("--load", "--load-N", help="Load F, N.")]
JsonOption = Annotated[bool, typer.Option("--json", help="JSON on stdout.")]


def read_geometry(
    paper: PaperOption = None,
    rig: RigOption = None,
    strings: StringsOption = None,
    string_diameter: StringDiameterOption = None,
    zone: ZoneOption = None,
    hole_distance: HoleDistanceOption = None,
    diameter: DiameterOption = None,
    section: SectionOption = "pair_core",
    hole_diameter: HoleDiameterOption = None,
    pitch: PitchOption = None,
    load: LoadOption = None,
) -> Any:
    """Geometry from --paper, then --rig, then single options; the later wins."""
    from tsvision.actuator.geometry import (
        Geometry,
        known_values,
        override,
        paper_geometry,
        rig_geometry,
        with_bundle,
    )

    geometry = Geometry() if paper is None else paper_geometry(paper)
    if rig is not None:
        from tsvision.rig import load_rig

        geometry = override(geometry, **known_values(rig_geometry(load_rig(rig))))
    other_strings = strings is not None or string_diameter is not None
    if paper is not None and other_strings and diameter is None:
        # Other strings make another bundle: the caliper's D no longer belongs to them.
        geometry = Geometry(**{**known_values(geometry), "bundle_diameter_mm": float("nan")})  # type: ignore[arg-type]
    given = {
        "strings": strings,
        "string_diameter_mm": string_diameter,
        "twisting_zone_mm": zone,
        "hole_distance_mm": hole_distance,
        "bundle_diameter_mm": diameter,
        "hole_diameter_mm": hole_diameter,
        "pitch_mm": pitch,
        "load_N": load,
    }
    return with_bundle(override(geometry, **given), section)


def numbers(text: str, option: str) -> np.ndarray:
    """`0,10,20` or `start:stop:step` (stop included) as a float array; InputError otherwise."""
    import numpy as np

    try:
        if ":" in text:
            start, stop, step = (float(part) for part in text.split(":"))
            if abs(stop - start) > MOST_VALUES * abs(step):
                raise InputError(
                    f"{option} '{text}' asks for over {MOST_VALUES} values; step wider"
                )
            values = np.arange(start, stop + step * 1e-9, step)
        else:
            values = np.array([float(part) for part in text.split(",")])
    except InputError:
        raise
    except (ValueError, ZeroDivisionError):
        values = np.empty(0)
    if not values.size or not np.all(np.isfinite(values)):
        raise InputError(f"{option} '{text}' holds no numbers; write 0,10,20 or start:stop:step")
    return values
