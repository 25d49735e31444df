"""`tsvision setup RECORDING`: put right by eye what was found, write rig.toml."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer


def command(
    recording: Annotated[Path, typer.Argument(help="A folder of frames, a video, a TIFF.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", help="Default: rig.toml beside the frames, NAME.rig.toml of a film."
        ),
    ] = None,
    frame: Annotated[int, typer.Option(help="The frame to show first, from 0.")] = 0,
    port: Annotated[int, typer.Option(help="Port on 127.0.0.1; 0 takes a free one.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
) -> None:
    """Show a frame with what was found in it, let it be dragged right, write rig.toml.

    The page is served on 127.0.0.1 alone, under an address that holds a random token, until the
    file is saved or Ctrl-C is pressed.
    """
    import webbrowser

    from tsvision.images.frames import open_recording
    from tsvision.report.setup import make_server
    from tsvision.rig import find_rig, load_rig

    known = out if out is not None and out.is_file() else find_rig(recording)
    opened = open_recording(recording, load_rig(known))
    own = recording / "rig.toml"
    if not recording.is_dir():  # one folder may hold several films
        own = recording.with_name(f"{recording.stem}.rig.toml")
    target = out or own
    server = make_server(opened, target, port, start=frame)
    print(f"open {server.address}", file=sys.stderr, flush=True)
    if browser:
        webbrowser.open(server.address)
    server.serve()
    print(target)
