"""Every code block of the README and the documentation runs, in order, page by page.

`bash` and `python` blocks are run, `toml` blocks are read as rig files, `json` blocks parsed;
`text` blocks are not run. Four comments, invisible on the page, prepare the ground:
`<!-- film: NAME -->` puts a small rendered recording there, `<!-- video: NAME -->` the same as one
H.264 film without its tables, `<!-- run … -->` runs commands, and `<!-- not run: REASON -->` right
before a block leaves it out.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import cv2
import pytest

from tsvision.rig import load_rig

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
_STEP = re.compile(
    r"<!-- (?P<word>film|video|run|not run):?\s(?P<said>.*?)-->"
    r"|^```(?P<kind>[\w-]+)[^\n]*\n(?P<code>.*?)^```",
    re.S | re.M,
)
# What sets a machine up: run by whoever installs, and by `make demo` and `make test` themselves.
_INSTALLS = re.compile(r"^(git clone|make |pip install|python3? -m (venv|pip)|cd tsvision)", re.M)


@dataclass(frozen=True)
class Step:
    """One thing to do on a page: `kind` is film, video, run, bash, python, toml or json."""

    kind: str
    text: str


def steps_of(page: str) -> list[Step]:
    """What a page asks for, in order."""
    steps: list[Step] = []
    left_out = False
    for found in _STEP.finditer(page):
        word, kind = found["word"], found["kind"]
        if word == "not run":
            left_out = True
        elif word:
            steps.append(Step(word, found["said"].strip()))
        else:
            if not left_out and kind in ("bash", "python", "toml", "json"):
                steps.append(Step(kind, found["code"]))
            left_out = False
    return steps


@pytest.fixture(scope="session")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small recording, rendered once: three frames from 0 to 20 turns."""
    folder = tmp_path_factory.mktemp("film") / "film"
    command = "tsvision synth --turns 0:20:10 --preset bench --look bright_on_dark --seed 5"
    run([*command.split(), "--size", "960x540", "--quiet", "--out", str(folder)], folder.parent)
    return folder


def run(command: list[str], folder: Path) -> None:
    """Run a command as a reader would, with this Python's tools first on the path."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    environment = {**os.environ, "PATH": path, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0, f"{command[-1]}\n{done.stdout[-2000:]}\n{done.stderr[-3000:]}"


def write_video(path: Path, film: Path) -> None:
    """The film's pictures as a phone would have filmed them."""
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx264", rate=5)
        stream.width, stream.height, stream.pix_fmt = 960, 540, "yuv420p"
        for picture in sorted(film.glob("*.png")):
            pixels: Any = cv2.imread(str(picture))
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="bgr24")))
        container.mux(stream.encode(None))


def do(step: Step, folder: Path, request: pytest.FixtureRequest) -> None:
    if step.kind == "film":
        shutil.copytree(request.getfixturevalue("film"), folder / step.text)
    elif step.kind == "video":
        write_video(folder / step.text, request.getfixturevalue("film"))
    elif step.kind == "python":
        run([sys.executable, "-c", step.text], folder)
    elif step.kind == "toml":
        tomllib.loads(step.text)
        (folder / "block.toml").write_text(step.text, encoding="utf-8")
        load_rig(folder / "block.toml")
    elif step.kind == "json":
        json.loads(step.text)
    elif not _INSTALLS.search(step.text):
        run(["bash", "-euo", "pipefail", "-c", step.text], folder)


def _param(page: Path) -> Any:
    """The page by its name: the README always, others that draw a film in `make test-all`."""
    steps = steps_of(page.read_text(encoding="utf-8"))
    draws = any(s.kind in ("film", "video") or "tsvision synth" in s.text for s in steps)
    marks = [pytest.mark.slow] if draws and page.name != "README.md" else []
    return pytest.param(page, id=page.relative_to(ROOT).as_posix(), marks=marks)


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash on this machine")
@pytest.mark.parametrize("page", [_param(page) for page in PAGES])
def test_the_page_does_what_it_says(
    page: Path, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    for step in steps_of(page.read_text(encoding="utf-8")):
        do(step, tmp_path, request)


def test_steps_are_found_in_order_and_text_is_left_alone() -> None:
    page = """
<!-- film: a/b -->
```bash
one
```
<!-- not run: needs a camera -->
```bash
two
```
```python title="x"
three
```
```text
four
```
<!-- run
five
-->
"""
    kinds = [(s.kind, s.text.strip()) for s in steps_of(page)]
    assert kinds == [("film", "a/b"), ("bash", "one"), ("python", "three"), ("run", "five")]
