"""`tsvision synth`: render synthetic recordings with exact truth."""

from __future__ import annotations

from pathlib import Path

import typer

command = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@command.callback(invoke_without_command=True)
def record(
    context: typer.Context,
    out: Path | None = typer.Option(None, "--out", "-o", help="Folder to write."),
    turns: str = typer.Option(
        "0:70:2", "--turns", help="START:STOP:STEP, or several: 0:60:2,58:0:2 winds and unwinds."
    ),
    strings: int = typer.Option(2, "--strings", help="N, 2 to 10."),
    preset: str = typer.Option("clean", "--preset", help="clean, bench or hard."),
    look: str | None = typer.Option(
        None, "--look", help="Strands, ground and light; see docs/synth.md. Default: the preset's."
    ),
    seed: int = typer.Option(0, "--seed", help="Equal seeds give equal bytes."),
    view: str = typer.Option("full", "--view", help="full or closeup."),
    side: str = typer.Option("left", "--side", help="Separator: left, right, top, bottom."),
    handedness: str = typer.Option("Z", "--handedness", help="Z or S at positive turns."),
    knots: bool = typer.Option(True, "--knots/--no-knots", help="Whether knots form."),
    holes: int = typer.Option(2, "--holes", help="Holes of the separator: 2, 4 or 6."),
    size: str | None = typer.Option(None, "--size", help="Picture size, such as 1280x720."),
    diameter: float = typer.Option(0.24, "--diameter", help="d of one string, mm."),
    load: float = typer.Option(19.61, "--load", help="Load, N."),
    format: str | None = typer.Option(None, "--format", help="png, jpg, tif or mp4."),
    settings: list[str] = typer.Option(
        [], "--set", help="Any other setting, such as hidden.slip=0.03 or look.braid=0.4."
    ),
    names: bool = typer.Option(False, "--list", help="Print every setting with its default."),
    ids: bool = typer.Option(False, "--ids", help="Write the strand id maps too."),
    overwrite: bool = typer.Option(False, "--overwrite", help="Replace an earlier recording."),
    quiet: bool = typer.Option(False, "--quiet", "-q", help="No progress on stderr."),
) -> None:
    """Render a recording: frames, turns.csv, rig.toml, truth.parquet, truth.json."""
    if context.invoked_subcommand is not None:
        return
    from synth.build import make_settings, parse_turns
    from synth.recording import write_recording
    from synth.settings import Actuator, Strings
    from tsvision.errors import InputError

    if names:
        print_settings()
        return
    if out is None:
        raise InputError("no folder to write; give --out DIR")
    changes: dict[str, object] = {"camera.view": view, "camera.side": side, "law.knots": knots}
    if side in ("top", "bottom"):
        changes.update({"camera.width_px": 720, "camera.height_px": 1280})
    if size is not None:
        changes.update(parse_size(size))
    if format is not None:
        changes["sensor.format"] = format
        if format == "mp4":
            changes["sensor.quality"] = 20
    changes.update(parse_pairs(settings))
    full = make_settings(
        parse_turns(turns),
        preset,
        seed,
        look,
        Strings(count=strings, diameter_mm=diameter, handedness=handedness),
        Actuator(holes=holes, load_N=load),
        changes,
    )
    from cli.progress import frame_progress

    with frame_progress(f"rendering {out.name}", quiet) as progress:
        folder = write_recording(out, full, overwrite, progress, ids)
    print(folder)


@command.command()
def view(
    turns: str = typer.Option("64", "--turns", help="One turn count, or START:STOP:STEP."),
    strings: int = typer.Option(2, "--strings", help="N, 2 to 10."),
    handedness: str = typer.Option("Z", "--handedness", help="Z or S."),
    holes: int = typer.Option(2, "--holes", help="Holes of the separator: 2, 4 or 6."),
    seed: int = typer.Option(0, "--seed", help="Where knots form."),
    png: Path | None = typer.Option(None, "--png", help="Write a picture of the last state."),
    movie: Path | None = typer.Option(None, "--movie", help="Write all states as .gif or .mp4."),
    gltf: Path | None = typer.Option(None, "--gltf", help="Write the last state as .glb."),
    size: str = typer.Option("1280x720", "--size", help="Picture size."),
    settings: list[str] = typer.Option([], "--set", help="Any setting, as for `synth`."),
) -> None:
    """The same scene in 3-D: a window, or files. Only the .glb works without OpenGL."""
    from synth.actuator import state_at
    from synth.build import make_settings, parse_turns
    from synth.gltf import write_glb
    from synth.meshes import scene_meshes
    from synth.settings import Actuator, Strings
    from synth.validate import check
    from synth.view3d import save_movie, save_png, show
    from tsvision.errors import InputError

    if gltf is not None and gltf.suffix != ".glb":
        raise InputError(f"--gltf {gltf}: the name must end in .glb")
    full = make_settings(
        parse_turns(turns),
        seed=seed,
        strings=Strings(count=strings, handedness=handedness),
        actuator=Actuator(holes=holes),
        changes={**parse_size(size), **parse_pairs(settings)},
    )
    check(full)
    if gltf is not None:
        print(write_glb(gltf, scene_meshes(full, state_at(full, len(full.turns) - 1))))
    if png is not None:
        print(save_png(png, full))
    if movie is not None:
        print(save_movie(movie, full))
    if gltf is None and png is None and movie is None:
        show(full)


def parse_pairs(pairs: list[str]) -> dict[str, object]:
    """`group.name=value` words -> a dict; the values stay text until their setting is known."""
    from tsvision.errors import InputError

    found: dict[str, object] = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals:
            raise InputError(f"--set {pair} has no '='; write it as group.name=value")
        found[key.strip()] = value.strip()
    return found


def parse_size(text: str) -> dict[str, object]:
    """`1280x720` -> the two camera settings."""
    from tsvision.errors import InputError

    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdigit() and height.isdigit()):
        raise InputError(f"--size '{text}' cannot be read; give WIDTHxHEIGHT such as 1280x720")
    return {"camera.width_px": int(width), "camera.height_px": int(height)}


def print_settings() -> None:
    """Every setting and its default, one a line."""
    from synth.build import setting_names
    from synth.settings import Settings

    default = Settings()
    for name in setting_names():
        group, _, field = name.rpartition(".")
        print(f"{name} = {getattr(getattr(default, group) if group else default, field)!r}")
