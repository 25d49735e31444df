"""`tsvision`: one command, one verb a file, each loaded only when it is called.

Importing numpy, cv2 and scipy takes far longer than printing a help page, so the verbs are
listed here by name and their modules imported on use.
"""

from __future__ import annotations

import difflib
import importlib
import os
import sys
import traceback
import warnings
from collections.abc import Callable

from tsvision.errors import InputError

STOPPED = 130  # exit code after Ctrl-C
BROKEN = 70  # exit code after a fault of the program itself
TRACEBACK = "TSVISION_TRACEBACK"  # set to 1 to see where a fault or a library's warning comes from

# verb -> (module, one line of help). A module holds a typer function or app named `command`.
VERBS: dict[str, tuple[str, str]] = {
    "demo": ("cli.demo", "Render a recording, measure it, print the knot onset, write the report."),
    "synth": ("cli.synth", "Render synthetic recordings with exact truth."),
    "rig": ("cli.rig", "Write a commented rig.toml, or show what is in force and from where."),
    "measure": ("cli.measure", "Measure a recording: diameter, pitch, angle, knots, phases."),
    "onset": ("cli.onset", "Print at which turn count knots (or another phase) begin."),
    "calibrate": ("cli.calibrate", "Scale, blur and shading from a gauge, a board or two points."),
    "watch": ("cli.watch", "Measure live: a growing folder, a camera, a stream."),
    "predict": ("cli.predict", "Displacement for turns, with a chosen model."),
    "invert": ("cli.invert", "Turns for a displacement, with a chosen model."),
    "validate": ("cli.validate", "The paper's tables against the models, cell by cell."),
    "compare": ("cli.compare", "All displacement models on one data set, in and out of sample."),
    "design": ("cli.design", "Which strings, length and turns give a wanted stroke and life."),
    "life": ("cli.life", "Cycles to failure: models fitted to the paper's or your own table."),
    "riglog": ("cli.riglog", "Read a life-cycle rig's log: cycles, dirt, wear, the break."),
    "diagnose": ("cli.diagnose", "What the model gets wrong, why, and what mending it gains."),
    "onsets": ("cli.onsets", "Onsets of many recordings against N, load, diameter."),
    "batch": ("cli.batch", "Measure many recordings, resumable, on all cores or a cluster."),
    "results": ("cli.results", "One table over the recordings of a batch."),
    "report": ("cli.report", "Write the page of a measured recording."),
    "setup": ("cli.setup", "Set a recording up by eye on a local page, write rig.toml."),
}


def help_text() -> str:
    """The top help page, from VERBS alone, so that it needs no import."""
    width = max(map(len, VERBS)) + 2
    lines = [f"  {verb:<{width}}{text}" for verb, (_, text) in VERBS.items()]
    return "\n".join(
        [
            "Usage: tsvision COMMAND [OPTIONS] ...",
            "",
            "Measure twisted strings from pictures; find out what a model of them gets wrong.",
            "",
            "Commands:",
            *lines,
            "",
            "`tsvision COMMAND --help` tells more. `tsvision --version` prints the version.",
        ]
    )


def load_command(verb: str) -> Callable[..., object]:
    """Import the verb's module and make it a command object that takes (args, prog_name)."""
    import typer

    loaded = importlib.import_module(VERBS[verb][0]).command
    if not isinstance(loaded, typer.Typer):
        single = typer.Typer(
            add_completion=False,
            pretty_exceptions_enable=False,
            context_settings={"help_option_names": ["-h", "--help"]},
        )
        single.command(name=verb)(loaded)
        loaded = single
    return typer.main.get_command(loaded)


def run(arguments: list[str]) -> int:
    """Run one command line (without the program's name); returns the exit code."""
    if not arguments or arguments[0] in ("-h", "--help"):
        print(help_text())
        return 0
    verb, *rest = arguments
    if verb == "--version":
        from tsvision import __version__

        print(f"tsvision {__version__}")
        return 0
    if verb not in VERBS:
        near = difflib.get_close_matches(verb, VERBS, n=1)
        hint = f"did you mean '{near[0]}'?" if near else "`tsvision --help` lists the commands"
        print(f"tsvision: no command '{verb}'; {hint}", file=sys.stderr)
        return 2
    try:
        outcome = load_command(verb)(rest, prog_name=f"tsvision {verb}", standalone_mode=False)
    except InputError as problem:
        print(f"tsvision {verb}: {problem}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"tsvision {verb}: stopped; finished work was kept", file=sys.stderr)
        return STOPPED
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    except Exception as problem:
        return _usage_problem(verb, problem)
    if outcome == STOPPED:  # the parser's answer to Ctrl-C, which says nothing
        print(f"tsvision {verb}: stopped; finished work was kept", file=sys.stderr)
    return outcome if type(outcome) is int else 0


def _usage_problem(verb: str, problem: Exception) -> int:
    """The parser's own complaint as one line; anything else goes on as it is.

    Known by what it does: which module it comes from depends on typer's version.
    """
    if type(problem).__name__ == "Abort":  # Ctrl-C, in older versions
        print(f"tsvision {verb}: stopped; finished work was kept", file=sys.stderr)
        return STOPPED
    if not hasattr(problem, "format_message"):
        raise problem
    words = " ".join(problem.format_message().split()).rstrip(".") or "a subcommand is missing"
    print(f"tsvision {verb}: {words}; see `tsvision {verb} --help`", file=sys.stderr)
    return int(getattr(problem, "exit_code", 2))


def app() -> None:
    """Entry point: whatever happens ends in one line on stderr and an exit code."""
    debugging = bool(os.environ.get(TRACEBACK))
    if not (sys.warnoptions or debugging):
        warnings.simplefilter("ignore")  # a library's remarks on numbers are not the user's concern
    try:
        code = run(sys.argv[1:])
        sys.stdout.flush()
    except BrokenPipeError:  # `tsvision … | head`: the reader has what it wanted
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    except Exception as fault:
        if debugging:
            raise
        print(f"tsvision {sys.argv[1]}: {fault_in_words(fault)}", file=sys.stderr)
        code = 2 if isinstance(fault, OSError) else BROKEN
    raise SystemExit(code)


def fault_in_words(fault: Exception) -> str:
    """One line on an error that nobody foresaw: the system's, or a fault of the program."""
    words = " ".join(str(fault).split())[:300]
    if isinstance(fault, OSError) and fault.strerror:
        return f"{fault.filename or 'the system'}: {fault.strerror}; mend that and start again"
    frames = traceback.extract_tb(fault.__traceback__)
    frame = ([f for f in frames if "site-packages" not in f.filename] or frames)[-1]
    where = f"{os.path.basename(frame.filename)}, line {frame.lineno}"
    return (
        f"a fault in the program ({type(fault).__name__}: {words}; {where}); please report it "
        f"with the input. {TRACEBACK}=1 shows where it comes from"
    )


if __name__ == "__main__":
    app()
