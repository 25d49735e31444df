"""`--model NAME` or `--model verdict.json`: of the shelf, or as a diagnosis extended it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tsvision.errors import InputError

if TYPE_CHECKING:
    from tsvision.actuator.geometry import Geometry


def choose(name: str) -> Any:
    """The shelf's model of that name, or the extended model of a verdict's JSON."""
    if name.endswith(".json"):
        return _from_verdict(Path(name))
    from tsvision.models.choose import choose_model

    return choose_model(name)


def _from_verdict(path: Path) -> Any:
    """The model of a verdict, tried once: a damaged file is told as such and not as a fault."""
    from tsvision.diagnosis.extended import load_model

    try:
        model = load_model(path)
        typical = model.reference
        model.displacement_mm(
            [0.0, 1.0],
            strings=2.0,
            radius_mm=typical.radius_mm,
            twisting_zone_mm=typical.zone_mm,
            hole_distance_mm=typical.hole_mm,
            load_N=typical.load_mean_N,
        )
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError) as problem:
        words = " ".join(str(problem).split())[:80]
        raise InputError(
            f"{path}: no model as `tsvision diagnose --json` writes it "
            f"({type(problem).__name__}: {words}); diagnose anew"
        ) from None
    return model


def keywords(chosen: Any, geometry: Geometry) -> dict[str, Any]:
    """What the model takes of the geometry; InputError names the options that it lacks."""
    from tsvision.actuator.geometry import model_keywords
    from tsvision.models.choose import check_strings

    if hasattr(chosen, "only_strings"):
        check_strings(chosen, geometry.strings)
    known: dict[str, Any] = dict(model_keywords(geometry))
    if geometry.strings is not None:
        known["strings"] = float(geometry.strings)
    if geometry.load_N == geometry.load_N:
        known["load_N"] = geometry.load_N
    lacking = [name for name in getattr(chosen, "parameters", ()) if name not in known]
    if lacking:
        raise InputError(
            f"model '{chosen.name}' needs {', '.join(lacking)}; give "
            f"{', '.join(dict.fromkeys(_option_of(name) for name in lacking))}, a --rig that holds "
            "them, or --paper N"
        )
    return chosen.geometry(known)


def _option_of(keyword: str) -> str:
    """The option that brings a model's keyword; radii follow from the bundle's diameter."""
    from tsvision.actuator.geometry import OPTION

    return OPTION["bundle_diameter_mm" if keyword.endswith("radius_mm") else keyword]


def completed(chosen: Any, geometry: Geometry) -> Geometry:
    """`geometry` with its gaps filled by what all of an extended model's data had in common."""
    nominal = getattr(chosen, "nominal", None)
    if nominal is None:
        return geometry
    own = {
        "strings": nominal["strings"],
        "string_diameter_mm": nominal["string_diameter_mm"],
        "twisting_zone_mm": nominal["twisting_zone_mm"],
        "hole_distance_mm": nominal["hole_distance_mm"],
        "bundle_diameter_mm": 2 * nominal["radius_mm"],
    }
    missing: dict[str, Any] = {
        key: round(value) if key == "strings" else value
        for key, value in own.items()
        if value == value
        and (getattr(geometry, key) is None or getattr(geometry, key) != getattr(geometry, key))
    }
    return replace(geometry, **missing)
