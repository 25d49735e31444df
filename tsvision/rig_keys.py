"""The keys of rig.toml: type, bounds, unit and one line of help each. The command line's options,
the commented file of `tsvision rig init` and the docs are made from this page."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field


def _no_truth_values(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("must be a number, not true or false")
    return value


def _split_numbers(value: Any) -> Any:
    """`0,0,1280,720` from a command line, brackets or none; lists from TOML pass through."""
    if isinstance(value, str):
        return re.sub(r"[\[\](),;]", " ", value).split()
    return value


def _split_points(value: Any) -> Any:
    """`x,y x,y` from a command line, brackets or none, to [[x, y], [x, y]]."""
    if isinstance(value, str):
        numbers = _split_numbers(value)
        if len(numbers) % 2:
            raise ValueError("must hold pairs x,y")
        return [numbers[i : i + 2] for i in range(0, len(numbers), 2)]
    return value


def _in_picture(value: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    if value[0] < 0 or value[1] < 0 or value[2] < 1 or value[3] < 1:
        raise ValueError("must be x, y, width, height with x, y from 0 on and a size of at least 1")
    return value


def _two_apart(value: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    if len(value) != 2 or math.dist(*value) < 8:
        raise ValueError("must be two points at least 8 px apart, [[x0, y0], [x1, y1]]")
    return value


Number = Annotated[float, BeforeValidator(_no_truth_values), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Count = Annotated[int, BeforeValidator(_no_truth_values), Field(ge=1, le=1000)]
Coordinate = Annotated[int, BeforeValidator(_no_truth_values)]
Region = Annotated[
    tuple[Coordinate, Coordinate, Coordinate, Coordinate],
    BeforeValidator(_split_numbers),
    AfterValidator(_in_picture),
]
Points = Annotated[tuple[tuple[Number, Number], ...], BeforeValidator(_split_points)]
TwoPoints = Annotated[Points, AfterValidator(_two_apart)]
Lens = Annotated[
    tuple[Number, ...], BeforeValidator(_split_numbers), Field(min_length=9, max_length=9)
]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


def _key(help_text: str, example: str) -> Any:
    return Field(default=None, description=help_text, examples=[example])


class StringsKeys(_Section):
    count: Count | None = _key("N, number of strings; N = 2 is one line folded into a pair", "2")
    diameter_mm: Positive | None = _key("d, one string under load", "0.24")


class ActuatorKeys(_Section):
    twisting_zone_mm: Positive | None = _key(
        "L, separator face to motor connector at zero turns", "23.20"
    )
    hole_distance_mm: Positive | None = _key("S, between the separator's holes", "5.0")
    hole_diameter_mm: Positive | None = _key(
        "a knot wider than this cannot pass when unwinding", "0.6"
    )
    load_N: NotNegative | None = _key("the load, in newton (1 kgf = 9.80665 N)", "19.61")


class CameraKeys(_Section):
    mm_per_px: Positive | None = _key(
        "scale on the bundle's axis; without one mm stay empty", "0.02281"
    )
    mm_per_px_sd: NotNegative | None = _key("its standard uncertainty", "0.00002")
    scale_from: Literal["hole_distance", "length", "charuco", "ruler"] | None = _key(
        "in place of mm_per_px: hole_distance | length | charuco | ruler", '"hole_distance"'
    )
    length_mm: Positive | None = _key("for scale_from length (or ruler: one division)", "200.0")
    points_px: Points | None = _key(
        "for length: the two ends, pixels; without them the found axis is taken",
        "[[100, 200], [1100, 220]]",
    )
    board: str | None = _key(
        "for charuco: squares across x down, square and marker side in mm, dictionary",
        '"7x5 square=5 marker=3.7 dict=DICT_4X4_50"',
    )
    gamma: Positive | None = _key(
        "exponent that encodes the picture (1: linear light); unknown: by its noise, else sRGB",
        "2.2",
    )
    lens: Lens | None = _key(
        "fx, fy, cx, cy, k1, k2, p1, p2, k3 of `tsvision calibrate charuco`; undistorts frames",
        "[2400, 2400, 640, 360, -0.1, 0.02, 0, 0, 0]",
    )


class ViewKeys(_Section):
    separator_side: Literal["left", "right", "top", "bottom", "none", "auto"] | None = _key(
        "where the separator lies: left | right | top | bottom | none | auto", '"auto"'
    )
    roi_px: Region | None = _key("look only here: x, y, width, height", "[0, 0, 1280, 720]")
    axis_px: TwoPoints | None = _key(
        "two points on the bundle's axis, the first on the separator's face; else found",
        "[[120, 330], [1130, 385]]",
    )


SECTIONS: dict[str, type[BaseModel]] = {
    "strings": StringsKeys,
    "actuator": ActuatorKeys,
    "camera": CameraKeys,
    "view": ViewKeys,
}


def commented_file() -> str:
    """A rig.toml in which every key stands as a comment: uncomment what is known."""
    lines = [
        "# What is known of the rig. Every key is optional: uncomment and change what you know.",
        "# A millimetre is never invented: without a scale the mm columns stay empty.",
    ]
    for section, model in SECTIONS.items():
        lines += ["", f"[{section}]"]
        for name, info in model.model_fields.items():
            example = (info.examples or [""])[0]
            lines += [f"# {info.description}", f"# {name} = {example}"]
    return "\n".join(lines) + "\n"
