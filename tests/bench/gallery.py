"""Draw every picture of docs/synth.md with the command that stands below it.

Run `python -m tests.bench.gallery`; it rewrites docs/gallery and the gallery part of
docs/synth.md. The 3-D pictures need OpenGL and keep their old file where there is none.
"""

from __future__ import annotations

import shlex
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from cli.main import run
from synth.view3d import opengl_works

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "synth.md"
FOLDER = ROOT / "docs" / "gallery"
START, STOP = "<!-- gallery: start -->", "<!-- gallery: stop -->"
RIG = "--preset bench --seed 7 --look bright_on_dark"
WIDTH_PX = 640


@dataclass(frozen=True)
class Picture:
    """`command` are the words after `tsvision synth`, without --out; the last frame is shown."""

    name: str
    caption: str
    command: str


def chapters() -> dict[str, list[Picture]]:
    """Heading -> pictures, in the page's order."""
    stages = (("twist", 14), ("overtwist", 32), ("local overtwist", 54), ("knots", 70))
    phases = [
        Picture(f"phase_{turns}", f"{name}, {turns} turns", f"{RIG} --turns {turns}")
        for name, turns in stages
    ]
    strings = [
        Picture(
            f"strings_{count}",
            f"N = {count}",
            f"{RIG} --strings {count} --view closeup --turns {turns}",
        )
        for count, turns in ((2, 18), (4, 9), (6, 9), (8, 9))
    ]
    holes = [
        Picture(
            f"holes_{holes}",
            f"{holes} holes, N = 6",
            f"{RIG} --strings 6 --holes {holes} --view closeup --turns 6 --set camera.yaw_deg=-16",
        )
        for holes in (2, 4, 6)
    ]
    lights = [
        Picture(
            f"look_{name}",
            name,
            f"--preset bench --seed 11 --look {name} --strings 4 --turns 15 --view closeup",
        )
        for name in (
            "bright_on_dark", "dark_on_bright", "backlit", "front_lit", "side_lit",
            "side_lit_below", "glossy", "equal_luma", "two_coloured",
        )
    ]  # fmt: skip
    camera = [
        Picture("side_top", "separator on top", "--side top --turns 30 --preset bench --seed 4"),
        Picture("hand_s", "S, the mirror image", f"{RIG} --turns 14 --handedness S"),
        Picture(
            "defocus", "shallow depth of field",
            f"{RIG} --turns 30 --set camera.yaw_deg=25 --set camera.defocus_px_per_mm=1.5",
        ),
        Picture(
            "motion", "half a turn during the exposure",
            f"{RIG} --turns 10 --view closeup --set camera.turning_blur_turns=0.3",
        ),
        Picture(
            "rolling", "rolling shutter, 4 turns over the frame, axis upright",
            "--preset bench --seed 4 --side top --turns 10 --set camera.rolling_turns=4",
        ),
        Picture(
            "distortion", "barrel distortion",
            f"{RIG} --turns 25 --set camera.k1=-0.15 --set camera.distance_mm=60",
        ),
        Picture(
            "noise", "few photons, JPEG quality 60",
            f"{RIG} --turns 25 --set sensor.full_well_e=300 --set sensor.quality=60 --format jpg",
        ),
        Picture(
            "dirt", "loose fibres, dust, another cable",
            f"{RIG} --turns 25 --set look.fibres_per_mm=3 --set look.dust=80 --set look.cable=true",
        ),
    ]  # fmt: skip
    effects = [
        Picture(
            f"hidden_{name}", caption,
            f"{RIG} --strings {count} --turns 8 --view closeup --set hidden.{name}={value}",
        )
        for name, caption, count, value in (
            ("unequal_diameters", "unequal strings", 4, 0.25),
            ("flattening", "flattened strings", 2, 0.3),
            ("slack_pair", "one slack pair", 4, 0.8),
            ("taper", "a tapering bundle", 4, 0.5),
        )
    ]  # fmt: skip
    way_back = [
        Picture(
            "unwound", "unwound from 70 to 20 turns: the knots stay",
            f"{RIG} --turns 0:70:10,60:20:-10",
        ),
        Picture(
            "stuck", "unwound to 8 turns: a knot stuck at the separator",
            f"{RIG} --turns 0:70:10,60:10:-10,8 --set law.stuck_knot=true",
        ),
    ]  # fmt: skip
    return {
        "Every phase": phases,
        "Every number of strings": strings,
        "Every separator": holes,
        "Every lighting": lights,
        "The camera": camera,
        "Planted effects that show": effects,
        "The way back": way_back,
    }


def sheets() -> list[Picture]:
    """One recording a preset, all frames on one sheet."""
    return [
        Picture(f"sheet_{name}", f"{name}, 0 to 70 turns", f"--preset {name} --seed {seed} {more}")
        for name, seed, more in (
            ("clean", 0, "--turns 0:70:10"),
            ("bench", 2, "--turns 0:70:10"),
            ("hard", 9, "--turns 0:70:10"),
        )
    ]


def render(picture: Picture, folder: Path) -> list[np.ndarray]:
    """Run the command and read its frames."""
    out = folder / picture.name
    code = run(["synth", *shlex.split(picture.command), "--out", str(out), "-q"])
    if code:
        raise SystemExit(f"{picture.name}: exit {code}")
    frames = sorted(out.glob("frame_*"))
    found = [cv2.imread(str(path)) for path in frames]
    return [frame for frame in found if frame is not None]


def save(name: str, picture: np.ndarray, width: int = WIDTH_PX) -> None:
    scale = width / max(picture.shape[:2])
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(FOLDER / f"{name}.jpg"), small, [cv2.IMWRITE_JPEG_QUALITY, 84])


def sheet_of(frames: list[np.ndarray], across: int = 2) -> np.ndarray:
    rows = [np.hstack(frames[k : k + across]) for k in range(0, len(frames), across)]
    return np.vstack(rows)


def three_d() -> list[str]:
    """The pyvista pictures and their lines on the page."""
    png = "view --turns 66 --png knots.png --set camera.yaw_deg=28 --set camera.tilt_deg=16"
    png += " --set camera.distance_mm=90 --size 960x540"
    gif = "view --turns 0:66:3 --movie winding.gif --size 480x270"
    gltf = "view --turns 66 --gltf knots.glb"
    if opengl_works():
        here = str(FOLDER) + "/"
        for words, name in ((png, "knots.png"), (gif, "winding.gif")):
            if run(["synth", *shlex.split(words.replace(name, here + "view3d_" + name))]):
                raise SystemExit(f"tsvision synth {words} failed")
        picture = cv2.imread(here + "view3d_knots.png")
        assert picture is not None
        save("view3d_knots", picture)
        Path(here + "view3d_knots.png").unlink()
    return [
        "## In three dimensions",
        "",
        "![knots in 3-D](gallery/view3d_knots.jpg)",
        "",
        f"`tsvision synth {png}`",
        "",
        "![winding](gallery/view3d_winding.gif)",
        "",
        f"`tsvision synth {gif}`",
        "",
        f"`tsvision synth {gltf}` writes the same scene as glTF; it needs no OpenGL.",
        "",
    ]


def main() -> None:
    """Draw everything and put the gallery between its marks in the page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    lines: list[str] = []
    with tempfile.TemporaryDirectory() as scratch:
        for heading, pictures in chapters().items():
            lines += [f"## {heading}", ""]
            for picture in pictures:
                print(picture.name, file=sys.stderr)
                save(picture.name, render(picture, Path(scratch))[-1])
                lines += [
                    f"![{picture.caption}](gallery/{picture.name}.jpg)",
                    "",
                    f"{picture.caption}: `tsvision synth {picture.command} --out DIR`",
                    "",
                ]
        lines += ["## One recording a preset", ""]
        for picture in sheets():
            print(picture.name, file=sys.stderr)
            save(picture.name, sheet_of(render(picture, Path(scratch))), 1280)
            lines += [
                f"![{picture.caption}](gallery/{picture.name}.jpg)",
                "",
                f"{picture.caption}: `tsvision synth {picture.command} --out DIR`",
                "",
            ]
    lines += three_d()
    text = PAGE.read_text()
    head, tail = text.split(START)[0], text.split(STOP)[1]
    PAGE.write_text(head + START + "\n\n" + "\n".join(lines) + "\n" + STOP + tail)
    size = sum(path.stat().st_size for path in FOLDER.iterdir())
    print(f"{len(list(FOLDER.iterdir()))} pictures, {size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
