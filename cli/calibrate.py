"""`tsvision calibrate`: scale (and lens, blur, light) from two points, a ruler, a board, a pin."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.shared_options import with_options

if TYPE_CHECKING:
    import numpy as np

    from tsvision.images.calibration import Calibration

command = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help="Scale from two points, a ruler, a ChArUco board or a gauge pin, with its uncertainty.",
    context_settings={"help_option_names": ["-h", "--help"]},
)

PointsOption = Annotated[str | None, typer.Option("--points", help='Two points, "x,y x,y" in px.')]
GammaOption = Annotated[
    float | None, typer.Option("--gamma", help="Exponent that encodes the picture; else sRGB.")
]


@dataclass(frozen=True)
class Ending:
    """What every way to a scale ends in: the bundle's depth before the calibrated plane, and where
    the answer goes."""

    nearer_mm: float
    nearer_mm_sd: float
    distance_mm: float
    as_json: bool
    write: Path | None


def read_ending(
    nearer_mm: Annotated[
        float, typer.Option("--nearer-mm", help="How much nearer to the camera the bundle lies.")
    ] = 0.0,
    nearer_mm_sd: Annotated[
        float, typer.Option("--nearer-mm-sd", help="Standard uncertainty of that depth.")
    ] = 0.0,
    distance_mm: Annotated[
        float | None, typer.Option("--distance-mm", help="Camera to the calibrated plane.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="JSON on stdout.")] = False,
    write: Annotated[
        Path | None, typer.Option("--write", help="rig.toml to put the scale (and lens) into.")
    ] = None,
) -> Ending:
    """The options that all sub-commands share."""
    from tsvision.errors import InputError

    if not math.isfinite(nearer_mm):
        raise InputError(f"--nearer-mm {nearer_mm:g}: must be a finite number")
    _must_be_sd("--nearer-mm-sd", nearer_mm_sd)
    if distance_mm is not None:
        _must_be_more_than_0("--distance-mm", distance_mm)
    return Ending(nearer_mm, nearer_mm_sd, _or_nan(distance_mm), as_json, write)


@command.command()
@with_options(ending=read_ending)
def points(
    ends: Annotated[str, typer.Option("--points", help='Two points, "x,y x,y" in px.')],
    length_mm: Annotated[float, typer.Option("--length-mm", help="The length between them.")],
    length_mm_sd: Annotated[float, typer.Option("--length-mm-sd", help="Its uncertainty.")] = 0.0,
    point_sd_px: Annotated[
        float, typer.Option("--point-sd-px", help="How well each point is placed.")
    ] = 0.5,
    *,
    ending: Any,
) -> None:
    """Scale from two points and the length between them."""
    from tsvision.images.calibration import from_points

    first, second = _two_points(ends)
    _must_be_more_than_0("--length-mm", length_mm)
    _must_be_sd("--length-mm-sd", length_mm_sd)
    _must_be_sd("--point-sd-px", point_sd_px)
    found = from_points(first, second, length_mm, length_mm_sd, point_sd_px)
    _tell(found, ending)


@command.command()
@with_options(ending=read_ending)
def ruler(
    picture: Annotated[Path, typer.Argument(help="A picture with a ruler beside the bundle.")],
    ends: Annotated[str, typer.Option("--points", help='A line across the ticks, "x,y x,y".')],
    division_mm: Annotated[float, typer.Option("--division-mm", help="From tick to tick.")] = 1.0,
    gamma: GammaOption = None,
    *,
    ending: Any,
) -> None:
    """Scale from the ticks of a ruler along a line."""
    from tsvision.images.calibration_ruler import from_ruler

    _must_be_more_than_0("--division-mm", division_mm)
    first, second = _two_points(ends)
    found = from_ruler(_read(picture), first, second, division_mm, _gamma(gamma))
    _tell(found, ending)


@command.command()
@with_options(ending=read_ending)
def charuco(
    pictures: Annotated[
        list[Path],
        typer.Argument(help="Pictures of the board; the FIRST with it where the bundle is."),
    ],
    board: Annotated[
        str, typer.Option("--board", help='"7x5 square=5 marker=3.7 dict=DICT_4X4_50"')
    ],
    at: Annotated[
        str | None, typer.Option("--at", help='Where the scale is wanted, "x,y"; else mid board.')
    ] = None,
    *,
    ending: Any,
) -> None:
    """Scale and tilt from a ChArUco board; with three views or more the lens's distortion too."""
    from tsvision.errors import InputError
    from tsvision.images.calibration_charuco import calibrate_charuco, parse_board, see_board

    made = parse_board(board)
    seen = [(path, see_board(_read(path), made)) for path in pictures]
    if seen[0][1] is None:
        raise InputError(
            f"{pictures[0]}: the board is not seen; show it sharp, whole and unmirrored"
        )
    for path, view in seen:
        if view is None:
            typer.echo(f"{path}: the board is not seen; left out", err=True)
    place = _numbers(at, 2, "--at") if at else None
    found = calibrate_charuco(
        [view for _, view in seen if view is not None], (place[0], place[1]) if place else None
    )
    if math.isnan(ending.distance_mm):
        ending = replace(ending, distance_mm=found.found["distance_mm"])
    _tell(found, ending)


@command.command()
@with_options(ending=read_ending)
def gauge(
    picture: Annotated[Path, typer.Argument(help="A picture with a straight cylinder in it.")],
    diameter_mm: Annotated[float, typer.Option("--diameter-mm", help="Its known diameter.")],
    diameter_mm_sd: Annotated[
        float, typer.Option("--diameter-mm-sd", help="Its uncertainty.")
    ] = 0.0,
    roi: Annotated[str | None, typer.Option("--roi-px", help="x,y,width,height around it.")] = None,
    ends: PointsOption = None,
    gamma: GammaOption = None,
    *,
    ending: Any,
) -> None:
    """Scale, blur and light from a gauge pin or any cylinder of known diameter."""
    from tsvision.images.calibration_gauge import calibrate_gauge

    _must_be_more_than_0("--diameter-mm", diameter_mm)
    _must_be_sd("--diameter-mm-sd", diameter_mm_sd)
    box = _numbers(roi, 4, "--roi-px") if roi else None
    region = (int(box[0]), int(box[1]), int(box[2]), int(box[3])) if box else None
    axis = _two_points(ends) if ends else None
    pixels = _read(picture)
    found = calibrate_gauge(pixels, diameter_mm, diameter_mm_sd, region, axis, _gamma(gamma))
    _tell(found, ending)


def _read(path: Path) -> np.ndarray:
    from tsvision.errors import InputError
    from tsvision.images.frames_picture import Unreadable, read_picture

    try:
        return read_picture(path)
    except Unreadable as problem:
        raise InputError(f"{path}: {problem}") from None


def _numbers(text: str, count: int, option: str) -> list[float]:
    from tsvision.errors import InputError

    try:
        values = [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise InputError(f"{option} {text!r}: write {count} numbers, such as 10,20")
    return values


def _must_be_sd(option: str, value: float) -> None:
    from tsvision.errors import InputError

    # The check is written so that NaN, which no comparison holds for, is refused with the rest.
    if not 0.0 <= value < math.inf:
        raise InputError(f"{option} {value:g}: must be a finite number of 0 or more")


def _must_be_more_than_0(option: str, value: float) -> None:
    from tsvision.errors import InputError

    if not 0.0 < value < math.inf:
        raise InputError(f"{option} {value:g}: must be a finite number greater than 0")


def _two_points(text: str) -> tuple[tuple[float, float], tuple[float, float]]:
    x0, y0, x1, y1 = _numbers(text, 4, "--points")
    return (x0, y0), (x1, y1)


def _gamma(given: float | None) -> float:
    if given is not None:
        _must_be_more_than_0("--gamma", given)
    return _or_nan(given)


def _or_nan(value: float | None) -> float:
    return float("nan") if value is None else value


def _tell(found: Calibration, ending: Ending) -> None:
    from tsvision.images.calibration import moved_in_depth
    from tsvision.jsonable import to_json

    found = moved_in_depth(found, ending.nearer_mm, ending.nearer_mm_sd, ending.distance_mm)
    if ending.write is not None:
        _write(found, ending.write)
    if ending.as_json:
        told: dict[str, Any] = {
            "mm_per_px": found.mm_per_px,
            "mm_per_px_sd": found.mm_per_px_sd,
            "source": found.source,
            "parts": dict(found.parts),
            "lens": list(found.lens) or None,
            "found": dict(found.found),
            "notes": list(found.notes),
        }
        typer.echo(to_json(told), nl=False)
        return
    relative = 100 * found.mm_per_px_sd / found.mm_per_px
    typer.echo(f"mm_per_px = {found.mm_per_px:.7g} ± {found.mm_per_px_sd:.2g} ({relative:.2g} %)")
    for name, part in found.parts.items():
        typer.echo(f"  from {name}: {100 * part / found.mm_per_px:.2g} %")
    for name, value in found.found.items():
        if value == value:
            typer.echo(f"{name} = {value:.6g}")
    if found.lens:
        typer.echo("lens = [" + ", ".join(f"{v:.6g}" for v in found.lens) + "]")
    for note in found.notes:
        typer.echo(note, err=True)
    if ending.write is not None:
        typer.echo(f"written to {ending.write}")


def _write(found: Calibration, path: Path) -> None:
    from tsvision.rig_edit import set_keys

    values: dict[str, float | tuple[float, ...] | None] = {
        "camera.scale_from": None,
        "camera.mm_per_px_sd": found.mm_per_px_sd,
        "camera.mm_per_px": found.mm_per_px,
    }
    if found.lens:
        values["camera.lens"] = found.lens
    set_keys(path, values)
