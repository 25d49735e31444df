"""`tsvision rig`: write a commented rig.toml, or show what is in force and from where."""

from __future__ import annotations

from pathlib import Path

import typer

from cli.rig_options import with_rig_options

command = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help="Write a commented rig.toml, or show what is in force and where each value came from.",
    context_settings={"help_option_names": ["-h", "--help"]},
)


@command.command()
def init(
    path: Path = typer.Argument(Path("rig.toml"), help="File to write, or the recording's folder."),
    overwrite: bool = typer.Option(False, "--overwrite", help="Replace an existing file."),
) -> None:
    """Write a commented rig.toml: uncomment what you know."""
    from tsvision.atomic import write_text
    from tsvision.errors import InputError
    from tsvision.rig_keys import commented_file

    target = path / "rig.toml" if path.is_dir() else path
    if target.exists() and not overwrite:
        raise InputError(f"{target}: exists; --overwrite replaces it")
    write_text(target, commented_file())
    typer.echo(target)


@command.command()
@with_rig_options
def show(
    source: Path | None = typer.Argument(None, help="rig.toml or a recording; else ./rig.toml."),
    as_json: bool = typer.Option(False, "--json", help="Keys, values and sources as JSON."),
    rig_path: Path | None = None,
    overrides: dict[str, object] = {},  # noqa: B006 - never changed
) -> None:
    """Print what is in force, and where each value came from."""
    from tsvision.errors import InputError
    from tsvision.jsonable import to_json
    from tsvision.rig import find_rig, load_rig, rig_values

    source = Path() if source is None else source
    if not source.exists():
        raise InputError(f"{source}: no such file or folder; check the path")
    if rig_path is None:
        rig_path = source if source.suffix == ".toml" else find_rig(source)
    rig = load_rig(rig_path, overrides)
    values = rig_values(rig)
    if as_json:
        rows = {key: {"value": values[key], "source": rig.source[key]} for key in values}
        typer.echo(to_json(rows), nl=False)
        return
    shown = {key: "-" if value is None else str(value) for key, value in values.items()}
    width_key, width_value = max(map(len, shown)), max(map(len, shown.values()))
    for key, text in shown.items():
        typer.echo(f"{key:<{width_key}}  {text:<{width_value}}  {rig.source[key]}")
