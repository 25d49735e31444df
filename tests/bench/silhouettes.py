"""D, angle and pitch of backlit strands beside the least that noise allows (Cramér-Rao).

`python -m tests.bench.silhouettes [--strings 2 4 6 8] [--flat] [--mesh] [--repeats 6] [--each]`

Strands before a lit screen, which their limbs mirror a little: what is left to get wrong is that,
the blur, the geometry and the noise. Four bundles of every N (D 40 to 62 px, 15 to 35 degrees) are
drawn at each blur and noise, `--repeats` times with fresh noise; every picture is measured cold, as
a recording of one frame, knowing N and the camera's tone curve. Bias is the mean over all of them,
worst that of the worst bundle, sd the scatter of a bundle's repeats, root mean square over bundles.

The bound is that of a fit of D, pitch, phase, place and slope to both edges of every column of the
stretch that is measured, some two pitches at most, with nothing else unknown. An edge of contrast
c, blurred by sigma px, in noise of sd s is placed no better than s / c sqrt(2 sqrt(pi) sigma) px;
how the outline moves with D and the rest is told by differences of discs along the centre lines,
none of the measuring code's own geometry. But light is not known: how blurred the picture is, how
bright both sides are and how much of the screen limbs mirror, all its columns have to tell. What
that adds to the bound, by Fresnel's law of a smooth plastic, is in the one that is called learnt.

`--flat` mirrors nothing; `--mesh` draws such by pyvista's tubes (needs OpenGL), whose 48 sides make
them up to 0.03 px a side too thin.
"""

# ruff: noqa: E402 - the thread counts must be set before numpy and numba are imported
from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter1d

from synth.presets import look_named
from synth.settings import Look
from tests.bench.pictures48_draw import (
    GAMMA,
    WIDTH,
    Case,
    cases,
    centre_lines,
    draw,
    draw_mesh,
    mesh_plotter,
)
from tests.bench.scoring import held, rms
from tsvision.measures.recording import Measurer
from tsvision.records import Camera, Frame, FrameRow, Rig, Strings, View

BLURS_PX = (0.5, 1.0, 1.5)
NOISES = (0.02, 0.05)  # sd of the stored grey, of full scale
LEAST_PX = 40.0  # of D
INDEX = 1.5  # of refraction, of plastic
INSIDE = 0.85  # of a strand's radius: further in lie its neighbours
STEP_PX = 0.05
# As light in the middle as at the limb, whichever way the surface faces.
FLAT = Look(
    strand_rgb=((0.04, 0.04, 0.04),),
    ground_rgb=(0.75, 0.75, 0.75),
    ambient=1.0,
    light_strength=0.0,
    specular=0.0,
    occlusion=0.0,
)
Drawing = Callable[[Case, float], np.ndarray]  # of a case under a blur, px


def bundles(strings: int) -> list[Case]:
    """Four of the benchmark's bundles, of every angle and across its larger diameters."""
    wide = [case for case in cases(strings) if case.diameter_px >= LEAST_PX and case.dark_on_bright]
    return [wide[k] for k in np.linspace(0, len(wide) - 1, 4).round().astype(int)]


def outline(case: Case, columns: np.ndarray) -> np.ndarray:
    """Both edges (2 M) px of discs along the centre lines, at `columns` (M,) along the axis."""
    lines, _, radius = centre_lines(case)
    edges = []
    for sign in (1.0, -1.0):
        reach = np.full(len(columns), -np.inf)
        for line in lines:
            x, y = line[:, 0], sign * line[:, 1]
            for offset in np.linspace(-radius, radius, 201):
                arc = np.sqrt(max(radius**2 - offset**2, 0.0))
                reach = np.maximum(reach, np.interp(columns, x + offset, y) + arc)
        edges.append(sign * reach)
    return np.concatenate(edges)


def least_sds(case: Case, edge_sd_px: float, length: float) -> dict[str, float]:
    """Least sd of D (px), pitch (a share) and angle (degrees) from edges known to `edge_sd_px` over
    a length (px)."""
    columns = np.arange(-0.5 * length, 0.5 * length)
    edges = len(columns)

    def of(diameter: float, pitch: float, phase: float) -> np.ndarray:
        beta = float(np.rad2deg(np.arctan(np.pi * diameter / pitch)))
        return outline(replace(case, diameter_px=diameter, beta_deg=beta, phase_rad=phase), columns)

    at = np.array([case.diameter_px, case.pitch_px, case.phase_rad])
    steps = np.diag([0.2, 0.5, 0.01])
    moved = [(of(*(at + step)) - of(*(at - step))) / (2.0 * step.sum()) for step in steps]
    place = np.ones(2 * edges)
    slope = np.tile(columns, 2) / length
    jacobian = np.stack([*moved, place, slope], axis=1)
    covariance = np.linalg.inv(jacobian.T @ jacobian) * edge_sd_px**2
    # tan(beta) = pi D / p
    turn = np.deg2rad(case.beta_deg)
    per = 0.5 * np.sin(2.0 * turn) * np.array([1.0 / at[0], -1.0 / at[1]])
    beta = np.sqrt(per @ covariance[:2, :2] @ per)
    diameter, pitch = np.sqrt(np.diag(covariance)[:2])
    return {
        "least_diameter": float(diameter),
        "least_pitch": float(pitch / at[1]),
        "least_beta": float(np.rad2deg(beta)),
    }


def levels(picture: np.ndarray) -> tuple[float, float]:
    """Of strands and screen as stored, in units of full scale; from the picture without noise."""
    dark, bright = np.percentile(picture, [1.0, 99.0]) / 255.0
    return float(dark), float(bright)


def mirrored(facing: np.ndarray) -> np.ndarray:
    """Share of light that a smooth dielectric of index 1.5 mirrors, at the cosine (K,) of the angle
    at which it is seen."""
    inward = np.sqrt(1.0 - (1.0 - facing**2) / INDEX**2)
    across = (facing - INDEX * inward) / (facing + INDEX * inward)
    along = (inward - INDEX * facing) / (inward + INDEX * facing)
    return np.asarray(0.5 * (across**2 + along**2))


def least_light_sd_px(
    seen: tuple[float, float], rho_px: float, blur_px: float, noise: float, columns: float
) -> float:
    """What is added to the sd of a width (px) by light that both edges of so many columns have to
    tell: blur, brightness of strands (of radius rho_px) and screen, the share of it mirrored."""
    t_px = np.arange(-6.0, INSIDE * rho_px, STEP_PX)  # inside the edge
    facing = np.sqrt(np.clip(1.0 - (1.0 - np.maximum(t_px, 0.0) / rho_px) ** 2, 0.0, 1.0))
    mirror = mirrored(facing)

    def stored(out_px: float, blur: float, share: float, dark: float, bright: float) -> np.ndarray:
        strand = dark + share * (bright - dark) * mirror
        sharp = np.where(t_px < 0.0, bright, strand)
        soft = gaussian_filter1d(sharp, blur / STEP_PX, mode="nearest")
        return np.interp(t_px + out_px, t_px, soft) ** (1.0 / GAMMA)

    at = np.array([0.0, blur_px, 0.0, *(level**GAMMA for level in seen)])
    steps = np.diag([0.1, 0.01, 0.01, 0.001, 0.001])
    moved = [(stored(*(at + step)) - stored(*(at - step))) / (2.0 * step.sum()) for step in steps]
    jacobian = np.stack(moved, axis=1)
    information = jacobian.T @ jacobian * (2.0 * columns * STEP_PX / noise**2)
    open_px2 = np.linalg.inv(information)[0, 0]
    return float(2.0 * np.sqrt(open_px2 - 1.0 / information[0, 0]))


def measured_cold(strings: int, picture: np.ndarray) -> tuple[FrameRow, Measurer]:
    """A picture as a recording of one frame, knowing N and the camera's tone curve."""
    rig = Rig(
        camera=Camera(gamma=GAMMA),
        strings=Strings(count=strings),
        view=View(separator_side="none"),
    )
    measurer = Measurer(rig)
    measurer.prime([picture])
    return measurer.measure(Frame(0, "picture.png", picture)).row, measurer


def measured(case: Case, picture: np.ndarray) -> dict[str, float]:
    """Errors of one picture, cold, and errors over their sd."""
    row, measurer = measured_cold(case.strings, picture)
    diameter = row.diameter_px - case.diameter_px
    beta = np.rad2deg(row.helix_angle_rad) - case.beta_deg
    near = measurer.warm.near
    return {
        "length": near.s_high_px - near.s_low_px if near is not None else np.nan,
        "diameter": diameter,
        "pitch": row.pitch_px / case.pitch_px - 1.0,
        "beta": float(beta),
        "diameter_held": diameter / row.diameter_px_sd,
        "beta_held": float(np.deg2rad(beta)) / row.helix_angle_rad_sd,
        "told": float(row.handedness != ""),
        "wrong": float(row.handedness not in ("", case.handedness)),
    }


def line(rows: pd.DataFrame) -> str:
    """One row of the table: bias, worst bundle's, sd and bound of D; sds and rms of the others."""
    means = rows.groupby("bundle")[["diameter", "pitch", "beta"]].mean()
    scatter = rows.groupby("bundle")[["diameter", "pitch", "beta"]].std()
    least = rows.groupby("bundle")[["least_diameter", "least_pitch", "least_beta"]].first()
    learnt = rms(rows.groupby("bundle")["least_learnt"].first())
    sds = [rms(scatter[name]) for name in ("diameter", "pitch", "beta")]
    bounds = [rms(least[f"least_{name}"]) for name in ("diameter", "pitch", "beta")]
    cells = [
        f"{rows['diameter'].mean():+.3f}",
        f"{means['diameter'].abs().max():.3f}",
        f"{sds[0]:.4f}",
        f"{bounds[0]:.4f}",
        f"{sds[0] / bounds[0]:.1f}",
        f"{learnt:.4f}",
        f"{sds[0] / learnt:.1f}",
        f"{rms(rows['beta']):.3f}",
        f"{sds[2] / bounds[2]:.1f}",
        f"{100.0 * rms(rows['pitch']):.3f}",
        f"{sds[1] / bounds[1]:.1f}",
        f"{100.0 * held(rows['diameter_held']):.0f}",
        f"{100.0 * held(rows['beta_held']):.0f}",
    ]
    return " | ".join(cells)


HEAD = (
    "| N | blur px | noise | D bias px | worst bundle | D sd px | bound | sd/bound "
    "| learnt | sd/learnt | β RMSE ° | sd/bound | p RMSE % | sd/bound | D in 95 % | β in 95 % |\n"
    + "| --- " * 16
    + "|"
)


def set_of(
    strings: int, blur_px: float, noise: float, repeats: int, drawn: Drawing, each: bool
) -> pd.DataFrame:
    """Every repeat of the bundles of one N, under one blur and noise, a row each."""
    rows = []
    for number, case in enumerate(bundles(strings)):
        clean = drawn(replace(case, noise=0.0), blur_px)
        seen = levels(clean)
        edge_sd_px = noise / (seen[1] - seen[0]) * np.sqrt(2.0 * np.sqrt(np.pi) * blur_px)
        found = []
        for repeat in range(repeats):
            noisy = replace(case, noise=noise, seed=case.seed + repeat)
            found.append(measured(case, drawn(noisy, blur_px)))
        length = float(np.median([row["length"] for row in found]))
        least = least_sds(case, edge_sd_px, length)
        added = least_light_sd_px(seen, centre_lines(case)[2], blur_px, noise, WIDTH)
        least["least_learnt"] = float(np.hypot(least["least_diameter"], added))
        rows += [{"bundle": number} | least | row for row in found]
        if each:
            errors = " ".join(f"{row['diameter']:+.3f}" for row in rows[-repeats:])
            print(
                f"N {strings} blur {blur_px} noise {noise} D {case.diameter_px:.1f} beta "
                f"{case.beta_deg:.0f} tilt {case.tilt_deg:+.0f}: {errors}",
                file=sys.stderr,
            )
    return pd.DataFrame(rows)


def main() -> None:
    """Print a row for every N, blur and noise, and what all of them have in common."""
    cv2.setNumThreads(1)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--strings", type=int, nargs="+", default=[2, 4, 6, 8])
    parser.add_argument("--repeats", type=int, default=6)
    parser.add_argument("--flat", action="store_true", help="limbs mirror nothing of the screen")
    parser.add_argument("--mesh", action="store_true", help="draw with pyvista")
    parser.add_argument("--each", action="store_true", help="every bundle, on stderr")
    given = parser.parse_args()
    look = FLAT if given.flat else look_named("backlit")
    plotter = mesh_plotter() if given.mesh else None

    def drawn(case: Case, blur_px: float) -> np.ndarray:
        if given.mesh:
            return draw_mesh(case, plotter, blur_px, headlight=False)
        return draw(case, blur_px, look)

    print(HEAD)
    every = []
    for strings in given.strings:
        for blur_px in BLURS_PX:
            for noise in NOISES:
                rows = set_of(strings, blur_px, noise, given.repeats, drawn, given.each)
                print(f"| {strings} | {blur_px} | {noise:.0%} | {line(rows)} |", flush=True)
                every.append(rows)
    joined = pd.concat(every)
    told, wrong = int(joined["told"].sum()), int(joined["wrong"].sum())
    print(f"\nSense told in {told} of {len(joined)} pictures, wrong in {wrong}.")


if __name__ == "__main__":
    main()
