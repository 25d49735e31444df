"""`tsvision watch`: measure live, one JSON line a frame, and act when an onset is certain."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import typer

from cli.onset import EXIT_CODES, Phase
from cli.rig_options import with_rig_options


@with_rig_options
def command(
    source: str = typer.Argument(
        ..., help="A folder that grows, a camera's index (0, 1, …), a stream's URL, a video."
    ),
    stop_on: Phase | None = typer.Option(
        None, "--stop-on", help="Stop when the beginning of this phase is certain enough."
    ),
    run_command: str | None = typer.Option(
        None, "--exec", help="Run this then; TSVISION_TURNS and others stand in its environment."
    ),
    keep_going: bool = typer.Option(False, "--keep-going", help="Go on after --exec."),
    certainty: float = typer.Option(0.95, "--certainty", help="How sure, 0.5 to 0.999."),
    turns: Path | None = typer.Option(
        None, "--turns", help="turns.csv that grows, or a file that holds the present turn count."
    ),
    turns_per_frame: float | None = typer.Option(None, help="Turns from frame to frame."),
    turns_per_second: float | None = typer.Option(None, help="Steady motor speed."),
    turns_from_name: str | None = typer.Option(None, help="Regular expression with one group."),
    idle: float | None = typer.Option(
        None, "--idle", help="End when no frame has come for so many seconds (default: never)."
    ),
    like: str | None = typer.Option(
        None, "--like", help="A recording of the same view: known from the first frame on."
    ),
    max_frames: int | None = typer.Option(None, "--max-frames", min=1, help="End after so many."),
    rig_path: Path | None = None,
    overrides: dict[str, object] = {},  # noqa: B006 - read only
) -> None:
    """One JSON line a frame on stdout; the account so far on stderr at the end.

    Exit code 0: the onset was observed, 3: not observed, 4: undetermined.
    """
    from tsvision.errors import InputError
    from tsvision.live.believing import Live
    from tsvision.live.sources import without_lens
    from tsvision.live.watching import watch

    if run_command and stop_on is None:
        raise InputError("--exec needs --stop-on PHASE: when shall it run?")
    if not 0.5 <= certainty <= 0.999:
        raise InputError(f"--certainty {certainty}: must lie between 0.5 and 0.999")
    if not (source.isdecimal() or "://" in source or Path(source).exists()):
        raise InputError(
            f"{source}: no such folder or file; create it, or name a camera index or a URL"
        )
    rig = _rig(source, rig_path, overrides)
    given = _turns(source, turns, turns_per_frame, turns_per_second, turns_from_name)
    arrivals = without_lens(_arrivals(source, given, idle), rig.camera.lens)

    name = f"{(stop_on or Phase.knot).value}_onset"
    live = Live(rig, name, certainty)
    rows = watch(arrivals, _measurer(rig, like), live)
    try:
        _follow(rows, stop_on is not None and not keep_going, run_command, max_frames)
    except KeyboardInterrupt:
        pass  # a person ends a live measurement this way: the account is still told
    finally:
        rows.close()
    raise typer.Exit(_conclude(live, name))


def _measurer(rig: Any, like: str | None) -> Any:
    """One that knows the view from a recording of it, or one that learns as the frames come."""
    from tsvision.images.frames import open_recording
    from tsvision.live.learning import Learner
    from tsvision.measures import recording as measuring

    if like is None:
        return Learner(lambda: measuring.Measurer(rig))
    recording = open_recording(like, rig)
    known = measuring.Measurer(recording.rig)  # whose scale may come from a board in its frames
    known.prime(measuring.sample_pictures(recording), recording.turns)
    return known


def _rig(source: str, rig_path: Path | None, overrides: dict[str, object]) -> Any:
    from tsvision.rig import find_rig, load_rig

    return load_rig(rig_path or find_rig(source), overrides)


def _turns(
    source: str,
    table: Path | None,
    per_frame: float | None,
    per_second: float | None,
    from_name: str | None,
) -> Any:
    """How turns are known; a turns.csv in the watched folder is taken by itself."""
    from tsvision.errors import InputError
    from tsvision.live import sources

    ways = [
        sources.turns_from_file(table) if table is not None else None,
        sources.turns_per_frame(per_frame) if per_frame is not None else None,
        sources.turns_per_second(per_second) if per_second is not None else None,
        sources.turns_from_name(from_name) if from_name is not None else None,
    ]
    named = [way for way in ways if way is not None]
    if len(named) > 1:
        raise InputError("the turns are told in two ways; give one of the --turns options")
    if named:
        return named[0]
    if Path(source).is_dir():
        return sources.turns_from_file(Path(source) / "turns.csv")
    raise InputError(
        f"{source}: the turns are not known; give --turns FILE, --turns-per-second, "
        "--turns-per-frame or --turns-from-name"
    )


def _arrivals(source: str, turns: Any, idle_s: float | None) -> Any:
    from tsvision.live.sources import camera, growing_folder

    if source.isdecimal():
        return camera(int(source), turns, idle_s)
    if "://" in source:
        return camera(source, turns, idle_s)
    if Path(source).is_file():
        return camera(source, turns, idle_s, drop=False)
    return growing_folder(Path(source), turns, idle_s)


def _follow(rows: Any, stop: bool, run_command: str | None, max_frames: int | None) -> None:
    """Print rows as they come; at the decision run the command and stop, if asked to."""
    for count, row in enumerate(rows, start=1):
        print(json.dumps(row, allow_nan=False), flush=True)
        if row["decided"]:
            if run_command:
                _run(run_command, row)
            if stop:
                return
        if max_frames is not None and count >= max_frames:
            return


def _run(command_line: str, row: dict[str, Any]) -> None:
    """Run the user's own command line; its output goes to stderr, stdout is the rows'."""
    onset = row["onset"]
    told = {
        "TSVISION_FRAME": row["frame"],
        "TSVISION_FILE": row["file"],
        "TSVISION_TURNS": row["turns"],
        "TSVISION_ONSET_TURNS": onset["turns"],
        "TSVISION_ONSET_LOW": onset["low"],
        "TSVISION_ONSET_HIGH": onset["high"],
    }
    environment = os.environ | {key: str(value) for key, value in told.items()}
    done = subprocess.run(
        command_line,
        shell=True,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    print(done.stdout, end="", file=sys.stderr)
    if done.returncode:
        print(f"tsvision watch: --exec ended with code {done.returncode}", file=sys.stderr)


def _conclude(live: Any, name: str) -> int:
    """The line for people on stderr, and the exit code."""
    from tsvision.timeline.told import line, summary

    if not live.results:
        print("tsvision watch: no frame came", file=sys.stderr)
        return EXIT_CODES["undetermined"]
    told = summary(live.account())
    if live.onset is not None:  # what was decided and acted upon stands
        from tsvision.timeline.told import onset_values

        told[name] = onset_values(live.onset)
    print(line(name, told), file=sys.stderr)
    return EXIT_CODES[told[name]["status"]]  # type: ignore[index]
